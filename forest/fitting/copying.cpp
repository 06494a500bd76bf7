// SPDX-License-Identifier: Apache-2.0
#include "forest/fitting/copying.h"

#include <algorithm>
#include <vector>

#include "forest/core/error.h"
#include "forest/lsystem/turtle.h"

namespace forest::fitting {

std::optional<std::size_t> longest_run(const lsystem::Word& word, const lsystem::Grammar& grammar) {
  using lsystem::Action;
  struct Run {
    double donor = -1.;  // of the branch that the turtle stands on
    std::size_t length = 0;
  } run;
  std::vector<Run> open;
  std::optional<std::size_t> longest;
  const auto& samples = grammar.lookups.samples;
  for (const lsystem::Module& m : word.modules) {
    const lsystem::Symbol symbol = grammar.drawn_as[m.symbol];
    if (symbol >= lsystem::turtle_symbols().size()) continue;
    const Action action = lsystem::turtle_symbols()[symbol].action;
    if (action == Action::push) open.push_back(run);
    if (action == Action::pop && !open.empty()) run = open.back(), open.pop_back();
    if (action == Action::place || action == Action::move) run = {};
    if (action != Action::trace) continue;
    const auto values = word.of(m);
    if (!(values[0] >= 0. && values[0] < double(samples.size()) && values[1] >= 0. &&
          values[1] < double(samples[std::size_t(values[0])].rows())))
      throw Error(grammar.file + ": Trace names no row of a sample; mend the grammar");
    const lsystem::Sample& sample = samples[std::size_t(values[0])];
    const auto column = std::ranges::find(sample.outcomes, "donor");
    if (column == sample.outcomes.end()) continue;
    const double donor =
        sample.outcome(std::size_t(values[1]), std::size_t(column - sample.outcomes.begin()));
    run = {donor, run.length && run.donor == donor ? run.length + 1 : 1};
    longest = std::max(longest.value_or(0), run.length);
  }
  return longest;
}

}  // namespace forest::fitting
