// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/grid_quality.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "forest/cortex/named_row.h"

namespace forest::cortex {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

int corner_count(int d) { return 1 << d; }

// The edges at a corner, along ξ, η, ζ. In the plane the third is (0, 0, 1), so that determinants are areas.
Eigen::Matrix3d edges_at(const Corners& x, int c, int d) {
  Eigen::Matrix3d j = Eigen::Matrix3d::Identity();
  for (int a = 0; a < d; ++a) {
    const auto here = std::size_t(c & ~(1 << a)), beside = std::size_t(c | 1 << a);
    j.col(a) = x[beside] - x[here];
    if (d == 2) j(2, a) = 0.;
  }
  return j;
}

// Edges summed over the corners that they join: the Jacobian at the middle.
Eigen::Matrix3d principal_axes(const Corners& x, int d) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (int c = 0; c < corner_count(d); ++c) sum += edges_at(x, c, d);
  return sum / corner_count(d);
}

// The least or largest of f(edges) over the corners.
template <class F>
double least_at_corners(const Corners& x, int d, F&& f) {
  double least = infinity;
  for (int c = 0; c < corner_count(d); ++c) least = std::min(least, f(edges_at(x, c, d)));
  return least;
}

double scaled(const Eigen::Matrix3d& j, int d) {
  double lengths = 1.;
  for (int a = 0; a < d; ++a) lengths *= j.col(a).norm();
  return lengths > 0. ? j.determinant() / lengths : 0.;
}

double cell_volume(const Corners& x, int d) {
  if (d == 2) {
    const Eigen::Vector3d a = x[3] - x[0], b = x[2] - x[1];
    return .5 * (a.x() * b.y() - a.y() * b.x());
  }
  // Exact for trilinear cells: two points of Gauss and Legendre a parameter (det J is of degree 2).
  double sum = 0.;
  const double g = .5 / std::sqrt(3.);
  for (int n = 0; n < 8; ++n) {
    const std::array<double, 3> t{.5 + (n & 1 ? g : -g), .5 + (n & 2 ? g : -g), .5 + (n & 4 ? g : -g)};
    Eigen::Matrix3d j = Eigen::Matrix3d::Zero();
    for (int c = 0; c < 8; ++c)
      for (int a = 0; a < 3; ++a) {
        double weight = c >> a & 1 ? 1. : -1.;
        for (int b = 0; b < 3; ++b)
          if (b != a) weight *= c >> b & 1 ? t[std::size_t(b)] : 1. - t[std::size_t(b)];
        j.col(a) += weight * x[std::size_t(c)];
      }
    sum += j.determinant();
  }
  return sum / 8.;
}

double jacobian(const Corners& x, int d, double) {
  return least_at_corners(x, d, [](const Eigen::Matrix3d& j) { return j.determinant(); });
}

double scaled_jacobian(const Corners& x, int d, double) {
  const double corners = least_at_corners(x, d, [d](const Eigen::Matrix3d& j) { return scaled(j, d); });
  return d == 2 ? corners : std::min(corners, scaled(principal_axes(x, d), d));
}

double shape(const Corners& x, int d, double) {
  return least_at_corners(x, d, [d](const Eigen::Matrix3d& j) {
    const double det = j.determinant();
    return det > 0. ? d * std::pow(det, 2. / d) / j.leftCols(d).squaredNorm() : 0.;
  });
}

// Of Frobenius norms, over d; ‖J⁻¹‖ = ‖cofactors‖ / det.
double condition(const Corners& x, int d, double) {
  return -least_at_corners(x, d, [d](const Eigen::Matrix3d& j) {
    const double det = j.determinant();
    if (!(det > 0.)) return -infinity;
    const double norm = j.leftCols(d).norm();
    if (d == 2) return -.5 * norm * norm / det;
    const double cofactors =
        std::sqrt(j.col(0).cross(j.col(1)).squaredNorm() + j.col(1).cross(j.col(2)).squaredNorm() +
                  j.col(2).cross(j.col(0)).squaredNorm());
    return -norm * cofactors / (3. * det);
  });
}

double skew(const Corners& x, int d, double) {
  Eigen::Matrix3d axes = principal_axes(x, d);
  axes.colwise().normalize();
  double most = 0.;
  for (int a = 0; a < d; ++a)
    for (int b = 0; b < a; ++b) most = std::max(most, std::abs(axes.col(a).dot(axes.col(b))));
  return most;
}

double aspect(const Corners& x, int d, double) {
  const Eigen::Matrix3d axes = principal_axes(x, d);
  double least = infinity, most = 0.;
  for (int a = 0; a < d; ++a) {
    least = std::min(least, axes.col(a).norm());
    most = std::max(most, axes.col(a).norm());
  }
  return least > 0. ? most / least : infinity;
}

double edge_ratio(const Corners& x, int d, double) {
  double least = infinity, most = 0.;
  for (int c = 0; c < corner_count(d); ++c)
    for (int a = 0; a < d; ++a) {
      const double edge = edges_at(x, c, d).col(a).norm();
      least = std::min(least, edge), most = std::max(most, edge);
    }
  return least > 0. ? most / least : infinity;
}

