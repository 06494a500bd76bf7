// SPDX-License-Identifier: Apache-2.0
#include "forest/statistics/metric.h"

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <map>
#include <set>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "forest/core/error.h"
#include "forest/core/random.h"
#include "forest/morphology/measure.h"
#include "forest/statistics/features.h"
#include "forest/statistics/summary.h"

namespace forest::statistics {
namespace {

using Points = std::vector<Point>;
using Names = std::set<std::string_view>;
using testing::DoubleNear;
using testing::Each;
using testing::ElementsAre;

Soma ball(Point p = {0, 0, 0, 5}) {
  return {.kind = SomaKind::sphere, .points = {p}, .parents = {}, .contour_starts = {}};
}

std::vector<double> values(std::string_view name, const Morphology& m, KindSet kinds = KindSet::all()) {
  const Metric* metric = find_metric(name);
  if (!metric) throw Error("no metric " + std::string(name));
  return metric->values(Arbors(m, kinds));
}

double value(std::string_view name, const Morphology& m, KindSet kinds = KindSet::all()) {
  return values(name, m, kinds).at(0);
}

Morphology line(float length) {
  MorphologyBuilder b;
  b.set_soma(ball());
  b.add_section({}, SectionKind::basal, Points{{0, 0, 0, 1}, {0.6f * length, 0, 0, 1}, {length, 0, 0, 1}});
  return b.build();
}

/// Every section gives two daughters until `depth`, to the same side each time when `comb`.
Morphology tree(int depth, bool comb) {
  MorphologyBuilder b;
  b.set_soma(ball());
  const std::function<void(SectionId, Point, int)> grow = [&](SectionId parent, Point from, int left) {
    const float step = 10.f * float(left + 1);
    const Point end{from.x, from.y + step, from.z, 1};
    const SectionId id = b.add_section(parent, SectionKind::apical, Points{from, end});
    if (left == 0) return;
    grow(id, {end.x, end.y, end.z, 1}, left - 1);
    if (comb) {
      b.add_section(id, SectionKind::apical, Points{end, {end.x + 7, end.y, end.z, 1}});
    } else {
      grow(id, {end.x, end.y, end.z, 1}, left - 1);
    }
  };
  grow({}, {0, 5, 0, 1}, depth);
  return b.build();
}

/// Tortuous, tapering, binary; kinds by stem.
Morphology wild(std::uint64_t seed) {
  Random random(seed);
  MorphologyBuilder b;
  b.set_soma(ball({3, -2, 1, 6}));
  constexpr std::array kinds{SectionKind::axon, SectionKind::basal, SectionKind::apical};
  const std::function<void(SectionId, SectionKind, Point, int)> grow = [&](SectionId parent, SectionKind kind,
                                                                           Point p, int order) {
    Points points{p};
    const auto walk = 2 + random.below(6);
    for (std::uint32_t i = 0; i < walk; ++i) {
      p.x += float(random.normal(1., 6.)), p.y += float(random.normal(2., 6.)),
          p.z += float(random.normal(0., 6.));
      p.radius *= float(random.uniform(.8, 1.02));
      points.push_back(p);
    }
    const SectionId id = b.add_section(parent, kind, points);
    if (order < 6 && random.uniform() < .75)
      for (int i = 0; i < 2; ++i) grow(id, kind, p, order + 1);
  };
  for (std::size_t stem = 0; stem < 4; ++stem) grow({}, kinds[stem % 3], {3, 4, 1, 2}, 0);
  for (std::size_t spine = 0; spine < 5; ++spine) b.add_spine({.section = SectionId(spine % 2)});
  return b.build();
}

std::vector<Morphology> zoo() {
  std::vector<Morphology> all{line(95.f), tree(4, false), tree(6, true)};
  for (std::uint64_t seed = 0; seed < 20; ++seed) all.push_back(wild(seed));
  return all;
}

/// The same neuron with every point moved, and points put between by `between`.
Morphology changed(const Morphology& m, const std::function<Point(Point)>& move, int between = 0) {
  MorphologyBuilder b;
  Soma soma = m.soma();
  for (Point& p : soma.points) p = move(p);
  b.set_soma(soma);
  for (std::size_t i = 0; i < m.sections().size(); ++i) {
    Points points;
    for (const Point& p : m.points(SectionId(i))) {
      const Point to = move(p);
      for (int k = 1; k <= between && !points.empty(); ++k) {
        const Point from = points.back();
        const float t = 1.f / float(between + 2 - k);
        points.push_back({std::lerp(from.x, to.x, t), std::lerp(from.y, to.y, t), std::lerp(from.z, to.z, t),
                          std::lerp(from.radius, to.radius, t)});
      }
      points.push_back(to);
    }
    b.add_section(m.sections()[i].parent, m.sections()[i].kind, points);
  }
  for (const Spine& s : m.spines()) b.add_spine(s);
  return b.build();
}

Point same(Point p) { return p; }

void expect_same(const Metric& metric, const Morphology& a, const Morphology& b, double factor,
                 double tolerance) {
  const auto was = metric.values(Arbors(a)), is = metric.values(Arbors(b));
  ASSERT_EQ(was.size(), is.size()) << metric.name;
  for (std::size_t i = 0; i < was.size(); ++i) {
    EXPECT_EQ(std::isnan(was[i]), std::isnan(is[i])) << metric.name;
    if (!std::isnan(was[i])) {
      EXPECT_NEAR(is[i], factor * was[i], tolerance * (1. + std::abs(factor * was[i]))) << metric.name;
    }
  }
}

TEST(Metrics, AreAtLeastAHundredWithNamesOfTheirOwn) {
  Names names;
  for (const Metric& m : metrics()) {
    EXPECT_TRUE(names.insert(m.name).second) << m.name;
    EXPECT_EQ(find_metric(m.name), &m);
    if (!m.l_measure.empty()) {
      EXPECT_EQ(find_metric(m.l_measure), &m) << m.l_measure;
    }
    EXPECT_TRUE(m.definition.ends_with('.')) << m.name;
  }
  EXPECT_GE(names.size(), 100u);
  EXPECT_EQ(find_metric(""), nullptr);
  EXPECT_EQ(find_metric("Total_Length"), nullptr);
}

TEST(Metrics, GiveOneFiniteValueAnElement) {
  std::vector<Morphology> all = zoo();
  all.emplace_back();  // empty
  MorphologyBuilder b;
  const auto stub = b.add_section({}, SectionKind::basal, Points{{1, 2, 3, 0}});
  b.add_section(stub, SectionKind::basal, Points{{1, 2, 3, 0}, {1, 2, 3, 0}});  // no length, no radius
  b.add_section(stub, SectionKind::basal, Points{{1, 2, 3, 0}, {9, 2, 3, 1}, {1, 2, 3, 0}});  // a loop
  all.push_back(b.build());
  b.add_section({}, SectionKind::axon,
                Points{{-3e38f, 3e38f, 0, 1e38f}, {3e38f, 3e38f, 1, 1}, {0, -3e38f, 0, 1}});
  all.push_back(b.build());  // as far as a number goes
  for (const Morphology& m : all) {
    const Arbors arbors(m);
    const auto sections = arbors.sections();
    const std::map<Level, std::size_t> elements{
        {Level::neuron, 1},
        {Level::arbor, arbors.stems().size()},
        {Level::section, sections.size()},
        {Level::bifurcation, arbors.bifurcations().size()},
        {Level::point, arbors.columns().x.size() - sections.size()},
        {Level::bar, std::size_t(std::ranges::count(sections, 0u, &Branch::daughters))}};
    for (const Metric& metric : metrics()) {
      const auto v = metric.values(arbors);
      if (metric.level != Level::shell) {
        EXPECT_EQ(v.size(), elements.at(metric.level)) << metric.name;
      }
      for (const double x : v) EXPECT_FALSE(std::isinf(x)) << metric.name;
    }
  }
}

TEST(Metrics, AreInvariantUnderRotationAndTranslation) {
  const Names bound_to_axes{"total_width",
                            "total_height",
                            "total_depth",
                            "width",
                            "height",
                            "depth",
                            "length_fraction_above_soma",
                            "length_fraction_along_z",
                            "level_segment_fraction",
                            "length_along_z_by_x",
                            "section_length_fractions_along_z",
                            "segment_elevations",
                            "aspect_ratio",
                            "circularity",
                            "shape_factor",
                            "fractal_dimension_boxes",
                            "trunk_vectors_x",
                            "trunk_vectors_y",
                            "trunk_vectors_z",
                            "trunk_origin_azimuths",
                            "trunk_origin_elevations",
                            "trunk_angles_from_vector",
                            "trunk_angles",
                            "segment_midpoints_x",
                            "segment_midpoints_y",
                            "segment_midpoints_z",
                            "x",
                            "y",
                            "z"};
  const Quat turn = Quat(0.3f, -0.5f, 0.7f, 0.2f).normalized();
  const auto move = [&](Point p) {
    const Vec3 v = turn * p.position() + Vec3(100, -40, 12);
    return Point{v.x(), v.y(), v.z(), p.radius};
  };
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const Morphology m = wild(seed), moved = changed(m, move);
    for (const Metric& metric : metrics())
      if (!bound_to_axes.contains(metric.name)) expect_same(metric, m, moved, 1., 1e-3);
  }
}

TEST(Metrics, ScaleWithTheirUnit) {
  const auto twice = [](Point p) { return Point{2 * p.x, 2 * p.y, 2 * p.z, 2 * p.radius}; };
  for (const Morphology& m : zoo())
    for (const Metric& metric : metrics()) {
      if (metric.level == Level::shell || metric.name.starts_with("sholl_") ||
          metric.name.starts_with("tortuosity_"))
        continue;
      const std::map<std::string_view, double> factors{
          {"", 1.},    {"°", 1.},    {"µm", 2.},     {"µm²", 4.},
          {"µm³", 8.}, {"1/µm", .5}, {"1/µm²", .25}, {"µm^1.5", std::pow(2., 1.5)}};
      const double factor = factors.at(metric.unit);
      expect_same(metric, m, changed(m, twice), factor, 1e-12);
    }
}

// Nothing but radii is changed, each of them otherwise, and not where they are tied.
TEST(Metrics, SayWhetherTheyDependOnDiameters) {
  Names moved;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    Random random(seed);
    const auto thicker = [&](Point p) {
      return Point{p.x, p.y, p.z, p.radius * float(random.uniform(1.1, 3.))};
    };
    const Morphology m = wild(seed), thick = changed(m, thicker);
    for (const Metric& metric : metrics()) {
      const auto was = metric.values(Arbors(m)), is = metric.values(Arbors(thick));
      ASSERT_EQ(was.size(), is.size()) << metric.name;
      for (std::size_t i = 0; i < was.size(); ++i)
        if (was[i] != is[i] && !(std::isnan(was[i]) && std::isnan(is[i]))) moved.insert(metric.name);
    }
  }
  for (const Metric& metric : metrics())
    EXPECT_EQ(moved.contains(metric.name), metric.diameters) << metric.name;
}

