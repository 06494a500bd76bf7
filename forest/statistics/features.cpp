// SPDX-License-Identifier: Apache-2.0
#include "forest/statistics/features.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <set>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/morphology/transform.h"
#include "forest/statistics/metric.h"
#include "forest/statistics/shared.h"
#include "forest/statistics/summary.h"

namespace forest::statistics {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

// Radii at which Sholl's curve is read, µm: dense where small arbors end, sparse where large ones do.
constexpr auto radii = std::to_array<double>({20, 40, 60, 80, 100, 150, 200, 300, 400, 600, 800, 1000, 1500});

// Metrics of parts whose values have long tails, so that the mean says little of the middle.
constexpr auto skewed = std::to_array<std::string_view>(
    {"section_lengths", "section_term_lengths", "section_bif_lengths", "section_end_distances",
     "section_tortuosity", "section_mean_radii", "daughter_ratio"});

// How steeply branches leave the plane of the slice, which is where a tracing is least sure: depth shrinks as the slice dries, and
// is read from a microscope's focus.
constexpr auto slopes = std::to_array<std::string_view>({"length_along_z_by_x", "length_fraction_along_z",
                                                         "section_length_fractions_along_z",
                                                         "segment_elevations", "level_segment_fraction"});

// What changes when the same cell is traced by more points; of points everything does.
constexpr auto dense = std::to_array<std::string_view>({"number_of_segments",
                                                        "level_segment_fraction",
                                                        "width",
                                                        "height",
                                                        "depth",
                                                        "surface",
                                                        "volume",
                                                        "aspect_ratio",
                                                        "section_taper_rates",
                                                        "taper_1",
                                                        "taper_2",
                                                        "fragmentation",
                                                        "fractal_dim",
                                                        "parent_daughter_ratio",
                                                        "diam_threshold",
                                                        "sibling_ratios",
                                                        "daughter_ratio",
                                                        "rall_power",
                                                        "pk",
                                                        "pk_classic",
                                                        "pk_2",
                                                        "diameter_power_relations",
                                                        "hillman_threshold",
                                                        "principal_direction_extents",
                                                        "principal_direction_extents_2",
                                                        "principal_direction_extents_3"});

// What else changes when it lies turned about the direction of the pia.
constexpr auto turned =
    std::to_array<std::string_view>({"total_width", "total_depth", "circularity", "shape_factor",
                                     "fractal_dimension_boxes", "trunk_vectors_x", "trunk_vectors_z",
                                     "trunk_origin_azimuths", "trunk_origin_elevations", "trunk_angles"});

// What one number tells better than a forest among all others, of what is measured together first: whether cells are too deep (a plane
// has two directions to turn a neuron in, so that lengths along one of them are what lengths along z can be measured by), and whether
// branches lie in the planes of focus that they were traced in.
struct Alone {
  std::string_view metric, name;
};
constexpr auto alone =
    std::to_array<Alone>({{"length_along_z_by_x", "depth"}, {"level_segment_fraction", "level"}});

// What repeats another metric, or tells the tracer and not the cell.
constexpr auto left_out =
    std::to_array<std::string_view>({"segment_midpoints_x", "segment_midpoints_y", "segment_midpoints_z",
                                     "euc_distance", "diameter", "type"});

const std::vector<const Metric*>& chosen() {
  static const std::vector<const Metric*> all = [] {
    std::vector<const Metric*> rows;
    for (const Metric& m : metrics())
      if (!std::ranges::count(left_out, m.name)) rows.push_back(&m);
    return rows;
  }();
  return all;
}

bool listed(std::span<const std::string_view> names, const Metric& m) {
  return std::ranges::count(names, m.name) > 0;
}

std::vector<Feature> columns_of(const Metric& m, const std::string& group) {
  const auto column = [&](std::string_view part, std::string_view unit) {
    return Feature{fmt::format("{} {}{}{}", group, m.name, part.empty() ? "" : " ", part), std::string(unit),
                   m.diameters, depends_on_points(m) || listed(turned, m) || listed(slopes, m),
                   listed(slopes, m)};
  };
  if (m.level == Level::neuron) return {column("", m.unit)};
  if (m.level == Level::shell) {
    std::vector<Feature> columns;
    for (const double r : radii) columns.push_back(column(fmt::format("at {} µm", r), m.unit));
    columns.push_back(column("sd of radius", "µm"));
    return columns;
  }
  std::vector<Feature> columns{column("mean", m.unit), column("sd", m.unit)};
  if (std::ranges::count(skewed, m.name)) columns.push_back(column("median", m.unit));
  return columns;
}

void add_sholl(std::span<const double> curve, std::vector<double>& row) {
  for (const double r : radii) {
    const auto shell = std::size_t(r / sholl_step) - 1;
    row.push_back(shell < curve.size() ? curve[shell] : 0.);
  }
  double sum = 0., first = 0., second = 0.;
  for (std::size_t i = 0; i < curve.size(); ++i) {
    const double r = double(i + 1) * sholl_step;
    sum += curve[i], first += r * curve[i], second += r * r * curve[i];
  }
  const double mean = sum > 0. ? first / sum : nan;
  row.push_back(sum > 0. ? std::sqrt(std::max(0., second / sum - mean * mean)) : nan);
}

/// The values of a column that are defined; NaN counts as none of them.
std::vector<double> defined_values(const Eigen::MatrixXd& values, Eigen::Index column) {
  std::vector<double> defined;
  for (const double x : values.col(column))
    if (std::isfinite(x)) defined.push_back(x);
  return defined;
}

bool same_column(const Eigen::MatrixXd& m, Eigen::Index a, Eigen::Index b) {
  for (Eigen::Index r = 0; r < m.rows(); ++r)
    if (m(r, a) != m(r, b) && !(std::isnan(m(r, a)) && std::isnan(m(r, b)))) return false;
  return true;
}

}  // namespace

