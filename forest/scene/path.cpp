// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/path.h"

#include <algorithm>
#include <cmath>

#include "forest/core/error.h"
#include "forest/geometry/polyline.h"
#include "forest/scene/gallery.h"

namespace forest::scene {
namespace {

float eased(float t) {
  t = std::clamp(t, 0.f, 1.f);
  return t * t * t * (t * (6.f * t - 15.f) + 10.f);
}

// Of a way at one speed but for a fifth of the time at both ends, in which it begins and ends: nowhere faster than 1.25 times the mean.
float cruised(float t) {
  constexpr float part = .2f;
  t = std::clamp(t, 0.f, 1.f);
  if (t > .5f) return 1.f - cruised(1.f - t);
  const float x = std::min(t / part, 1.f), begun = part * x * x * x * (1.f - .5f * x);
  return (begun + std::max(t - part, 0.f)) / (1.f - part);
}

// Barry & Goldman (1988): a Catmull–Rom curve with knots k0 < k1 < k2 < k3, between p1 and p2.
Vec3 barry_goldman(const Vec3 p[4], const float k[4], float t) {
  const auto mix = [t](const Vec3& a, const Vec3& b, float from, float to) -> Vec3 {
    return a + (b - a) * ((t - from) / (to - from));
  };
  const Vec3 a1 = mix(p[0], p[1], k[0], k[1]), a2 = mix(p[1], p[2], k[1], k[2]),
             a3 = mix(p[2], p[3], k[2], k[3]);
  const Vec3 b1 = mix(a1, a2, k[0], k[2]), b2 = mix(a2, a3, k[1], k[3]);
  return mix(b1, b2, k[1], k[2]);
}

// How far what is looked at goes, µm: as the eye moves, or turns or zooms where it is.
float way(const frame::Camera& from, const frame::Camera& to) {
  const float reach = std::min((from.target - from.eye).norm(), (to.target - to.eye).norm());
  const float turn = float(Quat(from.axes()).angularDistance(Quat(to.axes())));
  const float zoom = std::abs(std::log(to.field_of_view / from.field_of_view));
  return std::max({(to.eye - from.eye).norm(), reach * turn, reach * zoom});
}

}  // namespace

CameraPath::CameraPath(std::vector<View> keys) : keys_(std::move(keys)) {
  if (keys_.empty()) throw Error("a camera path needs at least one view");
  knots_.push_back(0.f);
  for (std::size_t i = 1; i < keys_.size(); ++i) {
    // By the square root of the way: near keys get more time than their distance asks for.
    knots_.push_back(knots_.back() + std::max(std::sqrt(way(keys_[i - 1].camera, keys_[i].camera)), 1e-3f));
  }
  for (float& k : knots_) k /= std::max(knots_.back(), 1e-6f);
}

View CameraPath::at(float t) const {
  if (keys_.size() == 1) return keys_[0];
  const float u = cruised(t);
  std::size_t i = 1;
  while (i + 1 < keys_.size() && knots_[i] < u) ++i;
  // Ends are continued in a straight line.
  const auto key = [&](std::ptrdiff_t index) -> Vec3 {
    const auto last = std::ptrdiff_t(keys_.size()) - 1;
    if (index < 0) return 2.f * keys_[0].camera.eye - keys_[1].camera.eye;
    if (index > last)
      return 2.f * keys_[std::size_t(last)].camera.eye - keys_[std::size_t(last - 1)].camera.eye;
    return keys_[std::size_t(index)].camera.eye;
  };
  const auto knot = [&](std::ptrdiff_t index) {
    const auto last = std::ptrdiff_t(keys_.size()) - 1;
    if (index < 0) return 2.f * knots_[0] - knots_[1];
    if (index > last) return 2.f * knots_[std::size_t(last)] - knots_[std::size_t(last - 1)];
    return knots_[std::size_t(index)];
  };
  const std::ptrdiff_t at = std::ptrdiff_t(i);
  const Vec3 points[4] = {key(at - 2), key(at - 1), key(at), key(at + 1)};
  const float knots[4] = {knot(at - 2), knot(at - 1), knot(at), knot(at + 1)};
  const View &a = keys_[i - 1], &b = keys_[i];
  const float s = std::clamp((u - knots[1]) / (knots[2] - knots[1]), 0.f, 1.f);

  View view = s < .5f ? a : b;
  view.camera.eye = barry_goldman(points, knots, u);
  const Quat from(a.camera.axes()), to(b.camera.axes());
  const Mat3 axes = from.slerp(eased(s), to).toRotationMatrix();
  const auto mix = [s](float x, float y) { return x + (y - x) * s; };
  const float reach = mix((a.camera.target - a.camera.eye).norm(), (b.camera.target - b.camera.eye).norm());
  view.camera.target = a.camera.target == b.camera.target  // what both look at stays in the middle
                           ? a.camera.target
                           : Vec3(view.camera.eye - reach * axes.col(2));
  view.camera.up = axes.col(1);
  view.camera.field_of_view =
      std::exp(mix(std::log(a.camera.field_of_view), std::log(b.camera.field_of_view)));
  if (a.plane && b.plane) {
    view.plane->at = a.plane->at + s * (b.plane->at - a.plane->at);
    const Vec3 normal =
        a.plane->normal.normalized() + s * (b.plane->normal.normalized() - a.plane->normal.normalized());
    if (normal.norm() > .1f) view.plane->normal = normal;  // not where it turns over
    view.plane->opacity = mix(a.plane->opacity, b.plane->opacity);
  }
  view.camera.near = std::exp(mix(std::log(a.camera.near), std::log(b.camera.near)));
  return view;
}

float soma_clearance(const Forest& forest, const Vec3& point) {
  float nearest = INFINITY;
  for (const frame::Instance& i : forest.instances())
    nearest =
        std::min(nearest, (Vec3(i.x, i.y, i.z) - point).norm() - forest.neurons()[i.morphology].soma_radius);
  return nearest;
}

CameraPath walk(const Forest& forest, std::span<const frame::State> states, float aspect) {
  if (is_gallery(forest)) return CameraPath(around_gallery(forest, aspect, states));
  const View start = overview(forest, aspect, states);
  // In axes of which y is the forest's way up.
  const Mat3 turn = standing(forest);
  Bounds bounds;
  const auto seen = seen_in(states);
  bool all = true;
  for (std::uint32_t i = 0; i < forest.instances().size(); ++i)
    if (const frame::Instance& at = forest.instances()[i]; seen(i))
      bounds.add(turn.transpose() * Vec3(at.x, at.y, at.z));
    else
      all = false;
  if (bounds.empty()) return CameraPath({start});
  const Vec3 centre = bounds.centre(), from = turn.transpose() * start.camera.eye;
  const float height = bounds.extent().y(), of_column = all ? forest.circuit().radius : 0.f;
  const float radius =
      std::max(of_column > 0.f ? of_column : .5f * std::min(bounds.extent().x(), bounds.extent().z()), 50.f);

  // The clearest of a few places around a wish: a walk must not end inside a soma.
  const auto clear_place = [&](const Vec3& wish, float spread) {
    Vec3 best = wish;
    float most = -INFINITY;
    for (int i = 0; i < 64; ++i) {
      const float angle = 2.3999632f * float(i), out = spread * std::sqrt(float(i) / 64.f);
      const Vec3 place =
          wish + Vec3(out * std::cos(angle), .5f * out * std::sin(1.7f * angle), out * std::sin(angle));
      const float clearance = soma_clearance(forest, turn * place);
      if (clearance > most) most = clearance, best = place;
    }
    return best;
  };
  const auto look = [&](const Vec3& eye, const Vec3& target, float field_of_view) {
    View view = start;
    view.camera.eye = turn * eye, view.camera.target = turn * target;
    view.camera.field_of_view = field_of_view;
    view.camera.near = .5f;
    return view;
  };
  const Vec3 inward = Vec3(centre.x() - from.x(), 0.f, centre.z() - from.z()).normalized();
  const Vec3 side = Vec3::UnitY().cross(inward);
  const float y = bounds.low.y() + .62f * height;
  const Vec3 level(centre.x(), y, centre.z());
  const Vec3 edge = clear_place(level - inward * (1.15f * radius) + side * (.35f * radius), .1f * radius);
  const Vec3 inside = clear_place(level - inward * (.45f * radius) + side * (.15f * radius), .2f * radius);
  const Vec3 deep =
      clear_place(level - inward * (.05f * radius) - Vec3(0.f, .06f * height, 0.f), .2f * radius);
  return CameraPath(
      {start, look(level - inward * (2.2f * radius) + side * (.8f * radius), level, 44.f),
       look(edge, level, 52.f), look(inside, level + inward * radius, 58.f),
       look(deep, level + inward * radius + side * (.5f * radius) + Vec3(0.f, .1f * height, 0.f), 60.f)});
}

Dolly::Dolly(const Forest& forest) : start_(overview(forest)), end_(start_) {
  struct Soma {
    Vec3 place;
    float radius;
  };
  std::vector<Soma> somata;
  for (const frame::Instance& i : forest.instances())
    if (const float radius = forest.neurons()[i.morphology].soma_radius; radius > 0.f)
      somata.push_back({Vec3(i.x, i.y, i.z), radius});
  const Vec3 centre = forest.soma_bounds().centre(), eye = start_.camera.eye;
  std::ranges::stable_sort(somata, {}, [&](const Soma& s) { return (s.place - centre).squaredNorm(); });
  float clearest = -INFINITY;
  for (std::size_t i = 0; i < std::min<std::size_t>(somata.size(), 24); ++i) {
    const Soma& goal = somata[i];
    const float distance = 2.f * goal.radius / std::tan(.5f * radians(start_.camera.field_of_view));
    const Vec3 before = goal.place - distance * (goal.place - eye).normalized();
    float clearance = INFINITY;
    for (std::size_t other = 0; other < somata.size(); ++other)
      if (other != i)
        clearance =
            std::min(clearance, distance_to_segment(somata[other].place, eye, before) - somata[other].radius);
    if (clearance <= clearest) continue;
    clearest = clearance;
    end_.camera.eye = before, end_.camera.target = goal.place;
  }
  end_.camera.near = .5f;
}

View Dolly::at(float time) const {
  const float s = eased(time);
  const frame::Camera &from = start_.camera, &to = end_.camera;
  const float far = (from.eye - to.target).norm(), near = (to.eye - to.target).norm();
  const float share = std::pow(near / far, s);  // of the distance at the start
  View view = start_;
  view.camera.eye = to.target + share * (from.eye - to.target);
  const Mat3 axes = Quat(from.axes()).slerp(s, Quat(to.axes())).toRotationMatrix();
  view.camera.target = view.camera.eye - share * far * axes.col(2);
  view.camera.up = axes.col(1);
  view.camera.near = from.near * std::pow(to.near / from.near, s);
  return view;
}

}  // namespace forest::scene