TEST(Metrics, DoNotDependOnHowDenselyABranchWasTraced) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const Morphology m = wild(seed), denser = changed(m, same, 3);
    EXPECT_EQ(denser.segment_count(), 4 * m.segment_count());
    for (const Metric& metric : metrics())
      if (!depends_on_points(metric)) expect_same(metric, m, denser, 1., 1e-3);
  }
}

// More points, or a quarter of a turn about the direction of the pia: features that are not said to tell of the tracing stay.
TEST(Features, SayWhetherTheyTellOfTheTracing) {
  const auto groups = groups_of("all");
  const std::vector<Feature> features = features_of(groups);
  std::size_t kept = 0;
  for (const Feature& f : features) kept += !f.diameters && !f.tracing;
  EXPECT_GT(kept, 150u);
  const auto turned = [](Point p) { return Point{p.z, p.y, -p.x, p.radius}; };
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const Morphology m = wild(seed);
    const std::vector<double> was = measure(m, groups).features;
    for (const Morphology& other : {changed(m, same, 3), changed(m, turned)}) {
      const std::vector<double> is = measure(other, groups).features;
      for (std::size_t i = 0; i < features.size(); ++i) {
        if (features[i].diameters || features[i].tracing) continue;
        EXPECT_EQ(std::isnan(was[i]), std::isnan(is[i])) << features[i].name;
        if (!std::isnan(was[i])) {
          EXPECT_NEAR(is[i], was[i], 1e-3 * (1. + std::abs(was[i]))) << features[i].name;
        }
      }
    }
  }
}

