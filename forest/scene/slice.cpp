// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/slice.h"

#include <algorithm>
#include <cmath>

#include "forest/core/half.h"
#include "forest/core/parallel.h"

namespace forest::scene {
namespace {

constexpr std::size_t chunk = 64;  // neurons; fixed, so that the result does not depend on threads

struct Knife {
  Plane plane;
  Sheet sheet;
  // Radii were rounded after the bounds were made: a thousandth more is always enough.
  bool meets(const Sphere& sphere) const {
    const float reach = 1.001f * sphere.radius + 1e-3f;
    if (std::abs(plane.height(sphere.centre)) > reach) return false;
    const Place at = plane.place(sphere.centre).cast<double>(), around = Place::Constant(double(reach));
    return ((at + around).array() >= sheet.low.array()).all() &&
           ((at - around).array() <= sheet.high.array()).all();
  }
};

void cut_neuron(const Forest& forest, std::uint32_t index, const Knife& knife, std::vector<Profile>& out) {
  const frame::Instance& i = forest.instances()[index];
  const Neuron& neuron = forest.neurons()[i.morphology];
  if (!neuron.cluster_count) return;
  const Vec3 at(i.x, i.y, i.z);
  const Quat turn(i.qw, i.qx, i.qy, i.qz);
  const auto world = [&](float x, float y, float z) -> Eigen::Vector3d {
    return at.cast<double>() + turn.cast<double>() * Eigen::Vector3d(x, y, z);
  };
  const std::size_t before = out.size();
  std::vector<std::uint32_t> open{neuron.first_cluster};
  while (!open.empty()) {
    const Cluster& c = forest.clusters()[open.back()];
    open.pop_back();
    if (!knife.meets({at + turn * Vec3(c.x, c.y, c.z), c.radius})) continue;
    if (!c.is_leaf()) {
      open.insert(open.end(), std::begin(c.children), std::end(c.children));
      continue;
    }
    for (std::uint32_t k = c.first_segment; k < c.first_segment + c.segment_count; ++k) {
      const frame::Segment& s = forest.segments()[k];
      const RoundConed cone{world(s.ax, s.ay, s.az), world(s.bx, s.by, s.bz), from_half(s.radii),
                            from_half(s.radii >> 16)};
      if (auto shape = CrossSection::of(cone, knife.plane))
        out.push_back({index, k, s.meta & 7u, std::move(*shape)});
    }
  }
  std::sort(out.begin() + std::ptrdiff_t(before), out.end(),
            [](const Profile& a, const Profile& b) { return a.segment < b.segment; });
}

}  // namespace

namespace {

Sheet bounds_of(const Profile& profile) {
  Sheet sheet{Place::Constant(INFINITY), Place::Constant(-INFINITY)};
  for (const Place& place : profile.shape.outline(.1, .1))
    sheet.low = sheet.low.cwiseMin(place), sheet.high = sheet.high.cwiseMax(place);
  return sheet;
}

// As large as the profile: else what is hidden by others would be taken away too small, since vertices lie on its rim.
std::vector<Place> polygon_of(const CrossSection& shape) {
  std::vector<Place> polygon = shape.outline(1e-2, 1e-3);
  const double flat = area_of_union({&polygon, 1});
  if (!(flat > 0.)) return polygon;
  Place middle = Place::Zero();
  for (const Place& place : polygon) middle += place / double(polygon.size());
  const double larger = std::sqrt(shape.area() / flat);
  for (Place& place : polygon) place = middle + larger * (place - middle);
  return polygon;
}

bool beside(const Sheet& one, const Sheet& other) {
  return (one.low.array() > other.high.array()).any() || (one.high.array() < other.low.array()).any();
}

}  // namespace

Slice slice(const Forest& forest, const Plane& plane, const Sheet& sheet) {
  const Knife knife{plane, sheet};
  const std::size_t count = forest.instances().size();
  std::vector<std::vector<Profile>> parts((count + chunk - 1) / chunk);
  parallel_for(parts.size(), 1, [&](std::size_t p) {
    for (std::size_t i = p * chunk; i < std::min(count, (p + 1) * chunk); ++i)
      cut_neuron(forest, std::uint32_t(i), knife, parts[p]);
    if (sheet.low.allFinite() || sheet.high.allFinite())
      std::erase_if(parts[p], [&](const Profile& profile) { return beside(bounds_of(profile), sheet); });
  });
  Slice result{plane, {}};
  for (auto& part : parts)
    result.profiles.insert(result.profiles.end(), std::make_move_iterator(part.begin()),
                           std::make_move_iterator(part.end()));
  return result;
}

std::vector<ProfileArea> areas(const Slice& slice) {
  std::vector<std::size_t> starts;  // of neurons
  for (std::size_t i = 0; i < slice.profiles.size(); ++i)
    if (i == 0 || slice.profiles[i].instance != slice.profiles[i - 1].instance) starts.push_back(i);
  std::vector<std::vector<ProfileArea>> found(starts.size());
  parallel_for(starts.size(), 4, [&](std::size_t n) {
    const std::size_t end = n + 1 < starts.size() ? starts[n + 1] : slice.profiles.size();
    std::vector<const Profile*> profiles;
    for (std::size_t i = starts[n]; i < end; ++i) profiles.push_back(&slice.profiles[i]);
    std::ranges::stable_sort(profiles, {}, &Profile::kind);
    // Areas are exact one by one; only what overlaps is measured, on polygons of the same areas.
    std::vector<std::vector<Place>> polygons;
    double before = 0., exact = 0.;
    for (std::size_t i = 0; i < profiles.size();) {
      ProfileArea area{profiles[i]->instance, profiles[i]->kind, 0, 0.};
      for (; i < profiles.size() && profiles[i]->kind == area.kind; ++i, ++area.profiles) {
        polygons.push_back(polygon_of(profiles[i]->shape));
        exact += profiles[i]->shape.area();
      }
      const double sum = std::min(exact, area_of_union(polygons));
      area.area = std::max(0., sum - before);
      before = sum;
      found[n].push_back(area);
    }
  });
  std::vector<ProfileArea> all;
  for (const auto& some : found) all.insert(all.end(), some.begin(), some.end());
  return all;
}

Sheet bounds_of(const Slice& slice) {
  Sheet sheet{Place::Constant(INFINITY), Place::Constant(-INFINITY)};
  for (const Profile& profile : slice.profiles) {
    const Sheet own = bounds_of(profile);
    sheet.low = sheet.low.cwiseMin(own.low), sheet.high = sheet.high.cwiseMax(own.high);
  }
  return sheet;
}

Sheet sheet_of(const Forest& forest, const Plane& plane) {
  constexpr float beside = 60.f;  // µm
  Bounds bounds = forest.soma_bounds();
  if (bounds.empty()) return {Place::Constant(-beside), Place::Constant(beside)};
  for (const auto& layer : forest.layers_in_place())
    bounds.add(Vec3(bounds.centre().x(), layer.bottom, bounds.centre().z())),
        bounds.add(Vec3(bounds.centre().x(), layer.top, bounds.centre().z()));
  Sheet sheet{Place::Constant(INFINITY), Place::Constant(-INFINITY)};
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 at(corner & 1 ? bounds.low.x() : bounds.high.x(),
                  corner & 2 ? bounds.low.y() : bounds.high.y(),
                  corner & 4 ? bounds.low.z() : bounds.high.z());
    const Place place = plane.place(at).cast<double>();
    sheet.low = sheet.low.cwiseMin(place - Place::Constant(beside));
    sheet.high = sheet.high.cwiseMax(place + Place::Constant(beside));
  }
  return sheet;
}

}  // namespace forest::scene
