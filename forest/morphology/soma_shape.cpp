// SPDX-License-Identifier: Apache-2.0
#include "forest/morphology/soma_shape.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Eigenvalues>

namespace forest {
namespace {

using Run = std::vector<Point>;

Point point(const Vec3& at, float radius) { return {at.x(), at.y(), at.z(), radius}; }

std::vector<Run> of_cylinders(const Soma& soma) {
  std::vector<int> ends(soma.points.size(), 0);
  for (std::size_t i = 0; i < soma.points.size(); ++i)
    if (soma.parents[i] >= 0) ++ends[i], ++ends[std::size_t(soma.parents[i])];
  std::vector<Run> runs;
  for (std::size_t i = 0; i < soma.points.size(); ++i) {
    if (soma.parents[i] < 0) continue;
    const std::size_t p = std::size_t(soma.parents[i]);
    const Point &a = soma.points[p], &b = soma.points[i];
    const Vec3 way = b.position() - a.position();
    const float length = way.norm();
    if (!(length > 0.f)) continue;
    const auto drawn_in = [&](std::size_t end, float radius) {
      return ends[end] > 1 ? 0.f : std::min(radius, .5f * length) / length;
    };
    runs.push_back({point(a.position() + drawn_in(p, a.radius) * way, a.radius),
                    point(b.position() - drawn_in(i, b.radius) * way, b.radius)});
  }
  return runs;
}

// The direction in which a closed line is longest, and the one across it, both in its plane.
std::array<Vec3, 2> directions(std::span<const Point> loop, const Vec3& middle) {
  Eigen::Matrix3f spread = Eigen::Matrix3f::Zero();
  for (std::size_t i = 0; i < loop.size(); ++i) {
    const Vec3 a = loop[i].position(), b = loop[(i + 1) % loop.size()].position(),
               at = .5f * (a + b) - middle;
    spread += (b - a).norm() * at * at.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3f> solver(spread);
  return {solver.eigenvectors().col(2), solver.eigenvectors().col(1)};
}

Run of_outline(std::span<const Point> loop) {
  if (loop.size() < 3) return {};
  Vec3 middle = Vec3::Zero();
  float length = 0.f;
  for (std::size_t i = 0; i < loop.size(); ++i) {
    const Vec3 a = loop[i].position(), b = loop[(i + 1) % loop.size()].position();
    const float part = (b - a).norm();
    middle += .5f * part * (a + b), length += part;
  }
  if (!(length > 0.f)) return {};
  middle /= length;
  const auto [along, across] = directions(loop, middle);
  float low = INFINITY, high = -INFINITY;
  for (const Point& p : loop) {
    const float t = along.dot(p.position() - middle);
    low = std::min(low, t), high = std::max(high, t);
  }
  constexpr int stations = 9;
  Run run;
  for (int k = 0; k < stations; ++k) {
    // Nearer to one another where the outline turns.
    const float turn = float(pi) * (float(k) + .5f) / float(stations);
    const float t = .5f * (low + high) - .5f * (high - low) * std::cos(turn);
    float least = INFINITY, most = -INFINITY;
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const Vec3 a = loop[i].position() - middle, b = loop[(i + 1) % loop.size()].position() - middle;
      const float ta = along.dot(a), tb = along.dot(b);
      if ((ta < t) == (tb < t)) continue;
      const float s = across.dot(Vec3(a + (t - ta) / (tb - ta) * (b - a)));
      least = std::min(least, s), most = std::max(most, s);
    }
    if (most > least)
      run.push_back(point(middle + t * along + .5f * (least + most) * across, .5f * (most - least)));
  }
  return run.size() > 1 ? run : Run();
}

}  // namespace

std::vector<Point> outline_discs(const Soma& soma) {
  std::vector<Point> discs;
  for (std::size_t i = 0; i < soma.contour_starts.size(); ++i) {
    const std::span<const Point> loop = soma.contour(i);
    if (loop.empty()) continue;
    Vec3 middle = Vec3::Zero();
    for (const Point& p : loop) middle += p.position() / float(loop.size());
    float radius = 0.f;
    for (const Point& p : loop) radius += (p.position() - middle).norm() / float(loop.size());
    discs.push_back(point(middle, radius));
  }
  return discs;
}

std::vector<std::vector<Point>> soma_shape(const Soma& soma) {
  if (soma.kind == SomaKind::cylinders) return of_cylinders(soma);
  if (soma.kind != SomaKind::contours || soma.contour_starts.empty()) return {};
  Run run = soma.contour_starts.size() == 1 ? of_outline(soma.contour(0)) : outline_discs(soma);
  return run.size() > 1 ? std::vector<Run>(1, std::move(run)) : std::vector<Run>();
}

}  // namespace forest
