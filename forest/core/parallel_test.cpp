// SPDX-License-Identifier: Apache-2.0
#include "forest/core/parallel.h"

#include <atomic>
#include <numeric>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "tests/refused.h"

namespace forest {
namespace {

using namespace std::chrono_literals;

TEST(Parallel, TellsOfTheFirstThatThrows) {
  for (const unsigned threads : {1u, 2u, 7u}) {
    const ThreadLimit limit(threads);
    for (int repeat = 0; repeat < 20; ++repeat) {
      std::vector<std::atomic<int>> done(1000);
      EXPECT_EQ(refused([&] {
                  parallel_for(done.size(), 1, [&](std::size_t i) {
                    if (i == 300) std::this_thread::sleep_for(1ms);  // long after those that follow threw
                    if (i == 300 || i > 500) throw Error(std::to_string(i));
                    ++done[i];
                  });
                }),
                "300");
      for (std::size_t i = 0; i < done.size(); ++i)
        EXPECT_TRUE(done[i] == (i < 300) || (i > 300 && done[i] <= 1)) << i;
    }
  }
}

TEST(Parallel, InOrderTakesAllBeforeTheFirstThatThrows) {
  for (const unsigned threads : {1u, 2u, 7u}) {
    const ThreadLimit limit(threads);
    std::vector<std::size_t> taken;
    EXPECT_EQ(refused([&] {
                parallel_in_order(
                    1000,
                    [](std::size_t i) {
                      if (i == 300) std::this_thread::sleep_for(1ms);
                      if (i >= 300) throw Error(std::to_string(i));
                      return i;
                    },
                    [&](std::size_t, std::size_t made) { taken.push_back(made); });
              }),
              "300");
    std::vector<std::size_t> expected(300);
    std::iota(expected.begin(), expected.end(), 0u);
    EXPECT_EQ(taken, expected);
  }
}

TEST(Parallel, CoversEveryNumberOnce) {
  for (const std::size_t count : {0u, 1u, 7u, 10'000u})
    for (const std::size_t grain : {0u, 1u, 64u}) {
      std::vector<std::atomic<int>> done(count);
      parallel_ranges(count, grain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) ++done[i];
      });
      for (const auto& times : done) EXPECT_EQ(times, 1);
    }
}

}  // namespace
}  // namespace forest
