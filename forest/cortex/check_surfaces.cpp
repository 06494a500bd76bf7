// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/check_surfaces.h"

#include <array>
#include <utility>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/parallel.h"
#include "forest/geometry/isosurface.h"
#include "forest/geometry/self_intersection.h"
#include "forest/geometry/triangle_tree.h"

namespace forest::cortex {
namespace {

using Place = Eigen::Vector3d;

std::string place_text(const Place& p) {
  return fmt::format("({:.1f}, {:.1f}, {:.1f}) mm", p[0] / 1e3, p[1] / 1e3, p[2] / 1e3);
}

}  // namespace

std::vector<std::string> check_surfaces(const Mesh& outer, const Mesh& inner) {
  std::vector<std::string> oddities;
  const std::array<std::pair<const Mesh*, const char*>, 2> both{{{&outer, "outer"}, {&inner, "inner"}}};
  for (const auto& [mesh, name] : both) {
    if (mesh->triangles.empty()) throw Error(fmt::format("the {} surface has no triangles", name));
    for (std::size_t v = 0; v < mesh->positions.size(); ++v)
      if (!mesh->positions[v].allFinite())
        throw Error(
            fmt::format("vertex {} of the {} surface has a coordinate that is no number; mend it", v, name));
    const auto at = [&, mesh = mesh](std::uint32_t v) {
      return place_text(mesh->positions[v].cast<double>());
    };
    for (std::size_t t = 0; t < mesh->triangles.size(); ++t)
      if (const Triangle& v = mesh->triangles[t]; v[0] == v[1] || v[1] == v[2] || v[2] == v[0])
        throw Error(fmt::format("triangle {} of the {} surface has one vertex twice, {}, {}; take it out", t,
                                name, v[0] == v[1] ? v[0] : v[2], at(v[2])));
    if (const auto edge = open_edge(*mesh))
      throw Error(fmt::format(
          "the {} surface is open or not of one orientation at the edge of vertices {} and {}, {}; give a "
          "closed one",
          name, (*edge)[0], (*edge)[1], at((*edge)[0])));
    if (count_pieces(*mesh) != 1)
      throw Error(fmt::format("the {} surface has {} pieces; give one piece", name, count_pieces(*mesh)));
    const long euler = euler_number(*mesh);
    if (euler != 2)
      throw Error(fmt::format(
          "the {} surface has {} handles; give one without, such as FreeSurfer's after its topology is "
          "corrected",
          name, (2 - euler) / 2));
    if (!(volume(*mesh) > 0.))
      throw Error(fmt::format("the triangles of the {} surface face inwards; turn them", name));
  }
  constexpr double least = 1., most = 1e7;  // mm³: of a shrew, of a whale
  const double cubic_mm = volume(outer) / 1e9;
  if (cubic_mm < least || cubic_mm > most) {
    const bool metres = cubic_mm < least;
    const double other = metres ? cubic_mm * 1e9 : cubic_mm / 1e9;
    throw Error(fmt::format(
        "the outer surface encloses {:.3g} mm³, which is no hemisphere; check that it is in mm{}", cubic_mm,
        other > least && other < most
            ? fmt::format(" and not in {}, of which that would be {:.3g} mm³", metres ? "m" : "µm", other)
            : ""));
  }
  if (volume(inner) > volume(outer))
    throw Error(
        fmt::format("the inner surface encloses {:.3g} mm³, more than the outer one with {:.3g}; were they "
                    "swapped?",
                    volume(inner) / 1e9, cubic_mm));
  if (volume(inner) < .005 * volume(outer))
    throw Error(
        fmt::format("the inner surface encloses {:.3g} mm³ and the outer one {:.3g}; check that both are in "
                    "mm",
                    volume(inner) / 1e9, cubic_mm));
  for (const auto& [mesh, name] : both) {
    const std::size_t cut = count_cut_triangles(*mesh);
    if (cut == 0) continue;
    const auto first = self_intersection(*mesh);
    const std::string what =
        fmt::format("{} of {} triangles of the {} surface cut others of it, first {} and {} at {}", cut,
                    mesh->triangles.size(), name, first->first, first->second, place_text(first->point));
    if (cut * 200 > mesh->triangles.size())
      throw Error(what +
                  "; give one that does not cut itself, such as FreeSurfer's or one of 'cortex surfaces'");
    oddities.push_back(what + "; elements by it may be mended or left out");
  }
  // Inner vertices outside of the outer surface, and pieces of one that cut the other, are told by the first of them.
  const TriangleTree tree(outer);
  std::size_t outside = 0;
  Place where = Place::Zero();
  double farthest = 0.;
  std::vector<double> depths(inner.positions.size());
  parallel_for(depths.size(), 256, [&](std::size_t i) {
    const Place p = inner.positions[i].cast<double>();
    const auto hit = tree.nearest(p);
    depths[i] = hit->distance > 100. && !tree.encloses(p) ? hit->distance : 0.;
  });
  for (std::size_t i = 0; i < depths.size(); ++i) {
    if (depths[i] <= 100.) continue;
    ++outside;
    if (depths[i] > farthest) farthest = depths[i], where = inner.positions[i].cast<double>();
  }
  if (outside * 33 > depths.size())  // by the medial wall averaged surfaces cross one another a little
    throw Error(fmt::format(
        "{} of {} vertices of the inner surface lie outside of the outer one, the farthest by {:.2f} mm "
        "at {}; check that both are of one hemisphere and that they were not swapped",
        outside, depths.size(), farthest / 1e3, place_text(where)));
  return oddities;
}

}  // namespace forest::cortex