TEST(Counts, OfTerminalsAreStemsPlusBifurcationsInBinaryTrees) {
  for (const Morphology& m : zoo())
    EXPECT_EQ(value("number_of_leaves", m),
              value("number_of_neurites", m) + value("number_of_bifurcations", m));
}

TEST(Counts, TellBifurcationsFromForkingPoints) {
  MorphologyBuilder b;
  const auto stem = b.add_section({}, SectionKind::basal, Points{{0, 0, 0, 1}, {1, 0, 0, 1}});
  for (int i = 0; i < 3; ++i) b.add_section(stem, SectionKind::basal, Points{{2, float(i), 0, 1}});
  const Morphology m = b.build();
  EXPECT_EQ(value("number_of_bifurcations", m), 0);
  EXPECT_EQ(value("number_of_forking_points", m), 1);
  EXPECT_EQ(value("number_of_leaves", m), 3);
}

TEST(Metrics, AreTheSameWhoeverAsksFirst) {
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    const Morphology m = wild(seed);
    const Arbors shared(m);
    std::vector<std::vector<double>> backwards;
    for (auto row = metrics().rbegin(); row != metrics().rend(); ++row)
      backwards.push_back(row->values(shared));
    for (const Metric& metric : metrics()) {
      const auto alone = metric.values(Arbors(m));
      EXPECT_THAT(backwards.back(), testing::Pointwise(testing::NanSensitiveDoubleEq(), alone))
          << metric.name;
      backwards.pop_back();
    }
  }
}

