// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/compare.h"

#include <algorithm>
#include <cmath>

#include "forest/core/parallel.h"
#include "forest/core/progress.h"
#include "forest/geometry/triangle_tree.h"

namespace forest::cortex {
namespace {

// How far contours reach, µm.
struct Extent {
  Place low = Place::Constant(HUGE_VAL), high = Place::Constant(-HUGE_VAL);

  Extent(const Section& one, const Section& other, std::uint32_t object) {
    for (const Section* section : {&one, &other})
      for (const Contour& contour : section->contours)
        if (contour.object == object)
          for (const Place& p : contour.curve.points) low = low.cwiseMin(p), high = high.cwiseMax(p);
  }
  double size() const { return (high - low).maxCoeff(); }
};

std::vector<std::vector<Place>> polygons_of(const Section& section, std::uint32_t object, double size) {
  std::vector<std::vector<Place>> polygons;
  for (const Contour& contour : section.contours)
    if (contour.object == object) polygons.push_back(flattened(contour.curve, std::min(1., size / 5000.)));
  return polygons;
}

// Edges as triangles without area: what finds the nearest triangle finds the nearest edge.
TriangleTree tree_of(const std::vector<std::vector<Place>>& polygons) {
  Mesh mesh;
  for (const auto& polygon : polygons) {
    const auto first = std::uint32_t(mesh.positions.size());
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      mesh.positions.push_back({float(polygon[i].x()), float(polygon[i].y()), 0.f});
      const auto a = first + std::uint32_t(i), b = first + std::uint32_t((i + 1) % polygon.size());
      mesh.triangles.push_back({a, b, b});
    }
  }
  return TriangleTree(mesh);
}

void measure(const std::vector<std::vector<Place>>& from, const TriangleTree& to, double size,
             std::vector<double>& distances) {
  const double apart = std::min(50., size / 200.);
  for (const auto& polygon : from)
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const Place a = polygon[i], along = polygon[(i + 1) % polygon.size()] - a;
      const int parts = int(std::clamp(std::ceil(along.norm() / apart), 1., 1e5));
      for (int k = 0; k < parts; ++k) {
        const Place p = a + (k + .5) / parts * along;
        distances.push_back(to.nearest({p.x(), p.y(), 0.})->distance);
      }
    }
}

// Where lines across the longer extent, as many as there are lists, cross the polygons: rising, in each list.
std::vector<std::vector<double>> crossings_of(const std::vector<std::vector<Place>>& polygons, int along,
                                              double low, double step, std::size_t lines) {
  std::vector<std::vector<double>> at(lines);
  for (const auto& polygon : polygons)
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      Place a = polygon[i], b = polygon[(i + 1) % polygon.size()];
      if (a[along] > b[along]) std::swap(a, b);
      const auto line = [&](double place) {  // the first at it or beyond
        return std::size_t(std::clamp(std::ceil((place - low) / step - .5), 0., double(lines)));
      };
      for (std::size_t k = line(a[along]); k < line(b[along]); ++k)
        at[k].push_back(std::lerp(a[1 - along], b[1 - along],
                                  (low + (double(k) + .5) * step - a[along]) / (b[along] - a[along])));
    }
  for (auto& list : at) std::ranges::sort(list);
  return at;
}

// What lies within both of what lies within either, line by line; exact along the lines.
double overlap_of(const std::vector<std::vector<Place>>& one, const std::vector<std::vector<Place>>& other,
                  const Extent& extent) {
  constexpr std::size_t lines = 2000;
  const Place reach = extent.high - extent.low;
  const int along = reach.x() >= reach.y() ? 0 : 1;
  const double step = reach[along] / double(lines);
  if (!(step > 0.)) return 1.;
  const auto a = crossings_of(one, along, extent.low[along], step, lines),
             b = crossings_of(other, along, extent.low[along], step, lines);
  double both = 0., either = 0.;
  for (std::size_t k = 0; k < lines; ++k) {
    double before = 0.;
    for (std::size_t i = 0, j = 0; i < a[k].size() || j < b[k].size();) {
      const bool of_one = j == b[k].size() || (i < a[k].size() && a[k][i] <= b[k][j]);
      const double here = of_one ? a[k][i] : b[k][j];
      if (i % 2 && j % 2) both += here - before;
      if (i % 2 || j % 2) either += here - before;
      before = here;
      ++(of_one ? i : j);
    }
  }
  return either > 0. ? both / either : 1.;
}

}  // namespace

std::vector<SectionChange> changes(const ContourStack& stack, Progress& progress) {
  const std::size_t pairs = stack.sections.empty() ? 0 : stack.sections.size() - 1;
  std::vector<std::vector<SectionChange>> each(pairs);
  progress.begin("comparing", pairs);
  parallel_for(pairs, 1, [&](std::size_t i) {
    for (std::uint32_t object = 0; object < stack.objects.size(); ++object) {
      const Section &one = stack.sections[i], &other = stack.sections[i + 1];
      const Extent extent(one, other, object);
      const double size = extent.size();
      const auto a = polygons_of(one, object, size), b = polygons_of(other, object, size);
      if (a.empty() && b.empty()) continue;
      SectionChange change{.section = i, .object = object, .mean = NAN, .p95 = NAN, .greatest = NAN};
      if (!a.empty() && !b.empty()) {
        std::vector<double> distances, back;
        measure(a, tree_of(b), size, distances);
        measure(b, tree_of(a), size, back);
        const auto mean = [](const std::vector<double>& some) {
          double sum = 0.;
          for (const double distance : some) sum += distance;
          return sum / double(some.size());
        };
        change.mean = (mean(distances) + mean(back)) / 2.;
        distances.insert(distances.end(), back.begin(), back.end());
        std::ranges::sort(distances);
        change.p95 = distances[std::size_t(.95 * double(distances.size() - 1))];
        change.greatest = distances.back();
        change.overlap = overlap_of(a, b, extent);
      }
      each[i].push_back(change);
    }
    progress.advance();
  });
  progress.end();
  std::vector<SectionChange> all;
  for (const auto& some : each) all.insert(all.end(), some.begin(), some.end());
  return all;
}

}  // namespace forest::cortex
