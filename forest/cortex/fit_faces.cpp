// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/fit_faces.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numeric>

#include <Eigen/Cholesky>

#include "forest/core/parallel.h"
#include "forest/cortex/face_places.h"
#include "forest/cortex/gaps.h"
#include "forest/cortex/go.h"

namespace forest::cortex {
namespace {

// How far each of a face's sixteen places goes, of the ways from its 5×5 places to the surface.
using Shares = Eigen::Matrix<double, 16, face_places>;

Shares shares(Fit fit) {
  Shares result = Shares::Zero();
  if (fit == Fit::mean) {
    result.setConstant(1. / face_places);
    for (const int corner : {0, 3, 12, 15}) result.row(corner).setZero();
    return result;
  }
  // The least squares of what is left, with as little way as possible.
  const FaceWeights& weights = face_weights();
  constexpr double ease = .1;
  return (weights.transpose() * weights + ease * Eigen::Matrix<double, 16, 16>::Identity())
      .ldlt()
      .solve(weights.transpose());
}

// How far each of a face's sixteen places goes.
using Moves = Eigen::Matrix<double, 16, 3>;

// From the 5×5 places of a face to the surface, along its normals.
Eigen::Matrix<double, face_places, 3> ways(const Elements& elements, std::size_t element, std::size_t depth,
                                           const TriangleTree& surface) {
  Eigen::Matrix<double, face_places, 3> result;
  const auto pins = pins_of(elements, element, depth, surface);
  for (std::size_t k = 0; k < pins.size(); ++k)
    result.row(Eigen::Index(k)) = (pins[k].off * pins[k].normal).transpose();
  return result;
}

double area_of_face(const Elements& elements, std::size_t element, std::size_t depth) {
  const auto& own = elements.elements[element];
  const auto at = [&](int i, int j) -> const Place& { return elements.curves[own[slot(i, j)]][depth]; };
  double area = 0.;
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i < 3; ++i)
      area += .5 * (at(i + 1, j + 1) - at(i, j)).cross(at(i, j + 1) - at(i + 1, j)).norm();
  return area;
}

// Where a curve leaves the elements.
Place outwards(const Depths& curve, std::size_t depth) {
  return (curve[depth] - curve[depth == 0 ? 1 : 2]).normalized();
}

// What is missing between a face and the surface, as a height over all of it.
Moves raised(const Elements& elements, std::size_t element, std::size_t depth, double gap) {
  constexpr double most = 300.;  // µm
  const double area = area_of_face(elements, element, depth);
  const double height = area > 0. ? std::clamp(gap / area, -most, most) : 0.;
  Moves result;
  for (std::size_t c = 0; c < 16; ++c)
    result.row(Eigen::Index(c)) =
        height * outwards(elements.curves[elements.elements[element][c]], depth).transpose();
  return result;
}

constexpr double good = .5;  // scaled Jacobian

}  // namespace

void fit_faces(Elements& elements, const SurfaceTrees& surfaces, Fit fit) {
  const int rounds = fit == Fit::places ? 3 : 2;
  const Shares by_place = shares(fit);
  const std::vector<double> keep = to_keep(elements, good);
  const std::vector<Depths> before = elements.curves;
  std::vector<Moves> moves(elements.size());
  for (const std::size_t depth : {0u, 3u})
    for (int round = 0; round < rounds; ++round) {
      std::vector<double> gap;
      if (fit == Fit::volume) gap = gaps(elements, depth, surfaces.at(depth));
      parallel_for(elements.size(), 64, [&](std::size_t e) {
        moves[e] = fit == Fit::volume ? raised(elements, e, depth, gap[e])
                                      : Moves(by_place * ways(elements, e, depth, surfaces.at(depth)));
      });
      std::vector<Place> sum(elements.curves.size(), Place::Zero());
      std::vector<std::uint8_t> times(elements.curves.size(), 0);
      for (std::size_t e = 0; e < elements.size(); ++e)
        for (std::size_t c = 0; c < 16; ++c) {
          const std::uint32_t curve = elements.elements[e][c];
          sum[curve] += moves[e].row(Eigen::Index(c)).transpose(), ++times[curve];
        }
      for (std::size_t c = 0; c < sum.size(); ++c)
        if (times[c]) elements.curves[c][depth] += sum[c] / double(times[c]);
    }

  std::vector<Depths> fitted = before;
  fitted.swap(elements.curves);
  go(elements, fitted, keep);
}

void keep_volume(Elements& elements, double volume) {
  constexpr double most = 25.;    // µm
  constexpr double close = 1e-5;  // of the volume: what may be missing still
  const std::vector<double> keep = to_keep(elements, good);
  const std::size_t n = elements.size();
  std::vector<double> volumes(n), areas(n);
  double gone = 0.;
  constexpr int rounds = 4;  // what some elements cannot take others do
  for (int round = 0; round < rounds; ++round) {
    parallel_for(n, 64, [&](std::size_t e) {
      volumes[e] = elements.hexahedron(e).volume();
      areas[e] = area_of_face(elements, e, 0) + area_of_face(elements, e, 3);
    });
    const double missing = std::accumulate(volumes.begin(), volumes.end(), volume, std::minus()),
                 area = std::accumulate(areas.begin(), areas.end(), 0.);
    if (!(area > 0.) || std::abs(missing) <= close * volume) return;
    const double height = std::clamp(missing / area, -most - gone, most - gone);
    gone += height;
    std::vector<Depths> aim = elements.curves;
    for (Depths& curve : aim)
      for (const std::size_t depth : {0, 3}) curve[depth] += height * outwards(curve, depth);
    go(elements, aim, keep);
  }
}

}  // namespace forest::cortex
