// SPDX-License-Identifier: Apache-2.0
// Neurolucida ASC: nested brackets, `((Axon) (x y z diameter) … ( branch | branch ))`, as the tracing program writes
// them ("V3 text file") and as many others imitate them. The rules are those of MorphIO's description of the format
// (doc/source/specification_neurolucida.rst); docs/formats/asc.md tells where readers disagree and what is chosen.
//
//   - A pair of brackets with a type is a tree, one with (CellBody) an outline of the soma: several are a stack.
//   - A branch may or may not repeat the point it leaves from. Where it does, with a diameter of its own, that is the
//     section's radius at its start; where not, the section starts with the radius of its first own point.
//   - Spines become spines. Leaf words, markers, other outlines, texts and blocks become annotations that are written
//     again: ("leaf", "Incomplete x y z"), ("tree", "x y z (Color Red)…") of a root, and the block's text under "marker",
//     "contour", "text" or "asc".
#pragma once

#include <array>
#include <span>
#include <string>
#include <string_view>

#include "forest/io/format.h"

namespace forest::io {

/// Whether the first thing that is no comment is a bracket with a word, a name or a bracket in it.
bool recognises_asc(std::string_view bytes);

/// One pass over the bytes, without recursion. Throws InputError when a bracket is not closed, when a point holds a
/// word, when something follows where a branch is over, or when there is neither tree nor cell body.
ReadResult read_asc(std::string_view bytes, const std::string& name);

/// Sections are written depth first (asc_keeps). What ASC has no word for (a soma that is no outline, kinds other than
/// axon, dendrite and apical, kinds that change within a tree, sizes of spines) stands in comments that begin with
/// FOREST_, which read_asc understands and others skip.
std::string write_asc(const Morphology& morphology);

inline constexpr std::array<std::string_view, 6> asc_keys{"leaf", "tree", "marker", "contour", "text", "asc"};
inline constexpr Keeps asc_keeps{.keys = false, .own_keys = asc_keys, .order = false};

/// Every deviation that is read.
std::span<const Oddity> asc_oddities();

}  // namespace forest::io
