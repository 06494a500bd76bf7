// SPDX-License-Identifier: Apache-2.0
// What the files of metrics share: their tables, and how a function of one element becomes a column.
#pragma once

#include <cmath>
#include <limits>
#include <numbers>
#include <span>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "forest/statistics/arbors.h"
#include "forest/statistics/metric.h"

namespace forest::statistics {

std::span<const Metric> metrics_of_neurons();
std::span<const Metric> metrics_of_arbors();
std::span<const Metric> metrics_of_sections();
std::span<const Metric> metrics_of_bifurcations();
std::span<const Metric> metrics_of_points();
std::span<const Metric> metrics_of_shells();
std::span<const Metric> metrics_of_bars();

inline constexpr bool axes_only = false, diameters_too = true;  // Metric::diameters

using Vector = Eigen::Vector3d;
using Values = std::vector<double>;
inline constexpr double nan = std::numeric_limits<double>::quiet_NaN();

template <double (*f)(const Arbors&)>
Values per_neuron(const Arbors& a) {
  return {f(a)};
}

/// f takes the stem.
template <double (*f)(const Arbors&, const Branch&)>
Values per_arbor(const Arbors& a) {
  Values values;
  values.reserve(a.stems().size());
  for (const std::uint32_t stem : a.stems()) values.push_back(f(a, a.section(stem)));
  return values;
}

template <double (*f)(const Arbors&, const Branch&)>
Values per_section(const Arbors& a) {
  Values values;
  values.reserve(a.sections().size());
  for (const Branch& b : a.sections()) values.push_back(f(a, b));
  return values;
}

template <double (*f)(const Arbors&, const Bifurcation&)>
Values per_bifurcation(const Arbors& a) {
  Values values;
  values.reserve(a.bifurcations().size());
  for (const Bifurcation& b : a.bifurcations()) values.push_back(f(a, b));
  return values;
}

/// f takes the columns and the row of the point; a section's first point is left out.
template <auto f>
Values per_point(const Arbors& a) {
  const Columns& c = a.columns();
  Values values(c.x.size() - a.sections().size());
  double* out = values.data();
  for (const Branch& b : a.sections())
    for (std::size_t row = b.first_row + 1; row <= b.last_row(); ++row) *out++ = f(c, row);
  return values;
}

/// Sums over each arbor what f says of its sections.
template <double (*f)(const Arbors&, const Branch&)>
Values sum_per_arbor(const Arbors& a) {
  Values sums(a.stems().size(), 0.);
  for (const Branch& b : a.sections()) sums[b.arbor] += f(a, b);
  return sums;
}

template <double (*f)(const Arbors&, const Branch&)>
double sum(const Arbors& a) {
  double total = 0.;
  for (const Branch& b : a.sections()) total += f(a, b);
  return total;
}

/// f where the section ends in a terminal, or in a bifurcation, and NaN elsewhere.
template <double (*f)(const Arbors&, const Branch&), std::uint32_t daughters>
double ending_in(const Arbors& a, const Branch& b) {
  return b.daughters == daughters ? f(a, b) : nan;
}
inline constexpr std::uint32_t terminal = 0, bifurcation_of = 2;

inline double ratio(double above, double below) { return below > 0. ? above / below : nan; }

inline Vector place(const Columns& c, std::size_t row) { return {c.x[row], c.y[row], c.z[row]}; }
inline Vector place(const Point& p) { return p.position().cast<double>(); }

inline double angle(const Vector& u, const Vector& v) {  // degrees
  if (u.isZero(0.) || v.isZero(0.)) return nan;
  return std::atan2(u.cross(v).norm(), u.dot(v)) * (180. / std::numbers::pi);
}

// Of sections, also summed over arbors and neurons.
inline double one(const Arbors&, const Branch&) { return 1.; }
inline double length(const Arbors&, const Branch& b) { return b.length; }
inline double area(const Arbors&, const Branch& b) { return b.area; }
inline double volume(const Arbors&, const Branch& b) { return b.volume; }
inline double is_terminal(const Arbors&, const Branch& b) { return b.daughters == 0; }
inline double is_bifurcation(const Arbors&, const Branch& b) { return b.daughters == 2; }
inline double order(const Arbors& a, const Branch& b) { return a.neuron().order(b.id); }
inline double radius_at_start(const Arbors& a, const Branch& b) { return a.columns().radius[b.first_row]; }

/// Path along one axis, whether forth or back.
template <auto column>
double length_along(const Arbors& a, const Branch& b) {
  const std::vector<double>& at = a.columns().*column;
  double along = 0.;
  for (std::size_t row = b.first_row + 1; row <= b.last_row(); ++row)
    along += std::abs(at[row] - at[row - 1]);
  return along;
}

/// The first point of a daughter repeats the branch point, often with the parent's radius: its own begins at the next.
inline double first_diameter(const Arbors& a, const Branch& b) {
  return 2. * a.columns().radius[b.first_row + (b.parent >= 0 ? 1 : 0)];
}
inline double last_diameter(const Arbors& a, const Branch& b) {
  return 2. * a.columns().radius[b.last_row()];
}

/// Of the line through the points (x, y) by least squares; NaN unless two x differ.
inline double regression_slope(std::span<const double> x, std::span<const double> y) {
  double mean_x = 0., mean_y = 0.;
  for (std::size_t i = 0; i < x.size(); ++i) mean_x += x[i], mean_y += y[i];
  mean_x /= double(x.size()), mean_y /= double(x.size());
  double xy = 0., xx = 0.;
  for (std::size_t i = 0; i < x.size(); ++i)
    xy += (x[i] - mean_x) * (y[i] - mean_y), xx += (x[i] - mean_x) * (x[i] - mean_x);
  return ratio(xy, xx);
}

}  // namespace forest::statistics
