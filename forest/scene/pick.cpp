// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/pick.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <mutex>
#include <queue>
#include <tuple>
#include <unordered_map>
#include <utility>

#include "forest/core/half.h"
#include "forest/core/parallel.h"

namespace forest::scene {
namespace {

// What a place of the picture asks of the forest.
struct Probe {
  Ray ray;
  Rayd exact;
  Vec3 eye, forward;
  float near;
  float slope, width;  // by how much a branch is widened: width + slope × depth

  Probe(const frame::Camera& camera, const frame::Viewport& viewport, const Vec2& place, float reach)
      : ray(ray_through(camera, viewport, place)),
        exact{ray.origin.cast<double>(), ray.direction.cast<double>().normalized()},
        eye(camera.eye),
        forward(-camera.axes().col(2)),
        near(camera.near) {
    width = reach * camera.pixel_size(viewport.height, 0.f);
    slope = reach * camera.pixel_size(viewport.height, 1.f) - width;
  }
};

// Nearer to the ray's begin than this lies nothing of the sphere, widened; nothing when it is beside the ray. Bounds are of
// single precision, and radii were rounded after they were made: a thousandth more is always enough.
std::optional<float> meets(const Probe& probe, const Sphere& sphere) {
  const Vec3 to = sphere.centre - probe.ray.origin;
  const float along = to.dot(probe.ray.direction);
  const float reach = 1.001f * sphere.radius + 1e-5f * std::abs(along) + 1e-3f + probe.width +
                      probe.slope * (to.norm() + sphere.radius);
  if (along < -reach || (to - along * probe.ray.direction).squaredNorm() > reach * reach) return {};
  return along - reach;
}

// As the renderers cut it; none when all of it lies too near.
std::optional<RoundConed> before_the_eye(const Probe& probe, const RoundCone& cone) {
  RoundConed c{cone.a.cast<double>(), cone.b.cast<double>(), cone.radius_a, cone.radius_b};
  const auto depth = [&](const Eigen::Vector3d& p) {
    return probe.forward.cast<double>().dot(p - probe.eye.cast<double>());
  };
  double a = depth(c.a), b = depth(c.b);
  const double near = probe.near;
  if (a < near && b < near) return {};
  if (a < near || b < near) {
    const double t = (near - a) / (b - a), radius = c.radius_a + t * (c.radius_b - c.radius_a);
    const Eigen::Vector3d cut = c.a + t * (c.b - c.a);
    if (a < near)
      c.a = cut, c.radius_a = radius, a = near;
    else
      c.b = cut, c.radius_b = radius, b = near;
  }
  c.radius_a += double(probe.width) + double(probe.slope) * a;
  c.radius_b += double(probe.width) + double(probe.slope) * b;
  return c;
}

// Where a ray enters the union of spheres along an axis. The points (share of the axis, distance along the ray) at which
// the ray is within the sphere of that share form a convex set, so its lowest point is found by halving. The set begins
// and ends at the roots of a quadratic: where the axis comes as near to the ray as its sphere is wide.
std::optional<double> enter_plainly(const Rayd& ray, const RoundConed& cone) {
  using Vector = Eigen::Vector3d;
  const auto beside = [&](const Vector& v) -> Vector { return v - v.dot(ray.direction) * ray.direction; };
  const Vector p = beside(cone.a - ray.origin), q = beside(cone.b - cone.a);
  const double r = cone.radius_a, dr = cone.radius_b - cone.radius_a;
  const double A = dr * dr - q.squaredNorm(), B = 2. * (r * dr - p.dot(q)), C = r * r - p.squaredNorm();
  const auto spare = [&](double s) { return C + s * (B + s * A); };  // half the chord, squared
  std::array<double, 4> ends{0., 1.};
  std::size_t count = 2;
  const double under = B * B - 4. * A * C;
  if (under > 0.) {
    const double z = -.5 * (B + std::copysign(std::sqrt(under), B));
    for (const double root : {A != 0. ? z / A : -1., z != 0. ? C / z : -1.})
      if (root > 0. && root < 1.) ends[count++] = root;
  }
  std::sort(ends.begin(), ends.begin() + std::ptrdiff_t(count));
  std::optional<double> nearest;
  for (std::size_t i = 1; i < count; ++i) {
    double low = ends[i - 1], high = ends[i];
    if (!(spare(.5 * (low + high)) >= 0.)) continue;
    const auto entered = [&](double s) {
      return (cone.a + s * (cone.b - cone.a) - ray.origin).dot(ray.direction) -
             std::sqrt(std::max(0., spare(s)));
    };
    double best = std::min(entered(low), entered(high));
    for (int step = 0; step < 90; ++step) {
      const double s = low + (high - low) / 3., t = high - (high - low) / 3.;
      entered(s) < entered(t) ? high = t : low = s;
    }
    best = std::min(best, entered(.5 * (low + high)));
    if (!nearest || best < *nearest) nearest = best;
  }
  return nearest && *nearest >= 0. ? nearest : std::nullopt;
}

std::uint32_t section_of(const Forest& forest, const Neuron& neuron, std::uint32_t segment) {
  return forest.section_of_segment()[neuron.first_original + segment - neuron.first_segment];
}

// What can be picked where neurons are shown so. For one thread: it remembers the branches of neurons.
class Pickable {
 public:
  Pickable(const Forest& forest, const Shown& shown) : forest_(forest), shown_(shown) {}