TEST(Metrics, CoverBothVocabularies) {
  for (const char* name : {"Soma_Surface",
                           "N_stems",
                           "N_bifs",
                           "N_branch",
                           "N_tips",
                           "Width",
                           "Height",
                           "Depth",
                           "Type",
                           "Diameter",
                           "Diameter_pow",
                           "Length",
                           "Surface",
                           "SectionArea",
                           "Volume",
                           "EucDistance",
                           "PathDistance",
                           "XYZ",
                           "Branch_Order",
                           "Terminal_degree",
                           "TerminalSegment",
                           "Taper_1",
                           "Taper_2",
                           "Branch_pathlength",
                           "Contraction",
                           "Fragmentation",
                           "Daughter_Ratio",
                           "Parent_Daughter_Ratio",
                           "Partition_asymmetry",
                           "Rall_Power",
                           "Pk",
                           "Pk_classic",
                           "Pk_2",
                           "Bif_ampl_local",
                           "Bif_ampl_remote",
                           "Bif_tilt_local",
                           "Bif_tilt_remote",
                           "Bif_torque_local",
                           "Bif_torque_remote",
                           "Last_parent_diam",
                           "Diam_threshold",
                           "HillmanThreshold",
                           "Helix",
                           "Fractal_Dim",  // and NeuroM's
                           "section_term_lengths",
                           "segment_meander_angles",
                           "terminal_path_lengths",
                           "volume_density",
                           "principal_direction_extents",
                           "trunk_angles_inter_types",
                           "diameter_power_relations",
                           "aspect_ratio"})
    EXPECT_NE(find_metric(name), nullptr) << name;
}

