// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/connection.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "forest/core/half.h"
#include "forest/core/parallel.h"

namespace forest::scene {
namespace {

bool before(const Vec3& a, const Vec3& b) {
  return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end());
}

void sort_places(std::vector<Vec3>& places) {
  std::sort(places.begin(), places.end(), before);
  places.erase(std::unique(places.begin(), places.end()), places.end());
}

bool holds(const std::vector<Vec3>& places, const Vec3& place) {
  return std::binary_search(places.begin(), places.end(), place, before);
}

Vec3 begin_of(const frame::Segment& s) { return {s.ax, s.ay, s.az}; }
Vec3 end_of(const frame::Segment& s) { return {s.bx, s.by, s.bz}; }

struct Place {
  Vec3 at;
  Quat turn;
  explicit Place(const frame::Instance& i) : at(i.x, i.y, i.z), turn(i.qw, i.qx, i.qy, i.qz) {}
  Vec3 operator()(const Vec3& p) const { return at + turn * p; }
};

}  // namespace

bool draws(const frame::Segment& segment, const frame::Instance& instance, const frame::Camera& camera,
           float focal, bool as_line, float thinnest) {
  const Place place(instance);
  const Mat3 axes = camera.axes();
  const auto seen = [&](const Vec3& p) {
    const Vec3 v = axes.transpose() * (place(p) - camera.eye);
    return Vec3(v.x(), v.y(), -v.z());
  };
  const Vec3 a = seen(begin_of(segment)), b = seen(end_of(segment));
  if (a.z() < camera.near && b.z() < camera.near) return false;
  const float za = std::max(a.z(), camera.near), zb = std::max(b.z(), camera.near);
  const float ra = from_half(segment.radii), rb = from_half(segment.radii >> 16);
  const float la = camera.orthographic() ? 1.f : za, lb = camera.orthographic() ? 1.f : zb;
  if (!as_line && focal * std::max(ra / la, rb / lb) >= .75f) return true;
  if (thinnest == 0.f) return true;  // drawn where samples meet it
  const Vec2 d = (b.head<2>() / lb - a.head<2>() / la).cwiseAbs();
  const float stretch = d.maxCoeff() > 0.f ? d.norm() / d.maxCoeff() : 1.f;
  const float width = focal * (ra / la + rb / lb) * stretch;
  const float mean = from_half(segment.meta >> 16);
  const float rank = float(segment.meta >> 8 & 255u) / 256.f + 1.f / 512.f;
  if (width < thinnest && mean > 0.f)
    return focal * mean * (1.f / la + 1.f / lb) * float(FOREST_MEAN_STRETCH) / thinnest > rank;
  return thinnest < 1.f || width >= rank;  // a picture of one sample draws whole pixels
}

Connectedness::Connectedness(const Forest& forest) : forest_(forest), roots_(forest.neurons().size()) {
  parallel_for(roots_.size(), 1, [&](std::size_t n) {
    const Neuron& neuron = forest.neurons()[n];
    const auto segments = forest.segments().subspan(neuron.first_segment, neuron.original_count);
    std::vector<Vec3> ends;
    for (const frame::Segment& s : segments) ends.push_back(end_of(s));
    sort_places(ends);
    for (const frame::Segment& s : segments)
      if (!holds(ends, begin_of(s))) roots_[n].push_back(begin_of(s));
    roots_[n].push_back(Vec3::Zero());  // the soma
    sort_places(roots_[n]);
  });
}

Connections Connectedness::operator()(const Cut& cut, const frame::Camera& camera,
                                      const frame::Viewport& viewport, float thinnest) const {
  struct Piece {
    const frame::Item* item;
    bool as_line;
  };
  std::vector<std::vector<Piece>> pieces(forest_.instances().size());
  for (const frame::Item& i : cut.lines)
    if (i.instance != FOREST_IN_WORLD) pieces[i.instance].push_back({&i, true});
  for (const frame::Item& i : cut.capsules) pieces[i.instance].push_back({&i, false});
  const float focal = camera.focal(viewport.height);
  std::vector<Connections> found(pieces.size());
  parallel_for(pieces.size(), 8, [&](std::size_t index) {
    const frame::Instance& instance = forest_.instances()[index];
    std::vector<Vec3> begins, ends;
    for (const Piece& piece : pieces[index])
      for (std::uint32_t drawn = piece.item->drawn; drawn; drawn &= drawn - 1) {
        const frame::Segment& s =
            forest_.segments()[piece.item->first_segment + std::uint32_t(std::countr_zero(drawn))];
        if (draws(s, instance, camera, focal, piece.as_line, thinnest)) {
          begins.push_back(begin_of(s));
          ends.push_back(end_of(s));
        }
      }
    sort_places(ends);
    for (const Vec3& begin : begins) {
      if (holds(ends, begin)) continue;
      ++found[index].runs;
      if (holds(roots_[instance.morphology], begin)) continue;
      const Vec3 pixel = frame::project(camera, viewport, Place(instance)(begin));
      found[index].disconnected += pixel.z() > camera.near && pixel.x() >= 0.f && pixel.y() >= 0.f &&
                                   pixel.x() < viewport.width && pixel.y() < viewport.height;
    }
  });
  Connections sum;
  for (const Connections& c : found) sum.runs += c.runs, sum.disconnected += c.disconnected;
  return sum;
}

}  // namespace forest::scene
