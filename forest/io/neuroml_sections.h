// SPDX-License-Identifier: Apache-2.0
// From segments to the soma and the unbranched sections of a morphology.
#pragma once

#include "forest/io/neuroml_segments.h"
#include "forest/morphology/morphology.h"

namespace forest::io::neuroml {

/// Segments that read_groups() was asked about become a neuron. Afterwards each hangs where its section begins or within.
void add_sections(Segments& segments, MorphologyBuilder& builder);

}  // namespace forest::io::neuroml