bool depends_on_points(const Metric& metric) { return metric.level == Level::point || listed(dense, metric); }

std::vector<Group> groups_of(std::string_view word) {
  const KindSet chosen = kind_set(word);
  std::vector<Group> groups{{std::string(word), chosen}};
  for (const SectionKind kind : {SectionKind::basal, SectionKind::apical, SectionKind::axon})
    if (chosen.contains(kind) && !(chosen == KindSet{kind}))
      groups.push_back({std::string(name_of(kind)), KindSet{kind}});
  return groups;
}

std::vector<Feature> features_of(std::span<const Group> groups) {
  std::vector<Feature> features;
  for (const Group& group : groups)
    for (const Metric* m : chosen())
      for (Feature& column : columns_of(*m, group.name)) {
        const auto asked = std::ranges::find(alone, m->name, &Alone::metric);
        if (asked != alone.end() && &group == &groups.front()) column.alone = asked->name;
        features.push_back(std::move(column));
      }
  return features;
}

Measured measure(const Morphology& neuron, std::span<const Group> groups) {
  Measured measured;
  const Morphology placed = centred(neuron);
  for (const Group& group : groups) {
    const Arbors arbors(placed, group.kinds);
    const bool first = &group == &groups.front();
    if (first) {
      const auto bars = arbors.once<radial_barcodes>().bars();
      measured.bars.assign(bars.begin(), bars.end());
    }
    for (const Metric* metric : chosen()) {
      const Metric& m = *metric;
      const std::vector<double> values = m.values(arbors);
      if (m.level == Level::neuron) {
        measured.features.push_back(values.at(0));
      } else if (m.level == Level::shell) {
        if (first) measured.sholl = values;
        add_sholl(values, measured.features);
      } else {
        const Summary s = summarize(values);
        measured.features.push_back(s.mean);
        measured.features.push_back(s.count > 1 ? s.sd : nan);
        if (std::ranges::count(skewed, m.name)) measured.features.push_back(s.median);
      }
    }
  }
  for (double& x : measured.features)
    if (!std::isfinite(x)) x = nan;  // coordinates at the end of a float's range
  return measured;
}

