// SPDX-License-Identifier: Apache-2.0
#include "forest/reports/trace.h"

#include <cmath>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "forest/core/error.h"

#include "tests/sample_activity.h"
#include "tests/sample_forest.h"

namespace forest::reports {
namespace {

struct Sample {
  circuit::Circuit circuit = forest::testing::sample_circuit(9);
  std::vector<Morphology> neurons = forest::testing::sample_neurons();
  Report report =
      synthetic_report(circuit, neurons, {.compartments = 180, .steps = 70, .step = .5, .seed = 5});
  Activity activity() const {
    return Activity::from_bytes(forest::testing::packed_activity(report, circuit, neurons));
  }
};

TEST(Trace, IsWhatTheReportSaysOfThatPlace) {
  const Sample sample;
  const Activity activity = sample.activity();
  for (std::uint32_t row = 0; row < activity.rows().size(); ++row) {
    const auto layout = activity.layout(activity.rows()[row].layout);
    for (std::uint32_t c = 0; c < layout.compartments.size(); c += 37) {
      const Trace t = trace(activity, row, c);
      EXPECT_EQ(t.node, activity.rows()[row].node_id);
      const std::size_t column = sample.report.first_column[row] + layout.compartments[c].column;
      const std::uint32_t element = sample.report.element_ids[column];
      const auto order = sections_of_elements(sample.neurons[layout.morphology]);
      EXPECT_EQ(t.section, element ? order[element - 1].value() : soma_run);
      EXPECT_EQ(t.name(), element ? "node " + std::to_string(t.node) + " section " +
                                        std::to_string(order[element - 1].value()) +
                                        fmt::format(" at {:.4g}", t.position)
                                  : "node " + std::to_string(t.node) + " soma");
      EXPECT_EQ(t.position, layout.compartments[c].position);
      ASSERT_EQ(t.values.size(), 70u);
      for (std::size_t step = 0; step < 70; step += 23) {
        float value = 0.f;
        sample.report.read(step, 1, column, 1, &value);
        EXPECT_NEAR(t.values[step], value, activity.facts().range.error() + 1e-4f);
      }
    }
  }
}

TEST(Trace, AsATableHasALineAStepAndLeavesOutWhatIsNoNumber) {
  const Sample sample;
  const Activity activity = sample.activity();
  std::vector<Trace> traces{trace(activity, 0, 3), trace(activity, 1, 0)};
  traces[1].values[2] = NAN;
  const std::string csv = csv_of(activity.facts(), traces);
  EXPECT_EQ(std::ranges::count(csv, '\n'), 71);
  EXPECT_TRUE(csv.starts_with("time (ms)," + traces[0].name() + " (mV)," + traces[1].name() + " (mV)\n0,"));
  EXPECT_NE(csv.find(",\n1.5,"), std::string::npos);
}

TEST(Trace, OfWhatWasNotReportedIsRefused) {
  const Sample sample;
  const Activity activity = sample.activity();
  EXPECT_THROW(trace(activity, 9, 0), Error);
  EXPECT_THROW(trace(activity, 0, std::uint32_t(activity.count(0, Level::compartment))), Error);
}

}  // namespace
}  // namespace forest::reports
