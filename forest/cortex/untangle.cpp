// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/untangle.h"

#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "forest/cortex/grid.h"
#include "forest/cortex/minimise.h"

namespace forest::cortex {
namespace {

constexpr int steps = 6;

constexpr std::array<std::size_t, 8> inner{Hexahedron::index(1, 1, 1), Hexahedron::index(2, 1, 1),
                                           Hexahedron::index(1, 2, 1), Hexahedron::index(2, 2, 1),
                                           Hexahedron::index(1, 1, 2), Hexahedron::index(2, 1, 2),
                                           Hexahedron::index(1, 2, 2), Hexahedron::index(2, 2, 2)};

using Gradients = Eigen::Matrix<double, 3, 8>;  // of the weights of the inner control points, a column each

// At all places at which Jacobians are looked at.
const std::vector<Gradients>& gradients() {
  static const std::vector<Gradients> table = [] {
    std::vector<Gradients> result;
    const auto weight = [](int i, double t) {
      return i == 1 ? 3. * t * (1. - t) * (1. - t) : 3. * t * t * (1. - t);
    };
    const auto slope = [](int i, double t) {
      return i == 1 ? 3. * (1. - t) * (1. - 3. * t) : 3. * t * (2. - 3. * t);
    };
    for (int k = 0; k <= steps; ++k)
      for (int j = 0; j <= steps; ++j)
        for (int i = 0; i <= steps; ++i) {
          const double u = double(i) / steps, v = double(j) / steps, w = double(k) / steps;
          Gradients g;
          for (int c = 0; c < 8; ++c) {
            const int a = 1 + (c & 1), b = 1 + (c >> 1 & 1), d = 1 + (c >> 2);
            g.col(c) << slope(a, u) * weight(b, v) * weight(d, w), weight(a, u) * slope(b, v) * weight(d, w),
                weight(a, u) * weight(b, v) * slope(d, w);
          }
          result.push_back(g);
        }
    return result;
  }();
  return table;
}

Hexahedron evened(const Hexahedron& start) {
  // Jacobians without the inner control points; then relative to the mean lengths along u, v, w and the mean volume.
  Hexahedron shell = start;
  for (const std::size_t n : inner) shell.points[n].setZero();
  std::vector<Eigen::Matrix3d> fixed;
  Eigen::Vector3d lengths = Eigen::Vector3d::Zero();
  for (int k = 0; k <= steps; ++k)
    for (int j = 0; j <= steps; ++j)
      for (int i = 0; i <= steps; ++i) {
        const double u = double(i) / steps, v = double(j) / steps, w = double(k) / steps;
        fixed.push_back(shell.jacobian(u, v, w));
        lengths += start.jacobian(u, v, w).colwise().norm().transpose();
      }
  lengths *= std::cbrt(std::abs(start.volume()) / lengths.prod());
  const Eigen::Vector3d inverse = lengths.cwiseInverse();
  if (!inverse.allFinite() || !(lengths.minCoeff() > 0.)) return start;

  const double unit = lengths.mean();
  Vector x(24);
  for (int c = 0; c < 8; ++c) x.segment<3>(3 * c) = start.points[inner[std::size_t(c)]] / unit;
  const auto sum = [&](const Vector& at, Vector& gradient, const Unfolding& phi, double* least) {
    gradient.setZero(24);
    double total = 0.;
    const Eigen::Map<const Eigen::Matrix<double, 3, 8>> places(at.data());
    Eigen::Map<Eigen::Matrix<double, 3, 8>> slopes(gradient.data());
    for (std::size_t n = 0; n < fixed.size(); ++n) {
      const Gradients& g = gradients()[n];
      const Matrix<3> j = (fixed[n] + unit * places * g.transpose()) * inverse.asDiagonal();
      if (least) *least = std::min(*least, j.determinant());
      const Density<3> density = phi(j);
      total += density.value;
      slopes += unit * density.slope * inverse.asDiagonal() * g;
    }
    return total;
  };
  unfold(x, 40, 200, 1e-6, sum);
  Hexahedron result = start;
  for (int c = 0; c < 8; ++c) result.points[inner[std::size_t(c)]] = unit * x.segment<3>(3 * c);
  return result;
}

}  // namespace

Hexahedron blended_inside(Hexahedron faces) {
  // Linear interpolation of Bézier faces is linear in control points at thirds: a grid of 4×4×4 points.
  Grid grid{{4, 4, 4}, {faces.points.begin(), faces.points.end()}};
  grid = generate(grid, "transfinite");
  for (const std::size_t n : inner) faces.points[n] = grid.points[n];
  return faces;
}

Untangled untangle(const Hexahedron& hexahedron) {
  Untangled result{hexahedron, certify(hexahedron)};
  if (result.certificate.positive()) return result;
  for (const auto& p : hexahedron.points)
    if (!p.allFinite()) return result;
  // On edges det J depends on the faces alone.
  const Eigen::Vector3d& where = result.certificate.where;
  const auto ends = (where.array() == 0. || where.array() == 1.).count();
  if (result.certificate.verdict == Certificate::Verdict::not_positive && ends >= 2) return result;
  const Hexahedron blended = blended_inside(hexahedron);
  for (const bool even : {false, true}) {
    const Hexahedron next = even ? evened(blended) : blended;
    if (const Certificate certificate = certify(next); certificate.positive()) return {next, certificate};
  }
  return result;
}

}  // namespace forest::cortex
