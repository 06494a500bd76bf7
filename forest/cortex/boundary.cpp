// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/boundary.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "forest/core/parallel.h"

namespace forest::cortex {
namespace {

constexpr double apart = 400.;  // µm between places whose normals are looked at, or less
constexpr int rings = 2;        // of places of a disc whose normals are its
constexpr int most_sides = 32;  // of a triangle; larger ones are looked at more coarsely

std::uint32_t places(int sides) { return std::uint32_t((sides + 1) * (sides + 2) / 2); }
// The i-th of the j-th row.
std::uint32_t place(int sides, int i, int j) { return std::uint32_t(j * (sides + 1) - j * (j - 1) / 2 + i); }
int sides_of(std::uint32_t places) { return int(std::lround((std::sqrt(8. * places + 1.) - 3.) / 2.)); }

}  // namespace

double degrees_between(const Place& a, const Place& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) * 180. / std::numbers::pi;
}

Place normal_around(const TriangleTree& surface, const TriangleTree::Hit& hit, const Place& outwards) {
  Place sum = surface.normal(hit.triangle);
  const Place u = outwards.unitOrthogonal(), v = outwards.normalized().cross(u);
  for (int ring = 1; ring <= rings; ++ring)
    for (int k = 0; k < 6 * ring; ++k) {
      const double angle = k * std::numbers::pi / (3. * ring), radius = normal_radius * ring / rings;
      const auto near =
          surface.nearest(hit.at + radius * (std::cos(angle) * u + std::sin(angle) * v), normal_radius);
      if (near && surface.normal(near->triangle).dot(outwards) > 0.) sum += surface.normal(near->triangle);
    }
  return sum;
}

Boundary::Boundary(const Mesh& mesh, Progress& progress) : tree_(mesh) {
  const std::vector<Vec3> facing = vertex_normals(mesh);
  const std::size_t n = mesh.triangles.size();
  first_.assign(n + 1, 0);
  for (std::size_t t = 0; t < n; ++t) {
    const auto [a, b, c] = tree_.corners(std::uint32_t(t));
    const double longest = std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
    first_[t + 1] = first_[t] + places(int(std::clamp(std::ceil(longest / apart), 1., double(most_sides))));
  }
  normals_.resize(first_.back());
  const auto seen = [&](std::uint32_t triangle, const Place& at, const Place& outwards) -> Eigen::Vector3f {
    if (outwards.norm() == 0.) return Eigen::Vector3f::Zero();
    return normal_around(tree_, {triangle, at, 0.}, outwards).normalized().cast<float>();
  };
  // Corners are looked at once, not by each of their triangles.
  std::vector<std::uint32_t> one_of(mesh.positions.size());
  for (std::size_t t = 0; t < n; ++t)
    for (const std::uint32_t corner : mesh.triangles[t]) one_of[corner] = std::uint32_t(t);
  std::vector<Eigen::Vector3f> at_corners(mesh.positions.size());
  progress.begin("looking which way surfaces face", mesh.positions.size() + n);
  parallel_ranges(at_corners.size(), 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v)
      at_corners[v] = seen(one_of[v], mesh.positions[v].cast<double>(), facing[v].cast<double>());
    progress.advance(end - begin);
  });
  parallel_ranges(n, 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      const Triangle& of = mesh.triangles[t];
      const int sides = sides_of(first_[t + 1] - first_[t]);
      const auto corners = tree_.corners(std::uint32_t(t));
      for (int j = 0; j <= sides; ++j)
        for (int i = 0; i + j <= sides; ++i) {
          Eigen::Vector3f& normal = normals_[first_[t] + place(sides, i, j)];
          const double b = double(i) / sides, c = double(j) / sides, a = 1. - b - c;
          if (i + j == 0 || i == sides || j == sides)
            normal = at_corners[of[i == sides ? 1 : j == sides ? 2 : 0]];
          else
            normal = seen(std::uint32_t(t), a * corners[0] + b * corners[1] + c * corners[2],
                          a * facing[of[0]].cast<double>() + b * facing[of[1]].cast<double>() +
                              c * facing[of[2]].cast<double>());
        }
    }
    progress.advance(end - begin);
  });
  progress.end();
}

Place Boundary::normal(const TriangleTree::Hit& hit) const {
  const auto [p, q, r] = tree_.corners(hit.triangle);
  const Place across = (q - p).cross(r - p);
  const double area = across.squaredNorm();
  if (area == 0.) return Place::Zero();
  const int sides = sides_of(first_[hit.triangle + 1] - first_[hit.triangle]);
  const auto share = [&](const Place& of) { return std::clamp(of.dot(across) / area, 0., 1.); };
  double b = share((hit.at - p).cross(r - p)) * sides, c = share((q - p).cross(hit.at - p)) * sides;
  if (b + c > sides) b -= b + c - sides;
  const int j = std::clamp(int(c), 0, sides - 1), i = std::clamp(int(b), 0, sides - 1 - j);
  b -= i, c -= j;
  const auto known = [&](int more, int up) -> Place {
    return normals_[first_[hit.triangle] + place(sides, i + more, j + up)].cast<double>();
  };
  // Of the two small triangles of a cell the one with the corner, or the one across.
  const Place sum = b + c <= 1. || i + j + 2 > sides
                        ? Place((1. - b - c) * known(0, 0) + b * known(1, 0) + c * known(0, 1))
                        : Place((1. - c) * known(1, 0) + (1. - b) * known(0, 1) + (b + c - 1.) * known(1, 1));
  return sum.squaredNorm() > 0. ? Place(sum.normalized()) : sum;
}

}  // namespace forest::cortex
