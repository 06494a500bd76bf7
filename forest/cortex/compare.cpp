// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/compare.h"

#include <algorithm>
#include <cmath>

#include "forest/core/parallel.h"
#include "forest/core/progress.h"
#include "forest/cortex/surfaces.h"
#include "forest/geometry/triangle_tree.h"

namespace forest::cortex {
namespace {

constexpr double apart = 50.;  // µm

std::vector<std::vector<Place>> polygons_of(const Section& section, std::uint32_t object) {
  std::vector<std::vector<Place>> polygons;
  for (const Contour& contour : section.contours)
    if (contour.object == object) polygons.push_back(flattened(contour.curve, 1.));
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

void measure(const std::vector<std::vector<Place>>& from, const TriangleTree& to,
             std::vector<double>& distances) {
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

double overlap_of(const Section& one, const Section& other, std::uint32_t object) {
  Place low = Place::Constant(HUGE_VAL), high = -low;
  for (const Section* section : {&one, &other})
    for (const Contour& contour : section->contours)
      for (const Place& p : contour.curve.points)
        if (contour.object == object) low = low.cwiseMin(p), high = high.cwiseMax(p);
  const double step = std::max(100., (high - low).maxCoeff() / 2000.);
  const auto count = [&](double extent) { return std::size_t(extent / step) + 2; };
  const std::size_t width = count(high.x() - low.x()), height = count(high.y() - low.y());
  const auto a = signed_distances(one, object, low, step, width, height, step),
             b = signed_distances(other, object, low, step, width, height, step);
  std::size_t both = 0, either = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    both += a[i] < 0.f && b[i] < 0.f, either += a[i] < 0.f || b[i] < 0.f;
  return either ? double(both) / double(either) : 1.;
}

}  // namespace

std::vector<SectionChange> changes(const ContourStack& stack, Progress& progress) {
  const std::size_t pairs = stack.sections.empty() ? 0 : stack.sections.size() - 1;
  std::vector<std::vector<SectionChange>> each(pairs);
  progress.begin("comparing", pairs);
  parallel_for(pairs, 1, [&](std::size_t i) {
    for (std::uint32_t object = 0; object < stack.objects.size(); ++object) {
      const auto a = polygons_of(stack.sections[i], object), b = polygons_of(stack.sections[i + 1], object);
      if (a.empty() && b.empty()) continue;
      SectionChange change{.section = i, .object = object, .mean = NAN, .p95 = NAN, .greatest = NAN};
      if (!a.empty() && !b.empty()) {
        std::vector<double> distances, back;
        measure(a, tree_of(b), distances);
        measure(b, tree_of(a), back);
        const auto mean = [](const std::vector<double>& some) {
          double sum = 0.;
          for (const double one : some) sum += one;
          return sum / double(some.size());
        };
        change.mean = (mean(distances) + mean(back)) / 2.;
        distances.insert(distances.end(), back.begin(), back.end());
        std::ranges::sort(distances);
        change.p95 = distances[std::size_t(.95 * double(distances.size() - 1))];
        change.greatest = distances.back();
        change.overlap = overlap_of(stack.sections[i], stack.sections[i + 1], object);
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
