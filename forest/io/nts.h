// SPDX-License-Identifier: Apache-2.0
// Eutectic NTS, the files of the Neuron Tracing System that N++ was built for: a header, then one record a point in
// fixed columns. The order of records is the tree: after an end the next point leaves from the branch point opened last
// (the notes on the format that go with ntscable in surf-hippo, and NEURON's reader import3d/read_nts.hoc).
//
//   column   0–5     8–10  11–15   16–23   24–31   32–39   40–45  48–53   56–61 62–67
//   Point    number  type  tag     X       Y       Z       Thick  name    attachment
//
//   - Branch points one after the other at one place are one node: n of them have n + 1 daughters.
//   - Every tree origin (MTO, TTO, BTO) is a root of its own, so that pieces of unmerged serial sections are kept.
//   - The tag is the kind, with the numbers of SWC (as in NEURON).
//   - Soma outlines (SOS SCP SOE) are a stack, spine bases (SB) spines. Other codes are annotations that are written again:
//     ("eutectic", "FS x y z"), ("outline" or "dots", "x y z d; …").
#pragma once

#include <array>
#include <span>
#include <string>
#include <string_view>

#include "forest/io/format.h"

namespace forest::io {

/// Whether one of the first lines begins with "No. points" or is a record.
bool recognises_nts(std::string_view bytes);

/// Throws InputError when a record lacks a number or names a place outside of what the columns can hold, or when there
/// is no point.
ReadResult read_nts(std::string_view bytes, const std::string& name);

/// Throws LimitError when a place, a diameter or the number of points does not fit into its column.
std::string write_nts(const Morphology& morphology);

inline constexpr std::array<std::string_view, 4> nts_keys{"Text", "eutectic", "outline", "dots"};
inline constexpr Keeps nts_keeps{.cylinders = false,
                                 .soma_points = false,
                                 .single_daughters = false,
                                 .spine_sizes = false,
                                 .keys = false,
                                 .own_keys = nts_keys,
                                 .order = false,
                                 .step = .1f,
                                 .largest_tag = 9999,
                                 .largest_place = 99999.9f,
                                 .largest_diameter = 9999.9f};

/// Every deviation that is read.
std::span<const Oddity> nts_oddities();

}  // namespace forest::io
