// SPDX-License-Identifier: Apache-2.0
#include "forest/geometry/surface_distance.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "forest/core/parallel.h"

namespace forest {

using Place = TriangleTree::Place;

double area_each(const Mesh& mesh) {
  constexpr double most = 1e7;
  return std::max(usual_area_each, area(mesh) / most);
}

std::vector<Place> evenly_on(const Mesh& mesh, double each) {
  std::vector<Place> places;
  double passed = 0.;
  for (const Triangle& t : mesh.triangles) {
    const Place a = mesh.positions[t[0]].cast<double>(), b = mesh.positions[t[1]].cast<double>(),
                c = mesh.positions[t[2]].cast<double>();
    passed += (b - a).cross(c - a).norm() / 2.;
    const auto count = std::size_t(passed / each);
    passed -= double(count) * each;
    if (count == 1) places.emplace_back((a + b + c) / 3.);
    if (count < 2) continue;
    // Roberts's sequence in the plane, folded into the triangle.
    double u = .5, v = .5;
    for (std::size_t i = 0; i < count; ++i) {
      u = std::fmod(u + .7548776662466927, 1.), v = std::fmod(v + .5698402909980532, 1.);
      const bool beyond = u + v > 1.;
      places.emplace_back(a + (beyond ? 1. - u : u) * (b - a) + (beyond ? 1. - v : v) * (c - a));
    }
  }
  return places;
}

std::vector<Place> at_vertices(const Mesh& mesh) {
  std::vector<Place> places;
  for (const Vec3& p : mesh.positions) places.push_back(p.cast<double>());
  return places;
}

Distances distances(std::span<const Place> places, const TriangleTree& surface) {
  Distances d;
  d.each.resize(places.size());
  if (places.empty()) return d;
  parallel_for(places.size(), 256, [&](std::size_t i) { d.each[i] = surface.nearest(places[i])->distance; });
  const auto most = std::ranges::max_element(d.each);
  d.greatest = *most, d.farthest = places[std::size_t(most - d.each.begin())];
  d.mean = std::accumulate(d.each.begin(), d.each.end(), 0.) / double(places.size());
  std::vector<double> sorted = d.each;
  const auto at = [&](double share) {
    const auto place = sorted.begin() + std::ptrdiff_t(share * double(sorted.size() - 1));
    std::ranges::nth_element(sorted, place);
    return *place;
  };
  d.median = at(.5), d.p95 = at(.95);
  return d;
}

}  // namespace forest
