// SPDX-License-Identifier: Apache-2.0
#include "apps/studio/pace.h"

#include <cmath>

#include <gtest/gtest.h>

namespace forest::studio {
namespace {

// A machine that needs `full` ms at an error of one pixel, and less for coarser pictures.
float after(Pace& pace, float full, int pictures) {
  float last = full;
  for (int i = 0; i < pictures; ++i) pace.drew(last = full / std::sqrt(pace.error(1.f)));
  return last;
}

TEST(Pace, FastMachineShowsEverything) {
  Pace pace(40.f);
  after(pace, 12.f, 50);
  EXPECT_EQ(pace.error(1.5f), 1.5f);
}

TEST(Pace, SlowMachineKeepsItsTimeByShowingLess) {
  Pace pace(40.f);
  EXPECT_NEAR(after(pace, 80.f, 60), 40.f, 2.f);
  EXPECT_GT(pace.error(1.f), 2.f);
}

TEST(Pace, DetailComesBackWhereThereIsLess) {
  Pace pace(40.f);
  after(pace, 100.f, 60);
  after(pace, 15.f, 60);
  EXPECT_EQ(pace.error(1.f), 1.f);
}

TEST(Pace, ErrorStaysBounded) {
  Pace pace(40.f);
  after(pace, 1e5f, 100);
  EXPECT_LE(pace.error(1.f), 8.f);
}

}  // namespace
}  // namespace forest::studio
