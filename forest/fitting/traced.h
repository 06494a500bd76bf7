// SPDX-License-Identifier: Apache-2.0
// What a grammar is resampled from: stems and forks as they were traced, and what sets one neuron apart from another. Private to
// this room; resampling.h says what is made of it.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <map>
#include <numbers>
#include <span>
#include <vector>

#include "forest/core/vec.h"
#include "forest/lsystem/sample.h"
#include "forest/morphology/morphology.h"
#include "forest/statistics/arbors.h"

namespace forest::fitting {

// What sets the branches of one neuron apart from those of another, and the names that the grammar gives it. Stairs and kinks are how
// much its segments differ in how steep they are, and the angles between them.
namespace trait {
enum : std::size_t {
  reach,
  wander,
  girth,
  grain,
  slope,
  kink,
  stairs,
  kinks,
  depth,
  spread,
  thinning,
  extent,
  forks,
  count
};
}
inline constexpr std::array<const char*, trait::count> style_names{
    "reach", "wander", "girth",  "grain",    "slope",  "kink", "stairs",
    "kinks", "depth",  "spread", "thinning", "extent", "forks"};
// What is a tracer's habit rather than a neuron's.
constexpr bool habit(std::size_t style) { return style >= trait::grain && style <= trait::kinks; }
// What a grown neuron has of the neuron that was dealt, whose soma and tracer it has, and not of the mate or the third.
constexpr bool of_dealt(std::size_t style) { return style == trait::wander || habit(style); }
using Style = std::array<double, trait::count>;

inline constexpr double least_diameter = .05;  // µm: where none was measured
inline constexpr double least_length = .05;    // µm: so that none has a logarithm

inline constexpr std::size_t most_daughters = 3;  // of a fork; those with more are not learned from

inline constexpr int none = -1;  // no fork

struct Stem {
  std::size_t cell;
  int kind;
  double tips, ahead, length, end_diameter;  // ahead: path from its beginning to the farthest tip, µm
  Vec3 place, heading;                       // of its beginning, from the soma's centre
  Vec3 aim;                                  // the middle of its tips, from there
  std::vector<Point> points;
  int next = none;  // the fork at its end
};

struct Fork {
  std::size_t cell;
  int kind;
  double tips, ahead, path, order, diameter;  // of the branch that ends here; ahead: to its farthest tip, µm
  double side, height, depth;                 // from the soma: across, above and before it, µm
  Vec3 heading, aim;                          // aim: unit, towards the middle of its tips
  Vec3 last_step;                             // unit: of the branch that ends here
  // How far to the right of the way out from the soma it heads, in the plane of the slice.
  double lean() const {
    return (side * double(heading.y()) - height * double(heading.x())) /
           std::max(1., std::hypot(side, height, depth));
  }
  // By which angle about z its last step leaves its heading, degrees.
  double swerve() const {
    return std::atan2(double(heading.x() * last_step.y() - heading.y() * last_step.x()),
                      double(heading.x() * last_step.x() + heading.y() * last_step.y())) *
           180. / std::numbers::pi;
  }
  struct Daughter {
    double tips, ahead, length, end_diameter;
    Vec3 aim;  // the middle of its tips, from the fork
    std::vector<Point> points;
    int next = none;  // the fork at its end
  };
  std::vector<Daughter> daughters;  // fewest tips first
  // Of all its tips, from the fork.
  Vec3 middle() const {
    Vec3 sum = Vec3::Zero();
    double count = 0.;
    for (const Daughter& d : daughters) sum += float(d.tips) * d.aim, count += d.tips;
    return sum / float(count);
  }
  bool turned = false;  // … though the one with more came first
};

/// The spines of one kind of section of a neuron: how many per µm, and as means how far their heads are from the axis, and how wide
/// these and the necks are, µm; the spread is that of the logarithms of distances.
struct Spininess {
  double density = 0., reach = 0., head = 0., neck = 0., spread = 0.;
};

// What is true of one kind of section of a neuron.
struct Manner {
  Style style{};
  double thinnest = least_diameter;  // diameter, µm
  double farthest = 0.;              // end of a branch from the soma, µm
  double winding = .01;              // mean of the logarithm of path / chord
  double turn = .02;                 // mean angle from one segment to the next
  double level = 0.;                 // share of its segments that stay as high as they begin
  // How much the others differ in how steep they are, and those angles: standard deviations in shares of the mean.
  double stairs = .1, kinks = .1;
  double uneven = .1;  // … and how much its branches differ in how steep they are: likewise
  Spininess spines = {};
};

/// How many points have a diameter, µm.
using Diameters = std::map<double, std::size_t>;

/// How the outline of a soma, seen along z, is not round, by its Fourier series about the middle: a2, b2, a3 and b3 of its radius over the
/// mean one, 1 + a2 cos 2φ + b2 sin 2φ + a3 cos 3φ + b3 sin 3φ, φ from +x to +y. The second tell how long it is and
/// whither, the third how much of a triangle.
using Outline = std::array<double, 4>;

struct Cell {
  double soma = 0.;      // diameter, µm
  Outline outline = {};  // of a soma that was traced with one, or as cylinders
  double fibre = -1.;    // … of the point where it begins, when it has no soma, as an insect's tracing
  double low = 0., high = 0.;  // of its points, along z from the soma, µm
  std::map<int, Manner> kinds;
  std::map<int, Diameters> diameters = {};  // by kind
  std::vector<Stem> stems;
};

/// Of all neurons. Styles are in standard deviations from the mean of all neurons.
struct Traced {
  std::vector<Cell> cells;  // that have such sections
  std::vector<Fork> forks;
  std::map<int, Style> means, deviations;  // among cells, by kind
};

Traced learn(std::span<const Morphology> neurons, statistics::KindSet kinds);

/// How steep a branch is: the share of its length that goes along z, up or down.
double slope_of(std::span<const Point> points);

/// A branch from its beginning on.
std::vector<lsystem::Trace::Stop> stops_of(std::span<const Point> points);

}  // namespace forest::fitting
