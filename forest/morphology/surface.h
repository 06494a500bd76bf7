// SPDX-License-Identifier: Apache-2.0
// A neuron as lines, as tubes and as one closed surface, for programs that show models. Labels of what is made are the
// numbers of SectionKind, and `soma_label` for the soma. In all three a stem reaches into the soma it hangs on; a root
// that lies apart from it (a lost piece) stays apart.
#pragma once

#include <cstddef>
#include <cstdint>

#include "forest/geometry/mesh.h"
#include "forest/morphology/morphology.h"

namespace forest {

inline constexpr std::uint8_t soma_label = 1;

/// Every section is one line. A soma is its outlines or the axes of its cylinders; a sphere its three diameters.
Lines sticks(const Morphology& m);

struct TubeOptions {
  int sides = 12;          // of a tube, 3 to 64
  float thinnest = 0.01f;  // µm: thinner and unmeasured branches become as thick as this
};

/// Every section is one closed tube, flat at its tip and round where it meets others. A soma is a sphere, or tapered
/// cylinders; a stack of outlines is the cylinders through their middles, a single one the sphere of its mean radius.
/// The pieces overlap where they meet.
Mesh tubes(const Morphology& m, const TubeOptions& options = {});

struct SurfaceOptions {
  float voxel = 0.f;  // µm; 0: the thinnest radius, or coarser where that gives more than 2 million triangles
};

struct Surface {
  Mesh mesh;
  float voxel = 0.f;          // µm, that was taken
  std::size_t thickened = 0;  // points whose radius was made 0.75 voxels, for thinner branches would break
};

/// The whole neuron as one closed surface, rounded where branches meet; its tips are round too. Pieces that do not touch
/// stay pieces. Throws LimitError as `polygonise` does.
Surface surface(const Morphology& m, const SurfaceOptions& options = {});

}  // namespace forest
