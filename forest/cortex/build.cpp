// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/build.h"

#include <cmath>

#include "forest/core/parallel.h"
#include "forest/cortex/check_surfaces.h"
#include "forest/cortex/folds.h"
#include "forest/cortex/shape_all.h"

namespace forest::cortex {
namespace {

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

}  // namespace

Cortex build_cortex(const Mesh& outer, const Mesh& inner, const BuildOptions& options, Progress& progress) {
  const auto oddities = check_surfaces(outer, inner);
  const Laplace field(outer, inner, {.spacing = options.spacing}, progress);
  const Boundary outside(outer, progress), inside(inner, progress);
  const SurfaceTrees surfaces{outside.tree(), inside.tree()};
  const WCurves curves(field, outside, inside);
  const Ribbon dropped = make_ribbon(
      outer, curves, {.edge = ribbon_edge(options.volume), .least_thickness = options.thinnest}, progress);

  Cortex cortex;
  cortex.oddities = oddities;
  cortex.between = volume(outer) - volume(inner);
  cortex.wall = under_wall(dropped, surfaces.inner);
  Folds folds = find_folds(dropped, curves, options.line_scale, progress);
  const Ribbon& ribbon = folds.ribbon;
  const Quads quads = lay_quads(ribbon, folds.bent, folds.lines,
                                {.volume = options.volume, .whole = cortex.between - cortex.wall}, progress);
  cortex.elements = make_elements(ribbon, quads, folds.bent, curves, progress);
  cortex.lines = std::move(folds.lines);
  cortex.lines.insert(cortex.lines.end(), folds.sulci.begin(), folds.sulci.end());
  cortex.w_reached = 1. - double(cortex.elements.not_arrived) / double(cortex.elements.curves.size());

  progress.begin("measuring w-curves", quads.points.size());
  std::vector<double> angles(2 * quads.points.size());
  parallel_ranges(quads.points.size(), 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v) {
      const EndAngles at = end_angles(curve_at(ribbon, quads.points[v], curves), surfaces);
      angles[2 * v] = at.outer, angles[2 * v + 1] = at.inner;
    }
    progress.advance(end - begin);
  });
  progress.end();
  cortex.w_angle = spread_of(angles);
  shape_all(cortex, surfaces, options.volume, progress);
  cortex.elements.depth = even_depth(cortex.elements, progress);
  return cortex;
}

}  // namespace forest::cortex
