// SPDX-License-Identifier: Apache-2.0
// NeuroML 2: cells as trees of segments (Cannon et al. 2014, Front. Neuroinform. 8:79; schema NeuroML_v2beta5 to v2.3).
//
//   <segment id="7" name="dend">                   a tapered cylinder from proximal to distal; a sphere where the two
//     <parent segment="3" fractionAlong="0.5"/>    are equal. Without a proximal point it begins where it hangs on.
//     <proximal x="0" y="5" z="0" diameter="2"/>
//     <distal x="0" y="15" z="0" diameter="1"/>
//   </segment>
//   <segmentGroup id="dendrite_group" neuroLexId="sao1211023249"> … what kind segments are of
//   <segmentGroup id="section_2" neuroLexId="sao864921383"> … an unbranched section
//
// A child at a fraction of its parent splits the section there. What is not shape (channels, networks, included files)
// is told and left out. docs/formats/neuroml.md says what becomes of all that.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "forest/io/format.h"

namespace forest::io {

inline constexpr Keeps neuroml_keeps{.contours = false, .least_diameter = 1e-6f};

/// Whether the first element is <neuroml>.
bool recognises_neuroml(std::string_view bytes);

/// Throws InputError when the text is no XML, no NeuroML 2, or a cell's segments make no tree.
ReadResult read_neuroml(std::string_view bytes, const std::string& name);
/// Cells, and morphologies that no cell refers to.
std::vector<Cell> read_all_neuroml(std::string_view bytes, const std::string& name);

/// Valid against NeuroML_v2beta5 and later. The same neuron gives the same bytes.
std::string write_neuroml(const Morphology& morphology);

/// Every deviation that is read, in the order of enum NeuromlOddity (neuroml_document.h).
std::span<const Oddity> neuroml_oddities();

}  // namespace forest::io
