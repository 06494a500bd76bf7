// SPDX-License-Identifier: Apache-2.0
#include "forest/core/signals.h"

#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>

#include "forest/core/file.h"

namespace forest {
namespace {

TEST(Signals, AFileThatShrinksWhileItIsReadIsASentence) {
  const auto path = std::filesystem::path(::testing::TempDir()) / "forest_shrinking";
  std::ofstream(path) << std::string(100'000, 'x');
  const MappedFile file(path);
  const auto read = [&] {
    say_signals("brainforest");
    std::filesystem::resize_file(path, 10);
    std::size_t sum = 0;
    for (const std::byte b : file.bytes()) sum += std::size_t(b);
    std::exit(sum ? 0 : 2);
  };
  EXPECT_EXIT(read(), ::testing::ExitedWithCode(1), "brainforest: a file became shorter while it was read");
  std::filesystem::remove(path);
}

}  // namespace
}  // namespace forest
