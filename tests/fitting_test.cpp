// SPDX-License-Identifier: Apache-2.0
// Models of traced neurons grow neurons of their sizes.
#include <cmath>

#include <gtest/gtest.h>

#include "forest/fitting/resampling.h"
#include "forest/io/format.h"
#include "forest/lsystem/grow.h"
#include "forest/statistics/metric.h"
#include "forest/statistics/summary.h"

#include "tests/real_data.h"

namespace forest::fitting {
namespace {

double mean_of(std::span<const Morphology> neurons, const char* metric) {
  const statistics::Metric& m = *statistics::find_metric(metric);
  std::vector<double> values;
  for (const Morphology& n : neurons)
    values.push_back(statistics::mean(m.values(statistics::Arbors(n, statistics::dendrites))));
  return statistics::mean(values);
}

TEST(Resampling, OfTracedGranuleCells) {
  FOREST_REAL_DATA(folder, "morphologies/real/rat_DG_granule__tejada");
  std::vector<Morphology> models;
  for (const auto& file : files_below(folder, ".swc")) models.push_back(io::read(file).morphology);
  ASSERT_GT(models.size(), 30u);
  const lsystem::Grammar grammar = lsystem::parse(resampling_grammar(models, "granule cells"), "granule");
  const std::vector<Morphology> grown = lsystem::grow_population(grammar, 60, 1);
  for (const char* metric : {"number_of_leaves", "total_length", "max_path_distance", "contraction"}) {
    const double wanted = mean_of(models, metric);
    EXPECT_NEAR(mean_of(grown, metric), wanted, .2 * std::abs(wanted)) << metric;
  }
}

}  // namespace
}  // namespace forest::fitting