FeatureTable table_of(std::vector<std::string> cells, std::span<const Group> groups,
                      std::span<const Measured> measured) {
  FeatureTable table{.cells = std::move(cells),
                     .features = features_of(groups),
                     .values = {},
                     .sholl = {},
                     .bars = {},
                     .slices = {}};
  table.values.resize(Eigen::Index(measured.size()), Eigen::Index(table.features.size()));
  for (std::size_t i = 0; i < measured.size(); ++i) {
    table.values.row(Eigen::Index(i)) =
        Eigen::Map<const Eigen::RowVectorXd>(measured[i].features.data(), table.values.cols());
    table.sholl.push_back(measured[i].sholl);
    table.bars.push_back(measured[i].bars);
  }
  return table;
}

FeatureTable stacked(std::span<const FeatureTable> tables) {
  FeatureTable all;
  if (tables.empty()) return all;
  all.features = tables.front().features;
  Eigen::Index rows = 0;
  for (const FeatureTable& t : tables) {
    if (t.features != all.features)
      throw Error("tables of different features cannot be compared; measure both alike");
    all.cells.insert(all.cells.end(), t.cells.begin(), t.cells.end());
    all.sholl.insert(all.sholl.end(), t.sholl.begin(), t.sholl.end());
    all.bars.insert(all.bars.end(), t.bars.begin(), t.bars.end());
    all.slices.insert(all.slices.end(), t.slices.begin(), t.slices.end());
    rows += t.values.rows();
  }
  all.values.resize(rows, Eigen::Index(all.features.size()));
  Eigen::Index at = 0;
  for (const FeatureTable& t : tables) {
    all.values.middleRows(at, t.values.rows()) = t.values;
    at += t.values.rows();
  }
  return all;
}

FeatureTable rows_of(const FeatureTable& table, std::span<const std::size_t> rows) {
  FeatureTable part{
      .cells = {}, .features = table.features, .values = {}, .sholl = {}, .bars = {}, .slices = {}};
  part.values.resize(Eigen::Index(rows.size()), table.values.cols());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    part.cells.push_back(table.cells[rows[i]]);
    if (!table.sholl.empty()) part.sholl.push_back(table.sholl[rows[i]]);
    if (!table.bars.empty()) part.bars.push_back(table.bars[rows[i]]);
    if (!table.slices.empty()) part.slices.push_back(table.slices[rows[i]]);
    part.values.row(Eigen::Index(i)) = table.values.row(Eigen::Index(rows[i]));
  }
  return part;
}

namespace {

FeatureTable columns_that(const FeatureTable& table, auto&& wanted) {
  FeatureTable part{.cells = table.cells,
                    .features = {},
                    .values = {},
                    .sholl = table.sholl,
                    .bars = table.bars,
                    .slices = table.slices};
  std::vector<Eigen::Index> columns;
  for (std::size_t i = 0; i < table.features.size(); ++i)
    if (wanted(table.features[i])) {
      columns.push_back(Eigen::Index(i));
      part.features.push_back(table.features[i]);
    }
  part.values = table.values(Eigen::all, columns);
  return part;
}

}  // namespace

FeatureTable structure_of(const FeatureTable& table) {
  return columns_that(table, [](const Feature& f) { return !f.diameters; });
}

FeatureTable branching_of(const FeatureTable& table) {
  return columns_that(table, [](const Feature& f) { return !f.diameters && !f.tracing; });
}

FeatureTable slopes_of(const FeatureTable& table) {
  return columns_that(table, [](const Feature& f) { return f.slope; });
}

