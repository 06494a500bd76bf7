// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/build.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "forest/core/error.h"
#include "forest/core/parallel.h"
#include "forest/core/random.h"
#include "forest/cortex/check_surfaces.h"
#include "forest/cortex/fit_faces.h"
#include "forest/cortex/folds.h"
#include "forest/cortex/gaps.h"
#include "forest/cortex/gauge.h"
#include "forest/cortex/report.h"
#include "forest/cortex/shape.h"

#include "tests/effort.h"

namespace forest::cortex {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

// A ball whose radius (µm) depends on the direction.
template <class Radius>
Mesh star(int halvings, Radius&& radius) {
  Mesh mesh = icosphere(Vec3::Zero(), 1.f, halvings, 0);
  for (Vec3& p : mesh.positions) p = p.normalized() * float(radius(p.normalized()));
  return mesh;
}
Mesh ball(double radius, int halvings = 5) {
  return star(halvings, [&](const Vec3&) { return radius; });
}

std::string refusal(const Mesh& outer, const Mesh& inner) {
  try {
    (void)check_surfaces(outer, inner);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

// Between balls everything is known: the field falls as 1/r.
struct Shell : ::testing::Test {
  static constexpr double inside = 8000., outside = 10000.;
  struct Made {
    Mesh outer = ball(outside), inner = ball(inside);
    Laplace field{outer, inner, {.spacing = 250.}};
    Boundary above{outer}, below{inner};
    WCurves curves{field, above, below};
    Cortex cortex = build();

    Cortex build() const {
      return build_cortex(outer, inner, {.volume = wanted, .spacing = 400.}, Progress::none());
    }
  };
  static constexpr double wanted = 2e9;  // µm³ of an element
  static const Made& made() {
    static const Made once;  // for all tests
    return once;
  }
  const Mesh &outer = made().outer, &inner = made().inner;
  const Laplace& field = made().field;
  const TriangleTree& tree = made().below.tree();
  const WCurves& curves = made().curves;
};

TEST_F(Shell, TheSlopeIsThatOfOneOverR) {
  LONG_TEST();
  for (const Place& way : {Place(1., 2., 3.), Place(-1., .1, 0.), Place(.3, -.7, .2)})
    for (const double r : {8200., 8900., 9700.}) {
      const auto slope = field.gradient(r * way.normalized(), way);
      ASSERT_TRUE(slope);
      const double known = 1. / (r * r) / (1. / inside - 1. / outside);
      EXPECT_NEAR(slope->norm(), known, .01 * known);
      EXPECT_GT(slope->normalized().dot(way.normalized()), std::cos(.01));
    }
  EXPECT_FALSE(field.gradient(Place(100., 0., 0.), Place(1., 0., 0.)));
}

TEST_F(Shell, WCurvesAreRadiiAndTheirDepthsShareTheVolume) {
  const Place way = Place(.2, -.5, .8).normalized();
  const auto start = TriangleTree(outer).first(Place::Zero(), 2. * outside * way)->at;
  const WCurve curve = curves.drop(start, -way);
  EXPECT_TRUE(curve.arrived);
  EXPECT_NEAR(curve.length(), outside - inside, 15.);
  for (const double w : {.25, .5, .75}) {
    const double r = std::cbrt(std::pow(outside, 3) * (1. - w) + std::pow(inside, 3) * w);
    EXPECT_NEAR(curve.at(w).norm(), r, 12.);
    EXPECT_NEAR(curve.at_length(w).norm(), outside - w * (outside - inside), 12.);
    EXPECT_GT(curve.at(w).normalized().dot(way), std::cos(.005));
  }
}

TEST_F(Shell, ACurveThroughAPlaceIsTheOneDroppedFromAboveIt) {
  const Place way = Place(.3, -.5, .7).normalized();
  for (const double from : {8300., 9000., 9800.}) {
    // What is given as the way inwards may be wrong by 40°.
    const auto curve = curves.through(from * way, -way + .8 * way.unitOrthogonal());
    ASSERT_TRUE(curve);
    EXPECT_TRUE(curve->arrived);
    EXPECT_NEAR(curve->length(), outside - inside, 15.);
    EXPECT_NEAR(curve->points.front().norm(), outside, 15.);
    EXPECT_NEAR(curve->points.back().norm(), inside, 15.);
    const double r = std::cbrt((std::pow(outside, 3) + std::pow(inside, 3)) / 2.);
    EXPECT_NEAR(curve->at(.5).norm(), r, 12.);
    for (const double w : {0., .5, 1.}) EXPECT_GT(curve->at(w).normalized().dot(way), std::cos(.005));
    EXPECT_TRUE(std::ranges::is_sorted(curve->volume));
  }
  EXPECT_FALSE(curves.through(1.5 * outside * way, -way));  // the field has no slope there
}

TEST_F(Shell, AFoldedMiddleIsUnfoldedAndTheRestStays) {
  const Ribbon made = make_ribbon(outer, curves, {.edge = 500.}, Progress::none());
  const auto turned = [](const Ribbon& ribbon) {
    return std::ranges::count_if(ribbon.triangles, [&](const Triangle& t) {
      const Place a = ribbon.middle[t[0]], b = ribbon.middle[t[1]], c = ribbon.middle[t[2]];
      return (b - a).cross(c - a).dot(a) <= 0.;
    });
  };
  Ribbon ribbon = made;
  Random random(1, 2, 3);
  std::vector<std::uint8_t> near(ribbon.size(), 0);
  for (std::size_t v = 0; v < ribbon.size(); ++v) {
    if (ribbon.middle[v].x() < 8000.) continue;
    ribbon.middle[v] += 400. * Place(0., random.normal(), random.normal());
    ribbon.middle[v] *= made.middle[v].norm() / ribbon.middle[v].norm();
    near[v] = 1;
  }
  ASSERT_GT(turned(ribbon), 50);
  const Ribbon after = unfolded(ribbon, curves, Progress::none());
  EXPECT_EQ(turned(after), 0);
  double sum = 0., radius = 0.;
  for (const Triangle& t : after.triangles) sum += volume_under(after, t);
  EXPECT_NEAR(sum, volume(outer) - volume(inner), .005 * sum);
  for (std::size_t v = 0; v < after.size(); ++v) {
    if (made.middle[v].x() < 6000.) {
      EXPECT_EQ(after.middle[v], made.middle[v]);
    }
    EXPECT_LT((after.middle[v] - ribbon.middle[v]).norm(), 1500.);  // nor off the end of a pocket
    if (near[v]) radius = std::max(radius, std::abs(after.middle[v].norm() - made.middle[v].norm()));
  }
  EXPECT_LT(radius, 150.);  // along the middle, not off it
}

TEST_F(Shell, ACrumpledSurfaceHasElementsAsEvenAsASmoothOne) {
  LONG_TEST();
  Mesh crumpled = outer;
  Random random(1, 2, 3);
  for (Vec3& p : crumpled.positions)
    if (p.x() > .5 * outside) p += p.normalized() * float(120. * random.normal());
  const Cortex cortex = build_cortex(crumpled, inner, {.volume = wanted, .spacing = 400.}, Progress::none());
  const Report r = report(cortex, wanted, nullptr, nullptr, Progress::none());
  EXPECT_EQ(r.uncertified, 0u);
  EXPECT_GT(r.volume_within, .99);
  EXPECT_LT(r.volume_error, .0015);
  EXPECT_GT(r.jacobian_least, .5);
}

TEST_F(Shell, ARibbonHasTheVolumeBetweenTheSurfaces) {
  const Ribbon ribbon = make_ribbon(outer, curves, {.edge = 500.}, Progress::none());
  double sum = 0.;
  for (const Triangle& t : ribbon.triangles) {
    EXPECT_GT(volume_under(ribbon, t), 0.);
    sum += volume_under(ribbon, t);
  }
  const double between = volume(outer) - volume(inner);
  EXPECT_NEAR(sum, between, .002 * between);
  EXPECT_EQ(std::count(ribbon.wall.begin(), ribbon.wall.end(), 1), 0);
}

TEST_F(Shell, AnIslandInTheWallIsWall) {
  // Towards +x the surfaces are .3 mm apart, but for a spot in the middle.
  const auto thin = [](double from, double to) {
    return star(6, [&](const Vec3& d) { return d.x() < from || d.x() > to ? outside : inside + 300.; });
  };
  const auto wall_of = [&](const Mesh& mesh, double least) {
    const Boundary surface(mesh);
    const Laplace between(mesh, inner, {.spacing = 250.});
    const WCurves own(between, surface, made().below);
    const Ribbon r = make_ribbon(mesh, own, {.edge = 500., .least_wall = least}, Progress::none());
    std::pair<std::size_t, std::size_t> result{0, 0};  // in the spot, and elsewhere
    for (std::size_t v = 0; v < r.size(); ++v)
      (r.outer[v].normalized().x() > .9 ? result.first : result.second) += r.wall[v];
    return result;
  };
  const auto island = wall_of(thin(.8, .97), 50e6);  // 19 mm² in a wall of 107
  const auto whole = wall_of(thin(.8, 2.), 50e6);
  EXPECT_GT(whole.first, 500u);
  EXPECT_EQ(island.first, whole.first);
  EXPECT_EQ(island.second, whole.second);
  const auto larger = wall_of(thin(.8, .97), 10e6);  // than what a wall has to be: it stays
  EXPECT_LT(larger.first, whole.first - 100);
}

TEST_F(Shell, TheWallHasTheVolumeUnderIt) {
  LONG_TEST();
  // Towards +x the surfaces are .3 mm apart.
  const Mesh thin = star(6, [](const Vec3& d) { return d.x() > .8f ? inside + 300. : outside; });
  const Mesh even = ball(inside, 6);
  const double wall = build_cortex(thin, even, {.volume = wanted, .spacing = 400.}, Progress::none()).wall;
  const double cap = 2. * double(pi) / 3. * .2 * (std::pow(inside + 300., 3) - std::pow(inside, 3));
  EXPECT_GT(wall, cap);  // and triangles at its rim, which reach up 1.7 mm
  EXPECT_LT(wall, 3. * cap);
}

TEST_F(Shell, ACoarserRibbonIsTheOneOfTheTrianglesBeforeTheyWereHalved) {
  const Ribbon once = make_ribbon(outer, curves, {.edge = 200.}, Progress::none());
  ASSERT_EQ(once.halvings, 1);
  const Ribbon before = coarser(once);
  EXPECT_EQ(before.halvings, 0);
  EXPECT_EQ(before.triangles, outer.triangles);
  ASSERT_EQ(before.size(), outer.positions.size());
  for (std::size_t v = 0; v < before.size(); v += 97)
    EXPECT_EQ(before.outer[v], outer.positions[v].cast<double>());
  EXPECT_EQ(before.inner.size(), before.size());
  EXPECT_EQ(before.wall.size(), before.size());
  EXPECT_EQ(coarser(before).triangles, before.triangles);
}

TEST_F(Shell, WhatIsTangledBeginsAnewAndTheRestStays) {
  Elements elements = made().cortex.elements;
  const std::vector<Depths> before = elements.curves;
  even_out(elements, {}, 2);
  EXPECT_EQ(elements.curves, before);
  for (const std::uint32_t e : {7u, 450u}) {
    elements.curves = before;
    const auto corners = elements.corners_of(e);
    std::swap(elements.curves[corners[0]], elements.curves[corners[3]]);
    const auto tangled = uncertified(elements);
    ASSERT_GT(tangled.size(), 2u);
    even_out(elements, tangled, 2);
    EXPECT_TRUE(uncertified(elements).empty()) << e;
    std::size_t moved = 0;
    for (std::size_t c = 0; c < before.size(); ++c) moved += elements.curves[c] != before[c];
    EXPECT_GT(moved, 100u);
    EXPECT_LT(moved, before.size() / 3);
  }
}

TEST_F(Shell, AHeapThatCannotBeMendedDoesNotKeepOthersFromBeginningAnew) {
  LONG_TEST();
  Elements elements = made().cortex.elements;
  constexpr std::uint32_t mendable = 7, hopeless = 450;
  const auto corners = elements.corners_of(mendable);
  std::swap(elements.curves[corners[0]], elements.curves[corners[3]]);
  for (const std::size_t k : {1u, 2u, 3u})  // an edge without a length
    elements.elements[hopeless][k] = elements.elements[hopeless][0];
  const std::vector<Depths> before = elements.curves;
  const auto tangled = uncertified(elements);
  ASSERT_GT(tangled.size(), 3u);
  const TriangleTree outer_tree(outer);
  begin_anew(elements, {outer_tree, tree}, {.volume = wanted}, .2, Progress::none());
  EXPECT_EQ(uncertified(elements), std::vector<std::uint32_t>{hopeless});
  std::size_t moved = 0;
  for (std::size_t c = 0; c < before.size(); ++c) moved += elements.curves[c] != before[c];
  EXPECT_LT(moved, before.size() / 3);

  Elements well = made().cortex.elements;
  begin_anew(well, {outer_tree, tree}, {.volume = wanted}, .2, Progress::none());
  EXPECT_EQ(well.curves, made().cortex.elements.curves);
}

// Elements whose faces go up and down.
Elements wavy_ones(Elements elements) {
  for (Depths& curve : elements.curves) {
    curve[0] *= 1. + .006 * std::sin(curve[0].x() / 300.);
    curve[3] *= 1. + .006 * std::sin(curve[3].y() / 300.);
  }
  return elements;
}
// How far faces are from their surfaces, µm, outer and inner, by 199 of 200 places: a face by a fault of the lattice stays where it
// would cost its element its shape.
std::pair<double, double> farthest(const Elements& elements, const SurfaceTrees& surfaces) {
  std::vector<double> outside_by, inside_by;
  for (std::size_t e = 0; e < elements.size(); ++e) {
    const Hexahedron h = elements.hexahedron(e);
    for (const double u : {0., .2, .5, .9}) {
      outside_by.push_back(surfaces.outer.nearest(h.at(u, .3, 0.))->distance);
      inside_by.push_back(surfaces.inner.nearest(h.at(u, .3, 1.))->distance);
    }
  }
  std::ranges::sort(outside_by), std::ranges::sort(inside_by);
  return {outside_by[outside_by.size() * 199 / 200], inside_by[inside_by.size() * 199 / 200]};
}

TEST_F(Shell, FacesComeToTheSurfacesAndElementsStayValid) {
  const TriangleTree outer_tree(outer);
  const SurfaceTrees surfaces{outer_tree, tree};
  Elements wavy = wavy_ones(made().cortex.elements);
  ASSERT_GT(farthest(wavy, surfaces).first, 50.);
  ASSERT_GT(farthest(wavy, surfaces).second, 40.);
  const auto folded = uncertified(wavy);  // by the waves
  ASSERT_LE(folded.size(), 3u);
  Elements as_a_whole = wavy;
  fit_faces(as_a_whole, surfaces, Fit::mean);
  for (std::size_t c = 0; c < wavy.corners; ++c) EXPECT_EQ(as_a_whole.curves[c], wavy.curves[c]);
  fit_faces(wavy, surfaces, Fit::places);
  EXPECT_LT(farthest(wavy, surfaces).first, 10.);
  EXPECT_LT(farthest(wavy, surfaces).second, 10.);
  EXPECT_TRUE(std::ranges::includes(folded, uncertified(wavy)));
  EXPECT_LT(farthest(wavy, surfaces).first, farthest(as_a_whole, surfaces).first);
}

TEST_F(Shell, ShapesAreMendedWithFacesHeldClose) {
  const TriangleTree outer_tree(outer);
  const SurfaceTrees surfaces{outer_tree, tree};
  const Elements wavy = wavy_ones(made().cortex.elements);
  const auto low = [](const Elements& elements) {  // scaled Jacobian, by 99 of 100
    std::vector<float> least = look(elements).least;
    std::ranges::sort(least);
    return least[least.size() / 100];
  };
  const auto shaped = [&](double close) {
    Elements elements = wavy;
    improve_shapes(
        elements, surfaces,
        {.enough = .5, .wanted = .62, .volume = wanted, .along = 1600., .off = 10., .close = close},
        Progress::none());
    return elements;
  };
  const Elements close = shaped(15.), by_curves = shaped(0.);
  {
    const ThreadLimit one(1);
    EXPECT_EQ(shaped(15.).curves, close.curves);
  }
  EXPECT_LT(farthest(close, surfaces).first, 15.);
  EXPECT_LT(farthest(close, surfaces).second, 15.);
  EXPECT_GT(farthest(by_curves, surfaces).first, 30.);  // what has a good shape stays where it is
  EXPECT_GT(low(close), low(wavy));
  EXPECT_TRUE(std::ranges::includes(uncertified(wavy), uncertified(close)));
}

TEST_F(Shell, GapsAreTheVolumeThatElementsLackAndFacesTakeIt) {
  const TriangleTree outer_tree(outer);
  Elements thin = made().cortex.elements;
  for (Depths& curve : thin.curves)
    curve[0] *= .99, curve[3] *= 1.005 + .005 * std::sin(curve[3].x() / 3000.);
  const auto missing = [&] {
    double sum = made().cortex.between;
    for (std::size_t e = 0; e < thin.size(); ++e) sum -= thin.hexahedron(e).volume();
    return sum;
  };
  const auto sum_of = [](const std::vector<double>& of) { return std::accumulate(of.begin(), of.end(), 0.); };
  const double before = missing(), above = sum_of(gaps(thin, 0, outer_tree)),
               below = sum_of(gaps(thin, 3, tree));
  ASSERT_GT(before, .02 * made().cortex.between);
  EXPECT_GT(above, .1 * before);
  EXPECT_GT(below, .1 * before);
  EXPECT_NEAR(above + below, before, .03 * before);
  const ThreadLimit one(1);
  EXPECT_EQ(sum_of(gaps(thin, 0, outer_tree)), above);
  fit_faces(thin, {outer_tree, tree}, Fit::volume);
  EXPECT_LT(std::abs(missing()), .03 * before);
  EXPECT_TRUE(uncertified(thin).empty());
}

TEST_F(Shell, WhatIsMissingIsSpreadEvenlyAndSoIsWhatIsTooMuch) {
  const Elements before = made().cortex.elements;
  double volume = 0.;
  for (std::size_t e = 0; e < before.size(); ++e) volume += before.hexahedron(e).volume();
  for (const double share : {.99, 1.01}) {
    Elements elements = before;
    keep_volume(elements, share * volume);
    double kept = 0.;
    std::vector<double> ways;
    for (std::size_t e = 0; e < elements.size(); ++e) kept += elements.hexahedron(e).volume();
    EXPECT_NEAR(kept, share * volume, 1e-4 * volume);
    EXPECT_TRUE(uncertified(elements).empty());
    for (std::size_t c = 0; c < before.curves.size(); ++c)
      for (const std::size_t depth : {0, 3})
        ways.push_back((elements.curves[c][depth] - before.curves[c][depth]).norm());
    std::ranges::sort(ways);  // some stay, where an element would lose its shape
    EXPECT_LE(ways.back(), 25.);
    EXPECT_GT(ways[ways.size() / 20], .8 * ways.back());
  }
  Elements too_much = before;
  keep_volume(too_much, 2. * volume);
  for (std::size_t c = 0; c < before.curves.size(); ++c)
    EXPECT_LE((too_much.curves[c][0] - before.curves[c][0]).norm(), 25.001);
}

TEST_F(Shell, ElementsAreValidEvenWholeAndTheSameAtAnyNumberOfThreads) {
  const Cortex& cortex = made().cortex;
  const TriangleTree outer_tree(outer);
  const Report r = report(cortex, wanted, &outer_tree, &tree, Progress::none());
  EXPECT_EQ(r.uncertified, 0u);
  EXPECT_LT(r.volume_error, .002);
  EXPECT_NEAR(r.volume_mean, wanted, .01 * wanted);
  EXPECT_GT(r.volume_within, .95);
  EXPECT_EQ(cortex.w_reached, 1.);
  EXPECT_LT(cortex.w_angle.p99, 3.);
  EXPECT_LT(r.equivolume_error, .005);
  EXPECT_LT(r.bulge_p99, 20.);
  EXPECT_LT(r.outer.value().p99, 30.);
  EXPECT_LT(r.inner.value().p99, 30.);

  // Every side between two elements, and Euler's number that of a ball: nothing is left open or lies double.
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> sides;
  std::vector<std::uint8_t> used(cortex.elements.corners, 0);
  for (std::size_t e = 0; e < cortex.elements.size(); ++e) {
    const auto c = cortex.elements.corners_of(e);
    for (const auto& [a, b] : {std::pair{c[0], c[1]}, {c[1], c[3]}, {c[3], c[2]}, {c[2], c[0]}})
      ++sides[std::minmax(a, b)], used[a] = 1;
  }
  for (const auto& [side, times] : sides) EXPECT_EQ(times, 2);
  EXPECT_EQ(std::count(used.begin(), used.end(), 1) - long(sides.size()) + long(cortex.elements.size()), 2);

  const ThreadLimit one(1);
  const Cortex again = made().build();
  EXPECT_EQ(again.elements.elements, cortex.elements.elements);
  EXPECT_EQ(again.elements.curves, cortex.elements.curves);
}

TEST(SmallCortex, HasElementsOfTheVolumeWantedInTheMean) {
  LONG_TEST();
  const auto radius = [](const Vec3& at) {
    return 4500. + 1600. * std::sin(7. * at.x()) * std::cos(6. * at.y()) * std::cos(5. * at.z());
  };
  const Mesh outer = star(5, radius), inner = star(5, [&](const Vec3&at) { return radius(at) - 900.; });
  const Laplace field(outer, inner, {.spacing = 300.}, Progress::none());
  const Boundary outside(outer), inside(inner);
  const WCurves curves(field, outside, inside);
  const double whole = volume(outer) - volume(inner);
  for (const double each : {2e8, 5e8}) {
    const Folds folds = find_folds(make_ribbon(outer, curves, {.edge = ribbon_edge(each)}, Progress::none()),
                                   curves, 1500., Progress::none());
    const Quads quads =
        lay_quads(folds.ribbon, folds.bent, folds.lines, {.volume = each, .whole = whole}, Progress::none());
    EXPECT_NEAR(whole / double(quads.quads.size()), each, .008 * each);
  }
}

TEST_F(Shell, NoiseShuffledFootprintsSwappedSurfacesAndDepthByLengthAreReported) {
  const Cortex& cortex = made().cortex;
  Cortex noisy = cortex;
  Random random(7);
  for (Depths& curve : noisy.elements.curves)
    for (Place& p : curve) p += 300. * Place(random.normal(), random.normal(), random.normal());
  const Report of_noise = report(noisy, wanted, nullptr, nullptr, Progress::none());
  EXPECT_GT(of_noise.uncertified, noisy.elements.size() / 2);

  Cortex shuffled = cortex;  // u and v against one another in every element
  for (auto& e : shuffled.elements.elements)
    for (std::size_t i = 0; i < 4; ++i)
      for (std::size_t j = 0; j < i; ++j) std::swap(e[4 * i + j], e[4 * j + i]);
  EXPECT_EQ(report(shuffled, wanted, nullptr, nullptr, Progress::none()).uncertified,
            shuffled.elements.size());

  Cortex swapped = cortex;  // the inner surface outside
  for (Depths& curve : swapped.elements.curves) std::swap(curve[0], curve[3]), std::swap(curve[1], curve[2]);
  EXPECT_EQ(report(swapped, wanted, nullptr, nullptr, Progress::none()).uncertified, swapped.elements.size());

  Cortex equidistant = cortex;  // thirds of the length, where thirds of the volume are claimed
  for (Depths& curve : equidistant.elements.curves) {
    const Place first = curve[0], last = curve[3];
    curve[1] = (2. * first + last) / 3., curve[2] = (first + 2. * last) / 3.;
  }
  EXPECT_GT(report(equidistant, wanted, nullptr, nullptr, Progress::none()).equivolume_error, .02);
}

TEST(CheckSurfaces, NamesWhatIsWrong) {
  const Mesh outer = ball(10e3, 3), inner = ball(8e3, 3);
  EXPECT_EQ(refusal(outer, inner), "");
  EXPECT_THAT(refusal(inner, outer), HasSubstr("swapped"));
  EXPECT_THAT(refusal(outer, outer), HasSubstr("give the outer and the inner one"));
  Mesh open = outer;
  open.triangles.pop_back();
  EXPECT_THAT(refusal(open, inner), HasSubstr("outer surface is open"));
  EXPECT_THAT(refusal(open, inner), HasSubstr("at the edge of vertices"));
  Mesh one_turned = outer;
  std::swap(one_turned.triangles[7][0], one_turned.triangles[7][1]);
  EXPECT_THAT(refusal(one_turned, inner),
              HasSubstr("of the outer surface face opposite ways at the edge of"));
  EXPECT_THAT(refusal(one_turned, inner), HasSubstr("triangles 4 and 7 of"));
  Mesh doubled = outer;
  doubled.triangles.push_back(doubled.triangles[7]);
  EXPECT_THAT(refusal(doubled, inner), HasSubstr("3 triangles of the outer surface meet at the edge of"));
  Mesh flat = outer;
  flat.triangles[7][1] = flat.triangles[7][0];
  EXPECT_THAT(refusal(flat, inner), HasSubstr("triangle 7 of the outer surface has one vertex twice"));
  Mesh nowhere = inner;
  nowhere.positions[17].y() = NAN;
  EXPECT_THAT(refusal(outer, nowhere), HasSubstr("vertex 17 of the inner surface"));
  Mesh turned = inner;
  for (Triangle& t : turned.triangles) std::swap(t[0], t[1]);
  EXPECT_THAT(refusal(outer, turned), HasSubstr("inner surface face inwards"));
  Mesh two = inner;
  append(two, ball(1e3, 1));
  EXPECT_THAT(refusal(outer, two), HasSubstr("2 pieces"));
  Mesh beside = inner;
  for (Vec3& p : beside.positions) p += Vec3(5e3f, 0, 0);
  EXPECT_THAT(refusal(outer, beside), HasSubstr("lie outside of the outer one"));
  EXPECT_THAT(refusal(ball(10., 3), ball(8., 3)), HasSubstr("check that it is in mm and not in m"));
  EXPECT_THAT(refusal(ball(1e7, 3), ball(8e6, 3)), HasSubstr("check that it is in mm and not in µm"));
  EXPECT_THAT(refusal(outer, ball(8., 3)), HasSubstr("check that both are in mm"));
}

// A ball with tunnels: a square of two triangles on either side, and a tube between them.
Mesh with_handles(int count) {
  constexpr int n = 24;
  std::map<std::array<int, 3>, std::uint32_t> corners;
  Mesh mesh;
  const auto solid = [&](int x, int y, int z) {
    const auto in = [](int c) { return c >= 0 && c < n; };
    const bool tunnel = y / 4 == 2 && x % 6 / 2 == 1 && x / 6 < count;
    return in(x) && in(y) && in(z) && !tunnel;
  };
  const auto corner = [&](std::array<int, 3> at) {
    const auto [place, fresh] = corners.try_emplace(at, std::uint32_t(mesh.positions.size()));
    if (fresh) mesh.positions.push_back(Vec3(float(at[0]), float(at[1]), float(at[2])) * 800.f);
    return place->second;
  };
  for (int x = 0; x < n; ++x)
    for (int y = 0; y < n; ++y)
      for (int z = 0; z < n; ++z)
        for (int axis = 0; axis < 3 && solid(x, y, z); ++axis)
          for (const int side : {0, 1}) {
            std::array<int, 3> next{x, y, z};
            next[std::size_t(axis)] += side ? 1 : -1;
            if (solid(next[0], next[1], next[2])) continue;
            const auto at = [&](int u, int v) {
              std::array<int, 3> c{x, y, z};
              c[std::size_t(axis)] += side, c[std::size_t(axis + 1) % 3] += u,
                  c[std::size_t(axis + 2) % 3] += v;
              return corner(c);
            };
            const std::array q{at(0, 0), at(1, 0), at(1, 1), at(0, 1)};
            for (const auto& [a, b, c] : {std::array{0, 1, 2}, std::array{0, 2, 3}})
              mesh.triangles.push_back(
                  {q[std::size_t(a)], q[std::size_t(side ? b : c)], q[std::size_t(side ? c : b)]});
          }
  mesh.labels.assign(mesh.positions.size(), 0);
  return mesh;
}

TEST(CheckSurfaces, HandlesAreCountedAndPartsThatTouchAreNone) {
  const Mesh inner = ball(3e3);
  EXPECT_THAT(refusal(with_handles(1), inner), HasSubstr("the outer surface has 1 handle;"));
  EXPECT_THAT(refusal(with_handles(2), inner), HasSubstr("the outer surface has 2 handles;"));
  EXPECT_THAT(refusal(with_handles(0), inner), Not(HasSubstr("handle")));
  Mesh touching = ball(10e3);
  const auto size = std::uint32_t(touching.positions.size());
  Mesh other = ball(1e3);
  for (Vec3& p : other.positions) p += touching.positions[5] - 1.1f * other.positions[3];
  append(touching, other);
  for (Triangle& t : touching.triangles)
    for (std::uint32_t& v : t)
      if (v == size + 3) v = 5;
  EXPECT_THAT(refusal(touching, inner), HasSubstr("the outer surface touches itself at vertex 5, ("));
}

TEST(CheckSurfaces, ACrossingIsToldAndADeepOneRefused) {
  // A bump of 3 mm width on the inner surface, about which cortex is `thick`.
  const auto inner = [](double size, double thick, double beyond) {
    return star(5, [=](const Vec3& way) {
      const double off = size * std::acos(std::clamp(double(way.dot(Vec3(.6f, 0.f, .8f))), -1., 1.));
      return size - thick + (thick + beyond) * std::exp(-off * off / 2.25e6);
    });
  };
  const Mesh outer = ball(10e3);
  EXPECT_THAT(check_surfaces(outer, inner(10e3, 2e3, -100.)), ::testing::IsEmpty());
  EXPECT_THAT(check_surfaces(outer, inner(10e3, 2e3, 50.)), ::testing::IsEmpty());
  const auto oddities = check_surfaces(outer, inner(10e3, 2e3, 300.));
  ASSERT_EQ(oddities.size(), 1u);
  EXPECT_THAT(oddities[0],
              ::testing::ContainsRegex(
                  "^the surfaces cross: at [0-9]+ of 10242 vertices the inner one lies outside of the "
                  "outer one, at [0-9]+ of 10242 vertices the outer one lies within the inner one, deepest "
                  "by 0.(2[6-9]|30) mm at .[56].[0-9], -?0.[0-9], [78].[0-9]. mm"));
  EXPECT_THAT(refusal(outer, inner(10e3, 2e3, 700.)), HasSubstr("the farthest by 0.6"));
  // Half as thick, half as much: .3 mm is no accident.
  const Mesh small = ball(5e3);
  EXPECT_EQ(refusal(small, inner(5e3, 1e3, 200.)), "");
  EXPECT_THAT(refusal(small, inner(5e3, 1e3, 300.)), HasSubstr("pull the inner one back there"));
}

TEST(CheckSurfaces, FewTrianglesThatCutAreToldAndManyRefused) {
  const Mesh outer = ball(10e3), inner = ball(8e3);
  EXPECT_TRUE(check_surfaces(outer, inner).empty());
  Mesh left = outer;  // a vertex of no triangle
  left.positions.push_back(Vec3::Zero());
  EXPECT_TRUE(check_surfaces(left, inner).empty());
  Mesh few = inner;  // one vertex is pulled through the other side
  few.positions[20] = -1.2f * few.positions[20] + Vec3(137.f, 211.f, 97.f);
  const auto oddities = check_surfaces(outer, few);
  ASSERT_EQ(oddities.size(), 1u);
  EXPECT_THAT(oddities[0], HasSubstr("triangles of the inner surface cut others of it, first"));
  EXPECT_THAT(oddities[0], HasSubstr(" mm"));
  Mesh spike = outer;  // through all of the inner one, to the other side of it
  spike.positions[20] *= -1.f;
  EXPECT_THAT(refusal(spike, inner),
              HasSubstr("of its triangles reach there between theirs, the farthest by 7.8"));
  Mesh many = inner;
  for (std::size_t v = 0; v < many.positions.size(); v += 200)
    many.positions[v] = -1.2f * many.positions[v] + Vec3(137.f, 211.f, 97.f);
  EXPECT_THAT(refusal(outer, many), HasSubstr("triangles of the inner surface cut others"));
}

TEST(CheckSurfaces, OneVertexThatLeavesTheOtherSurfaceIsRefusedIfItIsFar) {
  const Mesh outer = ball(10e3), inner = ball(8e3);
  const auto pulled = [&](float radius) {
    Mesh mesh = inner;
    mesh.positions[20] = radius * mesh.positions[20].normalized();
    return mesh;
  };
  EXPECT_EQ(refusal(outer, pulled(10.4e3f)), "");
  EXPECT_THAT(refusal(outer, pulled(11e3f)),
              HasSubstr("1 of 10242 vertices of the inner surface lie outside"));
}

// Fine and coarse: such triangles cut one another when they are as wide as the noise, and else they do not.
TEST(CheckSurfaces, NoiseIsRefused) {
  for (const int halvings : {4, 5, 6}) {
    const Mesh outer = ball(40e3, halvings), inner = ball(37.5e3, halvings);
    for (const bool of_inner : {false, true})
      for (const double sd : {100., 300.}) {
        Mesh noisy = of_inner ? inner : outer;
        Random random(3);
        for (Vec3& p : noisy.positions)
          p += Eigen::Vector3d(random.normal(0., sd), random.normal(0., sd), random.normal(0., sd))
                   .cast<float>();
        const std::string said = of_inner ? refusal(outer, noisy) : refusal(noisy, inner);
        if (sd < 200.)
          EXPECT_EQ(said, "") << halvings;
        else
          EXPECT_THAT(said, HasSubstr(of_inner ? "vertices of the inner surface scatter by 0.3"
                                               : "vertices of the outer surface scatter by 0."))
              << halvings;
      }
  }
}

TEST(Lines, ACrestRunsAroundALensAndAValleyAroundAWaist) {
  const auto lines_on = [](const Mesh& mesh) {
    Ribbon ribbon;
    for (const Vec3& p : mesh.positions) ribbon.middle.push_back(p.cast<double>());
    ribbon.triangles = mesh.triangles;
    ribbon.wall.assign(ribbon.size(), 0);
    const auto bent =
        curvatures(ribbon.middle, ribbon.triangles, neighbours(ribbon.size(), ribbon.triangles), 500.);
    return crests_and_valleys(ribbon, bent, {.least_strength = .5});
  };
  // All lines of a kind lie by the equator, and make up the most of it.
  const auto expect_around = [](const std::vector<Line>& lines, Line::Kind kind, double radius) {
    double length = 0.;
    for (const Line& line : lines) {
      if (line.kind != kind) continue;
      for (const Place& p : line.points) EXPECT_LT(std::abs(p.z()), 250.);
      for (std::size_t i = 0; i + 1 < line.points.size(); i += 7)
        EXPECT_LT(std::abs(line.direction(i).z()), .1);
      for (std::size_t i = 1; i < line.points.size(); ++i)
        length += (line.points[i] - line.points[i - 1]).norm();
    }
    EXPECT_GT(length, .9 * 2. * double(pi) * radius);
    EXPECT_LT(length, 1.1 * 2. * double(pi) * radius);
  };
  expect_around(lines_on(star(6,
                              [](const Vec3& d) {
                                return 1. / std::sqrt(double(d.x() * d.x() + d.y() * d.y()) / 1e8 +
                                                      double(d.z() * d.z()) / 1.6e7);
                              })),
                Line::Kind::crest, 1e4);
  expect_around(lines_on(star(6, [](const Vec3& d) { return 6e3 + 9e3 * double(d.z() * d.z()); })),
                Line::Kind::valley, 6e3);
}

}  // namespace
}  // namespace forest::cortex
