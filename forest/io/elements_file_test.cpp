// SPDX-License-Identifier: Apache-2.0
#include "forest/io/elements_file.h"

#include <filesystem>
#include <fstream>
#include <iterator>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/io/hdf5.h"

namespace forest::io {
namespace {

namespace fs = std::filesystem;
using cortex::Place;

struct ElementsOnDisk : ::testing::Test {
  fs::path folder = fs::path(::testing::TempDir()) / "elements_file_test";
  void SetUp() override { fs::create_directories(folder); }
  void TearDown() override { fs::remove_all(folder); }
};

cortex::Cortex one_block() {
  cortex::Cortex cortex;
  cortex.elements.corners = 4;
  cortex.elements.on_valley = {0, 1, 0, 1};
  std::array<std::uint32_t, 16> e{};
  // Corners are the curves 0 to 3, the others follow.
  for (std::uint32_t c = 0, other = 4; c < 16; ++c)
    e[c] = c == 0 ? 2 : c == 3 ? 0 : c == 12 ? 3 : c == 15 ? 1 : other++;
  cortex.elements.elements = {e};
  for (int c = 0; c < 16; ++c)
    cortex.elements.curves.push_back({Place(c, 0, 0), Place(c, 1, 0), Place(c, 2, .1), Place(c, 3, 1e6)});
  cortex.lines.push_back({.kind = cortex::Line::Kind::valley,
                          .points = {Place(0, 0, 0), Place(1, 2, 3), Place(4, 5, 6)},
                          .triangles = {},
                          .strength = 2.5,
                          .closed = false});
  cortex.lines.push_back({.kind = cortex::Line::Kind::sulcus,
                          .points = {Place(7, 0, 0), Place(8, 1, 0)},
                          .triangles = {},
                          .strength = 900.,
                          .closed = false});
  cortex.between = 3e9, cortex.wall = 1e8, cortex.w_angle = {1., 9.}, cortex.w_reached = .999;
  cortex.mending.before = 17;
  return cortex;
}

TEST_F(ElementsOnDisk, ComeBackAsTheyWere) {
  const cortex::Cortex cortex = one_block();
  write_elements(folder / "e.h5", cortex, 1e9);
  const ElementsFile back = read_elements(folder / "e.h5");
  EXPECT_EQ(back.volume, 1e9);
  EXPECT_EQ(back.cortex.elements.elements, cortex.elements.elements);
  EXPECT_EQ(back.cortex.elements.curves, cortex.elements.curves);
  EXPECT_EQ(back.cortex.elements.on_valley, cortex.elements.on_valley);
  EXPECT_EQ(back.cortex.elements.corners, 4u);
  ASSERT_EQ(back.cortex.lines.size(), 2u);
  EXPECT_EQ(back.cortex.lines[0].points, cortex.lines[0].points);
  EXPECT_EQ(back.cortex.lines[0].kind, cortex::Line::Kind::valley);
  EXPECT_EQ(back.cortex.lines[1].points, cortex.lines[1].points);
  EXPECT_EQ(back.cortex.lines[1].kind, cortex::Line::Kind::sulcus);
  EXPECT_EQ(back.cortex.wall, 1e8);
  EXPECT_EQ(back.cortex.mending.before, 17u);
}

TEST_F(ElementsOnDisk, CutOffAnywhereAreRefused) {
  write_elements(folder / "e.h5", one_block(), 1e9);
  std::ifstream file(folder / "e.h5", std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(file), {}};
  ASSERT_GT(bytes.size(), 1000u);
  for (std::size_t size = 0; size < bytes.size(); size += size < 2000 ? 1 : 97) {
    write_file(folder / "cut.h5", std::string_view(bytes).substr(0, size));
    EXPECT_THROW(read_elements(folder / "cut.h5"), InputError) << size;
  }
}

TEST_F(ElementsOnDisk, ACornerThatIsNoneIsRefused) {
  cortex::Cortex cortex = one_block();
  std::swap(cortex.elements.elements[0][0], cortex.elements.elements[0][1]);
  write_elements(folder / "e.h5", cortex, 1e9);
  EXPECT_THROW((void)read_elements(folder / "e.h5"), InputError);
}

TEST_F(ElementsOnDisk, OfAnotherKindAreRefusedWithTheRemedy) {
  hdf5::NewFile other(folder / "other.h5");
  other.group("/something");
  other.close();
  try {
    read_elements(folder / "other.h5");
    ADD_FAILURE();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), ::testing::HasSubstr("brainforest cortex build"));
  }
  cortex::Cortex wrong = one_block();
  wrong.elements.elements[0][3] = 99;
  write_elements(folder / "wrong.h5", wrong, 1e9);
  EXPECT_THROW(read_elements(folder / "wrong.h5"), InputError);
  wrong = one_block();
  wrong.elements.curves[2][1][0] = std::nan("");
  write_elements(folder / "nan.h5", wrong, 1e9);
  EXPECT_THROW(read_elements(folder / "nan.h5"), InputError);
}

}  // namespace
}  // namespace forest::io
