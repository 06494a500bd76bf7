// SPDX-License-Identifier: Apache-2.0
// One neuron and the rows of all its tables: stored, or compared with what is stored. And where those rows stand.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "forest/repository/insert.h"
#include "forest/repository/repository.h"
#include "forest/repository/rows.h"

namespace forest::repository {

// To select from or delete from. Sections of a neuron are those from its first to before the next one's.
std::string of_sections(long long neuron);
std::string of_metrics(long long neuron);  // one look-up a metric: the table is in the order of metrics

/// The statements that store one neuron, prepared once, with the variables they are bound to.
class Statements {
 public:
  explicit Statements(Database& database);
  Statements(const Statements&) = delete;  // its parts point at one another

  // What the caller sets before run().
  int id = 0, population = 0, grammar = 0;
  std::string name, fingerprint;
  NewNeuron about;
  Rows rows;
  std::string packed_points;  // empty: as in rows
  long long checksum = 0;

  /// False when the population has the name or the fingerprint by now, from another program.
  bool run(const Morphology& m);

  /// What version 2 of the tables keeps otherwise than version 1: points, sections, metrics.
  void run_shape();

  /// Metrics wait until those of some hundred neurons are there: their table is in the order of metrics, and a neuron's values
  /// alone would each go to another page.
  void run_metrics();
  void finish();  // stores those that wait; before they are asked for, and before the end of the transaction

  /// What the tables hold otherwise than this neuron, of all that follows from its points: "length of sections is 1 in row 2,
  /// not 14.5", and how much more there is. Empty when nothing is.
  std::string deviation(Database& database, const Morphology& m);

 private:
  void run(Insert& insert, std::size_t count);  // a table with `count` rows of this neuron
  void number(std::size_t count);
  void fill(const Morphology& m);
  void fill_shape();
  void wait_metrics();
  void take_waiting();

  struct Value {
    int metric, neuron;
    double value;
  };
  std::vector<Value> waiting_;
  Ints metric_, metric_neuron_;  // those that no longer wait, as columns
  Reals metric_value_;

  int stems_ = 0, section_count_ = 0, point_count_ = 0, spine_count_ = 0, packing_ = 0;
  double length_ = 0., area_ = 0.;
  std::string origin_, file_, hash_, program_, soma_kind_, data_;
  long long seed_ = 0, index_ = 0;
  std::array<double, 4> sphere_{};
  Ints numbers_, spine_section_, spine_shape_;
  Longs section_ids_;
  std::array<Reals, 6> spine_;
  Texts key_, value_;
  Insert neuron_, provenance_, soma_, points_, arbors_, sections_, metrics_, spines_, annotations_;
};

}  // namespace forest::repository
