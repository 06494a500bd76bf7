// SPDX-License-Identifier: Apache-2.0
// Length, area and volume of segments (truncated cones) and sections, in double precision.
#pragma once

#include <cmath>

#include "forest/morphology/morphology.h"

namespace forest {

inline double segment_length(const Point& a, const Point& b) {  // µm
  const double x = double(b.x) - a.x, y = double(b.y) - a.y, z = double(b.z) - a.z;
  return std::sqrt(x * x + y * y + z * z);  // squares of floats are far from the ends of double
}
double segment_area(const Point& a, const Point& b);    // lateral area of the truncated cone, µm²
double segment_volume(const Point& a, const Point& b);  // µm³

double section_length(const Morphology& m, SectionId id);
double section_area(const Morphology& m, SectionId id);
double section_volume(const Morphology& m, SectionId id);

double total_length(const Morphology& m);  // of all sections, the soma aside
double total_area(const Morphology& m);    // of all sections, the soma aside

/// Path distance from the start of its root to the end of every section, µm.
std::vector<double> path_distances(const Morphology& m);

}  // namespace forest
