// SPDX-License-Identifier: Apache-2.0
// Sections of a cortex: parallel planes, and in each the closed curves that bound the tissue, of one or more surfaces. They
// come from cutting surfaces, from volumes, or from people who traced them; they go to reconstruction (surfaces.h).
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "forest/geometry/bezier.h"
#include "forest/geometry/mesh.h"

namespace forest {
class Progress;
}

namespace forest::cortex {

/// Across the planes. Of a human brain in the usual coordinates: x sagittal, y coronal, z horizontal sections.
enum class Axis : std::uint8_t { x, y, z };

/// In a plane the two other axes in their order: (y, z), (x, z) or (x, y).
constexpr std::array<int, 2> flat_axes(Axis axis) {
  return {axis == Axis::x ? 1 : 0, axis == Axis::z ? 1 : 2};
}
Place flat(const Eigen::Vector3d& point, Axis axis);
Eigen::Vector3d solid(const Place& place, double at, Axis axis);

/// One closed curve. Walking along it one has the inside of its surface to the left, as the plane's axes are drawn: around a
/// hole it runs clockwise.
struct Contour {
  std::uint32_t object = 0;  // which surface it is of: ContourStack::objects
  BezierLoop curve;          // µm

  friend bool operator==(const Contour&, const Contour&) = default;
};

struct Section {
  double at = 0.;  // µm, along the axis
  std::vector<Contour> contours;

  friend bool operator==(const Section&, const Section&) = default;
};

struct ContourStack {
  Axis axis = Axis::y;
  std::vector<std::string> objects;  // "outer", "inner", or what the file says
  std::vector<Section> sections;     // `at` ascends

  friend bool operator==(const ContourStack&, const ContourStack&) = default;
};

// µm: what reaches farther, or not as far, has another unit. A whale's is .3 m long, a fruit fly's .6 mm wide.
inline constexpr double largest_brain = 1e6, smallest_brain = 500.;

/// What is wrong with the numbers of a stack, in one sentence; empty when nothing is. Tested are that they are finite, that sections
/// ascend, and that no axis reaches farther than the largest brain. Takes no time, and what has another unit would take long.
std::string fault_of_numbers(const ContourStack& stack);

/// How far sections and contours reach, along the axis that is longest; µm, 0 without any.
double extent(const ContourStack& stack);

/// What is said of a stack that reaches less far than the smallest brain, in one sentence; empty of others. No fault of a stack: cells
/// that were traced in electron micrographs are such.
std::string too_small_for_a_brain(const ContourStack& stack);

/// As fault_of_numbers, and what is wrong with contours, with object, section and place: no contour of an object crosses itself or another
/// one of it, and none is there twice. On all cores.
std::string fault_of(const ContourStack& stack);

/// How often contours of two objects cross, or of one and the same.
struct Crossings {
  std::uint32_t object = 0, other = 0;  // object <= other
  std::size_t places = 0, sections = 0;
  std::size_t section = 0;      // the first
  Place place = Place::Zero();  // µm, in that section the leftmost
};
/// Of all objects that do, also of different ones: there the tissue between the two has no thickness. By object, then by the
/// other. On all cores.
std::vector<Crossings> crossings(const ContourStack& stack);

/// All sections, and in them the contours of these objects alone. Throws Error for an object that the stack has not.
ContourStack only(const ContourStack& stack, std::span<const std::string> objects);

/// Where planes stand: at multiples of `spacing` (µm, > 0) moved by `offset`, all that lie within [low, high].
std::vector<double> planes_between(double low, double high, double spacing, double offset = 0.);

/// Cuts a closed surface: straight loops, one corner an edge that is cut. A vertex within a plane counts as above it, so
/// that loops always close. Parts of the surface may hide in others (sections then hold loops within loops).
/// Throws Error where the surface has a border, with the place.
ContourStack cut(const Mesh& surface, const std::string& object, Axis axis, std::span<const double> planes);

/// The stacks as one; their sections must be at the same places and their objects have names of their own. Throws Error.
ContourStack together(std::span<const ContourStack> stacks);

struct FitSummary {
  std::size_t contours = 0, pieces = 0, corners = 0;
  double length = 0.;              // µm
  double rms = 0., greatest = 0.;  // µm, over all contours
};
/// Every polygon by the fewest cubics that lie along it (fit_loop), closer around places where curves of an object would cross
/// and what was given does not; where that does not help the polygon is kept. What is curves already stays as it is, bit for
/// bit. On all cores.
ContourStack fitted(const ContourStack& stack, const FitOptions& options, FitSummary& summary,
                    Progress& progress);

}  // namespace forest::cortex
