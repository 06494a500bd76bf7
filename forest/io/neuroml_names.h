// SPDX-License-Identifier: Apache-2.0
// Words by which a NeuroML file that we wrote is known, to those who write and to those who read it (neuroml.h).
#pragma once

#include <string_view>

namespace forest::io::neuroml {

inline constexpr std::string_view section_lex = "sao864921383", marker_tag = "brain_forest",
                                  marker_value = "NeuroML 1", spine_tag = "brain_forest_spine",
                                  encoded_tag = "brain_forest_encoded", sphere_name = "soma",
                                  stump_name = "point";

}  // namespace forest::io::neuroml
