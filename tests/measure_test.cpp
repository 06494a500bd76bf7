// SPDX-License-Identifier: Apache-2.0
// The metrics of real neurons, read from their files.
#include <algorithm>
#include <cmath>
#include <filesystem>

#include <gtest/gtest.h>

#include "forest/io/format.h"
#include "forest/statistics/metric.h"
#include "forest/statistics/summary.h"

#include "tests/real_data.h"

namespace forest::statistics {
namespace {

std::vector<std::filesystem::path> swc_files(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder))
    if (entry.path().extension() == ".swc") files.push_back(entry.path());
  std::ranges::sort(files);
  return files;
}

double value(std::string_view name, const Arbors& a) { return find_metric(name)->values(a).at(0); }
Summary summary(std::string_view name, const Arbors& a) { return summarize(find_metric(name)->values(a)); }

TEST(RealNeurons, ObeyTheLawsOfTrees) {
  FOREST_REAL_DATA(folder, "morphologies/real");
  const auto files = swc_files(folder);
  ASSERT_GT(files.size(), 100u);
  for (const auto& file : files) {
    SCOPED_TRACE(file);
    const Arbors a(io::read(file).morphology);
    for (const Metric& m : metrics())
      for (const double x : m.values(a)) ASSERT_FALSE(std::isinf(x)) << m.name;

    double extra_daughters = 0.;
    for (const Branch& b : a.sections()) extra_daughters += b.daughters > 1 ? b.daughters - 1. : 0.;
    EXPECT_EQ(value("number_of_leaves", a), value("number_of_neurites", a) + extra_daughters);
    EXPECT_FALSE(summary("contraction", a).max > 1. + 1e-6);  // not defined without a section that has length
    EXPECT_FALSE(summary("partition_asymmetry", a).max > 1.);
    EXPECT_FALSE(summary("remote_bifurcation_angles", a).max > 180.);
    if (a.sections().empty()) continue;
    EXPECT_GE(value("total_length", a) + 1e-6, value("max_path_distance", a));
    EXPECT_LE(summary("section_strahler_orders", a).max, 1. + std::log2(value("number_of_leaves", a)));
    const Summary bars = summary("tmd_path_bars", a);
    EXPECT_EQ(double(bars.count), value("number_of_leaves", a));
    EXPECT_NEAR(bars.mean * double(bars.count), value("total_length", a), 1e-6 * value("total_length", a));
    for (const auto& [part, whole] :
         {std::pair("width", "total_width"), {"height", "total_height"}, {"depth", "total_depth"}})
      EXPECT_FALSE(value(part, a) > value(whole, a)) << part;
    EXPECT_FALSE(value("hull_volume", a) >
                 value("total_width", a) * value("total_height", a) * value("total_depth", a) * (1. + 1e-9));
    EXPECT_FALSE(value("circularity", a) > 1.);
    EXPECT_FALSE(value("fractal_dimension_boxes", a) > 2.5);
    EXPECT_FALSE(summary("tortuosity_10", a).min < 1. - 1e-6);
  }
}

// What is known of these cells from the literature, in wide limits: a wrong unit or a missed arbor falls
// outside.
TEST(RealNeurons, AreOfTheSizeTheirKindHas) {
  struct Kind {
    const char* folder;
    double stems_low, stems_high, length_low, length_high;  // µm of dendrite
  };
  for (const Kind kind : {Kind{"rat_DG_granule__claiborne", 1, 4, 1500, 5000},
                          Kind{"rat_S1_L5_thick_tufted_pyramidal__markram", 4, 12, 4000, 25000}}) {
    FOREST_REAL_DATA(folder, std::filesystem::path("morphologies/real") / kind.folder);
    std::vector<double> stems, lengths;
    for (const auto& file : swc_files(folder)) {
      const Arbors a(io::read(file).morphology, dendrites);
      stems.push_back(value("number_of_neurites", a));
      lengths.push_back(value("total_length", a));
    }
    EXPECT_GE(summarize(stems).median, kind.stems_low) << kind.folder;
    EXPECT_LE(summarize(stems).median, kind.stems_high) << kind.folder;
    EXPECT_GE(summarize(lengths).median, kind.length_low) << kind.folder;
    EXPECT_LE(summarize(lengths).median, kind.length_high) << kind.folder;
  }
}

// One of the six cells of Cullheim et al. (1987) whose L-Measure values, mean and standard deviation between
// cells, are published with L-Neuron's motoneurons (Ascoli et al. 2001, Anat Embryol 204:283).
TEST(CatMotoneuron, LiesAmongThePublishedValues) {
  FOREST_REAL_DATA(file, "morphologies/real/misc_btmorph/examples__data__v_e_moto1.CNG.swc");
  struct Published {
    const char* metric;
    double mean, sd;
  };
  const Arbors a(io::read(file).morphology);
  for (const auto [metric, mean, sd] : {Published{"number_of_neurites", 11.7, 2.7},
                                        {"number_of_bifurcations", 159, 22},
                                        {"number_of_leaves", 172, 22},
                                        {"total_length", 1.03e5, 1.4e4},
                                        {"max_path_distance", 1894, 150},
                                        {"max_radial_distance", 1619, 66},
                                        {"max_branch_order", 9.3, 0.8},
                                        {"section_lengths", 312, 16},
                                        {"contraction", 0.935, 0.013},
                                        {"partition_asymmetry", 0.465, 0.038},
                                        {"remote_bifurcation_angles", 52.6, 4.9},
                                        {"daughter_ratio", 1.97, 0.28},
                                        {"parent_daughter_ratio", 0.63, 0.04},
                                        {"pk_classic", 1.11, 0.10}})
    EXPECT_NEAR(summary(metric, a).mean, mean, 2.5 * sd) << metric;
}

}  // namespace
}  // namespace forest::statistics
