// SPDX-License-Identifier: Apache-2.0
// SWC: one row a point, `id type x y z radius parent` (Cannon et al. 1998, J. Neurosci. Methods 84:49; INCF
// SWC specification v1). Many dialects are about; all of them are read, and every deviation from INCF v1
// comes back as a warning with its line, its code and how it was read. docs/formats/swc.md gives each choice
// to the person with the file.
//
//   - Sections end at branch points and where the type changes. A row's type is Section::tag, and says
//     the kind.
//   - Type 1 is the soma: one point a sphere; three in the pattern of NeuroMorpho.Org a sphere too; a
//     closed chain of thin points a contour; else cylinders. A root section begins at its own first
//     point; Section::soma_point remembers the soma point it hangs on.
//   - Comment lines are kept as annotations: `# KEY value`, or ("comment", text).
#pragma once

#include <array>
#include <span>
#include <string>
#include <string_view>

#include "forest/io/format.h"

namespace forest::io {

/// Whether the first lines that are no comments are rows of numbers.
bool recognises_swc(std::string_view bytes);

/// Throws InputError when a row is no row, when a point is its own ancestor, or when there is no point.
ReadResult read_swc(std::string_view bytes, const std::string& name);

/// Deterministic: ids 1…n, soma first, then the sections in their order, floats with the digits that read
/// back to the same bits. What SWC has no word for (outlines of the soma, a node with one daughter of the
/// same type, spines) is kept in comment lines that begin with FOREST_, which read_swc understands and others
/// skip.
std::string write_swc(const Morphology& morphology);

/// The same with the columns of Vaa3D behind each row: segment (0 the soma, then the sections from 1), level (0 the soma, a
/// stem 1, its daughters 2), and zeros for mode, time and index.
std::string write_eswc(const Morphology& morphology);

inline constexpr std::array<std::string_view, 1> swc_keys{"synapse"};
inline constexpr Keeps swc_keeps{.foreign_tags = false, .keys = false, .own_keys = swc_keys};

/// Every deviation that is read, in the order of enum SwcOddity (swc_rows.h).
std::span<const Oddity> swc_oddities();

}  // namespace forest::io
