// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/build.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/parallel.h"
#include "forest/cortex/fit_faces.h"
#include "forest/cortex/gauge.h"
#include "forest/cortex/shape.h"
#include "forest/cortex/sulci.h"
#include "forest/geometry/isosurface.h"
#include "forest/geometry/self_intersection.h"

namespace forest::cortex {
namespace {

double share_of(std::vector<double>& values, double share) {
  if (values.empty()) return 0.;
  const auto at = values.begin() + std::ptrdiff_t(share * double(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

Spread spread_of(std::vector<double>& values) { return {share_of(values, .5), share_of(values, .99)}; }

std::string place_text(const Place& p) {
  return fmt::format("({:.1f}, {:.1f}, {:.1f}) mm", p[0] / 1e3, p[1] / 1e3, p[2] / 1e3);
}

// Volume under the wall, µm³: under its triangles of the outer surface, down to the inner one. What lies between that and the
// ribbon's inner triangles, which cut its folds, is measured at the middle of each. Not as what the rest leaves of all that the
// surfaces enclose: a hundred times the volume, of which folds cut as much as the wall has.
double under_wall(const Ribbon& ribbon, const TriangleTree& inner) {
  constexpr double reach = 500.;  // µm
  std::vector<double> under(ribbon.triangles.size(), 0.);
  parallel_for(under.size(), 256, [&](std::size_t i) {
    const Triangle& t = ribbon.triangles[i];
    if (!ribbon.is_wall(t)) return;
    under[i] = volume_under(ribbon, t);
    const Place &a = ribbon.inner[t[0]], &b = ribbon.inner[t[1]], &c = ribbon.inner[t[2]];
    const Place middle = (a + b + c) / 3., normal = .5 * (b - a).cross(c - a);
    const auto hit = inner.nearest(middle, reach);
    if (!hit || inner.normal(hit->triangle).dot(normal) <= 0.) return;
    under[i] -= normal.norm() * (hit->at - middle).dot(inner.normal(hit->triangle));
  });
  double sum = 0.;
  for (const double u : under) sum += u;
  return sum;
}

bool as_wanted(double volume, double wanted) { return volume >= .8 * wanted && volume <= 1.25 * wanted; }

// Whether 95 of 100 have about the wanted volume, and 99 of 100 a scaled Jacobian of .5.
bool even_and_well_shaped(const Elements& elements, double volume) {
  const Looks looks = look(elements);
  const auto odd =
                 std::ranges::count_if(looks.volume, [&](float v) { return !as_wanted(double(v), volume); }),
             sheared = std::ranges::count_if(looks.least, [](float least) { return least < .5f; });
  return 20 * odd <= long(elements.size()) && 100 * sheared <= long(elements.size());
}

// How far 99 of 100 places of faces, four of each, are from a surface, µm.
double farthest(const Elements& elements, double w, const TriangleTree& surface) {
  constexpr std::array<std::array<double, 2>, 4> at{{{.5, .17}, {.83, .5}, {.5, .83}, {.17, .5}}};
  std::vector<double> far(at.size() * elements.size());
  parallel_for(elements.size(), 64, [&](std::size_t e) {
    const Hexahedron h = elements.hexahedron(e);
    for (std::size_t k = 0; k < at.size(); ++k)
      far[at.size() * e + k] = surface.nearest(h.at(at[k][0], at[k][1], w))->distance;
  });
  return share_of(far, .99);
}

bool faces_are_close(const Elements& elements, const TriangleTree& outer, const TriangleTree& inner) {
  constexpr double close = 50.;  // µm
  return farthest(elements, 0., outer) <= close && farthest(elements, 1., inner) <= close;
}

// From elements as they are dropped to those that are valid, well shaped, of even volumes, and lie on both surfaces.
void shape(Cortex& cortex, const TriangleTree& outer, const TriangleTree& inner, double volume,
           Progress& progress) {
  fit_faces(cortex.elements, outer, inner, Fit::mean);
  const Shaping shaping{.volume = volume};
  for (int time = 0; time < 2; ++time) improve_shapes(cortex.elements, outer, inner, shaping, progress);
  // The few that are badly shaped still may take room from others and leave a creased surface farther.
  const Shaping last{.enough = .36,
                     .wanted = .5,
                     .volume = volume,
                     .least = .6,
                     .most = 1.6,
                     .even = 1.,
                     .along = 1600.,
                     .off = 100.,
                     .worst_off = 400.,
                     .rounds = 4,
                     .iterations = 400,
                     .gain = .01};
  improve_shapes(cortex.elements, outer, inner, last, progress);
  constexpr double least_jacobian = .2;
  begin_anew(cortex.elements, outer, inner, last, least_jacobian, progress);
  cortex.mending = mend(cortex.elements, outer, inner, progress);
  if (cortex.mending.before > 0) {
    // What is still tangled has another start now.
    improve_shapes(cortex.elements, outer, inner, last, progress);
    begin_anew(cortex.elements, outer, inner, last, least_jacobian, progress);
  }
  // Where nothing is tangled any more volumes can be evened, and what is sheared still has room.
  const Shaping even{
      .enough = .5, .wanted = .62, .volume = volume, .even = 16., .worst_off = 100., .gain = .01};
  Shaping roomy = even;
  roomy.along = 1600., roomy.off = 50., roomy.worst_off = 400.;
  // … and held closer to the surfaces; and what shape is lost to that is found again, with more patience.
  Shaping closely = roomy;
  closely.off = 15.;
  Shaping patient = roomy;
  patient.off = 30., patient.even = 10., patient.iterations = 120, patient.gain = .005;
  constexpr int evenings = 2, evenings_with_faces = 6;
  for (int time = 0; time < evenings && !even_and_well_shaped(cortex.elements, volume); ++time) {
    improve_shapes(cortex.elements, outer, inner, even, progress);
    improve_shapes(cortex.elements, outer, inner, roomy, progress);
    begin_anew(cortex.elements, outer, inner, last, least_jacobian, progress);
  }
  cortex.left_out = leave_out(cortex.elements, least_jacobian);
  cortex.wall += cortex.left_out.volume;
  fit_faces(cortex.elements, outer, inner, Fit::places);
  for (int time = 0; time < 2; ++time) fit_faces(cortex.elements, outer, inner, Fit::volume);
  // Faces that take what they lacked make volumes uneven again.
  for (int time = 0; time < evenings_with_faces && !even_and_well_shaped(cortex.elements, volume); ++time) {
    improve_shapes(cortex.elements, outer, inner, roomy, progress);
    fit_faces(cortex.elements, outer, inner, Fit::volume);
  }
  // What some faces cannot take all of them do. Then every place of a face comes as near to its surface as shapes allow.
  const double whole = cortex.between - cortex.wall;
  keep_volume(cortex.elements, whole);
  for (int time = 0; time < evenings && !(even_and_well_shaped(cortex.elements, volume) &&
                                          faces_are_close(cortex.elements, outer, inner));
       ++time) {
    fit_faces(cortex.elements, outer, inner, Fit::places);
    keep_volume(cortex.elements, whole);
    improve_shapes(cortex.elements, outer, inner, closely, progress);
  }
  if (!even_and_well_shaped(cortex.elements, volume))
    improve_shapes(cortex.elements, outer, inner, patient, progress);
  begin_anew(cortex.elements, outer, inner, last, least_jacobian, progress, Rings::many);
  keep_volume(cortex.elements, whole);
  begin_anew(cortex.elements, outer, inner, last, least_jacobian, progress,
             Rings::many);  // a height for all costs some
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

Cortex build_cortex(const Mesh& outer, const Mesh& inner, const BuildOptions& options, Progress& progress) {
  const auto oddities = check_surfaces(outer, inner);
  const Laplace field(outer, inner, {.spacing = options.spacing}, progress);
  const Boundary outside(outer, progress), inside(inner, progress);
  const TriangleTree &outer_tree = outside.tree(), &inner_tree = inside.tree();
  const WCurves curves(field, outside, inside);
  // Two triangles to a side of the lattice that elements are laid by, or more.
  const double side = std::sqrt(options.volume / 2500.);
  const Ribbon dropped = make_ribbon(outer, curves, {.edge = .75 * side}, progress);

  Cortex cortex;
  cortex.oddities = oddities;
  cortex.between = volume(outer) - volume(inner);
  cortex.wall = under_wall(dropped, inner_tree);
  const Ribbon ribbon = unfolded(dropped, curves, progress);
  progress.begin("looking for crests and valleys", 0);
  const auto bent = curvatures(ribbon.middle, ribbon.triangles, neighbours(ribbon.size(), ribbon.triangles),
                               options.line_scale);
  cortex.lines = crests_and_valleys(ribbon, bent, {.scale = options.line_scale});
  progress.end();
  const Quads quads = lay_quads(ribbon, bent, cortex.lines, {.volume = options.volume}, progress);
  progress.begin("looking for the floors of sulci", 0);
  for (Line& line : sulci(coarser(dropped), {})) cortex.lines.push_back(std::move(line));
  progress.end();
  cortex.elements = make_elements(ribbon, quads, bent, curves, progress);
  cortex.w_reached = 1. - double(cortex.elements.not_arrived) / double(cortex.elements.curves.size());

  progress.begin("measuring w-curves", quads.points.size());
  std::vector<double> angles(2 * quads.points.size());
  parallel_ranges(quads.points.size(), 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v) {
      const EndAngles at = end_angles(curve_at(ribbon, quads.points[v], curves), outer_tree, inner_tree);
      angles[2 * v] = at.outer, angles[2 * v + 1] = at.inner;
    }
    progress.advance(end - begin);
  });
  progress.end();
  cortex.w_angle = spread_of(angles);
  shape(cortex, outer_tree, inner_tree, options.volume, progress);
  cortex.elements.depth = even_depth(cortex.elements, progress);
  return cortex;
}

Report report(const Cortex& cortex, double wanted, const TriangleTree* outer, const TriangleTree* inner,
              Progress& progress) {
  const Elements& elements = cortex.elements;
  const std::size_t n = elements.size();
  Report result;
  result.elements = n;
  std::vector<double> volumes(n), equivolume(n), jacobian(n);
  std::vector<std::uint8_t> bad(n);
  progress.begin("measuring elements", n);
  parallel_ranges(n, 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t e = begin; e < end; ++e) {
      const Hexahedron h = elements.hexahedron(e);
      bad[e] = !certify(h).positive();
      volumes[e] = h.volume();
      equivolume[e] = depth_error(elements, e);
      jacobian[e] = scaled_jacobian(h);
    }
    progress.advance(end - begin);
  });
  progress.end();
  double total = 0.;
  for (std::size_t e = 0; e < n; ++e) {
    total += volumes[e];
    result.uncertified += bad[e];
    result.volume_within += as_wanted(volumes[e], wanted);
  }
  result.volume_within /= double(n), result.volume_mean = total / double(n);
  result.volume_error =
      cortex.between > 0. ? std::abs(total + cortex.wall - cortex.between) / cortex.between : 0.;
  result.equivolume_error = *std::max_element(equivolume.begin(), equivolume.end());
  result.equivolume_p99 = share_of(equivolume, .99);
  result.jacobian_least = *std::min_element(jacobian.begin(), jacobian.end());
  result.jacobian_p1 = share_of(jacobian, .01);
  if (outer) result.outer_distance_p99 = farthest(elements, 0., *outer);
  if (inner) result.inner_distance_p99 = farthest(elements, 1., *inner);

  // Elements by a crest: how far their v-isolines are from crossing it at a right angle.
  const Mesh crests = pieces(cortex.lines, Line::Kind::crest);
  const std::vector<Place> along = directions(cortex.lines, Line::Kind::crest);
  if (!crests.triangles.empty()) {
    const TriangleTree tree(crests);
    std::vector<double> angles;
    for (std::size_t e = 0; e < n; ++e) {
      const Hexahedron h = elements.hexahedron(e);
      const auto hit = tree.nearest(h.at(.5, .5, .5), .5 * std::cbrt(wanted));
      if (hit)
        angles.push_back(
            std::abs(90. - degrees_between(h.jacobian(.5, .5, .5).col(0), along[hit->triangle])));
    }
    result.crest_angle = spread_of(angles);
  }
  return result;
}

}  // namespace forest::cortex
