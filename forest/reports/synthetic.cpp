// SPDX-License-Identifier: Apache-2.0
#include "forest/reports/synthetic.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include "forest/core/random.h"
#include "forest/morphology/measure.h"
#include "forest/reports/layout.h"

namespace forest::reports {
namespace {

constexpr std::size_t wave_size = 4096, noise_size = 1024;

/// What the compartments of one morphology share.
struct Cell {
  std::vector<std::uint32_t> elements;
  std::vector<float> positions;
  std::vector<float> delay;  // of a spike from the soma, ms
  std::vector<float> share;  // of its height that is left
};

Cell cell_of(const Morphology& m, std::size_t wanted) {
  const auto order = sections_of_elements(m);
  const auto distances = path_distances(m);
  const double total = std::max(1e-6, total_length(m));
  const std::size_t spare = wanted > order.size() + 1 ? wanted - order.size() - 1 : 0;
  Cell cell{{0}, {.5f}, {0.f}, {1.f}};
  double so_far = 0.;
  std::size_t given = 0;
  for (std::size_t e = 0; e < order.size(); ++e) {
    const double length = section_length(m, order[e]);
    so_far += length;  // rounding of the sum, so that all are given away in the end
    const std::size_t upto =
        e + 1 == order.size() ? spare : std::min(spare, std::size_t(double(spare) * so_far / total));
    const std::size_t count = 1 + upto - std::min(given, upto);
    given = std::max(given, upto);
    for (std::size_t k = 0; k < count; ++k) {
      const float position = (float(k) + .5f) / float(count);
      const double distance = distances[order[e].value()] - (1. - double(position)) * length;
      cell.elements.push_back(std::uint32_t(e + 1));
      cell.positions.push_back(position);
      cell.delay.push_back(float(distance / 400.));  // 0.4 m/s
      cell.share.push_back(float(std::exp(-distance / 300.)));
    }
  }
  return cell;
}

/// A spike and the rest after it, over 20 ms; mV above rest.
float spike_at(double ms) {
  if (ms < 0.) return 0.f;
  return float(105. * std::exp(-std::pow((ms - 1.) / .45, 2)) - 9. * std::exp(-std::pow((ms - 4.) / 3., 2)));
}

struct Neuron {
  std::uint32_t cell = 0;
  float rest = 0.f, period = 0.f, first = 0.f, wave = 0.f;  // mV, ms, ms, phase
  std::uint32_t noise = 0;
};

struct Formula {
  Synthetic options;
  std::vector<Cell> cells;
  std::vector<Neuron> neurons;
  std::vector<std::uint64_t> first_column;
  std::array<float, wave_size> spike{};  // 20 ms
  std::array<float, noise_size> noise{};

  void read(std::size_t row, std::size_t rows, std::size_t column, std::size_t columns, float* out) const {
    for (std::size_t r = row; r < row + rows; ++r) {
      const float time = float(double(r) * options.step);
      auto n = std::size_t(std::ranges::upper_bound(first_column, column) - first_column.begin()) - 1;
      for (std::size_t c = column; c < column + columns; ++n) {
        const std::size_t end = std::min<std::size_t>(column + columns, first_column[n + 1]);
        const Neuron& neuron = neurons[n];
        const Cell& cell = cells[neuron.cell];
        const float base = neuron.rest + 4.f * std::sin(.03f * time + neuron.wave);
        for (; c < end; ++c) {
          const std::size_t i = c - first_column[n];
          float since = time - neuron.first - cell.delay[i];
          since -= neuron.period * std::floor(since / neuron.period);
          const float height =
              since < 20.f ? spike[std::size_t(since * (wave_size / 20.f)) % wave_size] : 0.f;
          *out++ = base + cell.share[i] * height + noise[(neuron.noise + i * 5 + r * 3) % noise_size];
        }
      }
    }
  }
};

}  // namespace

Nodes nodes_of(const circuit::Circuit& circuit) {
  Nodes nodes{{circuit.name}, {circuit.instances.size()}, {}};
  for (std::size_t i = 0; i < circuit.instances.size(); ++i) nodes.of_instance.push_back({0, i});
  return nodes;
}

Report synthetic_report(const circuit::Circuit& circuit, std::span<const Morphology> morphologies,
                        const Synthetic& options) {
  const auto formula = std::make_shared<Formula>();
  formula->options = options;
  for (const Morphology& m : morphologies) formula->cells.push_back(cell_of(m, options.compartments));
  for (std::size_t i = 0; i < wave_size; ++i) formula->spike[i] = spike_at(20. * double(i) / wave_size);
  for (std::size_t i = 0; i < noise_size; ++i)
    formula->noise[i] = .4f * float(std::sin(2. * std::numbers::pi * double(i * 7) / noise_size) +
                                    std::sin(2. * std::numbers::pi * double(i * 31) / noise_size));

  Report report{.source = "made-up values",
                .start = 0.,
                .step = options.step,
                .steps = options.steps,
                .populations = {circuit.name},
                .nodes = nodes_of(circuit).of_instance,
                .first_column = {0},
                .element_ids = {},
                .element_positions = {},
                .read = {}};
  for (std::size_t i = 0; i < circuit.instances.size(); ++i) {
    Random random(options.seed, i, 20);
    Neuron neuron{.cell = circuit.instances[i].morphology};
    neuron.rest = float(random.uniform(-72., -62.));
    neuron.period = float(random.uniform(30., 200.));
    neuron.first = float(random.uniform(0., 200.));
    neuron.wave = float(random.uniform(0., 6.28));
    neuron.noise = random.below(noise_size);
    formula->neurons.push_back(neuron);
    const Cell& cell = formula->cells[neuron.cell];
    report.element_ids.insert(report.element_ids.end(), cell.elements.begin(), cell.elements.end());
    report.element_positions.insert(report.element_positions.end(), cell.positions.begin(),
                                    cell.positions.end());
    report.first_column.push_back(report.element_ids.size());
  }
  formula->first_column = report.first_column;
  report.read = [formula](std::size_t row, std::size_t rows, std::size_t column, std::size_t columns,
                          float* out) { formula->read(row, rows, column, columns, out); };
  return report;
}

}  // namespace forest::reports
