// SPDX-License-Identifier: Apache-2.0
// Of each point but the first of a section, and of the segment that ends in it: L-Measure's compartment.
#include <algorithm>
#include <array>
#include <cmath>

#include "forest/core/clones.h"
#include "forest/statistics/angles.h"
#include "forest/statistics/metric_table.h"

namespace forest::statistics {
namespace {

constexpr double pi = std::numbers::pi;

template <auto column>
double at_end(const Columns& c, std::size_t row) {
  return (c.*column)[row];
}
template <auto column>
double at_middle(const Columns& c, std::size_t row) {
  return 0.5 * ((c.*column)[row - 1] + (c.*column)[row]);
}

double segment_area(const Columns& c, std::size_t row) {
  const double taper = c.radius[row] - c.radius[row - 1], length = c.length[row];
  return pi * (c.radius[row - 1] + c.radius[row]) * std::sqrt(length * length + taper * taper);
}
double segment_volume(const Columns& c, std::size_t row) {
  const double r = c.radius[row - 1], s = c.radius[row];
  return pi / 3. * c.length[row] * (r * r + r * s + s * s);
}
double segment_taper_rate(const Columns& c, std::size_t row) {
  return ratio(2. * std::abs(c.radius[row] - c.radius[row - 1]), c.length[row]);
}
double segment_elevation(const Columns& c, std::size_t row) {
  if (!(c.length[row] > 0.)) return nan;
  return std::asin(std::min(1., std::abs(c.z[row] - c.z[row - 1]) / c.length[row])) * (180. / pi);
}
double diameter(const Columns& c, std::size_t row) { return 2. * c.radius[row]; }
double diameter_pow(const Columns& c, std::size_t row) {
  const double d = 2. * c.radius[row];
  return d * std::sqrt(d);
}
double section_area(const Columns& c, std::size_t row) { return pi * c.radius[row] * c.radius[row]; }

Values radial_distances(const Arbors& a) {
  const Columns& c = a.columns();
  Values values(c.x.size() - a.sections().size());
  double* out = values.data();
  for (const Branch& b : a.sections()) {
    const std::size_t start = a.section(a.stems()[b.arbor]).first_row;
    const double ox = 2. * c.x[start], oy = 2. * c.y[start], oz = 2. * c.z[start];
    for (std::size_t row = b.first_row + 1; row <= b.last_row(); ++row) {
      const double x = c.x[row - 1] + c.x[row] - ox, y = c.y[row - 1] + c.y[row] - oy,
                   z = c.z[row - 1] + c.z[row] - oz;
      *out++ = 0.5 * std::sqrt(x * x + y * y + z * z);
    }
  }
  return values;
}

/// Of each row and the two before it: sine and cosine, times the same factor, of the angle between the ways back and on
/// from the point in the middle.
FOREST_CLONES void openings(std::size_t count, const double* __restrict x, const double* __restrict y,
                            const double* __restrict z, double* __restrict sine, double* __restrict cosine) {
  for (std::size_t i = 2; i < count; ++i) {
    const double ax = x[i - 2] - x[i - 1], ay = y[i - 2] - y[i - 1], az = z[i - 2] - z[i - 1];
    const double bx = x[i] - x[i - 1], by = y[i] - y[i - 1], bz = z[i] - z[i - 1];
    const double cx = ay * bz - az * by, cy = az * bx - ax * bz, cz = ax * by - ay * bx;
    sine[i] = std::sqrt(cx * cx + cy * cy + cz * cz);
    cosine[i] = ax * bx + ay * by + az * bz;
  }
}

/// A value of each row as values of points: of a section's first `without` points none.
Values points_of(const Arbors& a, const std::vector<double>& rows, std::size_t without) {
  Values values(rows.size() - a.sections().size());
  double* out = values.data();
  for (const Branch& b : a.sections())
    for (std::size_t row = b.first_row + 1; row <= b.last_row(); ++row)
      *out++ = row < b.first_row + without ? nan : rows[row];
  return values;
}

Values meander_angles(const Arbors& a) {
  const Columns& c = a.columns();
  std::vector<double> sine(c.x.size(), 0.), cosine(c.x.size(), 0.);
  openings(c.x.size(), c.x.data(), c.y.data(), c.z.data(), sine.data(), cosine.data());
  angles_of(c.x.size(), sine.data(), cosine.data(), sine.data());
  return points_of(a, sine, 2);
}

/// Of each row and the three before it, (A × B) · C / (3 |A| |B| |C|) of the segments A, B, C between them.
FOREST_CLONES void helices(std::size_t count, const double* __restrict x, const double* __restrict y,
                           const double* __restrict z, const double* __restrict length,
                           double* __restrict helix) {
  for (std::size_t i = 3; i < count; ++i) {
    const double ax = x[i - 2] - x[i - 3], ay = y[i - 2] - y[i - 3], az = z[i - 2] - z[i - 3];
    const double bx = x[i - 1] - x[i - 2], by = y[i - 1] - y[i - 2], bz = z[i - 1] - z[i - 2];
    const double cx = x[i] - x[i - 1], cy = y[i] - y[i - 1], cz = z[i] - z[i - 1];
    const double volume = (ay * bz - az * by) * cx + (az * bx - ax * bz) * cy + (ax * by - ay * bx) * cz;
    helix[i] = volume / (3. * length[i - 2] * length[i - 1] * length[i]);  // 0 / 0, NaN, without length
  }
}

Values helix(const Arbors& a) {
  const Columns& c = a.columns();
  std::vector<double> rows(c.x.size(), 0.);
  helices(c.x.size(), c.x.data(), c.y.data(), c.z.data(), c.length.data(), rows.data());
  return points_of(a, rows, 3);
}

Values in_terminal_section(const Arbors& a) {
  Values values;
  values.reserve(a.columns().x.size() - a.sections().size());
  for (const Branch& b : a.sections()) values.insert(values.end(), b.row_count - 1, b.daughters == 0);
  return values;
}

using enum Level;

// clang-format off
constexpr auto table = std::to_array<Metric>({
    {"segment_lengths", "µm", point, axes_only, per_point<at_end<&Columns::length>>,
     "Length of the segment.", "NeuroM", ""},
    {"segment_areas", "µm²", point, diameters_too, per_point<segment_area>,
     "Lateral area of the segment as a truncated cone of length l and radii r and s: π (r + s) √(l² + (r - s)²).", "NeuroM", ""},
    {"segment_volumes", "µm³", point, diameters_too, per_point<segment_volume>,
     "Volume of the segment as a truncated cone of length l and radii r and s: π l (r² + r s + s²) / 3.", "NeuroM", ""},
    {"segment_radii", "µm", point, diameters_too, per_point<at_middle<&Columns::radius>>,
     "Mean of the radii at both ends of the segment.", "NeuroM", ""},
    {"segment_taper_rates", "", point, diameters_too, per_point<segment_taper_rate>,
     "Change of diameter along the segment over its length, without its sign.", "NeuroM", ""},
    {"segment_meander_angles", "°", point, axes_only, meander_angles,
     "Angle at the segment's start between the ways back and on: 180 where the section runs straight; none at a section's first segment.", "NeuroM", ""},
    {"segment_elevations", "°", point, axes_only, per_point<segment_elevation>,
     "Angle of the segment with the x-y plane, without its sign; none where it has no length.", "", ""},
    {"segment_midpoints_x", "µm", point, axes_only, per_point<at_middle<&Columns::x>>,
     "x coordinate of the middle of the segment.", "NeuroM", ""},
    {"segment_midpoints_y", "µm", point, axes_only, per_point<at_middle<&Columns::y>>,
     "y coordinate of the middle of the segment.", "NeuroM", ""},
    {"segment_midpoints_z", "µm", point, axes_only, per_point<at_middle<&Columns::z>>,
     "z coordinate of the middle of the segment.", "NeuroM", ""},
    {"segment_path_lengths", "µm", point, axes_only, per_point<at_end<&Columns::path>>,
     "Way along the neurite from where it leaves the soma to the point.", "NeuroM", ""},
    {"segment_radial_distances", "µm", point, axes_only, radial_distances,
     "Straight distance of the middle of the segment from the start of its arbor.", "NeuroM", ""},
    {"euc_distance", "µm", point, axes_only, per_point<at_end<&Columns::distance>>,
     "Straight distance of the point from the centre of the soma.", "Scorcioni et al. 2008", ""},
    {"x", "µm", point, axes_only, per_point<at_end<&Columns::x>>,
     "x coordinate of the point; y and z are rows of their own.", "Scorcioni et al. 2008", "XYZ"},
    {"y", "µm", point, axes_only, per_point<at_end<&Columns::y>>,
     "y coordinate of the point.", "", ""},
    {"z", "µm", point, axes_only, per_point<at_end<&Columns::z>>,
     "z coordinate of the point.", "", ""},
    {"diameter", "µm", point, diameters_too, per_point<diameter>,
     "Diameter at the point.", "Scorcioni et al. 2008", "Diameter"},
    {"diameter_pow", "µm^1.5", point, diameters_too, per_point<diameter_pow>,
     "Diameter at the point to the power 3/2.", "Rall 1959", "Diameter_pow"},
    {"section_area", "µm²", point, diameters_too, per_point<section_area>,
     "Area of the cross section at the point, π r².", "Scorcioni et al. 2008", "SectionArea"},
    {"helix", "", point, axes_only, helix,
     "(A × B) · C / (3 abs(A) abs(B) abs(C)) of three segments A, B, C that follow one another in a section and end in the point: positive where it winds as a right-handed screw.", "Scorcioni et al. 2008", "Helix"},
    {"terminal_segment", "", point, axes_only, in_terminal_section,
     "1 on sections that end in a terminal, 0 elsewhere.", "Scorcioni et al. 2008", "TerminalSegment"},
});
// clang-format on

}  // namespace

std::span<const Metric> metrics_of_points() { return table; }

}  // namespace forest::statistics
