// SPDX-License-Identifier: Apache-2.0
// What a model that was resampled still does otherwise than the traced neurons, mended by taste: of several candidates of a neuron
// one is drawn, by weights on named features (grow.h of the L-systems). The weights come from a loop against a discriminator.
// It is a linear one of features and of their squares, so that spreads between neurons are mended as well as means; part of it is
// added to the taste, then it is learned anew between traced neurons and candidates as they are drawn now.
//
// When to stop is asked of neurons that nothing was fitted to: traced ones are dealt into thirds, each third in its turn is held
// back while model and taste are made of the others, and that many rounds are gone after which drawn ones lie nearest to it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "forest/core/progress.h"
#include "forest/fitting/resampling.h"
#include "forest/morphology/morphology.h"

namespace forest::fitting {

struct Calibration {
  std::uint32_t candidates = 4;  // of each neuron
  std::size_t rounds = 24;       // at most
  double share = .2;             // of the discriminator that a round adds to the taste
  double ridge = .3;             // of the discriminator, whose features have a standard deviation of 1
  std::size_t repeats = 3;       // how often the candidates of each neuron are grown for the loop
  std::size_t least = 12;        // traced neurons; of fewer nothing is learned
  std::uint64_t seed = 1;
};

struct Calibrated {
  std::string text;        // of the grammar
  std::size_t rounds = 0;  // 0: no taste helped
  double gap_before = 0.,
         gap_after =
             0.;  // mean square, over features, of how far the mean of drawn ones lies from that of the
                  // third held back, in standard deviations; 0 when nothing was tried
};

/// As resampling_grammar, with a taste where one helps.
/// @param slices  of the neurons, which are dealt together; none when each is on its own
Calibrated calibrated_grammar(std::span<const Morphology> neurons, std::span<const std::uint32_t> slices,
                              const std::string& title, const Resampling& resampling = {},
                              const Calibration& calibration = {}, Progress& progress = Progress::none());

/// The features that are tasted, of the kinds of sections that nearly all of these neurons have.
std::vector<std::string> tasted_features(std::span<const Morphology> neurons, statistics::KindSet kinds);

}  // namespace forest::fitting
