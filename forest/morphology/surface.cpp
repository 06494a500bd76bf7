// SPDX-License-Identifier: Apache-2.0
#include "forest/morphology/surface.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "forest/geometry/polygonise.h"
#include "forest/morphology/soma_shape.h"

namespace forest {
namespace {

/// A piece of the soma: a sphere (both ends alike) or a tapered cylinder.
struct SomaPiece {
  Vec4 a, b;
};

Vec4 vec4(const Point& p) { return {p.x, p.y, p.z, p.radius}; }

std::vector<SomaPiece> pieces(const Soma& soma) {
  std::vector<SomaPiece> list;
  const Vec4 mean = vec4(soma.sphere());
  if (soma.kind == SomaKind::cylinders) {
    for (std::size_t i = 0; i < soma.points.size(); ++i)
      if (soma.parents[i] >= 0)
        list.push_back({vec4(soma.points[std::size_t(soma.parents[i])]), vec4(soma.points[i])});
  } else if (soma.kind == SomaKind::contours) {
    const std::vector<Point> discs = outline_discs(soma);
    for (std::size_t i = 1; i < discs.size(); ++i) list.push_back({vec4(discs[i - 1]), vec4(discs[i])});
  }
  if (list.empty() && soma.kind != SomaKind::none && mean.w() > 0.f) list.push_back({mean, mean});
  return list;
}

/// Where a stem is fastened within the soma; none for a root that lies apart.
std::optional<Vec3> anchor(const Morphology& m, const Section& stem) {
  const Soma& soma = m.soma();
  if (soma.kind == SomaKind::none) return {};
  const Point mean = soma.sphere();
  const Vec3 begin = m.points()[stem.first_point].position();
  const bool known = stem.soma_point >= 0 && std::size_t(stem.soma_point) < soma.points.size();
  if (!known && (begin - mean.position()).norm() > 1.5f * mean.radius) return {};
  if (known && soma.kind == SomaKind::cylinders) return soma.points[std::size_t(stem.soma_point)].position();
  return mean.position();
}

/// The points of a section with radii of at least `thinnest`, a stem from where it is fastened. Empty for a root of a
/// single point that is fastened nowhere.
std::vector<Vec4> axis(const Morphology& m, SectionId id, float thinnest) {
  const auto points = m.points(id);
  std::vector<Vec4> list;
  list.reserve(points.size() + 1);
  const auto add = [&](const Vec3& at, float radius) {
    list.emplace_back(at.x(), at.y(), at.z(), std::max(radius, thinnest));
  };
  if (!m.section(id).parent.valid())
    if (const auto inside = anchor(m, m.section(id)); inside && *inside != points[0].position()) {
      const float soma = m.soma().sphere().radius;
      add(*inside, soma > 0.f ? std::min(points[0].radius, soma) : points[0].radius);
    }
  for (const Point& p : points) add(p.position(), p.radius);
  return list;
}

std::vector<SectionId> all_sections(const Morphology& m) {
  std::vector<SectionId> ids;
  for (std::uint32_t i = 0; i < m.sections().size(); ++i) ids.emplace_back(i);
  return ids;
}

std::uint8_t label_of(const Section& section) { return std::uint8_t(section.kind); }

}  // namespace

Lines sticks(const Morphology& m) {
  Lines lines;
  const Soma& soma = m.soma();
  std::vector<Vec3> line;
  if (soma.kind == SomaKind::sphere) {
    const Point p = soma.sphere();
    for (int i = 0; i < 3; ++i) {
      const Vec3 half = p.radius * Vec3::Unit(i);
      lines.add(std::array{Vec3(p.position() - half), Vec3(p.position() + half)}, soma_label);
    }
  } else if (soma.kind == SomaKind::contours) {
    for (std::size_t i = 0; i < soma.contour_starts.size(); ++i) {
      line.clear();
      for (const Point& p : soma.contour(i)) line.push_back(p.position());
      if (line.empty()) continue;
      line.push_back(line[0]);
      lines.add(line, soma_label);
    }
  } else {
    for (const SomaPiece& piece : pieces(soma))
      lines.add(std::array{Vec3(piece.a.head<3>()), Vec3(piece.b.head<3>())}, soma_label);
  }
  for (const SectionId id : all_sections(m)) {
    line.clear();
    for (const Vec4& p : axis(m, id, 0.f)) line.push_back(p.head<3>());
    if (line.size() > 1) lines.add(line, label_of(m.section(id)));
  }
  return lines;
}

Mesh tubes(const Morphology& m, const TubeOptions& options) {
  Mesh mesh;
  for (const SomaPiece& piece : pieces(m.soma())) {
    std::array ends{piece.a, piece.b};
    for (Vec4& end : ends) end.w() = std::max(end.w(), options.thinnest);
    append(mesh, ends[0] == ends[1]
                     ? icosphere(ends[0].head<3>(), ends[0].w(), 3, soma_label)
                     : tube(ends, std::max(24, options.sides), Cap::flat, Cap::flat, soma_label));
  }
  for (const SectionId id : all_sections(m)) {
    const Section& section = m.section(id);
    const std::vector<Vec4> line = axis(m, id, options.thinnest);
    const bool free = !section.parent.valid() && !anchor(m, section);
    append(mesh, tube(line, options.sides, free ? Cap::flat : Cap::dome,
                      m.is_terminal(id) ? Cap::flat : Cap::dome, label_of(section)));
  }
  return mesh;
}

namespace {

/// The soma is branch 0, section i branch i + 1.
std::vector<BranchCone> branch_cones(const Morphology& m, float thinnest) {
  std::vector<BranchCone> cones;
  const auto add = [&](const Vec4& a, const Vec4& b, std::size_t branch, std::uint8_t label) {
    cones.push_back({.shape = {.a = a.head<3>(),
                               .b = b.head<3>(),
                               .radius_a = std::max(a.w(), thinnest),
                               .radius_b = std::max(b.w(), thinnest)},
                     .branch = std::uint32_t(branch),
                     .label = label});
  };
  for (const SomaPiece& piece : pieces(m.soma())) add(piece.a, piece.b, 0, soma_label);
  for (const SectionId id : all_sections(m)) {
    const std::vector<Vec4> line = axis(m, id, thinnest);
    const std::uint8_t label = label_of(m.section(id));
    if (line.size() == 1) add(line[0], line[0], id.value() + 1, label);
    for (std::size_t i = 1; i < line.size(); ++i) add(line[i - 1], line[i], id.value() + 1, label);
  }
  return cones;
}

/// Branch points, and where stems leave the soma. As far as three radii they are rounded, by half a radius.
std::vector<Joint> joints_of(const Morphology& m, float thinnest) {
  std::vector<Joint> joints;
  const auto add = [&](const Vec3& centre, float radius) -> Joint& {
    const float r = std::max(radius, thinnest);
    return joints.emplace_back(
        Joint{.centre = centre, .reach = 3.f * r, .rounding = .5f * r, .branches = {}});
  };
  for (const SectionId id : all_sections(m)) {
    const Section& section = m.section(id);
    const Point& last = m.points(id).back();
    if (const auto children = m.children(id); !children.empty()) {
      Joint& joint = add(last.position(), last.radius);
      joint.branches.push_back(id.value() + 1);
      for (const SectionId child : children) joint.branches.push_back(child.value() + 1);
    }
    if (section.parent.valid() || !anchor(m, section)) continue;
    const Point &first = m.points(id)[0], mean = m.soma().sphere();
    const Vec3 out = first.position() - mean.position();
    const bool round = pieces(m.soma()).size() == 1 && out.norm() > 0.f;
    add(round ? Vec3(mean.position() + mean.radius * out.normalized()) : first.position(),
        std::min(first.radius, mean.radius))
        .branches = {0, id.value() + 1};
  }
  return joints;
}

/// The thinnest radius above 0; 0.5 µm where none was measured.
float thinnest_radius(const Morphology& m) {
  float thinnest = std::numeric_limits<float>::infinity();
  for (const Point& p : m.points())
    if (p.radius > 0.f) thinnest = std::min(thinnest, p.radius);
  if (m.points().empty() && m.soma().sphere().radius > 0.f) thinnest = m.soma().sphere().radius / 8.f;
  return std::isfinite(thinnest) ? thinnest : .5f;
}

constexpr double unasked_triangles = 2e6;
constexpr float voxels_a_radius = .75f;

}  // namespace

Surface surface(const Morphology& m, const SurfaceOptions& options) {
  Surface result;
  float& voxel = result.voxel = options.voxel;
  if (!(voxel > 0.f)) {
    voxel = std::max(thinnest_radius(m), 1e-3f);
    for (int i = 0; i < 8; ++i) {  // thickened branches have more area, so that once is not enough
      const double expected = expected_triangles(branch_cones(m, voxels_a_radius * voxel), voxel);
      if (expected <= unasked_triangles) break;
      voxel *= 1.01f * float(std::sqrt(expected / unasked_triangles));
    }
  }
  const float thinnest = voxels_a_radius * voxel;
  for (const Point& p : m.points()) result.thickened += p.radius < thinnest;
  result.mesh = polygonise(branch_cones(m, thinnest), joints_of(m, thinnest), voxel);
  return result;
}

}  // namespace forest
