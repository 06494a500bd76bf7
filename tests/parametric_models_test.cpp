// SPDX-License-Identifier: Apache-2.0
// The parametric models of real populations: they grow cells whose numbers of tips and lengths are of the right order.
#include <cmath>

#include <gtest/gtest.h>

#include "forest/fitting/burke.h"
#include "forest/fitting/hillman.h"
#include "forest/io/format.h"
#include "forest/lsystem/grow.h"
#include "forest/statistics/metric.h"
#include "forest/statistics/summary.h"

#include "tests/real_data.h"

namespace forest {
namespace {

std::vector<double> of_cells(const std::vector<Morphology>& cells, std::string_view metric,
                             statistics::KindSet kinds) {
  std::vector<double> values;
  for (const Morphology& m : cells)
    values.push_back(statistics::mean(statistics::find_metric(metric)->values(statistics::Arbors(m, kinds))));
  return values;
}

TEST(ParametricModels, OfRealCellsHaveTheirTipsAndLength) {
  FOREST_REAL_DATA(folder, "morphologies/real");
  constexpr statistics::KindSet dendrites{SectionKind::basal, SectionKind::apical, SectionKind::undefined};
  for (const char* population :
       {"rat_S1_L5_thick_tufted_pyramidal__markram", "rat_S1_L1_interneuron__markram",
        "rat_DG_granule__tejada", "mouse_spinal_motoneuron__ascoli"}) {
    std::vector<Morphology> cells;
    for (const auto& file : files_below(folder / population, ".swc"))
      if (cells.size() < 25) cells.push_back(io::read(file).morphology);
    ASSERT_FALSE(cells.empty()) << population;
    for (const auto write : {fitting::burke_grammar, fitting::hillman_grammar}) {
      const std::string text = write(cells, population, {.kinds = dendrites});
      const auto grown = lsystem::grow_population(lsystem::parse(text, population), 100, 5);
      for (const char* metric : {"number_of_neurites", "number_of_leaves", "total_length"}) {
        const double wanted = statistics::mean(of_cells(cells, metric, dendrites));
        const double got = statistics::mean(of_cells(grown, metric, dendrites));
        EXPECT_GT(got, 0.6 * wanted) << text.substr(text.find("title:"), 120) << metric << " of the traced "
                                     << wanted;
        EXPECT_LT(got, 1.6 * wanted) << text.substr(text.find("title:"), 120) << metric << " of the traced "
                                     << wanted;
      }
    }
  }
}

}  // namespace
}  // namespace forest
