// SPDX-License-Identifier: Apache-2.0
// What a model is told to do, and what comes of it, differ: a branch that is drawn to where its tips should be leaves its fork more
// widely and bends more than where it was traced, whatever it is drawn from. So a model is heard, and tuned: as many neurons as were
// traced are grown, their branches are compared in the mean with those of the traced ones, knobs are turned by the difference, and
// they are grown again. Private to this room.
#pragma once

#include <array>
#include <cstddef>
#include <map>

#include "forest/core/progress.h"
#include "forest/fitting/resampling.h"
#include "forest/fitting/traced.h"
#include "forest/lsystem/grammar.h"

namespace forest::fitting {

/// A factor that the model asks for, of each kind of section, as a table of this name.
struct Knob {
  const char* name;
  std::size_t style;   // what it turns up
  double first, gain;  // gain: of its logarithm, for each standard deviation of that style among neurons
  const char* says;
};
inline constexpr std::array knobs{
    Knob{"wide", trait::spread, 1., .35,
         "how far the middle of a fork's tips stands beside the branch before"},
    Knob{"straighter", trait::wander, .95, .15, "how far they bend from their chord"},
    Knob{"kinked", trait::kink, 1., .2, "how large the angles between steps are"},
    Knob{"rugged", trait::stairs, 1., .4, "how unevenly steep steps are"},
    Knob{"climb", trait::slope, 1., .3, "how steep they are"},
    Knob{"deep", trait::depth, 1., .4, "how far along z from the soma the middle of their tips is sought"},
};

/// By kind, in the order of `knobs`.
using Tuning = std::map<int, std::array<double, knobs.size()>>;

/// As the knobs are at first, for each kind that was traced.
Tuning untuned(const Traced& traced);

/// The same at any number of threads.
/// @param grammar  as resampling_grammar writes it, with a table for each knob
/// @param traced   of what it was made
Tuning tuned(lsystem::Grammar grammar, const Traced& traced, const Resampling& options,
             Progress& progress = Progress::none());

}  // namespace forest::fitting
