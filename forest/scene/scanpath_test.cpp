// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/scanpath.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "forest/core/error.h"

#include "tests/refused.h"

namespace forest::scene {
namespace {

TEST(Scanpath, HoldsTheLastSampleAndJumps) {
  const Scanpath path = parse_scanpath("time,x,y\n100,.5,.25\n116,.5,.3\n200,.9,.1\n");
  EXPECT_EQ(path.duration(), 100.);
  EXPECT_EQ(path.at(-5.), Vec2(.5f, .25f));
  EXPECT_EQ(path.at(0.), Vec2(.5f, .25f));
  EXPECT_EQ(path.at(99.9), Vec2(.5f, .3f));
  EXPECT_EQ(path.at(100.), Vec2(.9f, .1f));
  EXPECT_EQ(path.at(1e9), Vec2(.9f, .1f));
}

TEST(Scanpath, ReadsPixelsBlinksCommentsAndForeignLineEnds) {
  const Scanpath path = parse_scanpath(
      "# a recording\r\n# size 200x100\r\ntime,x_px,y_px\r\n0,100,50\r\n5,,\r\n9;nan;nan\r\n\r\n12, -20, "
      "150");
  ASSERT_EQ(path.samples().size(), 4u);
  EXPECT_EQ(path.samples()[0].place, Vec2(.5f, .5f));
  EXPECT_EQ(path.samples()[2].place, Vec2(.5f, .5f));
  EXPECT_EQ(path.samples()[3].place, Vec2(-.1f, 1.5f));
  EXPECT_EQ(parse_scanpath("0,.1,.2").samples().size(), 1u);
  EXPECT_EQ(parse_scanpath("\xef\xbb\xbftime,x,y\n0,.1,.2").samples().size(), 1u);  // as Excel begins a file
}

TEST(Scanpath, ABlinkAtTheBeginningTakesItsTime) {
  const Scanpath path = parse_scanpath("time,x,y\n100,,\n350,,\n600,.2,.2\n1100,.8,.8\n");
  EXPECT_EQ(path.duration(), 1000.);
  EXPECT_EQ(path.at(0.), Vec2(.2f, .2f));
  EXPECT_EQ(path.at(999.), Vec2(.2f, .2f));
  EXPECT_EQ(path.at(1000.), Vec2(.8f, .8f));
  EXPECT_THROW(parse_scanpath("time,x,y\n100,,\n50,,\n600,.2,.2\n"), InputError);
  EXPECT_THROW(parse_scanpath("time,x,y\n100,,\n350,,\n"), InputError);
}

TEST(Scanpath, NamesTheBadLine) {
  const auto said = [](std::string_view text) {
    return refused<InputError>([&] { parse_scanpath(text, "gaze.csv"); });
  };
  for (const auto& [text, words] : std::initializer_list<std::pair<const char*, const char*>>{
           {"time,x,y\n0,.5,.5\n1,.5\n", "gaze.csv:3: has 2 columns"},
           {"0,.5,.5\n-1,.5,.5\n", "gaze.csv:2: -1 ms is earlier"},
           {"0,.5,.5\nlater,.5,.5\n", "gaze.csv:2: 'later' is no time"},
           {"0,.5,.5\n1,.5,\n", "gaze.csv:2:"},
           {"0,inf,.5\n", "gaze.csv:1:"},
           {"time,x_px,y_px\n0,5,5\n", "gaze.csv:1: pixels of a picture of what size?"},
           {"# size 0x5\n", "gaze.csv:1:"},
           {"time,left,top\n", "gaze.csv:1: the columns must be"},
           {"0,960,540\n", "gaze.csv:1: 960, 540 lies three pictures or more"},
           {"", "holds no sample"},
           {"time,x,y\n1,,\n", "holds no sample"}})
    EXPECT_THAT(said(text), testing::HasSubstr(words)) << text;
}

TEST(Scanpath, AnyBytesAreReadOrRefused) {
  const std::string good = "# size 20x10\ntime,x_px,y_px\n0,10,5\n5,,\n7,3,4\n";
  for (std::size_t length = 0; length <= good.size(); ++length)
    for (const char c : {'\0', '\xff', ',', '9', '-', 'e'}) {
      std::string text = good.substr(0, length) + c + good.substr(std::min(good.size(), length + 1));
      try {
        EXPECT_FALSE(parse_scanpath(text).samples().empty());
      } catch (const InputError&) {
      }
    }
}

}  // namespace
}  // namespace forest::scene
