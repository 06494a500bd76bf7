// SPDX-License-Identifier: Apache-2.0
#include "forest/morphology/measure.h"

#include <cmath>

namespace forest {
namespace {

template <class Measure>
double sum_over_segments(std::span<const Point> points, Measure measure) {
  double sum = 0.;
  for (std::size_t i = 1; i < points.size(); ++i) sum += measure(points[i - 1], points[i]);
  return sum;
}

template <class Measure>
double sum_over_sections(const Morphology& m, Measure measure) {
  double sum = 0.;
  for (std::size_t i = 0; i < m.sections().size(); ++i)
    sum += sum_over_segments(m.points(SectionId(i)), measure);
  return sum;
}

}  // namespace

double segment_area(const Point& a, const Point& b) {
  const double length = segment_length(a, b), taper = double(b.radius) - a.radius;
  const double slant = std::sqrt(length * length + taper * taper);
  return std::numbers::pi * (double(a.radius) + b.radius) * slant;
}

double segment_volume(const Point& a, const Point& b) {
  const double r = a.radius, s = b.radius;
  return std::numbers::pi / 3. * segment_length(a, b) * (r * r + r * s + s * s);
}

double section_length(const Morphology& m, SectionId id) {
  return sum_over_segments(m.points(id), segment_length);
}
double section_area(const Morphology& m, SectionId id) {
  return sum_over_segments(m.points(id), segment_area);
}
double section_volume(const Morphology& m, SectionId id) {
  return sum_over_segments(m.points(id), segment_volume);
}
double total_length(const Morphology& m) { return sum_over_sections(m, segment_length); }
double total_area(const Morphology& m) { return sum_over_sections(m, segment_area); }

std::vector<double> path_distances(const Morphology& m) {
  std::vector<double> distances(m.sections().size());
  for (std::size_t i = 0; i < distances.size(); ++i) {
    const SectionId parent = m.sections()[i].parent;
    distances[i] = (parent.valid() ? distances[parent.value()] : 0.) + section_length(m, SectionId(i));
  }
  return distances;
}

}  // namespace forest
