// SPDX-License-Identifier: Apache-2.0
#include "forest/core/number_order.h"

#include <algorithm>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "forest/core/error.h"

namespace forest {
namespace {

using ::testing::ElementsAreArray;
using ::testing::HasSubstr;
namespace fs = std::filesystem;

// However they come.
void expect_order(const std::vector<std::string>& names) {
  std::vector<fs::path> files(names.begin(), names.end());
  for (int turn = 0; turn < 3; ++turn) {
    std::vector<std::string> got;
    for (const NumberedFile& f : in_number_order(files)) got.push_back(f.file.string());
    EXPECT_THAT(got, ElementsAreArray(names));
    turn ? std::ranges::sort(files) : std::ranges::reverse(files);
  }
}

std::string refusal(const std::vector<fs::path>& files) {
  try {
    (void)in_number_order(files);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(NumberOrder, IsThatOfWhatTheNumbersSay) {
  expect_order({"s1.png", "s2.png", "s10.png", "s011.png"});
  expect_order({"S0.png", "s1.PNG", "S2.tif", "s10.tiff"});
  expect_order({"1.svg"});
  expect_order({"a.png", "b.png", "c9.png"});
  expect_order({"b1_s2.png", "b1_s10.png", "b2_s1.png", "b10_s1.png"});
  expect_order({"1_left.png", "2_left.png", "11_left.png"});
  expect_order({});
}

TEST(NumberOrder, KnowsSignsAndDecimals) {
  expect_order({"b_-19.0.PNG", "b_-18.0.png", "b_-9.0.png", "b_+0.0.png", "b_+1.0.png", "b_+10.0.png"});
  expect_order({"-10mm.png", "-9mm.png", "0mm.png", "+9mm.png", "+10mm.png"});
  expect_order({"-3.png", "-2.png", "-1.png"});
  expect_order({"s-1.png", "s-2.png", "s-10.png"});  // no sign behind a letter
  expect_order({"z0.png", "z0.25.png", "z0.5.png", "z0.75.png", "z1.png", "z1.25.png"});
  expect_order({"z0,5.png", "z1.png", "z1,5.png", "z2.png"});
  expect_order({"x9.00.png", "x9.25.png", "x10.50.png"});
  const std::vector<fs::path> files{"b_+0.5.png", "b_-0.5.png"};
  EXPECT_EQ(in_number_order(files)[0].number, -.5);
}

TEST(NumberOrder, TwoNumbersAreDecimalsIfTheseAreEven) {
  expect_order({"1.1.png", "1.2.png", "1.9.png", "2.1.png"});
  expect_order({"s1.8.png", "s1.9.png", "s1.10.png", "s1.11.png", "s2.1.png"});
  EXPECT_THAT(refusal({"1.2.png", "1.5.png", "1.10.png", "1.11.png"}), HasSubstr("either way"));
}

TEST(NumberOrder, OneNumberOfTwoIsRefused) {
  EXPECT_EQ(refusal({"s1.png", "s2.png", "s01.png"}),
            "s1.png and s01.png have the same number; take one of them out");
  EXPECT_THAT(refusal({"s1.png", "s1.tif", "s2.png"}), HasSubstr("the same number"));
  EXPECT_THAT(refusal({"a1b1.png", "a01b1.png", "a2b2.png"}), HasSubstr("the same number"));
  EXPECT_THAT(refusal({"z0.5.png", "z0.50.png", "z1.png"}), HasSubstr("the same number"));
}

}  // namespace
}  // namespace forest
