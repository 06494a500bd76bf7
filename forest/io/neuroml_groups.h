// SPDX-License-Identifier: Apache-2.0
// Groups of segments say what these are: <segmentGroup id="dendrite_group" neuroLexId="sao1211023249">, and which make an unbranched
// section. They list segments, name paths and subtrees of them, and include one another.
#pragma once

#include "forest/io/neuroml_segments.h"

namespace forest::io::neuroml {

/// Meaning, kind and section of all segments, by their groups, else by names that people give. Throws InputError for groups that
/// would take hours to follow.
void read_groups(const xml_node& morphology, Segments& segments);

}  // namespace forest::io::neuroml
