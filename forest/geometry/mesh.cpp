// SPDX-License-Identifier: Apache-2.0
#include "forest/geometry/mesh.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <compare>
#include <map>
#include <utility>

#include "forest/core/unions.h"

namespace forest {

void Lines::add(std::span<const Vec3> line, std::uint8_t label) {
  starts.push_back(std::uint32_t(positions.size()));
  labels.push_back(label);
  positions.insert(positions.end(), line.begin(), line.end());
}

std::span<const Vec3> Lines::line(std::size_t i) const {
  const std::size_t end = i + 1 < starts.size() ? starts[i + 1] : positions.size();
  return std::span(positions).subspan(starts[i], end - starts[i]);
}

void append(Mesh& mesh, const Mesh& other) {
  const auto shift = std::uint32_t(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(), other.positions.begin(), other.positions.end());
  mesh.labels.insert(mesh.labels.end(), other.labels.begin(), other.labels.end());
  for (const Triangle& t : other.triangles)
    mesh.triangles.push_back({t[0] + shift, t[1] + shift, t[2] + shift});
}

std::optional<std::array<std::uint32_t, 2>> open_edge(const Mesh& mesh) {
  std::vector<std::uint64_t> there, back;
  there.reserve(3 * mesh.triangles.size()), back.reserve(3 * mesh.triangles.size());
  const auto named = [](std::uint64_t edge) {
    return std::array{std::uint32_t(edge >> 32), std::uint32_t(edge)};
  };
  for (const Triangle& t : mesh.triangles)
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint64_t a = t[i], b = t[(i + 1) % 3];
      if (a == b) return named(a << 32 | b);
      there.push_back(a << 32 | b), back.push_back(b << 32 | a);
    }
  std::ranges::sort(there), std::ranges::sort(back);
  if (const auto twice = std::ranges::adjacent_find(there); twice != there.end()) return named(*twice);
  const auto differ = std::ranges::mismatch(there, back);
  if (differ.in1 != there.end()) return named(*differ.in1);
  return {};
}

bool is_closed(const Mesh& mesh) { return !open_edge(mesh); }

std::optional<std::uint32_t> pinched_vertex(const Mesh& mesh) {
  // Around its corner at a vertex a triangle leads from one neighbour to the next: a fan comes back to where it began.
  struct Step {
    std::uint32_t vertex, from, to;
    auto operator<=>(const Step&) const = default;
  };
  std::vector<Step> steps;
  steps.reserve(3 * mesh.triangles.size());
  for (const Triangle& t : mesh.triangles)
    for (std::size_t i = 0; i < 3; ++i) steps.push_back({t[i], t[(i + 1) % 3], t[(i + 2) % 3]});
  std::ranges::sort(steps);
  for (std::size_t begin = 0, end = 0; begin < steps.size(); begin = end) {
    while (end < steps.size() && steps[end].vertex == steps[begin].vertex) ++end;
    const std::span<const Step> own(&steps[begin], end - begin);
    std::size_t walked = 0;
    for (std::uint32_t at = own[0].from; walked < own.size(); ++walked) {
      if (walked && at == own[0].from) return own[0].vertex;
      at = std::ranges::lower_bound(own, at, {}, &Step::from)->to;
    }
  }
  return {};
}

std::size_t count_pieces(const Mesh& mesh) {
  Unions together(mesh.positions.size());
  std::vector<bool> used(mesh.positions.size());
  for (const Triangle& t : mesh.triangles)
    for (const std::uint32_t v : t) used[v] = true, together.join(t[0], v);
  std::size_t pieces = 0;
  for (std::uint32_t v = 0; v < used.size(); ++v) pieces += used[v] && together.root(v) == v;
  return pieces;
}

double volume(const Mesh& mesh) {
  if (mesh.positions.empty()) return 0.;
  const Eigen::Vector3d origin = mesh.positions[0].cast<double>();  // near, so that nothing large cancels
  double six = 0.;
  for (const Triangle& t : mesh.triangles) {
    std::array<Eigen::Vector3d, 3> p;
    for (std::size_t i = 0; i < 3; ++i) p[i] = mesh.positions[t[i]].cast<double>() - origin;
    six += p[0].dot(p[1].cross(p[2]));
  }
  return six / 6.;
}

double mean_edge(const Mesh& mesh) {
  double sum = 0.;
  for (const Triangle& t : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k)
      sum += double((mesh.positions[t[k]] - mesh.positions[t[(k + 1) % 3]]).norm());
  return sum / (3. * double(std::max<std::size_t>(mesh.triangles.size(), 1)));
}

double area(const Mesh& mesh) {
  double twice = 0.;
  for (const Triangle& t : mesh.triangles) {
    const Eigen::Vector3d a = mesh.positions[t[0]].cast<double>(), b = mesh.positions[t[1]].cast<double>(),
                          c = mesh.positions[t[2]].cast<double>();
    twice += (b - a).cross(c - a).norm();
  }
  return twice / 2.;
}

std::vector<Vec3> vertex_normals(const Mesh& mesh) {
  std::vector<Vec3> normals(mesh.positions.size(), Vec3::Zero());
  for (const Triangle& t : mesh.triangles) {
    const Vec3 across =
        (mesh.positions[t[1]] - mesh.positions[t[0]]).cross(mesh.positions[t[2]] - mesh.positions[t[0]]);
    for (const std::uint32_t v : t) normals[v] += across;
  }
  for (Vec3& n : normals) {
    n = n.stableNormalized();
    if (!(n.squaredNorm() > .5f)) n = Vec3(0.f, 1.f, 0.f);
  }
  return normals;
}

