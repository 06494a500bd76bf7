// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/report.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "forest/core/parallel.h"

namespace forest::cortex {

FaceDistance face_distance(const Elements& elements, double w, const TriangleTree& surface) {
  constexpr std::array<std::array<double, 2>, 4> at{{{.5, .17}, {.83, .5}, {.5, .83}, {.17, .5}}};
  std::vector<double> far(at.size() * elements.size());
  parallel_for(elements.size(), 64, [&](std::size_t e) {
    const Hexahedron h = elements.hexahedron(e);
    for (std::size_t k = 0; k < at.size(); ++k)
      far[at.size() * e + k] = surface.nearest(h.at(at[k][0], at[k][1], w))->distance;
  });
  if (far.empty()) return {};
  FaceDistance result;
  const auto most = std::max_element(far.begin(), far.end());
  result.most = *most, result.farthest = std::size_t(most - far.begin()) / at.size();
  result.p99 = share_of(far, .99);
  return result;
}

Report report(const Cortex& cortex, double wanted, const TriangleTree* outer, const TriangleTree* inner,
              Progress& progress) {
  const Elements& elements = cortex.elements;
  const std::size_t n = elements.size();
  Report result;
  result.elements = n;
  if (n == 0) return result;
  std::vector<double> volumes(n), equivolume(n), bulge(n), jacobian(n);
  std::vector<std::uint8_t> bad(n);
  progress.begin("measuring elements", n);
  parallel_ranges(n, 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t e = begin; e < end; ++e) {
      const Hexahedron h = elements.hexahedron(e);
      bad[e] = !certify(h).positive();
      volumes[e] = h.volume();
      equivolume[e] = depth_error(elements, e);
      bulge[e] = layer_bulge(elements, e);
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
  result.bulge_most = *std::max_element(bulge.begin(), bulge.end());
  result.bulge_p99 = share_of(bulge, .99);
  result.jacobian_least = *std::min_element(jacobian.begin(), jacobian.end());
  result.jacobian_p1 = share_of(jacobian, .01);
  if (outer) result.outer = face_distance(elements, 0., *outer);
  if (inner) result.inner = face_distance(elements, 1., *inner);

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
    if (!angles.empty()) result.crest_angle = spread_of(angles);
  }
  return result;
}

}  // namespace forest::cortex
