// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/grid_picture.h"

#include <map>
#include <sstream>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "forest/cortex/grid_domains.h"

#include "tests/refused.h"

namespace forest::cortex {
namespace {

using testing::HasSubstr;

std::size_t times(const std::string& text, const std::string& what) {
  std::size_t n = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++n;
  return n;
}

TEST(GridPicture, DrawsEveryCellOfAPlaneGridAndFoldedOnesInRed) {
  const Grid start = boundary(domain("swan"), {16, 16, 1});
  const Grid folded = generate(start, "transfinite"), good = generate(start, "winslow");
  const GridPanel bad{&folded, "bad"}, right{&good, "right"};
  const std::string red = "<path fill=\"#c83232\"";
  EXPECT_EQ(times(to_svg({&bad, 1}), "M"), 256u);
  EXPECT_EQ(times(to_svg({&bad, 1}), red), 1u);
  EXPECT_EQ(times(to_svg({&right, 1}), red), 0u);
  const GridPanel both[]{bad, right};
  EXPECT_EQ(times(to_svg(both), "M"), 512u);
  EXPECT_THAT(to_svg(both), HasSubstr(">right<"));
}

TEST(GridPicture, OpensABlockToShowItsInside) {
  const Grid grid = generate(boundary(domain("crown"), {6, 6, 6}), "transfinite");
  const GridPanel panel{&grid, ""};
  const std::string opened = to_svg({&panel, 1}), closed = to_svg({&panel, 1}, {.opened = false});
  EXPECT_NE(opened, closed);
  EXPECT_LT(times(closed, "M"), 6u * 36u);  // what faces away is not drawn
  EXPECT_GT(times(closed, "M"), 2u * 36u);
  EXPECT_THAT(refused([&] { to_svg({&panel, 1}, {.up = "north"}); }), HasSubstr("x, y, z"));
}

TEST(GridMesh, OfABlockIsItsClosedSurface) {
  const Grid grid = generate(boundary(domain("screw"), {3, 4, 5}), "transfinite");
  std::istringstream lines(to_obj(grid));
  std::map<std::pair<int, int>, int> edges;
  int vertices = 0, faces = 0;
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string kind;
    words >> kind;
    vertices += kind == "v";
    if (kind != "f") continue;
    ++faces;
    std::array<int, 4> c{};
    for (int& corner : c) words >> corner;
    for (std::size_t n = 0; n < 4; ++n) ++edges[{c[n], c[(n + 1) % 4]}];
  }
  EXPECT_EQ(vertices, 4 * 5 * 6);
  EXPECT_EQ(faces, 2 * (3 * 4 + 4 * 5 + 5 * 3));
  for (const auto& [edge, count] : edges) {
    EXPECT_EQ(count, 1);
    EXPECT_TRUE(edges.contains({edge.second, edge.first})) << edge.first << " " << edge.second;
  }
}

TEST(GridMesh, OfAPlaneGridHasItsCells) {
  const Grid grid = generate(boundary(domain("plow"), {3, 4, 1}), "transfinite");
  EXPECT_EQ(times(to_obj(grid), "\nf "), 12u);
}

}  // namespace
}  // namespace forest::cortex
