// SPDX-License-Identifier: Apache-2.0
// A neuron as a bracketed parametric string, after N++, which kept its neurons as such strings. One bracket
// is one section with its points, spines and daughters; the soma comes first:
//
//   [sphere P(0,0,0,5)]
//   [apical P(0,5,0,2) P(0,15,0,1)
//    [apical P(0,15,0,1) P(3,19,0,1)]
//    [apical P(0,15,0,0.5) P(-3,19,0,0.5) Spine(2.5, 0.4,0,0.3, 0.5,0.1, 3)]]
//
//   sphere, cylinders, contours   the soma; P(x,y,z,radius); Parents(…) of cylinders and
//                                 Starts(…) of contours by index
//   axon, basal, apical, …        a section; (tag), (tag, soma_point) or (tag, soma_point, index)
//                                 follow when they are not the number of the kind, -1, and the
//                                 place in the string
//   Spine(position, head x,y,z, head diameter, neck diameter, shape[, index])
#pragma once

#include <string>
#include <string_view>

#include "forest/morphology/morphology.h"

namespace forest::lsystem {

/// All of it but the annotations, in shortest decimals that give every number back bit for bit.
std::string to_string(const Morphology& morphology);

/// morphology_from_string(to_string(m)) == m. Throws InputError with line and column.
/// @param file  named in errors
Morphology morphology_from_string(std::string_view text, const std::string& file = "string");

}  // namespace forest::lsystem
