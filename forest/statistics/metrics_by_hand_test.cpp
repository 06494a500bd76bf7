// SPDX-License-Identifier: Apache-2.0
// Metrics of cells that can be worked by hand.
#include <array>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "forest/statistics/metric.h"
#include "forest/statistics/sholl.h"

#include "tests/zoo.h"

namespace forest::statistics {
namespace {

using Points = std::vector<Point>;
constexpr double none = std::numeric_limits<double>::quiet_NaN(), pi = std::numbers::pi;

struct Worked {
  const char* metric;
  std::vector<double> values;
};

void expect(const Morphology& m, const std::vector<Worked>& worked) {
  const Arbors arbors(m);
  for (const auto& [name, expected] : worked) {
    SCOPED_TRACE(name);
    const Metric* metric = find_metric(name);
    ASSERT_NE(metric, nullptr);
    const auto is = metric->values(arbors);
    ASSERT_EQ(is.size(), expected.size());
    for (std::size_t i = 0; i < is.size(); ++i) {
      EXPECT_EQ(std::isnan(is[i]), std::isnan(expected[i])) << i;
      if (!std::isnan(expected[i])) {
        EXPECT_NEAR(is[i], expected[i], 1e-5 * (1. + std::abs(expected[i]))) << i;
      }
    }
  }
}

//   B          A2    Everything but A1, which comes out of the page, lies in it; every section is 10 µm long.
//     ╲       ╱      The stem S thins from a diameter of 4 to 2, A has 1.6, B has 1, A1 ends with .8 and A2 with 1.2.
//       ╲   A ─A1    A and B meet at a right angle, and so do A1 and A2.
//         S
//         │ soma of radius 5 at 0
Morphology cell() {
  MorphologyBuilder b;
  b.set_soma(zoo_parts::sphere(5));
  const auto s = b.add_section({}, SectionKind::basal, Points{{0, 5, 0, 2}, {0, 10, 0, 1.5f}, {0, 15, 0, 1}});
  const auto a =
      b.add_section(s, SectionKind::basal, Points{{0, 15, 0, 1}, {3, 19, 0, .8f}, {6, 23, 0, .8f}});
  b.add_section(s, SectionKind::basal, Points{{0, 15, 0, 1}, {-4, 18, 0, .5f}, {-8, 21, 0, .5f}});
  b.add_section(a, SectionKind::basal, Points{{6, 23, 0, .8f}, {6, 23, 10, .4f}});
  b.add_section(a, SectionKind::basal, Points{{6, 23, 0, .8f}, {12, 31, 0, .6f}});
  return b.build();
}

TEST(ByHand, TheNeuron) {
  const double front = std::sqrt(820.) + std::sqrt(500.) + std::sqrt(320.);
  const double crossed_10 = std::log(1. / (pi * 100.)), crossed_20 = std::log(2. / (pi * 400.)),
               crossed_30 = std::log(1. / (pi * 900.));
  expect(cell(), {{"soma_radius", {5.}},
                  {"soma_surface_area", {100. * pi}},
                  {"soma_volume", {500. / 3. * pi}},
                  {"number_of_segments", {8.}},
                  {"total_length", {50.}},
                  {"surface", {71. * pi}},
                  {"volume", {30.35 * pi}},
                  {"max_radial_distance", {std::sqrt(1105.)}},
                  {"max_path_distance", {30.}},
                  {"total_width", {20.}},
                  {"total_height", {26.}},
                  {"total_depth", {10.}},
                  {"length_fraction_along_z", {10. / 50.}},
                  {"level_segment_fraction", {7. / 8.}},
                  {"length_along_z_by_x", {10. / 20.}},
                  {"hull_volume", {2000. / 3.}},
                  {"circularity", {4. * pi * 200. / (front * front)}},
                  {"shape_factor", {200. / 820.}},
                  {"max_strahler_order", {2.}},
                  {"horton_bifurcation_ratio", {3.}},
                  {"horton_length_ratio", {2.}},
                  {"horton_diameter_ratio", {47. / 20. / (38.5 / 30.)}},
                  {"sholl_crossings", {1., 2., 1.}},
                  {"sholl_maximum", {2.}},
                  {"sholl_critical_radius", {20.}},
                  {"sholl_centroid", {20.}},
                  {"sholl_ramification", {2.}},
                  {"sholl_decay", {(crossed_10 - crossed_30) / 20.}},
                  {"spine_density", {0.}}});
  EXPECT_GT(crossed_10, crossed_20);
}

TEST(ByHand, ItsArbor) {
  expect(cell(), {{"number_of_sections_per_neurite", {5.}},
                  {"number_of_bifurcations_per_neurite", {2.}},
                  {"number_of_leaves_per_neurite", {3.}},
                  {"total_length_per_neurite", {50.}},
                  {"max_radial_distance_per_neurite", {std::sqrt(820.)}},
                  {"max_path_distance_per_neurite", {30.}},
                  {"hull_volume_per_neurite", {2000. / 3.}},
                  {"trunk_origin_radii", {2.}},
                  {"trunk_section_lengths", {10.}},
                  {"trunk_vectors_x", {0.}},
                  {"trunk_vectors_y", {5.}},
                  {"trunk_vectors_z", {0.}},
                  {"trunk_origin_azimuths", {none}},
                  {"trunk_origin_elevations", {90.}},
                  {"trunk_angles_from_vector", {0.}},
                  {"trunk_angles", {none}},
                  {"trunk_angles_inter_types", {none}},
                  {"tmd_path_total_persistence", {50.}},
                  {"tmd_path_longest_bar", {30.}},
                  {"tmd_path_long_bars", {3.}},
                  {"tmd_path_entropy", {-.6 * std::log(.6) - .4 * std::log(.2)}},
                  {"tmd_radial_longest_bar", {std::sqrt(820.)}}});
}

TEST(ByHand, ItsSections) {
  expect(cell(),
         {{"section_lengths", {10., 10., 10., 10., 10.}},
          {"section_term_lengths", {none, none, 10., 10., 10.}},
          {"section_bif_lengths", {10., 10., none, none, none}},
          {"section_length_fractions_along_z", {0., 0., 0., 1., 0.}},
          {"section_path_distances", {10., 20., 20., 30., 30.}},
          {"terminal_path_lengths", {none, none, 20., 30., 30.}},
          {"section_radial_distances",
           {10., std::sqrt(360.), std::sqrt(320.), std::sqrt(460.), std::sqrt(820.)}},
          {"section_term_radial_distances", {none, none, std::sqrt(320.), std::sqrt(460.), std::sqrt(820.)}},
          {"section_bif_radial_distances", {10., std::sqrt(360.), none, none, none}},
          {"section_branch_orders", {0., 1., 1., 2., 2.}},
          {"section_term_branch_orders", {none, none, 1., 2., 2.}},
          {"section_bif_branch_orders", {0., 1., none, none, none}},
          {"section_strahler_orders", {2., 2., 1., 1., 1.}},
          {"terminal_degree", {3., 2., 1., 1., 1.}},
          {"fragmentation", {2., 2., 2., 1., 1.}},
          {"Type", {3., 3., 3., 3., 3.}},
          {"tortuosity_10", {1., 1., 1., 1., 1.}},
          {"tortuosity_25", {none, none, none, none, none}},
          {"taper_1", {.2, 0., 0., 0., 0.}},
          {"taper_2", {.5, 0., 0., 0., 0.}},
          {"section_taper_rates", {-.2, -.04, -.1, -.08, -.04}},
          {"parent_daughter_ratio", {none, .8, .5, .5, .75}},
          {"Diam_threshold", {none, none, 1., .8, 1.2}},
          {"Fractal_Dim", {none, none, none, none, none}}});
}

TEST(ByHand, ItsBifurcations) {
  const double tilt = std::acos(-.6) * 180. / pi;
  expect(cell(), {{"local_bifurcation_angles", {90., 90.}},
                  {"remote_bifurcation_angles", {90., 90.}},
                  {"Bif_tilt_local", {tilt, 90.}},
                  {"Bif_tilt_remote", {tilt, 90.}},
                  {"Bif_torque_local", {none, 90.}},
                  {"Bif_torque_remote", {none, 90.}},
                  {"partition_asymmetry", {1., 0.}},
                  {"partition_asymmetry_petilla", {.5, 0.}},
                  {"partition_asymmetry_length", {.4, 0.}},
                  {"bifurcation_partitions", {3., 1.}},
                  {"partition_pairs_first", {3., 1.}},
                  {"partition_pairs_second", {1., 1.}},
                  {"sibling_ratios", {.625, .8 / 1.2}},
                  {"daughter_ratio", {1.6, 1.5}},
                  {"Pk_classic",
                   {(std::pow(1.6, 1.5) + 1.) / std::pow(2., 1.5),
                    (std::pow(.8, 1.5) + std::pow(1.2, 1.5)) / std::pow(1.6, 1.5)}},
                  {"Pk_2", {.89, (.64 + 1.44) / 2.56}},
                  {"diameter_power_relations",
                   {std::pow(1.25, 1.5) + std::pow(2., 1.5), std::pow(2., 1.5) + std::pow(1.6 / 1.2, 1.5)}},
                  {"Last_parent_diam", {none, 1.6}},
                  {"HillmanThreshold", {none, 1.3}}});
  const Arbors arbors(cell());
  const auto powers = find_metric("Rall_Power")->values(arbors), pk = find_metric("Pk")->values(arbors);
  EXPECT_NEAR(std::pow(1.6, powers[0]) + 1., std::pow(2., powers[0]), 1e-6);
  const double mean = (powers[0] + powers[1]) / 2.;
  EXPECT_NEAR(pk[0], (std::pow(1.6, mean) + 1.) / std::pow(2., mean), 1e-6);
}

TEST(ByHand, ItsPoints) {
  expect(cell(),
         {{"segment_lengths", {5., 5., 5., 5., 5., 5., 10., 10.}},
          {"segment_radii", {1.75, 1.25, .9, .8, .75, .5, .6, .7}},
          {"segment_taper_rates", {.2, .2, .08, 0., .2, 0., .08, .04}},
          {"segment_meander_angles", {none, 180., none, 180., none, 180., none, none}},
          {"segment_midpoints_x", {0., 0., 1.5, 4.5, -2., -6., 6., 9.}},
          {"segment_midpoints_y", {7.5, 12.5, 17., 21., 16.5, 19.5, 23., 27.}},
          {"segment_midpoints_z", {0., 0., 0., 0., 0., 0., 5., 0.}},
          {"segment_elevations", {0., 0., 0., 0., 0., 0., 90., 0.}},
          {"segment_path_lengths", {5., 10., 15., 20., 15., 20., 30., 30.}},
          {"segment_radial_distances",
           {2.5, 7.5, std::hypot(1.5, 12.), std::hypot(4.5, 16.), std::hypot(2., 11.5), std::hypot(6., 14.5),
            std::hypot(6., 18., 5.), std::hypot(9., 22.)}},
          {"segment_volumes",
           {5. * pi / 3. * 9.25, 5. * pi / 3. * 4.75, 5. * pi / 3. * 2.44, 3.2 * pi, 5. * pi / 3. * 1.75,
            1.25 * pi, 10. * pi / 3. * 1.12, 10. * pi / 3. * 1.48}},
          {"segment_areas",
           {pi * 3.5 * std::hypot(5., .5), pi * 2.5 * std::hypot(5., .5), pi * 1.8 * std::hypot(5., .2),
            pi * 8., pi * 1.5 * std::hypot(5., .5), pi * 5., pi * 1.2 * std::hypot(10., .4),
            pi * 1.4 * std::hypot(10., .2)}},
          {"XYZ", {0., 0., 3., 6., -4., -8., 6., 12.}},
          {"Diameter", {3., 2., 1.6, 1.6, 1., 1., .8, 1.2}},
          {"SectionArea", {2.25 * pi, pi, .64 * pi, .64 * pi, .25 * pi, .25 * pi, .16 * pi, .36 * pi}},
          {"TerminalSegment", {0., 0., 0., 0., 1., 1., 1., 1.}}});
}

TEST(ByHand, AScrewOfThreeSegments) {
  MorphologyBuilder b;
  b.add_section({}, SectionKind::axon,
                Points{{0, 0, 0, 1}, {2, 0, 0, 1}, {2, 3, 0, 1}, {2, 3, 4, 1}, {2, 3, 9, 1}});
  b.add_section({}, SectionKind::axon, Points{{0, 0, 0, 1}, {2, 0, 0, 1}, {2, 3, 0, 1}, {2, 3, -4, 1}});
  expect(b.build(), {{"Helix", {none, none, 1. / 3., 0., none, none, -1. / 3.}},
                     {"segment_meander_angles", {none, 90., 90., 180., none, 90., 90.}}});
}

TEST(ByHand, AZigzagHasAFractalDimensionAndTortuosityByScale) {
  MorphologyBuilder b;
  Points zigzag{{0, 0, 0, 1}};
  for (int i = 0; i < 40; ++i)  // steps of 5 µm, 3 along x
    zigzag.push_back({zigzag.back().x + 3, i % 2 ? 0.f : 4.f, 0, 1});
  b.add_section({}, SectionKind::axon, zigzag);
  b.add_section({}, SectionKind::axon,
                Points{{0, 0, 0, 1}, {1, 0, 0, 1}, {5, 0, 0, 1}, {7, 0, 0, 1}, {90, 0, 0, 1}});
  const Morphology m = b.build();
  double sx = 0., sy = 0., sxx = 0., sxy = 0.;
  for (int i = 1; i <= 40; ++i) {
    const double y = std::log(5. * i), x = std::log(std::hypot(3. * i, i % 2 ? 4. : 0.));
    sx += x / 40., sy += y / 40., sxx += x * x / 40., sxy += x * y / 40.;
  }
  expect(m, {{"tortuosity_10", {10. / 6., 1.}},
             {"tortuosity_25", {200. / (8. * std::hypot(15., 4.)), 1.}},
             {"tortuosity_50", {50. / 30., 1.}},
             {"tortuosity_100", {100. / 60., none}},
             {"section_tortuosity", {200. / 120., 1.}},
             {"Fractal_Dim", {(sxy - sx * sy) / (sxx - sx * sx), 1.}}});
}

TEST(ByHand, ARectangleSeenFromTheFront) {
  MorphologyBuilder b;
  b.add_section({}, SectionKind::axon, Points{{1, 1, 0, 1}, {5, 1, 3, 1}, {5, 2, 8, 1}, {1, 2, 9, 1}});
  expect(b.build(),
         {{"aspect_ratio", {.25}}, {"circularity", {16. * pi / 100.}}, {"shape_factor", {4. / 17.}}});
}

TEST(ByHand, AStraightArborReachesAlongOneAxis) {
  MorphologyBuilder b;
  b.set_soma(zoo_parts::sphere(1));
  b.add_section({}, SectionKind::axon, Points{{1, 0, 0, 1}, {3, 3, 6, 1}, {5, 6, 12, 1}});
  expect(b.build(), {{"principal_direction_extents", {14.}},
                     {"principal_direction_extents_2", {0.}},
                     {"principal_direction_extents_3", {0.}},
                     {"neurite_volume_density", {none}},
                     {"volume_density", {none}}});
}

TEST(ByHand, TrunksAroundTheSoma) {
  MorphologyBuilder b;
  b.set_soma(zoo_parts::sphere(5));
  for (const auto& [at, kind] : {std::pair(Vec3(5, 0, 0), SectionKind::basal),
                                 {Vec3(0, 0, 5), SectionKind::basal},
                                 {Vec3(0, 5, 0), SectionKind::apical},
                                 {Vec3(-3, -4, 0), SectionKind::axon}})
    b.add_section({}, kind, Points{{at.x(), at.y(), at.z(), 1}, {2 * at.x(), 2 * at.y(), 2 * at.z(), 1}});
  const double down = std::acos(.8) * 180. / pi;  // of the axon, from -y
  expect(b.build(), {{"trunk_origin_azimuths", {0., 90., none, 180.}},
                     {"trunk_origin_elevations", {0., 0., 90., down - 90.}},
                     {"trunk_angles_from_vector", {90., 90., 0., 180. - down}},
                     {"trunk_angles", {90., none, 180. - down, 90. + down}},
                     {"trunk_angles_inter_types", {90., 90., 90., 90.}}});
}

TEST(ByHand, SpinesOfTheZoo) {
  for (const Specimen& specimen : zoo())
    if (specimen.name == "spines")
      expect(specimen.morphology, {{"number_of_spines", {2.}},
                                   {"spine_density", {.04}},
                                   {"spine_area_density", {2. / (100. * pi)}},
                                   {"section_spine_counts", {2.}},
                                   {"section_spine_densities", {.04}}});
}

TEST(Zoo, HasTheCountsAndLengthsThatAreKnown) {
  for (const Specimen& specimen : zoo()) {
    SCOPED_TRACE(specimen.name);
    const Arbors arbors(specimen.morphology);
    EXPECT_EQ(find_metric("number_of_sections")->values(arbors)[0], double(specimen.sections));
    EXPECT_EQ(find_metric("number_of_leaves")->values(arbors)[0], double(specimen.tips));
    if (specimen.length) {
      EXPECT_NEAR(find_metric("total_length")->values(arbors)[0], *specimen.length, 1e-4);
    }
    for (const Metric& metric : metrics())
      for (const double x : metric.values(arbors)) EXPECT_FALSE(std::isinf(x)) << metric.name;
  }
}

TEST(Sholl, MayBeginAtAnyRadiusWithAnyStep) {
  MorphologyBuilder b;
  b.set_soma(zoo_parts::sphere(5));
  b.add_section({}, SectionKind::axon, Points{{5, 0, 0, 1}, {20, 0, 0, 1}});
  b.add_section({}, SectionKind::axon, Points{{0, 5, 0, 1}, {0, 11, 0, 1}});
  const Arbors arbors(b.build());
  EXPECT_EQ(sholl_crossings(arbors, 4., 5.),
            (std::vector{0., 2., 1., 1.}));                               // 5, where both begin, 9, 13, 17
  EXPECT_EQ(sholl_crossings(arbors, 5., 6.), (std::vector{2., 2., 1.}));  // 6, 11, 16
  EXPECT_EQ(sholl_crossings(arbors, 1000., 1000.), std::vector<double>{});
}

}  // namespace
}  // namespace forest::statistics