Mesh icosphere(const Vec3& centre, float radius, int halvings, std::uint8_t label) {
  const float g = std::numbers::phi_v<float>;
  std::vector<Vec3> unit{{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                         {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  std::vector<Triangle> triangles{{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                                  {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                                  {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                                  {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
  for (Vec3& p : unit) p.normalize();
  for (int i = 0; i < halvings; ++i) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [at, fresh] = middles.try_emplace(std::minmax(a, b), std::uint32_t(unit.size()));
      if (fresh) unit.push_back((unit[a] + unit[b]).normalized());
      return at->second;
    };
    std::vector<Triangle> finer;
    for (const auto& [a, b, c] : triangles) {
      const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
    }
    triangles = std::move(finer);
  }
  for (Vec3& p : unit) p = centre + radius * p;
  const std::size_t count = unit.size();
  return {std::move(unit), std::vector<std::uint8_t>(count, label), std::move(triangles)};
}

namespace {

/// The unit direction of the axis at each vertex; places that coincide share that of their neighbours.
std::vector<Vec3> tangents(std::span<const Vec4> axis) {
  const std::size_t n = axis.size();
  std::vector<Vec3> before(n, Vec3::Zero()), behind(n, Vec3::Zero()), result(n);
  for (std::size_t i = 1; i < n; ++i) {
    const Vec3 step = axis[i].head<3>() - axis[i - 1].head<3>();
    const float length = step.stableNorm();
    before[i] = length > 0.f ? Vec3(step / length) : before[i - 1];
  }
  for (std::size_t i = n - 1; i-- > 0;) {
    const Vec3 step = axis[i + 1].head<3>() - axis[i].head<3>();
    const float length = step.stableNorm();
    behind[i] = length > 0.f ? Vec3(step / length) : behind[i + 1];
  }
  for (std::size_t i = 0; i < n; ++i) {
    const Vec3 sum = before[i] + behind[i];
    result[i] = sum.norm() > 1e-3f ? sum.normalized() : before[i];  // a hairpin keeps the way it came
  }
  return result;
}

Vec3 reflect(const Vec3& v, const Vec3& normal, float squared) {
  return squared > 0.f ? Vec3(v - 2.f / squared * normal.dot(v) * normal) : v;
}

/// A ring of `sides` vertices around `centre`.
void add_ring(Mesh& mesh, const Vec3& centre, const Vec3& u, const Vec3& v, float radius, int sides) {
  for (int k = 0; k < sides; ++k) {
    const float angle = 2.f * pi * float(k) / float(sides);
    mesh.positions.push_back(centre + radius * (std::cos(angle) * u + std::sin(angle) * v));
  }
}

}  // namespace

Mesh tube(std::span<const Vec4> axis, int sides, Cap first, Cap last, std::uint8_t label) {
  assert(!axis.empty() && sides >= 3);
  std::vector<Vec3> along = tangents(axis);
  const bool one_place = along.front().isZero();
  if (one_place) {
    const auto widest = std::ranges::max_element(axis, {}, [](const Vec4& p) { return p.w(); });
    return icosphere(widest->head<3>(), widest->w(), sides > 8 ? 2 : 1, label);
  }
  Mesh mesh;
  const int steps = std::max(1, sides / 4);  // rings of a dome
  const auto place = [&](std::size_t i) -> Vec3 { return axis[i].head<3>(); };
  const auto dome = [&](std::size_t i, const Vec3& u, const Vec3& v, float sign, int step) {
    const float angle = pi / 2.f * float(step) / float(steps), r = axis[i].w();
    add_ring(mesh, place(i) + sign * std::sin(angle) * r * along[i], u, v, std::cos(angle) * r, sides);
  };
  Vec3 u = along[0].unitOrthogonal();
  mesh.positions.push_back(place(0) - (first == Cap::dome ? axis[0].w() : 0.f) * along[0]);
  for (int step = steps - 1; first == Cap::dome && step > 0; --step)
    dome(0, u, along[0].cross(u), -1.f, step);
  for (std::size_t i = 0; i < axis.size(); ++i) {
    if (i > 0) {
      const Vec3 step = place(i) - place(i - 1);
      const float squared = step.squaredNorm();
      const Vec3 u_left = reflect(u, step, squared), t_left = reflect(along[i - 1], step, squared);
      const Vec3 turn = along[i] - t_left;
      u = reflect(u_left, turn, turn.squaredNorm());
      u = u - along[i].dot(u) * along[i];  // what rounding has added
      u = u.norm() > 1e-3f ? u.normalized() : along[i].unitOrthogonal();
    }
    add_ring(mesh, place(i), u, along[i].cross(u), axis[i].w(), sides);
  }
  const std::size_t end = axis.size() - 1;
  for (int step = 1; last == Cap::dome && step < steps; ++step) dome(end, u, along[end].cross(u), 1.f, step);
  mesh.positions.push_back(place(end) + (last == Cap::dome ? axis[end].w() : 0.f) * along[end]);

  const auto n = std::uint32_t(sides), tip = std::uint32_t(mesh.positions.size() - 1), rings = (tip - 1) / n;
  for (std::uint32_t k = 0; k < n; ++k) mesh.triangles.push_back({0, 1 + (k + 1) % n, 1 + k});
  for (std::uint32_t ring = 0; ring + 1 < rings; ++ring)
    for (std::uint32_t k = 0; k < n; ++k) {
      const std::uint32_t a = 1 + ring * n + k, b = 1 + ring * n + (k + 1) % n;
      mesh.triangles.push_back({a, b, b + n}), mesh.triangles.push_back({a, b + n, a + n});
    }
  const std::uint32_t top = 1 + (rings - 1) * n;
  for (std::uint32_t k = 0; k < n; ++k) mesh.triangles.push_back({top + k, top + (k + 1) % n, tip});
  mesh.labels.assign(mesh.positions.size(), label);
  return mesh;
}

}  // namespace forest
