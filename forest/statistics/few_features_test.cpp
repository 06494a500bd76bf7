// SPDX-License-Identifier: Apache-2.0
#include "forest/statistics/few_features.h"

#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "forest/core/error.h"
#include "forest/morphology/transform.h"
#include "forest/statistics/features.h"

#include "tests/zoo.h"

namespace forest::statistics {
namespace {

// Of every neuron of the zoo, wherever it lies, all features that can be named, in an order of their own.
TEST(FewFeatures, AreThoseThatAllTogetherAreMeasured) {
  const auto groups = groups_of("all");
  const auto features = features_of(groups);
  FewFeatures few;
  std::vector<std::size_t> columns;
  for (std::size_t i = features.size(); i-- > 0;)
    if (features[i].name.find("sholl_crossings") == std::string::npos) {
      few.add(features[i].name);
      columns.push_back(i);
    }
  ASSERT_EQ(few.size(), columns.size());
  EXPECT_GT(few.size(), 200u);
  for (const Specimen& s : zoo()) {
    SCOPED_TRACE(s.name);
    const Morphology neuron = translated(s.morphology, Vec3(30, -20, 10));
    const Measured all = measure(neuron, groups);
    const std::vector<double> some = few.measure(neuron);
    ASSERT_EQ(some.size(), columns.size());
    for (std::size_t i = 0; i < columns.size(); ++i) {
      const double wanted = all.features[columns[i]];
      EXPECT_TRUE(some[i] == wanted || (std::isnan(some[i]) && std::isnan(wanted)))
          << features[columns[i]].name << ": " << some[i] << " for " << wanted;
    }
  }
}

TEST(FewFeatures, HaveNames) {
  FewFeatures few;
  for (const char* none : {"", "basal", "dragon total_length", "basal total_lngth", "basal total_length mean",
                           "basal contraction", "basal contraction mode", "basal contraction mean twice",
                           "basal sholl_crossings mean"})
    EXPECT_THROW(few.add(none), Error) << none;
  EXPECT_EQ(few.size(), 0u);
}

}  // namespace
}  // namespace forest::statistics
