// SPDX-License-Identifier: Apache-2.0
// NEURON (Hines and Carnevale 1997, Neural Computation 9:1179): a cell as a hoc template or a Python class, written only.
// Every section becomes a section of NEURON with the same points, so that NEURON 8.2 finds the same lengths and areas.
// docs/formats/neuron.md says it to the person with the file.
#pragma once

#include <string>

#include "forest/io/keeps.h"

namespace forest::io {

inline constexpr Keeps neuron_keeps{.contours = false,
                                    .lengthless = false,
                                    .zero_radii = false,
                                    .spines = false};  // annotations are comments

/// A template of a name of its own (from a checksum of what it holds, so that many load side by side).
std::string write_neuron_hoc(const Morphology& morphology);

/// A class `Cell` that needs the module neuron only.
std::string write_neuron_python(const Morphology& morphology);

}  // namespace forest::io
