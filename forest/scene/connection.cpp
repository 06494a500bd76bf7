// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/connection.h"

#include <algorithm>
#include <bit>

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
                                      const frame::Viewport& viewport) const {
  std::vector<std::vector<const frame::Item*>> pieces(forest_.instances().size());
  for (const auto* list : {&cut.lines, &cut.capsules})
    for (const frame::Item& i : *list)
      if (i.instance != FOREST_IN_WORLD) pieces[i.instance].push_back(&i);
  const auto depth = [&, ahead = Vec3(-camera.axes().col(2))](const Vec3& p) {
    return ahead.dot(p - camera.eye);
  };
  std::vector<Connections> found(pieces.size());
  parallel_for(pieces.size(), 8, [&](std::size_t index) {
    const frame::Instance& instance = forest_.instances()[index];
    std::vector<Vec3> begins, ends;
    const Place place(instance);
    for (const frame::Item* item : pieces[index])
      for (std::uint32_t drawn = item->drawn; drawn; drawn &= drawn - 1) {
        const frame::Segment& s =
            forest_.segments()[item->first_segment + std::uint32_t(std::countr_zero(drawn))];
        const Vec3 begin = begin_of(s), end = end_of(s);
        if (depth(place(begin)) < camera.near && depth(place(end)) < camera.near) continue;
        begins.push_back(begin);
        ends.push_back(end);
      }
    sort_places(ends);
    for (const Vec3& begin : begins) {
      if (holds(ends, begin)) continue;
      ++found[index].runs;
      if (holds(roots_[instance.morphology], begin)) continue;
      const Vec3 pixel = frame::project(camera, viewport, place(begin));
      found[index].disconnected += pixel.z() > camera.near && pixel.x() >= 0.f && pixel.y() >= 0.f &&
                                   pixel.x() < viewport.width && pixel.y() < viewport.height;
    }
  });
  Connections sum;
  for (const Connections& c : found) sum.runs += c.runs, sum.disconnected += c.disconnected;
  return sum;
}

}  // namespace forest::scene
