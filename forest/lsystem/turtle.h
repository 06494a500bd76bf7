// SPDX-License-Identifier: Apache-2.0
// The turtle of The Algorithmic Beauty of Plants (chapter 1.5) in µm and degrees, and what it draws as a
// neuron. It begins at the origin, heads to the pia (+y), its left is -x, its up +z. A branch point with two
// or more drawn daughters ends a section, and so does a change of kind.
#pragma once

#include <span>
#include <string_view>

#include "forest/cortex/environment.h"
#include "forest/lsystem/grammar.h"
#include "forest/morphology/morphology.h"

namespace forest::lsystem {

/// What the turtle does at a module. The order is that of turtle_symbols(), hence of the first
/// Grammar::symbols.
enum class Action : std::uint8_t {
  // clang-format off
  draw, move, turn_left, turn_right, pitch_down, pitch_up, roll_left, roll_right, turn_around, level,
  push, pop, diameter, tropism, soma, axon, basal, apical, glia, kind, outward, flat,
  place, head, trace, gauge, fibre, spiny, avoid, seek, shun,
  ask_place, ask_heading, ask_step, ask_depth, ask_near, ask_attraction,  // questions are the last
  // clang-format on
};

struct TurtleSymbol {
  std::string_view symbol, parameters, meaning;
  Action action;
  int least, most;                        // parameters
  std::span<const double> defaults = {};  // of those above the least, when each has one by itself
};
std::span<const TurtleSymbol> turtle_symbols();

/// Draws the word. Symbols that are none of the turtle's are passed over.
/// @param annotations  given to the neuron as they are
/// @param site         what the turtle finds around it
/// Throws Error when brackets do not match, a number is not finite or there are two somata.
Morphology interpret(const Word& word, const Grammar& grammar, const Annotations& annotations = {},
                     const cortex::Site& site = {});

constexpr bool is_question(Action action) { return action >= Action::ask_place; }

/// Whether what lies around can change what grows: the grammar avoids, seeks or shuns, or asks.
bool heeds_surroundings(const Grammar& grammar);

}  // namespace forest::lsystem