// How the edges of one direction differ: the largest cross derivative over the shorter of its axes.
double taper(const Corners& x, int d, double) {
  const Eigen::Matrix3d axes = principal_axes(x, d);
  double most = 0.;
  for (int a = 0; a < d; ++a)
    for (int b = 0; b < a; ++b) {
      Eigen::Vector3d cross = Eigen::Vector3d::Zero();
      for (int c = 0; c < corner_count(d); ++c)
        cross += ((c >> a & 1) == (c >> b & 1) ? 1. : -1.) * x[std::size_t(c)];
      if (d == 2) cross.z() = 0.;
      cross *= 2. / corner_count(d);
      most = std::max(most, cross.norm() / std::min(axes.col(a).norm(), axes.col(b).norm()));
    }
  return most;
}

double diagonal_ratio(const Corners& x, int d, double) {
  double least = infinity, most = 0.;
  for (int c = 0; c < corner_count(d) / 2; ++c) {
    Eigen::Vector3d diagonal = x[std::size_t(corner_count(d) - 1 - c)] - x[std::size_t(c)];
    if (d == 2) diagonal.z() = 0.;
    least = std::min(least, diagonal.norm()), most = std::max(most, diagonal.norm());
  }
  return most > 0. ? least / most : 0.;
}

double stretch(const Corners& x, int d, double) {
  double edge = infinity, diagonal = 0.;
  for (int c = 0; c < corner_count(d); ++c) {
    for (int a = 0; a < d; ++a) edge = std::min(edge, edges_at(x, c, d).col(a).norm());
    Eigen::Vector3d across = x[std::size_t(corner_count(d) - 1 - c)] - x[std::size_t(c)];
    if (d == 2) across.z() = 0.;
    diagonal = std::max(diagonal, across.norm());
  }
  return diagonal > 0. ? std::sqrt(double(d)) * edge / diagonal : 0.;
}

double orthogonality(const Corners& x, int d, double) {
  double most = 0.;
  for (int c = 0; c < corner_count(d); ++c) {
    Eigen::Matrix3d j = edges_at(x, c, d);
    j.colwise().normalize();
    for (int a = 0; a < d; ++a)
      for (int b = 0; b < a; ++b)
        most = std::max(most, std::asin(std::min(1., std::abs(j.col(a).dot(j.col(b))))));
  }
  return most * 180. / std::numbers::pi;
}

double volume_ratio(const Corners& x, int d, double mean) { return cell_volume(x, d) / mean; }

}  // namespace

std::span<const CellMeasure> cell_measures() {
  static constexpr auto table = std::to_array<CellMeasure>({
      {"jacobian", "least determinant of the edges at a corner", "µm³", 1., true, jacobian},
      {"scaled-jacobian", "the same over the lengths of the edges; in space also at the middle", "", 1., true,
       scaled_jacobian},
      {"shape", "d det^(2/d) / ‖J‖² at the worst corner (Knupp)", "", 1., true, shape},
      {"condition", "‖J‖ ‖J⁻¹‖ / d at the worst corner, Frobenius norms", "", 1., false, condition},
      {"skew", "cosine between the lines that join the middles of opposite faces, the largest", "", 0., false,
       skew},
      {"aspect", "longest of these lines over the shortest", "", 1., false, aspect},
      {"edge-ratio", "longest edge over the shortest", "", 1., false, edge_ratio},
      {"taper", "how much opposite edges differ, over the shorter line between middles", "", 0., false,
       taper},
      {"diagonal", "shortest diagonal over the longest", "", 1., true, diagonal_ratio},
      {"stretch", "√d shortest edge over the longest diagonal", "", 1., true, stretch},
      {"orthogonality", "how far the worst angle between edges at a corner is from a right one", "°", 0.,
       false, orthogonality},
      {"volume-ratio", "volume (area) over the mean of the grid's cells", "", 1., true, volume_ratio},
  });
  return table;
}

const CellMeasure& cell_measure(std::string_view name) {
  return named_row(cell_measures(), name, "measure of cells");
}

double volume(const Grid& grid) {
  double sum = 0.;
  for (std::size_t n = 0; n < grid.cells(); ++n) sum += cell_volume(grid.corners(n), grid.dimensions());
  return sum;
}

std::vector<double> measure(const Grid& grid, const CellMeasure& measure) {
  const double mean = volume(grid) / double(grid.cells());
  std::vector<double> values(grid.cells());
  for (std::size_t n = 0; n < values.size(); ++n)
    values[n] = measure.of(grid.corners(n), grid.dimensions(), mean);
  return values;
}

std::vector<QualityRow> quality(const Grid& grid) {
  std::vector<QualityRow> rows;
  for (const CellMeasure& row : cell_measures()) {
    std::vector<double> values = measure(grid, row);
    double sum = 0.;
    for (const double v : values) sum += v;
    std::ranges::sort(values);
    const std::size_t n = values.size(), hundredth = n / 100;
    rows.push_back({&row, values.front(), values[hundredth], values[n / 2], sum / double(n),
                    values[n - 1 - hundredth], values.back()});
  }
  return rows;
}

}  // namespace forest::cortex
