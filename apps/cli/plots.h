// SPDX-License-Identifier: Apache-2.0
// Plots of populations as SVG, for reports. Text and axes take the colour of the page (currentColor), so that they show on
// dark and light ones; data has the colours of Okabe & Ito, which colour-blind eyes tell apart.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace forest::cli {

/// The colour of the i-th population, "#0072B2".
std::string_view colour_of(std::size_t i);

/// A value with its interval in a row of its own: effect sizes, areas under curves.
struct IntervalRow {
  std::string label;
  double value, lower, upper;
  std::string note = {};  // right of the row
  std::size_t colour = 0;
  bool faint = false;  // not significant
};

struct IntervalAxis {
  double low, high;                          // at least: it is as long as the rows need
  std::vector<double> marks;                 // lines across all rows
  std::string title, left = {}, right = {};  // what the ends mean
};

std::string interval_plot(std::span<const IntervalRow> rows, const IntervalAxis& axis);

/// One value in several populations: every cell a dot, in the order of size apart where dots would touch, with its density,
/// median and quartiles.
struct StripPanel {
  std::string title, unit;
  std::vector<std::vector<double>> samples;
  std::optional<double> marked = {};  // a single cell
};

struct StripKeys {
  std::vector<std::size_t> colours = {};  // of the populations; none: in their order
  std::string marked = {};                // what the marked cell is called
};

std::string strip_plots(std::span<const StripPanel> panels, std::span<const std::string> names,
                        const StripKeys& more = {});

/// Mean curves over x = step, 2 step, …, each with a band or without.
struct CurveLine {
  std::string name;
  std::vector<double> values, lower = {}, upper = {};
  std::size_t colour = 0;
};

std::string curve_plot(std::span<const CurveLine> lines, double step, const std::string& x_title,
                       const std::string& y_title);

/// Cells in a plane.
struct Dot {
  double x, y;
  std::size_t colour;
  std::string name;  // shown under the pointer
  bool ring = false;
};

std::string scatter_plot(std::span<const Dot> dots, std::span<const std::string> names,
                         const std::string& x_title, const std::string& y_title);

/// Pictures of side × side values, the first axis fastest, upwards; shades of a population's colour, or from one to the
/// other of two.
struct HeatPanel {
  std::string title;
  std::vector<double> values;
  std::size_t colour = 0;
  bool difference = false;  // negative in colour 0, positive in colour 1
};

std::string heat_plots(std::span<const HeatPanel> panels, std::size_t side, double reach,
                       const std::string& x_title, const std::string& y_title);

/// Values as bars, and the density that was fitted to them. Atoms, values that come back exactly, are lines with their share and
/// count in no bar; bars and curve have the area that atoms leave to 1. Shares of a twentieth and more are written beside them.
struct DensityPanel {
  std::string title, unit, note;
  std::vector<double> values;
  std::function<double(double)> density;
  std::vector<std::pair<double, double>> atoms = {};  // value, share
  double step = 0.;                                   // values are whole multiples of this; 0: they are not
  double origin = 0.;                                 // from which the density counts: where a bar begins
};

std::string density_plots(std::span<const DensityPanel> panels);

/// How often chance reached which value, and what was found.
std::string chance_plot(std::span<const double> null, double found, double lower, double upper,
                        const std::string& title);

}  // namespace forest::cli
