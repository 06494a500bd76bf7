// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/check_surfaces.h"

#include <algorithm>
#include <array>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "forest/core/error.h"
#include "forest/core/parallel.h"
#include "forest/cortex/ribbon.h"
#include "forest/geometry/isosurface.h"
#include "forest/geometry/roughness.h"
#include "forest/geometry/self_intersection.h"
#include "forest/geometry/triangle_tree.h"

namespace forest::cortex {
namespace {

using Place = Eigen::Vector3d;

// A surface is rough whose vertices scatter by more than these shares of the cortex's thickness and of its triangles' edges. Average
// surfaces with edges of 3 mm have .05 and .04, of single hemispheres .025 and .06; noise of .3 mm makes .12 and .1 of all.
// 6 mm wide triangles, too coarse for folds but no noise, have .2 and .085.
constexpr double rough = .08, steep = .09;

std::string place_text(const Place& p) {
  return fmt::format("({:.1f}, {:.1f}, {:.1f}) mm", p[0] / 1e3, p[1] / 1e3, p[2] / 1e3);
}

// What is wrong at an edge that does not lie between two triangles which run along it in opposite directions, and what to do.
std::string fault_at(const Mesh& mesh, const char* name, const std::array<std::uint32_t, 2>& edge,
                     const std::string& place) {
  std::vector<std::size_t> by;  // the triangles there
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Triangle& v = mesh.triangles[t];
    if (std::ranges::count(v, edge[0]) && std::ranges::count(v, edge[1])) by.push_back(t);
  }
  const std::string where = fmt::format("the edge of vertices {} and {}, {}", edge[0], edge[1], place);
  if (by.size() == 1) return fmt::format("the {} surface is open at {}; give a closed one", name, where);
  if (by.size() == 2)
    return fmt::format("triangles {} and {} of the {} surface face opposite ways at {}; turn one of them",
                       by[0], by[1], name, where);
  return fmt::format(
      "{} triangles of the {} surface meet at {}, where two may; leave out those that are too many",
      by.size(), name, where);
}

// How deep surfaces may cross. By the medial wall those of averages do: fs_LR's at one vertex of 75 by more than a tenth of a millimetre, by up
// to .37 mm; BigBrain's, of one brain, at one of 3,500 and by .21 mm; fsaverage5's by less than .1 mm.
struct Crossing {
  double told, most;  // µm; what is deeper than `most` is refused

  explicit Crossing(double thickness)
      : told(std::min(100., thickness / 20.)),
        most(std::min(RibbonOptions{}.least_thickness, thickness / 4.)) {}
};

// What lies on the wrong side of another surface, deeper than `told`.
struct Strays {
  std::size_t vertices = 0, triangles = 0;  // triangles: that only reach there between their corners
  std::size_t of = 0;                       // vertices
  double farthest = 0.;                     // µm
  Place where = Place::Zero();

