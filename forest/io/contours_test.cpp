// SPDX-License-Identifier: Apache-2.0
#include "forest/io/contours.h"

#include <cmath>
#include <regex>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/core/progress.h"
#include "forest/io/surface.h"

#include "tests/real_data.h"
#include "tests/refused.h"

namespace forest::io {
namespace {

using cortex::Axis;
using cortex::ContourStack;

// Curves of balls within balls, at odd numbers, and straight polygons.
ContourStack curves() {
  const auto planes = cortex::planes_between(-2000., 2000., 700. / 3.);
  const ContourStack both[] = {
      cortex::cut(icosphere({1e4f, .1f, 3.f}, 2500.f, 3, 0), "outer", Axis::y, planes),
      cortex::cut(icosphere({1e4f, .1f, 3.f}, 1500.f, 3, 0), "in \"&<>\" ner", Axis::y, planes)};
  cortex::FitSummary summary;
  ContourStack stack = cortex::fitted(cortex::together(both), {}, summary, Progress::none());
  stack.sections[3] = cortex::together(both).sections[3];
  return stack;
}

std::string sentence(std::string_view text) {
  return refused<InputError>([&] { (void)read_contours(text, "c"); });
}

TEST(Contours, ComeBackFromTheirFileToTheLastBit) {
  const ContourStack stack = curves();
  EXPECT_EQ(read_contours(write_contours(stack), "c").stack, stack);
}

TEST(Contours, ComeBackFromDrawingsToTheLastBit) {
  const ContourStack stack = curves();
  std::vector<ContourStack> drawings;
  for (const auto& section : stack.sections)
    drawings.push_back(read_contours(write_svg(stack, section, &stack.sections[0]), "c.svg").stack);
  std::swap(drawings.front(), drawings.back());
  ContourStack again = gathered(drawings, "drawn");
  EXPECT_EQ(again, stack);
}

TEST(Contours, DrawingsHaveAScaleBarAsLongAsItSaysAndTellWhereTheyAre) {
  ContourStack stack = curves();
  stack.axis = cortex::Axis::z;
  stack.sections.resize(1);
  for (const double scale : {1., .05, 60.}) {
    for (auto& contour : stack.sections[0].contours)
      for (Place& p : contour.curve.points) p *= scale;
    stack.sections[0].at = -14'250.;
    const std::string drawing = write_svg(stack, stack.sections[0]);
    EXPECT_NE(drawing.find(">z = -14.25 mm<"), std::string::npos);
    std::smatch bar, label;
    ASSERT_TRUE(
        std::regex_search(drawing, bar, std::regex("data-words=[^\n]*\n<path d=\"M[^h]*h([0-9.e+]+)v")));
    ASSERT_TRUE(std::regex_search(drawing, label, std::regex(">([0-9.]+) (µm|mm)</text>")));
    EXPECT_DOUBLE_EQ(std::stod(bar[1]), std::stod(label[1]) * (label[2] == "mm" ? 1000. : 1.));
    EXPECT_EQ(read_contours(drawing, "c.svg").stack, stack) << "words are no contours";
  }
}

TEST(Contours, CutOffAnywhereAreRefused) {
  ContourStack stack = curves();
  stack.sections.resize(2);
  const std::string text = write_contours(stack), drawing = write_svg(stack, stack.sections[1]);
  for (std::size_t size = 0; size + 2 < text.size(); ++size)
    EXPECT_NE(sentence(text.substr(0, size)), "") << size;
  for (std::size_t size = 0; size + 2 < drawing.size(); size += 7)
    EXPECT_NE(sentence(drawing.substr(0, size)), "") << size;
}

TEST(Contours, OfADrawingHaveTheirInsideToTheLeftHoweverTheyWereDrawn) {
  const std::string around = "M0 0h9v9h-9z", back = "M0 0v9h9v-9z", hole = "M2 2h3v3h-3z",
                    hole_back = "M2 2v3h3v-3z";
  for (const std::string& one : {around, back})
    for (const std::string& other : {hole, hole_back}) {
      const auto read =
          read_contours("<svg width='9mm' viewBox='0 0 9 9'><path d='" + one + other + "'/></svg>", "d.svg")
              .stack;
      ASSERT_EQ(read.sections[0].contours.size(), 2u);
      EXPECT_NEAR(area(read.sections[0].contours[0].curve), 81e6, 1.);
      EXPECT_NEAR(area(read.sections[0].contours[1].curve), -9e6, 1.);
    }
}

// A picture to trace over is placed by a transform as a rule; links and switches are groups.
TEST(Contours, OfADrawingAreFoundBesidePicturesAndInLinks) {
  const auto read = read_contours(
      "<svg width='9mm' viewBox='0 0 9 9'><image transform='rotate(90)'/><a><switch><g id='in'><path d='M0 "
      "0h9v9z'/></g>"
      "</switch></a><svg><path d='M0 0h9v9z'/></svg></svg>",
      "d.svg");
  EXPECT_EQ(read.stack.objects, std::vector<std::string>{"in"});
  EXPECT_EQ(read.stack.sections[0].contours.size(), 1u);
  EXPECT_EQ(read.oddities.size(), 1u);  // a drawing within the drawing
}

TEST(Contours, OfAnySizeAndNameAreReadOrRefused) {
  EXPECT_THAT(sentence("<svg data-unit='um' viewBox='0 0 9 9'><path d='M0 0L5e9 0 0 5e9z'/></svg>"),
              testing::HasSubstr("as no brain does; look at their unit"));
  EXPECT_THAT(sentence("{\"s.inf\": {\"thickness\": 1, \"contours\": {}}}"),
              testing::HasSubstr("has no number at its end"));
  ContourStack named = curves();
  named.objects[0] = "caf\xe9";
  EXPECT_EQ(read_contours(write_contours(named), "c").stack.objects.size(), named.objects.size());
}

TEST(Contours, OfTwoStacksWithOneNameAreRefused) {
  const std::vector<ContourStack> both(2, curves());
  EXPECT_THAT(refused([&] { (void)cortex::together(both); }),
              testing::HasSubstr("two boundaries are to be called"));
}

TEST(Contours, OfDrawingsWithoutPlacesAreRefusedWithTheRemedy) {
  const auto drawing =
      read_contours("<svg width='9mm' viewBox='0 0 9 9'><path d='M0 0h9v9h-9z'/></svg>", "d.svg").stack;
  EXPECT_THAT(refused<InputError>([&] {
                (void)gathered({drawing, drawing}, "drawn");
              }),
              testing::HasSubstr(
                  "drawn: has two sections at 0 mm; give each a place of its own, in µm, as <svg data-at="));
}

TEST(Contours, OfADrawingThatAreHiddenAreLeftOutAndLooseOnesTold) {
  const std::string path = "<path d='M0 0h9v9h-9z'/>";
  const auto drawn = [&](const std::string& inside) {
    return read_contours("<svg width='9mm' viewBox='0 0 9 9'>" + inside + "</svg>", "d.svg");
  };
  for (const char* hides : {"style='fill:none; display : none'", "display='none'", "style='display:none;'"}) {
    const ReadContours read =
        drawn("<g id='inner'>" + path + "</g><g id='old' " + hides + ">" + path + "</g>");
    EXPECT_EQ(read.stack.objects, std::vector<std::string>{"inner"}) << hides;
    EXPECT_THAT(read.oddities, testing::ElementsAre(testing::HasSubstr("hidden <g> 'old' was left out")));
  }
  EXPECT_EQ(drawn("<g id='a' style='display:inline'>" + path + "</g>").stack.sections[0].contours.size(), 1u);
  const ReadContours loose = drawn("<g id='inner'>" + path + "</g>" + path);
  EXPECT_EQ(loose.stack.objects, (std::vector<std::string>{"inner", "outer"}));
  EXPECT_THAT(loose.oddities, testing::ElementsAre(testing::HasSubstr("a path in no group")));
  EXPECT_TRUE(drawn(path).oddities.empty());
}

TEST(Contours, OfADrawingAreReadFromEveryCommandInItsSize) {
  const auto loops = [](const std::string& d) {
    return read_contours("<svg width='40mm' viewBox='0 0 20 20'><g id='a'><path d='" + d + "'/></g></svg>",
                         "d.svg")
        .stack;
  };
  const ContourStack square = loops("M1 2h4v4H1z");
  EXPECT_EQ(square.objects, std::vector<std::string>{"a"});
  ASSERT_EQ(square.sections[0].contours.size(), 1u);
  EXPECT_NEAR(std::abs(area(square.sections[0].contours[0].curve)), 16. * 4e6, 1.);  // 2 mm a unit
  EXPECT_EQ(square.sections[0].contours[0].curve.points[0], Place(2000., -4000.));
  for (const char* same :
       {"M1,2 5,2 5,6 1,6Z", "m1 2l4 0 0 4-4 0z", "M1 2 L5 2 V6 H1 Z", "M1 2C1 2 5 2 5 2L5 6 1 6Z"})
    EXPECT_EQ(area(loops(same).sections[0].contours[0].curve), area(square.sections[0].contours[0].curve))
        << same;
  EXPECT_EQ(loops("M1 2h4v4zM8 8h1v1z").sections[0].contours.size(), 2u);
  const auto wide = [](const std::string& width) {
    return area(read_contours("<svg width='" + width +
                                  "' viewBox='0 0 72 72'><g id='a'><path d='M0 0h72v72H0z'/></g></svg>",
                              "d.svg")
                    .stack.sections[0]
                    .contours[0]
                    .curve);
  };
  for (const char* inch : {"72pt", "6pc", "25.4mm", "2.54cm", "96px", "96"})
    EXPECT_NEAR(wide(inch), wide("1in"), 1e-6 * std::abs(wide("1in"))) << inch;
  EXPECT_THROW(wide("100%"), InputError);
  const ContourStack drop = loops("M1 1C9 1 1 9 1 1Z");  // one cubic: 3/20 of the parallelogram of its arms
  ASSERT_EQ(drop.sections[0].contours.size(), 1u);
  EXPECT_NEAR(std::abs(area(drop.sections[0].contours[0].curve)), 64. * 3. / 20. * 4e6, 1.);
  EXPECT_EQ(area(loops("M0 0Q2 2 4 0T8 0V9H0z").sections[0].contours[0].curve),
            area(loops("M0 0q2 2 4 0q2 -2 4 0V9H0z").sections[0].contours[0].curve));
  EXPECT_EQ(loops("M0 0C0 2 2 2 2 0S4-2 4 0V9H0z").sections[0].contours[0].curve,
            loops("M0 0C0 2 2 2 2 0C2-2 4-2 4 0V9H0z").sections[0].contours[0].curve);
}

TEST(Contours, SayWhatIsWrongInADrawing) {
  const auto said = [](const std::string& inside) {
    return sentence("<svg width='9mm' viewBox='0 0 9 9'>" + inside + "</svg>");
  };
  EXPECT_NE(said("<path d='M0 0L1 1 2 0'/>").find("open between"), std::string::npos);
  EXPECT_NE(said("<path d='M0 0A1 1 0 0 0 3 3z'/>").find("convert arcs"), std::string::npos);
  EXPECT_NE(said("<path d='M0 0L1'/>").find("number is missing"), std::string::npos);
  EXPECT_NE(said("<g transform='scale(2)'/>").find("transform"), std::string::npos);
  EXPECT_NE(sentence("<html/>").find("no SVG"), std::string::npos);
  EXPECT_NE(sentence("words").find(".contours"), std::string::npos);
}

TEST(Contours, SayWhatIsWrongInAFile) {
  const auto with = [](const std::string& sections, const std::string& unit = "um") {
    return sentence("{\"brainforest_contours\":1,\"unit\":\"" + unit + "\",\"axis\":\"y\",\"sections\":[" +
                    sections + "]}");
  };
  EXPECT_EQ(with("{\"at\":1,\"contours\":[]}"), "");
  EXPECT_NE(with("{\"at\":1,\"contours\":[]}", "inch").find("um or mm"), std::string::npos);
  EXPECT_NE(with("{\"at\":1,\"contours\":[]},{\"at\":1,\"contours\":[]}").find("two sections"),
            std::string::npos);
  EXPECT_NE(with("{\"at\":1,\"contours\":[{\"object\":\"a\",\"polygon\":[[0,0],[1,null],[1,1]]}]}")
                .find("section 1"),
            std::string::npos);
  EXPECT_NE(with("{\"at\":1,\"contours\":[{\"object\":\"a\",\"polygon\":[[0,0],[1,1]]}]}").find("2 points"),
            std::string::npos);
  EXPECT_NE(with("{\"at\":1}").find("\"contours\""), std::string::npos);
}

TEST(Contours, OfSlicesAreClosedOnesWithTheInsideToTheLeft) {
  // The outer one runs clockwise here, the hole anticlockwise: both are turned.
  const std::string text =
      "slice 2.0\ncontour closed\n0 0\n0 9\n9 9\n9 0\nadjacent\n-1\ncontour closed\n3 3\n6 3\n6 "
      "6\nadjacent\n-1\n"
      "slice 1.0\ncontour open\n0 0\n1 1\nadjacent\n0\n-1\n";
  const ReadContours read = read_contours(text, "s.slc", 1000.);
  ASSERT_EQ(read.stack.sections.size(), 2u);
  EXPECT_EQ(read.stack.sections[0].at, 1000.);
  EXPECT_TRUE(read.stack.sections[0].contours.empty());
  EXPECT_THAT(read.oddities, testing::ElementsAre("a contour is an open line and was left out"));
  ASSERT_EQ(read.stack.sections[1].contours.size(), 2u);
  EXPECT_NEAR(area(read.stack.sections[1].contours[0].curve), 81e6, 1.);
  EXPECT_NEAR(area(read.stack.sections[1].contours[1].curve), -4.5e6, 1.);
  EXPECT_NE(sentence("slice 1\ncontour closed\n1 x\n").find("c:3"), std::string::npos);
  EXPECT_NE(sentence("slice one\n"), "");
}

TEST(Contours, OfATracingProgramThatAreLeftOutAreTold) {
  const std::string dot = R"({"x":[0,1],"y":[0,1],"closed":true})";
  const auto oddities = [](const std::string& traces) {
    return read_contours(R"({"sections":{"s.1":{"thickness":1,"contours":{"a":[)" + traces + "]}}}}",
                         "s.jser")
        .oddities;
  };
  EXPECT_THAT(oddities(dot),
              testing::ElementsAre("a trace of 'a' has fewer than three points and was left out"));
  EXPECT_THAT(oddities(dot + "," + dot),
              testing::ElementsAre("2 traces of 'a' have fewer than three points and were left out"));
}

TEST(Contours, OfTracingProgramsAreRead) {
  FOREST_REAL_DATA(folder, "cortex/contour_stacks");
  const MappedFile series(folder / "class_series.jser"), slices(folder / "test.slc");
  const ReadContours traced = read_contours(series.text(), "class_series.jser");
  EXPECT_GT(traced.stack.sections.size(), 100u);
  std::size_t contours = 0;
  for (const auto& section : traced.stack.sections) contours += section.contours.size();
  EXPECT_EQ(contours, 228u);  // and six with less than three places
  EXPECT_FALSE(traced.oddities.empty());
  const ReadContours sliced = read_contours(slices.text(), "test.slc");
  contours = 0;
  for (const auto& section : sliced.stack.sections) contours += section.contours.size();
  EXPECT_EQ(contours, 7u);
  EXPECT_EQ(sliced.oddities.size(), 1u);  // 33 are open
}

}  // namespace
}  // namespace forest::io
