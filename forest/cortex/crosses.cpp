// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/crosses.h"

#include <algorithm>
#include <cmath>
#include <complex>

#include "forest/core/parallel.h"

namespace forest::cortex {

std::vector<std::optional<Pass>> passes(const Ribbon& ribbon, std::span<const Line> lines) {
  std::vector<std::optional<Pass>> by(ribbon.size());
  for (const Line& line : lines) {  // the strongest first
    const std::size_t n = line.points.size();
    for (std::size_t i = 0; i + 1 < n; ++i) {
      const Place along = line.direction(i);
      if (along.squaredNorm() == 0.) continue;
      for (const std::uint32_t v : ribbon.triangles[line.triangles[i]]) {
        const Place a = line.points[i], way = line.points[i + 1] - a;
        const double share = way.squaredNorm() > 0.
                                 ? std::clamp((ribbon.middle[v] - a).dot(way) / way.squaredNorm(), 0., 1.)
                                 : 0.;
        const Place at = a + share * way;
        if (!by[v] || (by[v]->kind == line.kind &&
                       (by[v]->at - ribbon.middle[v]).norm() > (at - ribbon.middle[v]).norm()))
          by[v] = Pass{at, along, line.kind};
      }
    }
  }
  return by;
}

std::vector<Place> crosses(const Ribbon& ribbon, const Neighbours& near, std::span<const Curvature> curvature,
                           std::span<const Line> lines) {
  using Complex = std::complex<double>;
  // A cross is a complex number: four times its angle in a frame of the vertex. A neighbour's is turned into this frame by
  // the least rotation that takes the one normal to the other.
  const std::size_t n = ribbon.size();
  std::vector<Place> axis(n);
  for (std::size_t v = 0; v < n; ++v) axis[v] = curvature[v].normal.unitOrthogonal();
  const auto angle_of = [&](std::size_t v, const Place& direction) {
    const Place up = curvature[v].normal.cross(axis[v]);
    return std::atan2(direction.dot(up), direction.dot(axis[v]));
  };
  std::vector<Complex> turns(near.list.size());
  parallel_for(n, 2048, [&](std::size_t v) {
    for (std::uint32_t e = near.starts[v]; e < near.starts[v + 1]; ++e) {
      const std::uint32_t w = near.list[e];
      const Place& from = curvature[w].normal;
      const Place& to = curvature[v].normal;
      const Place turned = from.squaredNorm() > 0. && to.squaredNorm() > 0. && from.dot(to) > -.99
                               ? Place(Eigen::Quaterniond::FromTwoVectors(from, to) * axis[w])
                               : axis[w];
      turns[e] = std::polar(1., 4. * angle_of(v, turned));
    }
  });
  // What a vertex wants, and how much.
  double mean = 0.;
  for (const Curvature& c : curvature) mean += std::pow(c.most - c.least, 2) / double(n);
  std::vector<Complex> wanted(n);
  std::vector<double> weight(n);
  const auto by = passes(ribbon, lines);
  for (std::size_t v = 0; v < n; ++v) {
    const Curvature& c = curvature[v];
    weight[v] = .02 * std::min(4., mean > 0. ? std::pow(c.most - c.least, 2) / mean : 0.);
    Place along = c.along_most;
    if (by[v]) along = by[v]->along, weight[v] = 50.;
    wanted[v] = std::polar(1., 4. * angle_of(v, along));
  }
  // (degree + weight) z - sum of turned neighbours = weight · wanted, by conjugate gradients with the diagonal before them.
  const auto apply = [&](const std::vector<Complex>& z, std::vector<Complex>& out) {
    parallel_for(n, 4096, [&](std::size_t v) {
      Complex sum = (weight[v] + double(near.starts[v + 1] - near.starts[v])) * z[v];
      for (std::uint32_t e = near.starts[v]; e < near.starts[v + 1]; ++e) sum -= turns[e] * z[near.list[e]];
      out[v] = sum;
    });
  };
  const auto dot = [&](const std::vector<Complex>& a, const std::vector<Complex>& b) {
    double sum = 0.;
    for (std::size_t v = 0; v < n; ++v) sum += a[v].real() * b[v].real() + a[v].imag() * b[v].imag();
    return sum;
  };
  std::vector<Complex> z = wanted, r(n), p(n), q(n), s(n);
  apply(z, q);
  const auto before = [&](std::size_t v) {
    return weight[v] + double(near.starts[v + 1] - near.starts[v]) + 1e-9;
  };
  for (std::size_t v = 0; v < n; ++v)
    r[v] = weight[v] * wanted[v] - q[v], s[v] = r[v] / before(v), p[v] = s[v];
  double rs = dot(r, s);
  const double enough = rs * 1e-8;
  for (int round = 0; round < 400 && rs > enough && rs > 0.; ++round) {
    apply(p, q);
    const double alpha = rs / dot(p, q);
    for (std::size_t v = 0; v < n; ++v) z[v] += alpha * p[v], r[v] -= alpha * q[v], s[v] = r[v] / before(v);
    const double next = dot(r, s);
    for (std::size_t v = 0; v < n; ++v) p[v] = s[v] + next / rs * p[v];
    rs = next;
  }
  std::vector<Place> result(n);
  for (std::size_t v = 0; v < n; ++v) {
    const double angle = std::arg(z[v]) / 4.;
    result[v] = std::cos(angle) * axis[v] + std::sin(angle) * curvature[v].normal.cross(axis[v]);
  }
  return result;
}

}  // namespace forest::cortex