FeatureTable distinct(const FeatureTable& table) {
  const Eigen::Index rows = table.values.rows();
  FeatureTable out{.cells = table.cells,
                   .features = {},
                   .values = {},
                   .sholl = table.sholl,
                   .bars = table.bars,
                   .slices = table.slices};
  out.values.resize(rows, 2 * table.values.cols());
  std::map<std::pair<double, double>, std::vector<Eigen::Index>>
      alike;  // columns by two sums, before all values
  Eigen::Index count = 0;
  // Keeps the column that was just put behind the others, unless it has been said.
  const auto keep = [&](Feature feature, std::span<const double> values) {
    double sum = 0., squares = 0.;
    for (const double x : values) sum += x, squares += x * x;
    auto& others = alike[{sum, squares}];
    for (const Eigen::Index other : others)
      if (same_column(out.values, other, count)) return;
    others.push_back(count++);
    out.features.push_back(std::move(feature));
  };
  std::set<std::vector<bool>> missing;
  for (Eigen::Index c = 0; c < table.values.cols(); ++c) {
    const Feature& feature = table.features[std::size_t(c)];
    const std::vector<double> values = defined_values(table.values, c);
    if (values.empty()) continue;
    const bool rare = 20 * Eigen::Index(values.size()) < rows;
    if (!rare && std::ranges::min(values) != std::ranges::max(values)) {
      out.values.col(count) = table.values.col(c);
      keep(feature, values);
    }
    if (Eigen::Index(values.size()) == rows) continue;
    std::vector<bool> defined;
    for (const double x : table.values.col(c)) defined.push_back(std::isfinite(x));
    if (!missing.insert(defined).second) continue;
    for (Eigen::Index r = 0; r < rows; ++r) out.values(r, count) = defined[std::size_t(r)];
    keep({feature.name + " is defined", "", feature.diameters, feature.slope},
         std::span(out.values.col(count).data(), std::size_t(rows)));
  }
  out.values.conservativeResize(rows, count);
  return out;
}

FeatureTable completed(const FeatureTable& table) {
  FeatureTable out = distinct(table);
  for (Eigen::Index c = 0; c < out.values.cols(); ++c) {
    const std::vector<double> values = defined_values(out.values, c);
    if (Eigen::Index(values.size()) == out.values.rows()) continue;
    const double middle = summarize(values).median;
    for (double& x : out.values.col(c))
      if (!std::isfinite(x)) x = middle;
  }
  return out;
}

std::vector<std::size_t> unlike(const FeatureTable& table, std::span<const std::size_t> order,
                                std::size_t count) {
  const Eigen::Index n = table.values.rows();
  const auto ranks = [&](std::size_t column) -> Eigen::VectorXd {
    std::vector<Eigen::Index> rows(static_cast<std::size_t>(n));
    std::iota(rows.begin(), rows.end(), Eigen::Index(0));
    const auto values = table.values.col(Eigen::Index(column));
    std::ranges::sort(rows, {}, [&](Eigen::Index r) { return values[r]; });
    Eigen::VectorXd rank(n);
    for (std::size_t i = 0, j = 0; i < rows.size(); i = j) {  // equal values share their mean rank
      while (j < rows.size() && values[rows[j]] == values[rows[i]]) ++j;
      for (std::size_t k = i; k < j; ++k) rank[rows[k]] = .5 * double(i + j - 1);
    }
    rank.array() -= rank.mean();
    return rank.normalized();
  };
  std::vector<std::size_t> chosen;
  std::vector<Eigen::VectorXd> said;
  for (const std::size_t column : order) {
    if (chosen.size() == count) break;
    Eigen::VectorXd rank = ranks(column);
    if (std::ranges::any_of(said,
                            [&](const Eigen::VectorXd& other) { return std::abs(rank.dot(other)) > .8; }))
      continue;
    chosen.push_back(column);
    said.push_back(std::move(rank));
  }
  return chosen;
}

Eigen::MatrixXd standardised(const FeatureTable& table) {
  Eigen::MatrixXd X = table.values.rowwise() - table.values.colwise().mean();
  const double n = double(std::max<Eigen::Index>(X.rows() - 1, 1));
  for (Eigen::Index c = 0; c < X.cols(); ++c) {
    const double sd = std::sqrt(X.col(c).squaredNorm() / n);
    if (sd > 0.) X.col(c) /= sd;
  }
  return X;
}

}  // namespace forest::statistics
