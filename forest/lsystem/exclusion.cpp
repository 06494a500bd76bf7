// SPDX-License-Identifier: Apache-2.0
#include "forest/lsystem/exclusion.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace forest::lsystem {
namespace {

using Eigen::Vector3d;
using Ball = Obstacles::Ball;

constexpr double slack = 1e-6;  // µm that rounding may take

// As wide as it may be when one stands at `from`.
double bound(const Ball& ball, const Vector3d& from) {
  return std::min(ball.radius, (ball.centre - from).norm());
}

// How deep the segment comes into the ball.
double depth(const Ball& ball, const Vector3d& from, const Vector3d& step) {
  const Vector3d way = ball.centre - from;
  const double along = std::clamp(way.dot(step) / step.squaredNorm(), 0., 1.);
  return bound(ball, from) - (way - along * step).norm();
}

// The part of v across the unit vector, as a unit vector; `otherwise` (made so) when there is none.
Vector3d across(const Vector3d& v, const Vector3d& unit, const Vector3d& otherwise) {
  for (const Vector3d& candidate : {v, otherwise}) {
    const Vector3d part = candidate - candidate.dot(unit) * unit;
    if (part.norm() > 1e-9 * candidate.norm() && part.norm() > 0.) return part.normalized();
  }
  return unit.unitOrthogonal();
}

// The direction nearest to this one in which a step of this length stays out of the ball: it touches it with its end, or,
// when it is long enough to pass, with its side.
Vector3d around(const Ball& ball, const Vector3d& from, const Vector3d& direction, double length,
                const Vector3d& side) {
  const Vector3d way = ball.centre - from;
  const double distance = way.norm();
  if (distance == 0.) return direction;
  const double radius = bound(ball, from) + slack / 2.;
  const double touch = std::max(0., distance * distance - radius * radius);
  const double cosine = length * length < touch ? (distance * distance + length * length - radius * radius) /
                                                      (2. * distance * length)
                                                : std::sqrt(touch) / distance;
  const Vector3d to = way / distance;
  return cosine * to + std::sqrt(std::max(0., 1. - cosine * cosine)) * across(direction, to, side);
}

Vector3d below(double ceiling, const Vector3d& from, const Vector3d& direction, double length,
               const Vector3d& side) {
  const double rise = std::clamp((std::max(ceiling, from.y()) - from.y()) / length, -1., 1.);
  return rise * Vector3d::UnitY() + std::sqrt(1. - rise * rise) * across(direction, Vector3d::UnitY(), side);
}

}  // namespace

Vector3d clear_step(const Vector3d& from, const Vector3d& step, const Vector3d& side,
                    const Obstacles& obstacles) {
  const double whole = step.norm();
  if (!(whole > 0.)) return step;
  const Vector3d heading = step / whole;
  const double ceiling = std::max(obstacles.ceiling, from.y());
  const auto too_high = [&](const Vector3d& s) { return from.y() + s.y() > ceiling + slack; };
  const auto deepest = [&](const Vector3d& s) {
    const Ball* worst = nullptr;
    double most = slack;
    for (const Ball& ball : obstacles.balls)
      if (const double d = depth(ball, from, s); d > most) most = d, worst = &ball;
    return worst;
  };
  if (!too_high(step) && !deepest(step)) return step;

  constexpr int turns = 8, slants = 12, sides = 8;
  for (const double length : {whole, whole / 2., whole / 4., whole / 8.}) {
    Vector3d direction = heading;
    for (int k = 0; k < turns; ++k) {
      const Vector3d tried = length * direction;
      if (too_high(tried)) {
        direction = below(ceiling, from, direction, length, side);
      } else if (const Ball* ball = deepest(tried)) {
        direction = around(*ball, from, direction, length, side);
      } else {
        return tried;
      }
    }
    const Vector3d right = across(side, heading, Vector3d::UnitX()), up = heading.cross(right);
    for (int i = 1; i <= slants; ++i)
      for (int j = 0; j < sides; ++j) {
        const double slant = std::numbers::pi * i / slants, angle = 2. * std::numbers::pi * j / sides;
        const Vector3d tried = length * (std::cos(slant) * heading +
                                         std::sin(slant) * (std::cos(angle) * right + std::sin(angle) * up));
        if (!too_high(tried) && !deepest(tried)) return tried;
      }
  }
  return Vector3d::Zero();
}

}  // namespace forest::lsystem
