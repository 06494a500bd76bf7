// SPDX-License-Identifier: Apache-2.0
// What a simulation tells: the values of compartments over time, and spikes. Where they come from is behind a function: a
// SONATA file (io/sonata_report.h) or a formula (synthetic.h), so that nothing is ever whole in memory.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace forest::reports {

/// Which neuron: its population and its number there, as SONATA names it.
struct Node {
  std::uint32_t population = 0;  // index in a list of names
  std::uint64_t id = 0;

  auto operator<=>(const Node&) const = default;
};

/// Of every instance of a circuit: its node. What joins reports and circuits.
struct Nodes {
  std::vector<std::string> populations;
  std::vector<std::uint64_t> ends;  // of each population: one past its greatest node, planted or not
  std::vector<Node> of_instance;
  std::vector<std::string> shapeless = {};  // populations of the circuit that are virtual as a whole
};

/// Values of compartments over time, as a matrix of steps × columns. A column is a compartment; those of one node are
/// neighbours.
struct Report {
  std::string source;  // the file, for errors and for whoever asks where it comes from
  std::string units = "mV";
  double start = 0., step = .1;  // time of the first row and between rows, ms
  std::size_t steps = 0;         // rows
  std::vector<std::string> populations;
  std::vector<Node> nodes;                  // in the order of their columns
  std::vector<std::uint64_t> first_column;  // one more than nodes
  std::vector<std::uint32_t> element_ids;   // by column: section, 0 for the soma
  std::vector<float> element_positions;     // by column: along the section, 0 to 1; or empty: evenly spread
  /// Writes rows [first, first + rows) of columns [column, column + columns), row after row. Called by any thread.
  std::function<void(std::size_t first, std::size_t rows, std::size_t column, std::size_t columns,
                     float* out)>
      read;

  std::size_t columns() const { return element_ids.size(); }
};

/// Throws InputError (the source, a sentence) unless the lists fit one another, every node occurs once and has a
/// compartment, and time is a finite number that goes on.
void check(const Report& report);

/// Spikes of one population, in any order.
struct Spikes {
  std::string source;  // the file
  std::string population;
  std::vector<double> times;         // ms
  std::vector<std::uint64_t> nodes;  // as many
};

/// A report for spikes of which no values are known: one compartment without a number for every node, from 5 ms before
/// the first spike to 100 ms after the last one, in at most a thousand steps.
/// Throws InputError when there are no spikes, or when a time is not finite.
Report without_values(std::span<const Spikes> spikes, const Nodes& nodes);

/// A spike of a neuron of the circuit.
struct Spike {
  double time = 0.;            // ms
  std::uint32_t instance = 0;  // of the circuit
  std::uint32_t zero = 0;

  bool operator==(const Spike&) const = default;
};

}  // namespace forest::reports
