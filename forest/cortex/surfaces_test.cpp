// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/surfaces.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "forest/core/parallel.h"
#include "forest/core/progress.h"
#include "forest/geometry/isosurface.h"
#include "forest/geometry/self_intersection.h"
#include "forest/geometry/triangle_tree.h"

#include "tests/refused.h"

namespace forest::cortex {
namespace {

// A bent egg with a dent, mm across.
Mesh folded(float scale) {
  Mesh mesh = icosphere(Vec3::Zero(), 1.f, 6, 0);
  for (Vec3& p : mesh.positions) {
    const float dent = .35f * std::exp(-6.f * (p - Vec3(0.f, .3f, 1.f)).squaredNorm());
    p = scale * 8000.f * (1.f - dent) * Vec3(p.x(), 1.3f * p.y() + .2f * p.x() * p.x(), .9f * p.z());
  }
  return mesh;
}

ContourStack cuts(const Mesh& outer, const Mesh& inner, Axis axis = Axis::y, double spacing = 1000.) {
  const auto planes = planes_between(-13000., 15000., spacing);
  const ContourStack both[] = {cut(outer, "outer", axis, planes), cut(inner, "inner", axis, planes)};
  return together(both);
}

// With all their triangles, which takes less time than making them fewer.
Surfaces made(const ContourStack& stack, const SurfaceOptions& options = {.error = 0.}) {
  return surfaces_from(stack, options, Progress::none());
}

double mean_distance(const Mesh& from, const Mesh& to) {
  const TriangleTree tree(to);
  double sum = 0.;
  for (const Vec3& p : from.positions) sum += tree.nearest(p.cast<double>())->distance;
  return sum / double(from.positions.size());
}

TEST(SurfacesFrom, CutsOfASolidComeBackToIt) {
  const Mesh outer = folded(1.f), inner = folded(.75f);
  for (const Axis axis : {Axis::x, Axis::y, Axis::z}) {
    const Surfaces result = made(cuts(outer, inner, axis));
    EXPECT_LT(mean_distance(result.outer, outer), 50.);
    EXPECT_LT(mean_distance(outer, result.outer), 50.);
    EXPECT_LT(mean_distance(result.inner, inner), 50.);
    EXPECT_NEAR(volume(result.outer) / volume(outer), 1., .02);
    EXPECT_EQ(result.pushed, 0u);
  }
}

TEST(SurfacesFrom, AreBetterFromMoreSections) {
  const Mesh outer = folded(1.f), inner = folded(.75f);
  const double far = mean_distance(made(cuts(outer, inner, Axis::y, 2000.)).outer, outer),
               near = mean_distance(made(cuts(outer, inner, Axis::y, 500.)).outer, outer);
  EXPECT_LT(near, .5 * far);
}

TEST(SurfacesFrom, AreSpheresWithinOneAnotherThatCutNothing) {
  const Surfaces result = made(cuts(folded(1.f), folded(.75f)), {.error = 20.});
  EXPECT_LT(result.outer.triangles.size() + result.inner.triangles.size(), result.triangles / 4);
  for (const Mesh* mesh : {&result.outer, &result.inner}) {
    EXPECT_TRUE(is_closed(*mesh));
    EXPECT_EQ(count_pieces(*mesh), 1u);
    EXPECT_EQ(euler_number(*mesh), 2);
    EXPECT_GT(volume(*mesh), 0.);
  }
  Mesh both = result.outer;
  append(both, result.inner);
  EXPECT_FALSE(self_intersection(both).has_value());
}

TEST(SurfacesFrom, SayWhatHangsTogetherWithNothing) {
  ContourStack stack = cuts(folded(1.f), folded(.75f));
  EXPECT_LT(made(stack).outer_unjoined.share, .01);
  const auto with_outer = [](ContourStack s, std::size_t section, auto&& change) {
    change(s.sections[section].contours);
    return s;
  };
  const std::size_t middle = stack.sections.size() / 2;
  const auto no_outer = [](auto& contours) {
    std::erase_if(contours, [](auto& c) { return c.object == 0; });
  };
  EXPECT_THAT(refused([&] { made(with_outer(stack, middle, no_outer)); }),
              ::testing::HasSubstr("has no contour of 'outer', and sections before and behind it have"));
  const auto twice = [](auto& contours) { contours.push_back(contours[0]); };
  EXPECT_THAT(refused([&] { made(with_outer(stack, middle, twice)); }),
              ::testing::HasSubstr("one contour twice"));
  // An island far aside, in three sections.
  ContourStack island = stack;
  for (std::size_t i = middle - 1; i <= middle + 1; ++i) {
    Contour aside = *std::ranges::find(stack.sections[middle].contours, 0u, &Contour::object);
    for (Place& point : aside.curve.points) point = .5 * point + Place(30'000., 0.);
    island.sections[i].contours.push_back(aside);
  }
  const Surfaces result = made(island);
  EXPECT_NEAR(result.outer_unjoined.share, .32, .1);
  EXPECT_LE(std::abs(double(result.outer_unjoined.section) - double(middle)), 1.);
}

TEST(SurfacesFrom, HaveNoHandleWhereTheirContoursDo) {
  // A ball with a bridge of tissue over it, as where two banks of a sulcus touch: a torus and a ball in it.
  Mesh handle = folded(1.f);
  append(handle, icosphere({0.f, 0.f, 20000.f}, 1500.f, 3, 0));  // and a piece apart
  const ContourStack stack = cuts(handle, folded(.5f), Axis::z);
  const Surfaces result = made(stack);
  EXPECT_EQ(count_pieces(result.outer), 1u);
  EXPECT_EQ(euler_number(result.outer), 2);
}

TEST(SurfacesFrom, StayNestedWhereContoursTouch) {
  const Mesh outer = folded(1.f);
  Mesh inner = folded(.75f);
  for (Vec3& p : inner.positions) p.z() += 1900.f;  // through the outer one at the top
  const Surfaces result = made(cuts(outer, inner));
  EXPECT_GT(result.pushed, 0u);
  Mesh both = result.outer;
  append(both, result.inner);
  EXPECT_FALSE(self_intersection(both).has_value());
}

TEST(SurfacesFrom, AreTheSameAtAnyNumberOfThreads) {
  const ContourStack stack = cuts(folded(1.f), folded(.75f));
  const auto with = [&](unsigned threads) {
    const ThreadLimit limit(threads);
    return made(stack).outer;
  };
  const Mesh one = with(1), two = with(2);
  EXPECT_EQ(one.positions, two.positions);
  EXPECT_EQ(one.triangles, two.triangles);
}

TEST(SurfacesFrom, RefuseWhatCannotBeWithASentence) {
  const ContourStack good = cuts(folded(1.f), folded(.75f));
  const auto sentence = [](const ContourStack& stack, const SurfaceOptions& options = {.error = 0.}) {
    return refused([&] { (void)made(stack, options); });
  };
  EXPECT_EQ(sentence(good), "");
  EXPECT_NE(sentence(good, {.outer = "inner", .inner = "outer"}).find("outside"), std::string::npos);
  EXPECT_NE(sentence(good, {.outer = "pia"}).find("'pia'"), std::string::npos);
  // What others there are is not looked at.
  ContourStack more = good;
  more.objects.push_back("dendrite");
  for (Section& section : more.sections)
    section.contours.push_back(
        {2, straight_loop(std::array<Place, 4>{{{0., 0.}, {9e6, 9e6}, {9e6, 0.}, {0., 9e6}}})});
  EXPECT_EQ(sentence(more), "");
  EXPECT_NE(sentence(good, {.voxel = 1.}).find("million points"), std::string::npos);
  // Grey matter alone, with the white matter in its holes.
  ContourStack grey = good;
  for (Section& section : grey.sections)
    for (std::size_t i = 0, count = section.contours.size(); i < count; ++i)
      if (section.contours[i].object == 1) {
        Contour hole = section.contours[i];
        hole.object = 0;
        std::ranges::reverse(hole.curve.points);
        std::ranges::rotate(hole.curve.points, hole.curve.points.end() - 1);
        section.contours.push_back(hole);
      }
  EXPECT_NE(sentence(grey).find("in holes of 'outer'; the outer boundary must hold grey and white matter"),
            std::string::npos)
      << sentence(grey);
  ContourStack one_swapped = good;
  for (Contour& contour : one_swapped.sections[good.sections.size() / 2].contours) contour.object ^= 1u;
  EXPECT_NE(sentence(one_swapped).find("exchange them there"), std::string::npos) << sentence(one_swapped);
  ContourStack end_swapped = good;  // the last that has both
  for (std::size_t i = good.sections.size(); i-- > 0;)
    if (std::ranges::any_of(good.sections[i].contours, [](const Contour& c) { return c.object == 1; })) {
      for (Contour& contour : end_swapped.sections[i].contours)
        contour.curve.points =
            contour.object == 1 ? good.sections[i].contours[0].curve.points : contour.curve.points;
      for (Contour& contour : end_swapped.sections[i].contours)
        if (contour.object == 1)
          for (Place& p : contour.curve.points) p.x() += 30e3;  // beside the outer one
      break;
    }
  EXPECT_NE(sentence(end_swapped).find("lies outside"), std::string::npos) << sentence(end_swapped);
  ContourStack undrawn = good;
  for (Section& section : undrawn.sections)
    std::erase_if(section.contours, [](const Contour& c) { return c.object == 1; });
  EXPECT_NE(sentence(undrawn).find("no section has a contour of 'inner'"), std::string::npos)
      << sentence(undrawn);
  ContourStack two_missing = good;
  two_missing.sections.erase(two_missing.sections.begin() + 4, two_missing.sections.begin() + 6);
  EXPECT_NE(sentence(two_missing).find("between section 4 "), std::string::npos) << sentence(two_missing);
  EXPECT_NE(sentence(two_missing).find(" 2 are missing"), std::string::npos);
  ContourStack missing = good;
  missing.sections.erase(missing.sections.begin() + 12);
  EXPECT_NE(sentence(missing).find(" 1 is missing"), std::string::npos) << sentence(missing);
  ContourStack uneven = good;
  uneven.sections[5].at += 300.;
  EXPECT_NE(sentence(uneven).find("equal distances"), std::string::npos);
  // A twenty-fifth of it is as large as a fly's brain; a thousandth is what was measured in mm and calls itself µm.
  const auto shrunk = [&](double times) {
    ContourStack stack = good;
    for (Section& section : stack.sections) {
      section.at *= times;
      for (Contour& contour : section.contours)
        for (Place& p : contour.curve.points) p *= times;
    }
    return stack;
  };
  EXPECT_EQ(sentence(shrunk(.04)), "");
  EXPECT_NE(sentence(shrunk(.001)).find("as no brain does; look at their unit: in mm it would be 2"),
            std::string::npos)
      << sentence(shrunk(.001));
  ContourStack one = good;
  one.sections.resize(1);
  EXPECT_NE(sentence(one).find("two sections"), std::string::npos);
  ContourStack empty = good;
  for (Section& section : empty.sections) section.contours.clear();
  EXPECT_NE(sentence(empty).find("no contours"), std::string::npos);
}

TEST(SignedDistances, AreThoseOfACircle) {
  std::vector<Place> circle;
  for (int i = 0; i < 2000; ++i)
    circle.push_back(1000. * Place(std::cos(i * M_PI / 1000.), std::sin(i * M_PI / 1000.)));
  Section section;
  section.contours.push_back({.object = 3, .curve = straight_loop(circle)});
  const auto distances = signed_distances(section, 3, {-2000., -2000.}, 100., 41, 41, 800.);
  for (std::size_t y = 0; y < 41; ++y)
    for (std::size_t x = 0; x < 41; ++x) {
      const double wanted = std::hypot(100. * double(x) - 2000., 100. * double(y) - 2000.) - 1000.;
      EXPECT_NEAR(distances[y * 41 + x], std::clamp(wanted, -800., 800.), .01);
    }
  for (const float value : signed_distances(section, 2, {-2000., -2000.}, 100., 41, 41, 800.))
    EXPECT_EQ(value, 800.f);  // of another object nothing is known
}

}  // namespace
}  // namespace forest::cortex
