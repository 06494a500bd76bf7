// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/gaps.h"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

#include "forest/core/parallel.h"
#include "forest/cortex/neighbourhood.h"

namespace forest::cortex {
namespace {

// All faces, each as 3×3 squares of two triangles between its places.
constexpr std::uint32_t per_face = 18;
Mesh mesh_of(const Elements& elements, std::size_t depth) {
  Mesh mesh;
  mesh.positions.reserve(elements.curves.size());
  for (const Depths& curve : elements.curves) mesh.positions.push_back(curve[depth].cast<float>());
  mesh.triangles.reserve(per_face * elements.size());
  for (const auto& own : elements.elements)
    for (int j = 0; j < 3; ++j)
      for (int i = 0; i < 3; ++i) {
        const std::uint32_t a = own[slot(i, j)], b = own[slot(i + 1, j)], c = own[slot(i + 1, j + 1)],
                            d = own[slot(i, j + 1)];
        mesh.triangles.push_back({a, b, c}), mesh.triangles.push_back({a, c, d});
      }
  return mesh;
}

struct Gap {
  std::uint32_t element = 0;
  double volume = 0.;  // µm³
};

class Faces {
 public:
  Faces(const Elements& elements, std::size_t depth)
      : elements_(elements), depth_(depth), tree_(mesh_of(elements, depth)) {}

  /// What a small piece of the surface, its area as a vector, adds to the nearest face.
  Gap above(const Place& at, const Place& area) const {
    constexpr double reach = 3e3;  // µm: no fold hides more
    const auto hit = tree_.nearest(at, reach);
    if (!hit) return {};
    const std::uint32_t element = hit->triangle / per_face;
    const Eigen::Vector2d uv = parameters(*hit);
    const Patch patch = face_of(elements_, element, depth_);
    constexpr double step = 1e-3;
    Place normal = (patch.at(uv[0] + step, uv[1]) - patch.at(uv[0] - step, uv[1]))
                       .cross(patch.at(uv[0], uv[1] + step) - patch.at(uv[0], uv[1] - step))
                       .normalized();
    const Depths& middle = elements_.curves[elements_.elements[element][slot(1, 1)]];
    if (normal.dot(middle[depth_] - middle[3 - depth_]) < 0.) normal = -normal;  // out of the element
    const Place way = at - patch.at(uv[0], uv[1]);
    const double height = way.dot(normal);
    constexpr double beside = 20.;  // µm: beyond a rim there is no face
    if ((way - height * normal).norm() > .5 * std::abs(height) + beside) return {};
    return {element, height * std::max(0., area.dot(depth_ == 0 ? normal : Place(-normal)))};
  }

 private:
  // Where on its face a point of a triangle lies: along the diagonal of its square and the other side.
  Eigen::Vector2d parameters(const TriangleTree::Hit& hit) const {
    const auto& own = elements_.elements[hit.triangle / per_face];
    const std::uint32_t square = hit.triangle % per_face / 2;
    const auto i = int(square % 3), j = int(square / 3);
    const bool lower = hit.triangle % 2 == 0;
    const auto corner = [&](int a, int b) { return elements_.curves[own[slot(i + a, j + b)]][depth_]; };
    const Place a = corner(0, 0);
    Eigen::Matrix<double, 3, 2> ways;
    ways << corner(1, 1) - a, (lower ? corner(1, 0) : corner(0, 1)) - a;
    const Eigen::Matrix2d squares = ways.transpose() * ways;
    if (!(squares.determinant() > 0.)) return Eigen::Vector2d(i + .5, j + .5) / 3.;
    const Eigen::Vector2d share = squares.inverse() * (ways.transpose() * (hit.at - a));
    return Eigen::Vector2d(i + share[0] + (lower ? share[1] : 0.), j + share[0] + (lower ? 0. : share[1])) /
           3.;
  }

  const Elements& elements_;
  std::size_t depth_;
  TriangleTree tree_;
};

}  // namespace

std::vector<double> gaps(const Elements& elements, std::size_t depth, const TriangleTree& surface) {
  constexpr double piece = 300.;  // µm, a side of what is looked at as one
  const Faces faces(elements, depth);
  std::vector<std::vector<Gap>> found(surface.size());
  parallel_for(surface.size(), 64, [&](std::size_t t) {
    const auto [a, b, c] = surface.corners(std::uint32_t(t));
    const double longest = std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
    const int n = std::max(1, int(std::ceil(longest / piece)));
    const Place u = (b - a) / n, v = (c - a) / n, area = .5 * u.cross(v);
    for (int j = 0; j < n; ++j)
      for (int i = 0; i + j < n; ++i) {
        const Place at = a + double(i) * u + double(j) * v;
        found[t].push_back(faces.above(at + (u + v) / 3., area));
        if (i + j + 1 < n) found[t].push_back(faces.above(at + 2. * (u + v) / 3., area));
      }
  });
  std::vector<double> result(elements.size(), 0.);
  for (const auto& of : found)
    for (const Gap& h : of) result[h.element] += h.volume;
  return result;
}

}  // namespace forest::cortex
