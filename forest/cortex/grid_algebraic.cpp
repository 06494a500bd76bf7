// SPDX-License-Identifier: Apache-2.0
// Transfinite interpolation: W. Gordon & C. Hall (1973), "Construction of curvilinear co-ordinate systems and applications to mesh
// generation", Int J Numer Meth Eng 7:461. Both generators are the Boolean sum P₁ ⊕ P₂ ⊕ P₃ of projectors, P_a the
// interpolation along parameter a between both faces: linear, or cubic Hermite with given slopes across the faces. It is
// built up as F ← F + P_a[x − F], where P_a needs x − F on the faces of a alone.
//
// Slopes across a face are those of the transfinite grid: at its edges they are the neighbouring faces', which must be kept;
// within the face their part along it is taken away, as far as `orthogonality` says.
#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Geometry>

#include "forest/cortex/grid_generators.h"

namespace forest::cortex {
namespace {

using Places = std::vector<Eigen::Vector3d>;
using Index = std::array<int, 3>;

std::size_t at(const Grid& grid, const Index& index) { return grid.index(index[0], index[1], index[2]); }

template <class Act>
void for_points(const Grid& grid, Act&& act) {
  for (int k = 0; k < grid.size[2]; ++k)
    for (int j = 0; j < grid.size[1]; ++j)
      for (int i = 0; i < grid.size[0]; ++i) act(Index{i, j, k});
}

Index with(Index index, int axis, int value) {
  index[std::size_t(axis)] = value;
  return index;
}
int last(const Grid& grid, int axis) { return grid.size[std::size_t(axis)] - 1; }
double share(const Grid& grid, const Index& index, int axis) {
  return double(index[std::size_t(axis)]) / double(last(grid, axis));
}

// ∂x/∂a at an end of a row of points, one-sided, of the highest order that the row allows, up to the fourth.
Eigen::Vector3d slope_at_end(const Grid& grid, const Places& x, const Index& index, int axis, bool far) {
  static constexpr double weights[4][5] = {{-1., 1., 0., 0., 0.},
                                           {-1.5, 2., -.5, 0., 0.},
                                           {-11. / 6., 3., -1.5, 1. / 3., 0.},
                                           {-25. / 12., 4., -3., 4. / 3., -.25}};
  const int n = last(grid, axis), order = std::min(n, 4);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int m = 0; m <= order; ++m)
    sum += weights[order - 1][m] * x[at(grid, with(index, axis, far ? n - m : m))];
  return (far ? -double(n) : double(n)) * sum;
}
// ∂x/∂a anywhere: central within.
Eigen::Vector3d slope(const Grid& grid, const Places& x, const Index& index, int axis) {
  const int i = index[std::size_t(axis)], n = last(grid, axis);
  if (i == 0 || i == n) return slope_at_end(grid, x, index, axis, i == n);
  return .5 * n * (x[at(grid, with(index, axis, i + 1))] - x[at(grid, with(index, axis, i - 1))]);
}

struct Hermite {
  double near, far, near_slope, far_slope;
  explicit Hermite(double t)
      : near((1. + 2. * t) * (1. - t) * (1. - t)),
        far(t * t * (3. - 2. * t)),
        near_slope(t * (1. - t) * (1. - t)),
        far_slope(-t * t * (1. - t)) {}
};

// What interpolates `x`, given on the boundary, between the faces of every axis in turn.
template <class Project>
Grid boolean_sum(Grid grid, Project&& project) {
  Places sum(grid.points.size(), Eigen::Vector3d::Zero()), rest = sum;
  for (int axis = 0; axis < grid.dimensions(); ++axis) {
    for_points(grid, [&](const Index& index) {
      if (grid.on_boundary(index[0], index[1], index[2])) {
        const std::size_t n = at(grid, index);
        rest[n] = grid.points[n] - sum[n];
      }
    });
    const Places before = sum;
    for_points(grid, [&](const Index& index) { sum[at(grid, index)] += project(index, axis, rest, before); });
  }
  for_points(grid, [&](const Index& index) {
    if (!grid.on_boundary(index[0], index[1], index[2])) grid.points[at(grid, index)] = sum[at(grid, index)];
  });
  return grid;
}

// The normal of a face of an axis, along the axis.
Eigen::Vector3d normal(const Grid& grid, const Index& index, int axis) {
  const auto along = [&](int a) { return slope(grid, grid.points, index, a); };
  if (grid.plane()) {
    const Eigen::Vector3d t = along(1 - axis);
    return axis == 0 ? Eigen::Vector3d(t.y(), -t.x(), 0.) : Eigen::Vector3d(-t.y(), t.x(), 0.);
  }
  return along((axis + 1) % 3).cross(along((axis + 2) % 3));
}

// The slopes across the two faces of an axis, those of the transfinite grid turned towards the normal; only entries on
// those faces are set.
Places slopes_across(const Grid& grid, int axis, double orthogonality) {
  Places result(grid.points.size(), Eigen::Vector3d::Zero());
  for_points(grid, [&](const Index& index) {
    const int i = index[std::size_t(axis)];
    if (i != 0 && i != last(grid, axis)) return;
    double turn = orthogonality;  // 0 at edges, near 1 inside
    for (int a = 0; a < grid.dimensions(); ++a)
      if (a != axis) turn *= 1. - std::pow(2. * share(grid, index, a) - 1., 4.);
    const Eigen::Vector3d s = slope_at_end(grid, grid.points, index, axis, i != 0);
    const Eigen::Vector3d n = normal(grid, index, axis);
    const double length = n.norm();
    if (length > 0.) {
      const double inwards = std::max(s.dot(n) / length, .2 * s.norm());
      result[at(grid, index)] = s + turn * (n * (inwards / length) - s);
    } else {
      result[at(grid, index)] = s;
    }
  });
  return result;
}

}  // namespace

Grid transfinite(Grid grid, const GridOptions&) {
  const Grid shape{grid.size, {}};
  return boolean_sum(std::move(grid), [&](const Index& index, int axis, const Places& x, const Places&) {
    const double t = share(shape, index, axis);
    return Eigen::Vector3d((1. - t) * x[at(shape, with(index, axis, 0))] +
                           t * x[at(shape, with(index, axis, last(shape, axis)))]);
  });
}

Grid tricubic(Grid grid, const GridOptions& options) {
  const Grid shape = transfinite(grid, options);
  std::array<Places, 3> slopes;
  for (int axis = 0; axis < grid.dimensions(); ++axis)
    slopes[std::size_t(axis)] = slopes_across(shape, axis, options.orthogonality);
  return boolean_sum(std::move(grid), [&](const Index& index, int axis, const Places& x, const Places& sum) {
    const Hermite h(share(shape, index, axis));
    const Index near = with(index, axis, 0), far = with(index, axis, last(shape, axis));
    const Places& d = slopes[std::size_t(axis)];
    return Eigen::Vector3d(h.near * x[at(shape, near)] + h.far * x[at(shape, far)] +
                           h.near_slope * (d[at(shape, near)] - slope_at_end(shape, sum, near, axis, false)) +
                           h.far_slope * (d[at(shape, far)] - slope_at_end(shape, sum, far, axis, true)));
  });
}

}  // namespace forest::cortex
