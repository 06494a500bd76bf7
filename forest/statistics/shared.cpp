// SPDX-License-Identifier: Apache-2.0
#include "forest/statistics/shared.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include <Eigen/Eigenvalues>

#include "forest/statistics/metric_table.h"
#include "forest/statistics/sholl.h"

namespace forest::statistics {

Barcodes radial_barcodes(const Arbors& arbors) { return {arbors, Filtration::radial}; }
Barcodes path_barcodes(const Arbors& arbors) { return {arbors, Filtration::path}; }

// The hull of all is that of the arbors' corners; its outline is that of its own corners.
Hulls hulls(const Arbors& arbors) {
  const Columns& c = arbors.columns();
  std::vector<std::vector<Vector>> points(arbors.stems().size());
  for (const Branch& b : arbors.sections())  // a daughter's first point is its parent's last
    for (std::size_t row = b.first_row + (b.parent >= 0); row <= b.last_row(); ++row)
      points[b.arbor].push_back(place(c, row));

  Hulls all;
  std::vector<Vector> corners;
  for (const auto& some : points) {
    const Hull hull = convex_hull(some);
    all.arbor_volumes.push_back(hull.volume);
    for (const std::uint32_t corner : hull.vertices) corners.push_back(some[corner]);
  }
  const Hull hull = convex_hull(corners);
  all.volume = hull.volume;
  std::vector<Eigen::Vector2d> outline;
  for (const std::uint32_t corner : hull.vertices) outline.emplace_back(corners[corner].head<2>());
  all.front = planar_hull(std::move(outline));
  return all;
}

std::vector<std::array<double, 3>> principal_extents(const Arbors& arbors) {
  const Columns& c = arbors.columns();
  struct Moments {
    double count = 0.;
    Vector origin = Vector::Zero(), sum = Vector::Zero();
    Eigen::Matrix3d squares = Eigen::Matrix3d::Zero(), axes = Eigen::Matrix3d::Zero();
    Vector low = Vector::Constant(1e300), high = Vector::Constant(-1e300);
  };
  std::vector<Moments> moments(arbors.stems().size());
  for (std::size_t i = 0; i < moments.size(); ++i)
    moments[i].origin = place(c, arbors.section(arbors.stems()[i]).first_row);
  for (const Branch& b : arbors.sections()) {
    Moments& m = moments[b.arbor];
    double x = 0., y = 0., z = 0., xx = 0., xy = 0., xz = 0., yy = 0., yz = 0., zz = 0.;
    const std::size_t first = b.first_row + (b.parent >= 0);
    for (std::size_t row = first; row <= b.last_row(); ++row) {
      const double px = c.x[row] - m.origin.x(), py = c.y[row] - m.origin.y(), pz = c.z[row] - m.origin.z();
      x += px, y += py, z += pz;
      xx += px * px, xy += px * py, xz += px * pz, yy += py * py, yz += py * pz, zz += pz * pz;
    }
    m.count += double(b.last_row() + 1 - first);
    m.sum += Vector(x, y, z);
    m.squares += Eigen::Matrix3d{{xx, xy, xz}, {xy, yy, yz}, {xz, yz, zz}};
  }
  for (Moments& m : moments) {
    const Eigen::Matrix3d covariance = m.squares / m.count - m.sum * m.sum.transpose() / (m.count * m.count);
    m.axes = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(covariance).eigenvectors().transpose();
  }
  for (const Branch& b : arbors.sections()) {
    Moments& m = moments[b.arbor];
    for (std::size_t row = b.first_row; row <= b.last_row(); ++row) {
      const Vector along = m.axes * (place(c, row) - m.origin);
      m.low = m.low.cwiseMin(along), m.high = m.high.cwiseMax(along);
    }
  }
  std::vector<std::array<double, 3>> extents;
  for (const Moments& m : moments) {
    const Vector extent = m.high - m.low;
    extents.push_back({extent.x(), extent.y(), extent.z()});
    std::ranges::sort(extents.back(), std::greater());
  }
  return extents;
}

// large^n + small^n - parent^n, divided by parent^n, is convex in n and falls from 1 at n = 0 where both daughters are
// thinner: Newton's steps from there never go past the root.
std::vector<double> rall_powers(const Arbors& arbors) {
  std::vector<double> powers;
  powers.reserve(arbors.bifurcations().size());
  for (const Bifurcation& b : arbors.bifurcations()) {
    const double parent = last_diameter(arbors, arbors.section(b.parent));
    const double p = std::log(ratio(first_diameter(arbors, arbors.section(b.left)), parent)),
                 q = std::log(ratio(first_diameter(arbors, arbors.section(b.right)), parent));
    if (!(p < 0. && q < 0. && std::isfinite(p) && std::isfinite(q) &&
          std::exp(5. * p) + std::exp(5. * q) <= 1.)) {
      powers.push_back(nan);
      continue;
    }
    double n = 0.;
    for (int i = 0; i < 100; ++i) {
      const double u = std::exp(n * p), v = std::exp(n * q);
      const double step = (1. - u - v) / (p * u + q * v);
      n += step;
      if (std::abs(step) <= 1e-15 * n) break;
    }
    powers.push_back(n);
  }
  return powers;
}

Streams streams(const Arbors& arbors) {
  Streams all;
  std::vector<double> lengths, weighted;  // weighted: diameters by length
  const Columns& c = arbors.columns();
  for (const Branch& b : arbors.sections()) {
    const auto order = std::size_t(b.strahler);
    if (all.count.size() < order)
      for (auto* column : {&all.count, &lengths, &weighted}) column->resize(order, 0.);
    all.count[order - 1] += b.parent < 0 || arbors.section(std::size_t(b.parent)).strahler != b.strahler;
    lengths[order - 1] += b.length;
    for (std::size_t row = b.first_row + 1; row <= b.last_row(); ++row)
      weighted[order - 1] += (c.radius[row - 1] + c.radius[row]) * c.length[row];
  }
  for (std::size_t i = 0; i < all.count.size(); ++i) {
    all.mean_length.push_back(lengths[i] / all.count[i]);
    all.mean_diameter.push_back(ratio(weighted[i], lengths[i]));
  }
  return all;
}

}  // namespace forest::statistics
