// SPDX-License-Identifier: Apache-2.0
#include "forest/lsystem/grow.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/parallel.h"
#include "forest/lsystem/derive.h"
#include "forest/lsystem/turtle.h"

namespace forest::lsystem {

namespace {

Annotations source(const Grammar& grammar, std::uint64_t seed, std::uint64_t index,
                   const cortex::Site& site) {
  Annotations list{
      {"grammar", grammar.name}, {"seed", std::to_string(seed)}, {"index", std::to_string(index)}};
  if (site.environment) {
    list.emplace_back("grown_at", fmt::format("{}, {}, {}", site.at.x(), site.at.y(), site.at.z()));
    if (!site.name.empty()) list.emplace_back("environment", site.name);
    list.emplace_back("environment_hash", site.environment->hash());
  }
  return list;
}

// What grows, or an error that names it.
template <class Growing>
auto named(std::uint64_t seed, std::uint64_t index, const Growing& growing) {
  const auto told = [&](std::string_view what) {
    return fmt::format("{} (neuron {} of seed {})", what, index, seed);
  };
  try {
    return growing();
  } catch (const InputError& error) {
    throw InputError(error.file(), error.line(), told(error.sentence()));
  } catch (const LimitError& error) {
    throw LimitError(told(error.what()));
  } catch (const Error& error) {
    throw Error(told(error.what()));
  }
}

constexpr std::uint32_t choice_stream = 0x70696368;  // "pick"

// The candidate that is drawn, with what it is numbered.
std::pair<Morphology, std::uint32_t> chosen(Deriver& deriver, const Grammar& grammar, std::uint64_t seed,
                                            std::uint64_t index) {
  const Annotations annotations = source(grammar, seed, index, deriver.site());
  const auto grown = [&](std::uint32_t candidate) {
    return interpret(deriver.derive(seed, index, {}, candidate), grammar, annotations, deriver.site());
  };
  if (grammar.tastes.empty()) return {grown(0), 0};
  std::vector<Morphology> candidates;
  std::vector<double> chances;
  for (std::uint32_t i = 0; i < grammar.candidates; ++i) {
    candidates.push_back(grown(i));
    chances.push_back(deriver.liking(candidates.back()));
  }
  const double best = std::ranges::max(chances);
  for (double& chance : chances) chance = std::exp(chance - best);
  double left =
      Random(seed, index, choice_stream).uniform() * std::accumulate(chances.begin(), chances.end(), 0.);
  std::uint32_t at = 0;
  while (at + 1 < grammar.candidates && (left -= chances[at]) >= 0.) ++at;
  return {candidates[at], at};
}

}  // namespace

Morphology grow(Deriver& deriver, const Grammar& grammar, std::uint64_t seed, std::uint64_t index) {
  return named(seed, index, [&] { return chosen(deriver, grammar, seed, index).first; });
}

Morphology grow(const Grammar& grammar, std::uint64_t seed, std::uint64_t index, const cortex::Site& site) {
  Deriver deriver(grammar, site);
  return grow(deriver, grammar, seed, index);
}

Morphology grow_to(Deriver& deriver, const Grammar& grammar, std::uint64_t seed, std::uint64_t index,
                   int steps) {
  Annotations annotations = source(grammar, seed, index, deriver.site());
  annotations.emplace_back("step", std::to_string(steps));
  return named(seed, index, [&] {
    const std::uint32_t candidate = grammar.tastes.empty() ? 0 : chosen(deriver, grammar, seed, index).second;
    return interpret(deriver.derive(seed, index, steps, candidate), grammar, annotations, deriver.site());
  });
}

std::vector<Morphology> grow_population(const Grammar& grammar, std::size_t count, std::uint64_t seed,
                                        Progress& progress, std::uint64_t first, const cortex::Site& site) {
  std::vector<Morphology> neurons(count);
  progress.begin("growing", count);
  parallel_ranges(count, 1, [&](std::size_t begin, std::size_t end) {
    Deriver deriver(grammar, site);
    for (std::size_t i = begin; i < end; ++i) {
      neurons[i] = grow(deriver, grammar, seed, first + i);
      progress.advance();
    }
  });
  progress.end();
  return neurons;
}

}  // namespace forest::lsystem