TEST(Kinds, PartTheNeuron) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const Morphology m = wild(seed);
    for (const auto name :
         {"total_length", "total_area", "number_of_leaves", "number_of_neurites", "number_of_spines"})
      EXPECT_NEAR(value(name, m), value(name, m, {SectionKind::axon}) + value(name, m, dendrites), 1e-6)
          << name;
    EXPECT_NEAR(value("total_length", m), total_length(m), 1e-9);
  }
}

TEST(Kinds, CountAnAxonOnADendriteAsAStemAtItsDistance) {
  MorphologyBuilder b;
  b.set_soma(ball());
  const auto stem = b.add_section({}, SectionKind::basal, Points{{5, 0, 0, 1}, {15, 0, 0, 1}});
  b.add_section(stem, SectionKind::basal, Points{{25, 0, 0, 1}});
  b.add_section(stem, SectionKind::axon, Points{{15, 30, 0, 1}});
  const Morphology m = b.build();
  EXPECT_EQ(value("number_of_neurites", m, {SectionKind::axon}), 1);
  EXPECT_EQ(value("max_path_distance", m, {SectionKind::axon}), 40);
  EXPECT_EQ(value("number_of_bifurcations", m, {SectionKind::basal}), 0);
  EXPECT_EQ(value("number_of_leaves", m, {SectionKind::basal}), 1);
  EXPECT_EQ(value("total_length", m, {SectionKind::apical}), 0);
  EXPECT_TRUE(std::isnan(value("max_path_distance", m, {SectionKind::apical})));
}

TEST(Kinds, AreNamedInTheFieldsWords) {
  EXPECT_EQ(kind_set("all"), KindSet::all());
  EXPECT_EQ(kind_set("dendrite"), dendrites);
  EXPECT_EQ(kind_set("axon"), KindSet{SectionKind::axon});
  EXPECT_EQ(kind_set("custom"), KindSet{SectionKind::custom});
  EXPECT_THROW(kind_set("axons"), Error);
}

TEST(Asymmetry, IsZeroInASymmetricTreeAndOneInAComb) {
  EXPECT_THAT(values("partition_asymmetry", tree(4, false)), Each(0.));
  auto comb = values("partition_asymmetry", tree(6, true));
  ASSERT_EQ(comb.size(), 6u);
  EXPECT_EQ(comb.back(), 0.);  // two terminals are symmetric
  comb.pop_back();
  EXPECT_THAT(comb, Each(1.));
}

TEST(Strahler, IsTheDepthOfASymmetricTreeAndTwoInAComb) {
  EXPECT_EQ(summarize(values("section_strahler_orders", tree(4, false))).max, 5);
  EXPECT_EQ(summarize(values("section_strahler_orders", tree(6, true))).max, 2);
}

TEST(Sholl, OfAStraightLineIsOneUpToItsLength) {
  EXPECT_THAT(values("sholl_crossings", line(95.f)), testing::AllOf(testing::SizeIs(9), Each(1.)));
  EXPECT_THAT(values("sholl_crossings", line(100.f)), testing::AllOf(testing::SizeIs(10), Each(1.)));
}

TEST(Sholl, CountsASegmentThatPassesByTwice) {
  MorphologyBuilder b;
  b.set_soma(ball());
  b.add_section({}, SectionKind::axon, Points{{-25, 12, 0, 1}, {25, 12, 0, 1}});
  EXPECT_THAT(values("sholl_crossings", b.build()), ElementsAre(0., 2.));
}