  bool any() const { return vertices + triangles > 0; }
  void add(double depth, const Place& place, std::size_t& count) {
    if (depth <= 0.) return;
    ++count;
    if (depth > farthest) farthest = depth, where = place;
  }
};
Strays strays(const Mesh& mesh, const TriangleTree& other, bool belongs_inside, double told) {
  const auto wrong = [&](const Place& p, double distance) {
    return distance > told && other.encloses(p) != belongs_inside ? distance : 0.;
  };
  const auto at = [&](std::uint32_t v) -> Place { return mesh.positions[v].cast<double>(); };
  std::vector<double> distances(mesh.positions.size()), depths(mesh.positions.size());
  parallel_for(depths.size(), 256, [&](std::size_t v) {
    distances[v] = other.nearest(at(std::uint32_t(v)))->distance;
    depths[v] = wrong(at(std::uint32_t(v)), distances[v]);
  });
  std::vector<std::pair<double, Place>> between(mesh.triangles.size(), {0., Place::Zero()});
  parallel_for(between.size(), 256, [&](std::size_t i) {
    const Triangle& t = mesh.triangles[i];
    const std::array<Place, 3> p{at(t[0]), at(t[1]), at(t[2])};
    const double longest = std::max({(p[1] - p[0]).norm(), (p[2] - p[1]).norm(), (p[0] - p[2]).norm()});
    if (longest < std::min({distances[t[0]], distances[t[1]], distances[t[2]]}) || depths[t[0]] > 0. ||
        depths[t[1]] > 0. || depths[t[2]] > 0.)
      return;
    for (const Place& place : {Place((p[0] + p[1]) / 2.), Place((p[1] + p[2]) / 2.),
                               Place((p[2] + p[0]) / 2.), Place((p[0] + p[1] + p[2]) / 3.)})
      if (const double depth = wrong(place, other.nearest(place)->distance); depth > between[i].first)
        between[i] = {depth, place};
  });
  Strays found;
  std::vector<std::uint8_t> used(depths.size(), 0);  // a vertex of no triangle is no part of the surface
  for (const Triangle& t : mesh.triangles)
    for (const std::uint32_t v : t) used[v] = 1;
  for (std::uint32_t v = 0; v < depths.size(); ++v)
    if (used[v]) ++found.of, found.add(depths[v], at(v), found.vertices);
  for (const auto& [depth, place] : between) found.add(depth, place, found.triangles);
  return found;
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
    if (const auto edge = open_edge(*mesh)) throw Error(fault_at(*mesh, name, *edge, at((*edge)[0])));
    if (count_pieces(*mesh) != 1)
      throw Error(fmt::format("the {} surface has {} pieces; give one piece", name, count_pieces(*mesh)));
    if (const auto vertex = pinched_vertex(*mesh))
      throw Error(
          fmt::format("the {} surface touches itself at vertex {}, {}, where its triangles make several "
                      "fans; move them apart",
                      name, *vertex, at(*vertex)));
    if (const long handles = (2 - euler_number(*mesh)) / 2; handles != 0)
      throw Error(fmt::format(
          "the {} surface has {} handle{}; give one without, such as FreeSurfer's after its topology is "
          "corrected",
          name, handles, handles == 1 ? "" : "s"));
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
  if (volume(inner) >= volume(outer))
    throw Error(
        volume(inner) < 1.001 * volume(outer)
            ? fmt::format("both surfaces enclose {:.4g} mm³; give the outer and the inner one", cubic_mm)
            : fmt::format("the inner surface encloses {:.4g} mm³, more than the outer one with {:.4g}; "
                          "were they swapped?",
                          volume(inner) / 1e9, cubic_mm));
  if (volume(inner) < .005 * volume(outer))
    throw Error(
        fmt::format("the inner surface encloses {:.3g} mm³ and the outer one {:.3g}; check that both are in "
                    "mm",
                    volume(inner) / 1e9, cubic_mm));
  const double thickness = 2. * (volume(outer) - volume(inner)) / (area(outer) + area(inner));
  for (const auto& [mesh, name] : both) {
    const double noise = roughness(*mesh), edge = mean_edge(*mesh);
    if (noise > rough * thickness && noise > steep * edge)
      throw Error(fmt::format(
          "the vertices of the {} surface scatter by {:.2f} mm about a smooth one, as of noise, where the "
          "cortex is {:.2f} mm thick and triangles {:.2f} mm wide; smooth it",
          name, noise / 1e3, thickness / 1e3, edge / 1e3));
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
  const TriangleTree trees[] = {TriangleTree(outer), TriangleTree(inner)};
  const Crossing crossing(thickness);
  const std::array found{strays(outer, trees[1], false, crossing.told),
                         strays(inner, trees[0], true, crossing.told)};
  for (const std::size_t k : {1u, 0u}) {
    const Strays& s = found[k];
    const bool many = s.vertices * 33 > s.of;
    if (!many && s.farthest <= crossing.most) continue;
    throw Error(fmt::format(
        "{} of {} vertices of the {} surface lie {} the {} one, and {} of its triangles reach there "
        "between theirs, the farthest by {:.2f} mm at {}; {}",
        s.vertices, s.of, both[k].second, k == 1 ? "outside of" : "within", both[1 - k].second, s.triangles,
        s.farthest / 1e3, place_text(s.where),
        many ? "check that both are of one hemisphere and that they were not swapped"
             : "pull the inner one back there"));
  }
  if (found[0].any() || found[1].any()) {
    const Strays& deepest = found[0].farthest > found[1].farthest ? found[0] : found[1];
    std::vector<std::string> parts;
    for (const std::size_t k : {1u, 0u})
      if (const Strays& s = found[k]; s.any())
        parts.push_back(fmt::format("at {} the {} one lies {} the {} one",
                                    s.vertices         ? fmt::format("{} of {} vertices", s.vertices, s.of)
                                    : s.triangles == 1 ? "one triangle"
                                                       : fmt::format("{} triangles", s.triangles),
                                    both[k].second, k == 1 ? "outside of" : "within", both[1 - k].second));
    oddities.push_back(
        fmt::format("the surfaces cross: {}, deepest by {:.2f} mm at {}; by a medial wall that does no harm, "
                    "elsewhere pull the inner one back",
                    fmt::join(parts, ", "), deepest.farthest / 1e3, place_text(deepest.where)));
  }
  return oddities;
}

}  // namespace forest::cortex
