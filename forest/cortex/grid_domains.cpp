// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/grid_domains.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "forest/cortex/named_row.h"

namespace forest::cortex {
namespace {

using Place = Eigen::Vector3d;
constexpr double pi = std::numbers::pi;

double bump(double t) { return 4. * t * (1. - t); }  // 1 in the middle, 0 at both ends
double dent(double s, double t) { return std::pow(bump(s) * bump(t), 2.); }
double tent(double t) { return 1. - std::abs(2. * t - 1.); }

// The boundary of a plane block by its four sides.
template <class Bottom, class Top, class Left, class Right>
Place sides(double u, double v, Bottom&& bottom, Top&& top, Left&& left, Right&& right) {
  if (v == 0.) return bottom(u);
  if (v == 1.) return top(u);
  return u == 0. ? left(v) : right(v);
}

// Knupp & Steinberg's: bottom (ξ, 0), top (ξ, 1 − 3ξ + 3ξ²), left (0, η), right (1 + 2η − 2η², η).
Place swan(double u, double v, double) {
  return {u == 1. ? 1. + 2. * v - 2. * v * v : u, v == 1. ? 1. - 3. * u + 3. * u * u : v, 0.};
}
Place chevron(double u, double v, double) { return {u, v - .5 * tent(u), 0.}; }
// Half of an elliptic ring, four times as long as wide.
Place horseshoe(double u, double v, double) {
  const double r = 1. + u, angle = pi * v;
  return {r * std::cos(angle), 4. * r * std::sin(angle), 0.};
}
Place dome(double u, double v, double) {
  return sides(
      u, v, [](double s) { return Place(s, 0., 0.); },
      [](double s) {
        const double angle = pi * (1. - s);
        return Place(.5 + .5 * std::cos(angle), .5 + .5 * std::sin(angle), 0.);
      },
      [](double t) { return Place(0., .5 * t, 0.); }, [](double t) { return Place(1., .5 * t, 0.); });
}
// A sulcus: the top runs down to a tenth of the height and up again.
Place valley(double u, double v, double) {
  return sides(
      u, v, [](double s) { return Place(s, 0., 0.); },
      [](double s) {
        const double t = std::abs(2. * s - 1.);  // 1 at the rim, 0 in the fundus
        return Place(.5 + (s < .5 ? -.5 : .5) * std::pow(t, 1.3), .1 + .9 * std::pow(t, 1.6), 0.);
      },
      [](double t) { return Place(0., t, 0.); }, [](double t) { return Place(1., t, 0.); });
}
// The upper side of a thick symmetric wing below half an ellipse.
Place airfoil(double u, double v, double) {
  const auto thickness = [](double x) {
    return 1.5 *
           (.2969 * std::sqrt(x) - .126 * x - .3516 * x * x + .2843 * x * x * x - .1036 * x * x * x * x);
  };
  return sides(
      u, v,
      [&](double s) {
        const double x = 3. * s - 1.;  // the wing from 0 to 1
        return Place(x, s < 1. / 3. || s > 2. / 3. ? 0. : thickness(x), 0.);
      },
      [](double s) { return Place(.5 - 1.5 * std::cos(pi * s), std::sin(pi * s) + .5, 0.); },
      [](double t) { return Place(-1., .5 * t, 0.); }, [](double t) { return Place(2., .5 * t, 0.); });
}
// A channel whose floor drops by a step.
Place backstep(double u, double v, double) {
  return sides(
      u, v,
      [](double s) {
        const double way = 3.5 * s;  // 1 along, ½ down, 2 along
        if (way < 1.) return Place(way, .5, 0.);
        if (way < 1.5) return Place(1., 1.5 - way, 0.);
        return Place(way - .5, 0., 0.);
      },
      [](double s) { return Place(3. * s, 1., 0.); }, [](double t) { return Place(0., .5 + .5 * t, 0.); },
      [](double t) { return Place(3., t, 0.); });
}
// A square into whose left side a wedge is driven.
Place plow(double u, double v, double) {
  return sides(
      u, v, [](double s) { return Place(s, 0., 0.); }, [](double s) { return Place(s, 1., 0.); },
      [](double t) { return Place(.7 * tent(t), t, 0.); }, [](double t) { return Place(1., t, 0.); });
}
Place trapezoid(double u, double v, double) { return {(1. - .8 * v) * u + .2 * v, v, 0.}; }
// Three quarters of a ring, whose inner points run faster at first than the outer ones.
Place annulus(double u, double v, double) {
  const double r = .3 + .7 * u, even = v, uneven = v + .25 * std::sin(pi * v);
  const double angle = 1.5 * pi * ((1. - u) * uneven + u * even);
  return {r * std::cos(angle), r * std::sin(angle), 0.};
}
// A square whose top and bottom bend the same way by more than its height.
Place bow(double u, double v, double) {
  return sides(
      u, v, [](double s) { return Place(s, 1.6 * s * (1. - s), 0.); },
      [](double s) { return Place(s, .25 + 3.2 * s * (1. - s), 0.); },
      [](double t) { return Place(0., .25 * t, 0.); }, [](double t) { return Place(1., .25 * t, 0.); });
}
// A square with a re-entrant notch in its top, and a tooth in its right side.
Place notch(double u, double v, double) {
  return sides(
      u, v, [](double s) { return Place(s, 0., 0.); },
      [](double s) { return Place(s, 1. - .75 * std::exp(-std::pow((s - .35) / .12, 2.)) * bump(s), 0.); },
      [](double t) { return Place(0., t, 0.); },
      [](double t) { return Place(1. - .4 * std::exp(-std::pow((t - .45) / .15, 2.)) * bump(t), t, 0.); });
}

// In space the faces of a cube, moved by what vanishes on its edges.
Place swan_block(double u, double v, double w) {  // its slice in the middle is the swan
  return {u == 1. ? 1. + .5 * bump(v) * bump(w) : u, v == 1. ? 1. - .75 * bump(u) * bump(w) : v, w};
}
Place chevron_block(double u, double v, double w) {
  return {u, v - .5 * tent(u), w + .25 * tent(u) * tent(v)};
}
Place horseshoe_tube(double u, double v, double w) {  // half of a ring with a square section
  const double r = 1. + u, angle = pi * v;
  return {r * std::cos(angle), 2. * r * std::sin(angle), w};
}
Place dome_block(double u, double v, double w) { return {u, v, w == 1. ? 1. + 1.2 * bump(u) * bump(v) : w}; }
Place valley_block(double u, double v, double w) {  // a dent nearly through the block
  return {u, v, w == 1. ? 1. - .85 * bump(u) * bump(u) * bump(v) : w};
}
Place pressed_block(double u, double v, double w) {  // two dents in neighbouring sides
  return {u == 1. ? 1. - .35 * dent(v, w) : u, v, w == 1. ? 1. - .45 * dent(u, v) : w};
}
Place screw(double u, double v, double w) {  // the top turned by 110°
  const double angle = 110. * pi / 180. * w, x = u - .5, y = v - .5;
  return {std::cos(angle) * x - std::sin(angle) * y, std::sin(angle) * x + std::cos(angle) * y, 1.5 * w};
}
// Cortex over the crown of a gyrus, and around the fundus of a sulcus: w from the pia to the white matter, mm.
Place crown(double u, double v, double w) {
  const double r = 2.9 - 2.5 * w, angle = (u - .5) * (1.9 + .5 * v);
  return {-r * std::sin(angle), v, r * std::cos(angle)};
}
Place fundus(double u, double v, double w) {
  const double r = .25 + 2.2 * w, angle = (u - .5) * (2.6 - .4 * v);
  return {-r * std::sin(angle), v, -r * std::cos(angle)};
}

}  // namespace

std::span<const Domain> domains() {
  static constexpr auto table = std::to_array<Domain>({
      {"swan", "a side that bulges beside a side that sinks in (Knupp & Steinberg's formula)", true, swan},
      {"chevron", "bent by a corner", true, chevron},
      {"horseshoe", "half of an elliptic ring", true, horseshoe},
      {"dome", "below half a circle, whose ends continue the sides", true, dome},
      {"valley", "a top that sinks to a tenth of the height, and rises again", true, valley},
      {"airfoil", "around the upper side of a wing", true, airfoil},
      {"backstep", "a channel whose floor drops by a step", true, backstep},
      {"plow", "a square with a wedge driven into a side", true, plow},
      {"trapezoid", "straight, five times as wide below as above", true, trapezoid},
      {"annulus", "three quarters of a ring, inner and outer points uneven", true, annulus},
      {"bow", "a thin arch that thickens", true, bow},
      {"notch", "a notch from above and a tooth from the side", true, notch},
      {"swan-block", "a cube whose slice in the middle is the swan", false, swan_block},
      {"chevron-block", "bent by corners", false, chevron_block},
      {"horseshoe-tube", "half of a ring with a square section", false, horseshoe_tube},
      {"dome-block", "a cube below a dome", false, dome_block},
      {"valley-block", "a cube with a dent nearly through", false, valley_block},
      {"pressed-block", "a cube with two dents", false, pressed_block},
      {"screw", "a prism turned by 110°", false, screw},
      {"crown", "cortex over the crown of a gyrus", false, crown},
      {"fundus", "cortex around the fundus of a sulcus", false, fundus},
  });
  return table;
}

const Domain& domain(std::string_view name) { return named_row(domains(), name, "domain"); }

Grid boundary(const Domain& domain, const std::array<int, 3>& steps) {
  Grid grid{{steps[0] + 1, steps[1] + 1, domain.plane ? 1 : steps[2] + 1}, {}};
  grid.points.assign(std::size_t(grid.size[0]) * std::size_t(grid.size[1]) * std::size_t(grid.size[2]),
                     Place::Zero());
  for (int k = 0; k < grid.size[2]; ++k)
    for (int j = 0; j < grid.size[1]; ++j)
      for (int i = 0; i < grid.size[0]; ++i)
        if (grid.on_boundary(i, j, k))
          grid.point(i, j, k) =
              domain.at(double(i) / steps[0], double(j) / steps[1], domain.plane ? 0. : double(k) / steps[2]);
  return grid;
}

}  // namespace forest::cortex