TEST(Sholl, AgreesWithSmallStepsAlongTheBranches) {
  const Morphology m = wild(7);
  const Vec3 centre = m.soma().sphere().position();
  std::vector<double> counts(1000, 0.);
  for (std::size_t i = 0; i < m.sections().size(); ++i) {
    const auto points = m.points(SectionId(i));
    for (std::size_t k = 1; k < points.size(); ++k) {
      const Vec3 a = points[k - 1].position() - centre, b = points[k].position() - centre;
      constexpr int steps = 20000;
      auto inside = std::ceil(a.norm() / 10.f);
      for (int s = 1; s <= steps; ++s) {
        const auto now = std::ceil((a + (b - a) * (float(s) / steps)).norm() / 10.f);
        if (now != inside) ++counts[std::size_t(std::min(now, inside)) - 1];
        inside = now;
      }
    }
  }
  while (!counts.empty() && counts.back() == 0.) counts.pop_back();
  EXPECT_EQ(values("sholl_crossings", m), counts);
}

TEST(Angles, OfARightAngledFork) {
  MorphologyBuilder b;
  b.set_soma(ball());
  const auto stem = b.add_section({}, SectionKind::basal, Points{{0, 5, 0, 1}, {0, 15, 0, 1}});
  b.add_section(stem, SectionKind::basal, Points{{0, 15, 0, 1}, {0, 15, 0, 1}, {1, 16, 0, 1}, {0, 30, 0, 1}});
  b.add_section(stem, SectionKind::basal, Points{{0, 15, 0, 1}, {-1, 16, 0, 1}, {-9, 15, 0, 1}});
  const Morphology m = b.build();
  EXPECT_THAT(values("local_bifurcation_angles", m), ElementsAre(DoubleNear(90., 1e-9)));
  EXPECT_THAT(values("remote_bifurcation_angles", m), ElementsAre(DoubleNear(90., 1e-9)));
  EXPECT_THAT(values("bif_tilt_remote", m), ElementsAre(DoubleNear(90., 1e-9)));
}

TEST(Diameters, ThatFollowRallHaveHisPower) {
  for (const double power : {1., 1.5, 2., 3.}) {
    MorphologyBuilder b;
    const double thick = 1.3, thin = 0.9,
                 parent = std::pow(std::pow(thick, power) + std::pow(thin, power), 1. / power);
    const auto stem = b.add_section({}, SectionKind::basal, Points{{0, 0, 0, 3}, {0, 9, 0, float(parent)}});
    b.add_section(stem, SectionKind::basal, Points{{0, 9, 0, float(parent)}, {1, 16, 0, float(thin)}});
    b.add_section(stem, SectionKind::basal, Points{{0, 9, 0, float(parent)}, {2, 16, 0, float(thick)}});
    const Morphology m = b.build();
    EXPECT_NEAR(value("rall_power", m), power, 1e-5);
    EXPECT_NEAR(value("pk_classic", m), (std::pow(thick, 1.5) + std::pow(thin, 1.5)) / std::pow(parent, 1.5),
                1e-6);
    EXPECT_NEAR(value("daughter_ratio", m) * value("sibling_ratios", m), 1., 1e-12);
    EXPECT_NEAR(values("parent_daughter_ratio", m)[2], thick / parent, 1e-6);
    EXPECT_TRUE(std::isnan(values("parent_daughter_ratio", m)[0]));
  }
}

TEST(Diameters, TaperOfAConeIsItsSlope) {
  MorphologyBuilder b;
  Points cone;
  for (const float x : {0.f, 3.f, 5.f, 20.f}) cone.push_back({x, 0, 0, 2.f - 0.05f * x});
  b.add_section({}, SectionKind::basal, cone);
  const Morphology m = b.build();
  EXPECT_NEAR(value("section_taper_rates", m), -0.1, 1e-6);
  EXPECT_NEAR(value("taper_1", m), 0.1, 1e-6);
  EXPECT_NEAR(value("taper_2", m), 0.5, 1e-6);
  EXPECT_NEAR(value("section_mean_radii", m), 1.5, 1e-6);
}

