// SPDX-License-Identifier: Apache-2.0
// Derivation: in each step all modules of the word are rewritten at once, by what the word was before the
// step. A word is a pure function of (grammar, seed, index, steps) and of the site, when the grammar asks what is there.
#pragma once

#include <memory>
#include <optional>

#include "forest/cortex/environment.h"
#include "forest/lsystem/grammar.h"
#include "forest/morphology/morphology.h"

namespace forest::lsystem {

/// Derives words of one grammar, keeping its memory between them. One object a thread; the grammar must
/// outlive it.
class Deriver {
 public:
  explicit Deriver(const Grammar& grammar, const cortex::Site& site = {});
  ~Deriver();
  Deriver(Deriver&&) noexcept;

  /// Derives a new word from the axiom. Throws LimitError, naming the production that wrote most, or the axiom, when the
  /// word would have more modules than the grammar's limit; Error when a number is not finite or a weight is
  /// negative.
  /// @param steps  of derivation; the grammar's own when not given. Ends before when nothing is left to
  /// rewrite.
  /// @param candidate  others of the same neuron have the same values that are drawn once a neuron, but grow otherwise
  const Word& derive(std::uint64_t seed = 0, std::uint64_t index = 0, std::optional<int> steps = {},
                     std::uint32_t candidate = 0);

  /// Whether nothing of the word that was derived last is left to rewrite: with more steps it stays as it is.
  bool full_grown() const;

  /// How well a grown neuron is liked: the sum of the grammar's tastes, of those features that are defined. It must have been
  /// derived last, or another candidate of it. Throws Error when a number is not finite.
  double liking(const Morphology& neuron);

  /// Where its neurons grow.
  const cortex::Site& site() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

Word derive(const Grammar& grammar, std::uint64_t seed = 0, std::uint64_t index = 0,
            std::optional<int> steps = {}, const cortex::Site& site = {});

}  // namespace forest::lsystem
