// SPDX-License-Identifier: Apache-2.0
// From traced neurons to a grammar that grows more of them. N++ asked for three families: where segments do not end, their
// trajectories and lengths, and the rotations where they fork. Here all three are drawn together, from forks and stems as
// they were traced at such a place of such a neuron:
//
// - a branch carries the tips that it is still to have, which its daughters share (Samsonovich & Ascoli 2005, Hippocampus
//   15:166): a tree neither dies out nor explodes;
// - a fork is drawn with its daughters, by kind, tips, path distance, order, diameter, heading and the way to the middle of
//   its tips; after three branches of one neuron the next fork comes from another;
// - branches are drawn a little aside, so that the middle of their tips comes to where it should be, within the faces of the
//   slice; daughters bear this together, so that a tuft stays over its trunk;
// - a neuron has a style of its own, how long, winding, thick, finely and steeply traced its branches are, and forks of
//   neurons of a like style are drawn for it: else neurons would be more alike than traced ones;
// - a neuron is made of four traced ones that are alike (mixing.h): it winds as the first, and has the stems of a second, of basal and other dendrites
//   the basal ones alone, lying as those of a fourth, and the diameters of a third, so that none is like one of them all over.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>

#include "forest/core/progress.h"
#include "forest/morphology/morphology.h"
#include "forest/statistics/arbors.h"

namespace forest::fitting {

/// How it is brought about that each stem and fork is drawn about as often as it was met (evening.h).
struct Evening {
  std::size_t rounds = 20;  // 0: it is not
  std::size_t repeats = 2;  // populations grown in each round, …
  std::size_t most = 2000;  // … of no more neurons than so many together
  double share = .8;        // of the logarithm of what is amiss, mended in a round
};

/// How a model is tuned after that, until its branches are in the mean as traced ones are.
struct TuningOptions {
  std::size_t rounds = 10;  // 0: it is not
  std::size_t most = 300;   // neurons in a round
};

struct Resampling {
  statistics::KindSet kinds = statistics::dendrites;  // of the sections that are modelled
  // Widths of the kernels by which forks are drawn.
  double tips = .06, ahead = .12;  // of the logarithms of the tips to come, and of the path to the farthest
  double path = 1., order = 2., diameter = .5, height = .6,
         depth = .2;                          // in standard deviations among the forks of a kind
  double heading = .15, heading_across = .1;  // of a unit vector: in the plane of the slice, and across it
  double aim = .25, aim_across = .15;         // of the unit vector to the middle of the tips: likewise
  double lean = .12;                          // of how far aside of the way out it heads
  double swerve = 20.;                        // of how far its last step turns aside, degrees
  double style = .45;                         // in standard deviations among the neurons
  double tracer = .25;                        // … where the style is the tracer's: how steep, how kinked
  double familiar = 1.;  // how often a fork may come from the neuron whose style its branch has
  // How far a neuron's style strays, in differences of two of its kin: 0 takes that of a traced neuron as it is. When not given,
  // 0, or with fewer than 25 neurons 10 over their number, at most 1.2: few show little of what there is.
  std::optional<double> smoothing = {};
  double jitter = .1;   // of the logarithms of a stem's tips and, at most, reach
  std::size_t kin = 4;  // neurons alike, by whose differences it is changed; none is its mate or third
  Evening evening = {};
  TuningOptions tuning = {};
};

/// The text of a grammar (docs/lsystem/notation.md) with all that it draws from.
/// @param neurons  at least two with such sections; others are passed over. Neurons without a soma begin at their first root, as
///                 insects' do whose arbors all leave one fibre. What changes its kind on the way (an axon on a dendrite) is a
///                 stem of its own, which begins where it began.
/// Throws Error where they cannot be resampled.
std::string resampling_grammar(std::span<const Morphology> neurons, const std::string& title,
                               const Resampling& options = {}, Progress& progress = Progress::none());

/// Whether two neurons or more have sections of these kinds, and any of these a fork.
bool can_be_resampled(std::span<const Morphology> neurons, statistics::KindSet kinds);

}  // namespace forest::fitting