TEST(LengthFractionAboveSoma, IsTheOtherPartUpsideDown) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const Morphology m = wild(seed);
    const Morphology turned = changed(m, [](Point p) { return Point{-p.x, -p.y, p.z, p.radius}; });
    EXPECT_NEAR(value("length_fraction_above_soma", m) + value("length_fraction_above_soma", turned), 1.,
                1e-12);
  }
}

// What the arbors compute in two sweeps, counted again by walking.
TEST(Arbors, AgreeWithWalkingTheTree) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const Morphology m = wild(seed);
    const std::function<double(SectionId)> terminals = [&](SectionId id) {
      double n = m.is_terminal(id);
      for (const SectionId child : m.children(id)) n += terminals(child);
      return n;
    };
    const std::function<int(SectionId)> strahler = [&](SectionId id) {
      std::vector<int> below;
      for (const SectionId child : m.children(id)) below.push_back(strahler(child));
      if (below.empty()) return 1;
      const int top = *std::ranges::max_element(below);
      return top + (std::ranges::count(below, top) > 1);
    };
    const auto path = values("section_path_distances", m), degrees = values("terminal_degree", m);
    const auto orders = values("section_branch_orders", m), strahlers = values("section_strahler_orders", m);
    for (std::size_t i = 0; i < m.sections().size(); ++i) {
      double distance = 0., order = -1.;
      for (SectionId id(i); id.valid(); id = m.section(id).parent) distance += section_length(m, id), ++order;
      EXPECT_NEAR(path[i], distance, 1e-9);
      EXPECT_EQ(orders[i], order);
      EXPECT_EQ(degrees[i], terminals(SectionId(i)));
      EXPECT_EQ(strahlers[i], strahler(SectionId(i)));
    }
  }
}

TEST(Volume, IsTheIntegralOfTheCrossSection) {
  const Morphology m = wild(3);
  double volume = 0.;
  for (std::size_t i = 0; i < m.sections().size(); ++i) {
    const auto points = m.points(SectionId(i));
    for (std::size_t k = 1; k < points.size(); ++k) {
      constexpr int slices = 1000;
      for (int s = 0; s < slices; ++s) {
        const double r = std::lerp(double(points[k - 1].radius), double(points[k].radius), (s + .5) / slices);
        volume += std::numbers::pi * r * r * segment_length(points[k - 1], points[k]) / slices;
      }
    }
  }
  EXPECT_NEAR(value("total_volume", m), volume, 1e-5 * volume);
}

// The page's table is made here: BRAINFOREST_REWRITE_DOCS=1 puts it in.
TEST(Documentation, HoldsTheTableOfMetrics) {
  const std::string path = FOREST_SOURCE_DIR "/docs/statistics/metrics.md";
  std::stringstream content;
  content << std::ifstream(path).rdbuf();
  const std::string page = content.str();

  std::string table =
      "| name | unit | level | diameters | definition | source | L-Measure "
      "|\n|---|---|---|---|---|---|---|\n";
  for (const Metric& m : metrics()) {
    const auto or_dash = [](std::string_view s) { return s.empty() ? "–" : std::string(s); };
    table += "| `" + std::string(m.name) + "` | ";
    for (const std::string& cell :
         {or_dash(m.unit), std::string(name_of(m.level)), or_dash(m.diameters ? "yes" : ""),
          std::string(m.definition), or_dash(m.source)})
      table += cell + " | ";
    table += or_dash(m.l_measure) + " |\n";
  }
  const std::size_t begin = page.find("| name | unit |"), end = page.find("\n\n", begin) + 1;
  ASSERT_LT(begin, end) << "the page has no table";
  const std::string right = page.substr(0, begin) + table + page.substr(end);
  if (std::getenv("BRAINFOREST_REWRITE_DOCS")) {
    std::ofstream(path) << right;
  } else {
    EXPECT_TRUE(page == right)
        << path << " is not what the table says; run this test with BRAINFOREST_REWRITE_DOCS=1";
  }
}

}  // namespace
}  // namespace forest::statistics