  // Whether anything of a neuron may be.
  bool any(std::uint32_t instance) const {
    if (shown_.states.empty()) return true;
    const frame::State& state = shown_.states[instance];
    return state.is(frame::State::visible) || state.is(frame::State::parted);
  }
  bool operator()(std::uint32_t instance, const Neuron& neuron, std::uint32_t segment) {
    if (shown_.states.empty()) return true;
    const frame::State* state = &shown_.states[instance];
    const bool parted = state->is(frame::State::parted);
    if (!parted && state->kind != frame::Kind::somata) return state->is(frame::State::visible);
    const std::uint32_t section = section_of(forest_, neuron, segment);
    if (parted && section != soma_section) {
      const auto [known, fresh] = sections_.try_emplace(instance);
      if (fresh) known->second = section_states(forest_, shown_, instance);
      if (known->second[section]) state = known->second[section];
    }
    return state->is(frame::State::visible) &&
           (state->kind != frame::Kind::somata || section == soma_section);
  }

 private:
  const Forest& forest_;
  const Shown& shown_;
  std::unordered_map<std::uint32_t, std::vector<const frame::State*>> sections_;
};

// At a joint two segments are met at once: the first of them is meant, whatever the order of the walk.
bool better(const Pick& a, const std::optional<Pick>& b) {
  constexpr double at_once = 1e-7;  // µm between what is entered at one point
  if (!b || a.distance < b->distance - at_once) return true;
  return a.distance <= b->distance + at_once &&
         std::tuple(a.instance, a.segment) < std::tuple(b->instance, b->segment);
}

}  // namespace

RoundCone in_world(const Forest& forest, std::uint32_t instance, std::uint32_t segment) {
  const frame::Instance& i = forest.instances()[instance];
  const frame::Segment& s = forest.segments()[segment];
  const Quat turn(i.qw, i.qx, i.qy, i.qz);
  const Vec3 at(i.x, i.y, i.z);
  return {at + turn * Vec3(s.ax, s.ay, s.az), at + turn * Vec3(s.bx, s.by, s.bz), from_half(s.radii),
          from_half(s.radii >> 16)};
}

std::optional<Pick> pick(const Forest& forest, const frame::Camera& camera, const frame::Viewport& viewport,
                         const Vec2& place, float reach, const Shown& shown) {
  const Probe probe(camera, viewport, place, reach);
  Pickable pickable(forest, shown);
  // The clusters that the ray meets, those that may begin nearest first: when one begins behind what is found, all do.
  struct Open {
    float from;
    std::uint32_t instance, cluster;
    bool operator<(const Open& other) const { return from > other.from; }
  };
  std::priority_queue<Open> open;
  const auto offer = [&](std::uint32_t instance, std::uint32_t cluster) {
    const frame::Instance& i = forest.instances()[instance];
    const Cluster& c = forest.clusters()[cluster];
    const Vec3 centre = Vec3(i.x, i.y, i.z) + Quat(i.qw, i.qx, i.qy, i.qz) * Vec3(c.x, c.y, c.z);
    if (const auto from = meets(probe, {centre, c.radius})) open.push({*from, instance, cluster});
  };
  for (std::uint32_t i = 0; i < forest.instances().size(); ++i)
    if (const Neuron& n = forest.neurons()[forest.instances()[i].morphology];
        n.cluster_count && pickable.any(i))
      offer(i, n.first_cluster);

  std::optional<Pick> best;
  while (!open.empty() && !(best && double(open.top().from) > best->distance)) {
    const Open next = open.top();
    open.pop();
    const Cluster& c = forest.clusters()[next.cluster];
    if (!c.is_leaf()) {
      for (const std::uint32_t child : c.children) offer(next.instance, child);
      continue;
    }
    const Neuron& neuron = forest.neurons()[forest.instances()[next.instance].morphology];
    for (std::uint32_t s = c.first_segment; s < c.first_segment + c.segment_count; ++s) {
      if (!pickable(next.instance, neuron, s)) continue;
      const auto cone = before_the_eye(probe, in_world(forest, next.instance, s));
      const auto t = cone ? intersect(probe.exact, *cone) : std::nullopt;
      if (!t) continue;
      if (const Pick here{next.instance, s, section_of(forest, neuron, s), *t}; better(here, best))
        best = here;
    }
  }
  return best;
}

std::vector<std::optional<Pick>> plain_picks(const Forest& forest, const frame::Camera& camera,
                                             const frame::Viewport& viewport, std::span<const Vec2> places,
                                             float reach, const Shown& shown) {
  if (places.empty()) return {};
  constexpr std::size_t block = 32;
  std::vector<Probe> probes;
  for (const Vec2& place : places) probes.emplace_back(camera, viewport, place, reach);
  // Of each ray: its direction, and how far it begins from the eye. Rays are left out only by the distance of their line
  // from the middle of the segment.
  std::vector<float> x(probes.size()), y(probes.size()), z(probes.size());
  const Mat3 axes = camera.axes();
  for (std::size_t i = 0; i < probes.size(); ++i) {
    const Vec3 d = camera.orthographic() ? Vec3(probes[i].ray.origin - camera.eye) : probes[i].ray.direction;
    x[i] = d.x(), y[i] = d.y(), z[i] = d.z();
  }
  std::vector<std::optional<Pick>> found(probes.size());
  std::mutex mutex;
  parallel_ranges(forest.instances().size(), 4, [&](std::size_t begin, std::size_t end) {
    std::vector<std::optional<Pick>> nearest(probes.size());
    Pickable pickable(forest, shown);
    for (std::uint32_t index = std::uint32_t(begin); index < end; ++index) {
      const Neuron& neuron = forest.neurons()[forest.instances()[index].morphology];
      for (std::uint32_t k = 0; k < neuron.original_count; ++k) {
        const std::uint32_t s = neuron.first_segment + k;
        if (!pickable(index, neuron, s)) continue;
        const RoundCone cone = in_world(forest, index, s);
        const Vec3 to = .5f * (cone.a + cone.b) - camera.eye;
        const float size = .5f * (cone.b - cone.a).norm() + std::max(cone.radius_a, cone.radius_b);
        const float wide = size + probes[0].width + probes[0].slope * (to.norm() + size);
        const float limit = wide * wide * 1.01f + 2e-6f * to.squaredNorm() + 1e-4f;
        for (std::size_t i = 0; i < probes.size(); i += block) {
          const std::size_t count = std::min(block, probes.size() - i);
          std::int32_t near = 0;
          if (camera.orthographic()) {
            const Vec3 across = to + axes.col(2) * -axes.col(2).dot(to);
            for (std::size_t j = i; j < i + count; ++j) {
              const float dx = x[j] - across.x(), dy = y[j] - across.y(), dz = z[j] - across.z();
              near += dx * dx + dy * dy + dz * dz <= limit;
            }
          } else {
            const float least = to.squaredNorm() - limit;
            for (std::size_t j = i; j < i + count; ++j) {
              const float along = x[j] * to.x() + y[j] * to.y() + z[j] * to.z();
              near += along * along >= least;
            }
          }
          if (!near) continue;
          for (std::size_t j = i; j < i + count; ++j) {
            const auto cut = before_the_eye(probes[j], cone);
            const auto t = cut ? enter_plainly(probes[j].exact, *cut) : std::nullopt;
            if (!t) continue;
            const Pick here{index, s, section_of(forest, neuron, s), *t};
            if (better(here, nearest[j])) nearest[j] = here;
          }
        }
      }
    }
    const std::scoped_lock lock(mutex);
    for (std::size_t j = 0; j < probes.size(); ++j)
      if (nearest[j] && better(*nearest[j], found[j])) found[j] = nearest[j];
  });
  return found;
}

std::vector<std::uint32_t> subarbor(const Forest& forest, std::uint32_t instance, std::uint32_t section) {
  const Neuron& neuron = forest.neurons()[forest.instances()[instance].morphology];
  std::vector<bool> inside(neuron.section_count, section == soma_section);
  for (std::uint32_t s = 0; s < neuron.section_count; ++s) {  // parents come first
    const std::uint32_t parent = forest.sections()[neuron.first_section + s].parent;
    if (s == section || (parent != 0xffffffffu && inside[parent])) inside[s] = true;
  }
  std::vector<std::uint32_t> segments;
  for (std::uint32_t i = 0; i < neuron.original_count; ++i) {
    const std::uint32_t of = forest.section_of_segment()[neuron.first_original + i];
    if (of == soma_section ? section == soma_section : inside[of])
      segments.push_back(neuron.first_segment + i);
  }
  return segments;
}

}  // namespace forest::scene
