// SPDX-License-Identifier: Apache-2.0
// The cortex as a ribbon: the triangles of the outer surface, refined, and what lies under each of their corners along its
// w-curve: a place half way down by volume, and one on the inner surface. Lines, quadrilaterals and elements are laid out
// on the middle, which is bent least, and carried up and down along the curves.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "forest/cortex/w_curve.h"

namespace forest::cortex {

/// Neighbours of the vertices of a triangulation, ascending: those of v are list[starts[v]] up to starts[v + 1].
struct Neighbours {
  std::vector<std::uint32_t> starts, list;

  std::span<const std::uint32_t> of(std::size_t vertex) const {
    return std::span(list).subspan(starts[vertex], starts[vertex + 1] - starts[vertex]);
  }
};
Neighbours neighbours(std::size_t vertices, std::span<const Triangle> triangles);

/// Unit normals of places, the mean of their triangles' by area; 0 where these have none.
std::vector<Place> normals_of(std::span<const Place> places, std::span<const Triangle> triangles);

/// Each triangle as four, corners of the old ones first and in their order, then the middles of edges.
Mesh halved(const Mesh& mesh);

struct Ribbon {
  std::vector<Place> outer, middle, inner;  // of every vertex, µm
  std::vector<float> thickness;    // the lesser of its w-curve and the straight way to the inner surface, µm
  std::vector<std::uint8_t> wall;  // 1: the medial wall, where there is no cortex
  std::vector<Triangle> triangles;
  int halvings = 0;  // of the surface's own triangles

  std::size_t size() const { return middle.size(); }
  bool is_wall(const Triangle& t) const { return wall[t[0]] || wall[t[1]] || wall[t[2]]; }
};

/// The ribbon with a middle that is folded nowhere. Curves from an outer surface that is crumpled on a smaller scale than the field sees,
/// as real ones are in the floor of sulci, cross one another and turn triangles of the middle over: there its vertices spread
/// along it until all triangles face outwards, and each has the curve through its new place. Levels then do not tell any more what the
/// closed surfaces enclose.
Ribbon unfolded(Ribbon ribbon, const WCurves& curves, Progress& progress);

/// The ribbon before its triangles were halved the last time; as it is when they never were.
Ribbon coarser(const Ribbon& ribbon);

/// A place of a ribbon, the same one on its outer surface, middle and inner surface.
struct RibbonPoint {
  std::uint32_t triangle = 0;
  Place weights = Place(1., 0., 0.);  // of its corners, in sum 1
};
Place on(const std::vector<Place>& level, const Ribbon& ribbon, const RibbonPoint& point);

/// The curve through a place of the middle, or where that does not arrive at both surfaces the one from the outer surface.
WCurve curve_at(const Ribbon& ribbon, const RibbonPoint& point, const WCurves& curves);

/// Finds places on a level of a ribbon, its middle unless told otherwise, outside its wall.
class RibbonLocator {
 public:
  explicit RibbonLocator(const Ribbon& ribbon);
  RibbonLocator(const Ribbon& ribbon, const std::vector<Place>& level);
  RibbonPoint nearest(const Place& to) const;

 private:
  const Ribbon& ribbon_;
  const std::vector<Place>& level_;
  std::vector<std::uint32_t> original_;  // triangle of the ribbon for each of the tree
  TriangleTree tree_;
};

struct RibbonOptions {
  double edge = 400.;             // µm: triangles are halved until their mean edge is no longer
  double least_thickness = 500.;  // µm: thinner places are no cortex where they make up a wall of
  double least_wall = 100e6;  // µm² or more; a thicker island in it is wall, too, if it is smaller than this
};

/// `outer` must be the surface that the curves' field has as its outer one.
/// Throws Error when over a hundredth of the curves outside the wall do not arrive: surfaces that are not of one cortex.
Ribbon make_ribbon(const Mesh& outer, const WCurves& curves, const RibbonOptions& options,
                   Progress& progress);

/// Volume between the outer and the inner surface under a triangle, µm³; those of neighbours fill space without gap or
/// overlap, so that all of them add up to what the closed surfaces enclose.
double volume_under(const Ribbon& ribbon, const Triangle& triangle);

}  // namespace forest::cortex
