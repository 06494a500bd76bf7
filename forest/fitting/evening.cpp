// SPDX-License-Identifier: Apache-2.0
#include "forest/fitting/evening.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <string_view>
#include <utility>

#include "forest/core/parallel.h"
#include "forest/lsystem/derive.h"

namespace forest::fitting {
namespace {

constexpr double most_weight = 12.;  // of its logarithm, and no less than minus that

// The rows of one sample.
struct Rows {
  lsystem::Sample* sample;
  std::size_t number;           // among the samples
  std::vector<double> weights;  // logarithms
  std::vector<std::atomic<std::uint32_t>> drawn;

  Rows(lsystem::Grammar& grammar, std::string_view name) {
    auto& samples = grammar.lookups.samples;
    sample = &*std::ranges::find(samples, name, &lsystem::Sample::name);
    number = std::size_t(sample - samples.data());
    weights.resize(sample->rows());
    drawn = std::vector<std::atomic<std::uint32_t>>(sample->rows());
  }
  void draw(double row) { drawn[std::size_t(row)].fetch_add(1, std::memory_order_relaxed); }

  std::vector<double> seldom() const {
    const double greatest = std::ranges::max(weights);
    std::vector<double> values;
    for (const double weight : weights) values.push_back(std::sqrt(2. * (greatest - weight)));
    return values;
  }

  // @param wanted  how often each should have been drawn. One more is added to either, so that what chance alone does is little
  void learn(double wanted, double share) {
    for (std::size_t i = 0; i < weights.size(); ++i) {
      const double was = double(drawn[i].exchange(0));
      weights[i] =
          std::clamp(weights[i] + share * std::log((wanted + 1.) / (was + 1.)), -most_weight, most_weight);
    }
    sample->ask(sample->conditions.size() - 1, seldom());
  }
};

}  // namespace

Seldom evened(lsystem::Grammar grammar, std::size_t neurons, const Evening& options, Progress& progress) {
  Rows stems(grammar, "stems"), forks(grammar, "forks"), calibres(grammar, "calibres");
  const auto trace = lsystem::Symbol(std::ranges::find(grammar.symbols, "Trace") - grammar.symbols.begin());
  const std::size_t grown = std::min(options.most, neurons * options.repeats);
  progress.begin("evening out", options.rounds * grown);
  for (std::size_t round = 0; round < options.rounds; ++round) {
    parallel_ranges(grown, 8, [&](std::size_t begin, std::size_t end) {
      lsystem::Deriver deriver(grammar);
      for (std::size_t i = begin; i < end; ++i, progress.advance()) {
        const lsystem::Word& word = deriver.derive(round, i);
        for (const lsystem::Module& m : word.modules) {
          if (m.symbol != trace) continue;
          const auto values = word.of(m);
          if (std::size_t(values[0]) == stems.number)
            stems.draw(values[1]);
          else if (values[2] == 0.)  // of a fork with several branches it is the first that counts
            forks.draw(values[1]), calibres.draw(values[7]);
        }
      }
    });
    for (Rows* rows : {&stems, &forks, &calibres})
      rows->learn(double(grown) / double(neurons), options.share);
  }
  progress.end();
  return {.stems = stems.seldom(), .forks = forks.seldom(), .calibres = calibres.seldom()};
}

}  // namespace forest::fitting
