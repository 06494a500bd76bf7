// SPDX-License-Identifier: Apache-2.0
#include "forest/circuit/plant_elements.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>

#include <boost/math/distributions/chi_squared.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "forest/core/parallel.h"
#include "forest/cortex/curved_elements.h"
#include "forest/cortex/slab_test.h"
#include "forest/cortex/warp.h"

#include "tests/effort.h"
#include "tests/refused.h"

namespace forest::circuit {
namespace {

using cortex::Hexahedron;
using testing::HasSubstr;
using Place = Eigen::Vector3d;

// Three layers of unlike densities and somata.
Recipe layered() {
  Recipe recipe;
  recipe.radius = 200.f;
  recipe.types = {{"small", "s"}, {"large", "l", false}};
  recipe.layers = {{"L1", 200.f, 6000., {}, {1., 0.}},
                   {"L2", 500.f, 60000., {}, {.8, .2}},
                   {"L3", 900.f, 25000., {}, {.5, .5}}};
  recipe.soma_gap = .5f;
  return recipe;
}
const std::vector<Candidate> candidates{{"s1", "s", 4.f, 150.f},
                                        {"s2", "s", 6.f, 600.f},
                                        {"l1", "l", 7.f, 300.f},
                                        {"l2", "l", 11.f, 900.f},
                                        {"l3", "l", 60.f, 900.f}};

bool same(const Rooted& a, const Rooted& b) {
  return a.position == b.position && a.orientation == b.orientation && a.uvw == b.uvw &&
         a.candidate == b.candidate && a.type == b.type && a.layer == b.layer && a.turn == b.turn;
}

// How far the surfaces of the two nearest somata are apart, by a grid.
double least_gap(std::span<const Rooted> all) {
  constexpr double cell = 24.;  // wider than two of the widest
  const auto at = [](const Vec3& p, int axis) {
    return std::int64_t(std::floor(double(p[axis]) / cell)) + 100'000;
  };
  std::map<std::array<std::int64_t, 3>, std::vector<std::size_t>> grid;
  for (std::size_t i = 0; i < all.size(); ++i)
    grid[{at(all[i].position, 0), at(all[i].position, 1), at(all[i].position, 2)}].push_back(i);
  double least = 1e9;
  for (const auto& [key, list] : grid)
    for (std::int64_t z = -1; z <= 1; ++z)
      for (std::int64_t y = -1; y <= 1; ++y)
        for (std::int64_t x = -1; x <= 1; ++x) {
          const auto other = grid.find({key[0] + x, key[1] + y, key[2] + z});
          if (other == grid.end()) continue;
          for (const std::size_t i : list)
            for (const std::size_t j : other->second)
              if (i < j)
                least = std::min(least, (all[i].position - all[j].position).cast<double>().norm() -
                                            double(candidates[all[i].candidate].soma_radius) -
                                            double(candidates[all[j].candidate].soma_radius));
        }
  return least;
}

double p_of(std::span<const double> seen, std::span<const double> expected) {
  double sum = 0.;
  for (std::size_t i = 0; i < seen.size(); ++i)
    sum += (seen[i] - expected[i]) * (seen[i] - expected[i]) / expected[i];
  return boost::math::cdf(boost::math::complement(boost::math::chi_squared(double(seen.size() - 1)), sum));
}

TEST(PlantElements, CountsAreThoseOfTheDensitiesToTheLastNeuron) {
  const ElementPlanter planter(layered(), candidates, 1);
  for (const Hexahedron& element : cortex::folded_sheet(3, 2)) {
    const auto wanted = planter.counts(element, 0);
    std::vector<std::vector<std::uint32_t>> planted(3, std::vector<std::uint32_t>(2));
    for (const Rooted& r : planter.plant(element, 0)) ++planted[r.layer][r.type];
    EXPECT_EQ(planted, wanted);
    double before = 0.;
    for (std::size_t l = 0; l < 3; ++l) {
      const double expected =
          layered().layers[l].density * 1e-9 * element.volume(before, planter.depths()[l]);
      EXPECT_NEAR(wanted[l][0] + wanted[l][1], expected, 1.);
      before = planter.depths()[l];
    }
  }
}

// Of a thousandth of the density an element has some 40 neurons, most of them of the second layer; in a thousand elements the rare ones are
// there as often as they should be.
TEST(PlantElements, RareNeuronsAreSpreadOverElementsAndNotRoundedAway) {
  const ElementPlanter planter(layered(), candidates, 1, {.scale = .001});
  const Hexahedron element = cortex::folded_sheet(3, 2)[2];
  constexpr std::size_t elements = 1000;
  std::vector<std::vector<double>> sums(3, std::vector<double>(2));
  for (std::size_t e = 0; e < elements; ++e) {
    const auto here = planter.counts(element, e);
    for (std::size_t l = 0; l < 3; ++l)
      for (std::size_t t = 0; t < 2; ++t) sums[l][t] += here[l][t];
  }
  double before = 0.;
  for (std::size_t l = 0; l < 3; ++l) {
    const double wanted = planter.density(l) * 1e-9 * element.volume(before, planter.depths()[l]);
    for (std::size_t t = 0; t < 2; ++t) {
      const double share = wanted * layered().layers[l].mix[t];
      EXPECT_NEAR(sums[l][t] / elements, share, 4. * std::sqrt(.25 / elements)) << l << " " << t;
    }
    before = planter.depths()[l];
  }
  EXPECT_GT(sums[0][0], 0.);
  for (std::size_t e = 0; e < 40; ++e) EXPECT_NO_THROW(planter.plant(element, e));  // there is room for all
}

TEST(PlantElements, AnElementIsTheSameWhateverElseIsPlantedAndOnAnyNumberOfThreads) {
  LONG_TEST();
  const auto sheet = cortex::folded_sheet(2, 2);
  const ElementPlanter first(layered(), candidates, 5), second(layered(), candidates, 5),
      other(layered(), candidates, 6);
  std::vector<std::vector<Rooted>> forwards, backwards(4);
  for (std::size_t e = 0; e < 4; ++e) forwards.push_back(first.plant(sheet[e], e));
  const ThreadLimit one(1);
  for (std::size_t e = 4; e-- > 0;) backwards[e] = second.plant(sheet[e], e);
  for (std::size_t e = 0; e < 4; ++e) EXPECT_TRUE(std::ranges::equal(forwards[e], backwards[e], same)) << e;
  EXPECT_FALSE(std::ranges::equal(forwards[0], other.plant(sheet[0], 0), same));
}

TEST(PlantElements, SomataKeepTheirGapInElementsAndAcrossTheirFaces) {
  LONG_TEST();
  const auto sheet = cortex::folded_sheet(4, 2);
  for (const double scale : {1., 4.}) {
    Recipe recipe = layered();
    const ElementPlanter planter(recipe, std::span(candidates), 3, {.scale = scale});
    std::vector<Rooted> all;
    std::size_t by_faces = 0;
    for (std::size_t e = 0; e < sheet.size(); ++e)
      for (const Rooted& r : planter.plant(sheet[e], e)) {
        all.push_back(r);
        by_faces +=
            r.uvw[0] < .004 || r.uvw[0] > .996;  // within 2.6 µm of a face, nearer than any soma's radius
      }
    EXPECT_GE(least_gap(all), double(recipe.soma_gap)) << scale;
    EXPECT_NEAR(double(by_faces) / double(all.size()), .008, .002);  // no face is bare
  }
}

// A layer that is dense and thin loses little to those beside it: only what their places would touch, those on their side.
TEST(PlantElements, ThinLayersOfWideSomataHoldWhatTheyShould) {
  Recipe recipe;
  recipe.types = {{"c", "c"}}, recipe.soma_gap = .5f;
  recipe.layers = {
      {"III", 900.f, 16'000., {}, {1.}}, {"IV", 70.f, 85'000., {}, {1.}}, {"V", 600.f, 35'000., {}, {1.}}};
  const std::vector<Candidate> wide{{"c", "c", 8.7f, 0.f}};
  const ElementPlanter planter(recipe, wide, 2);
  const auto sheet = cortex::folded_sheet(4, 2);
  for (std::size_t e = 0; e < sheet.size(); ++e) {
    const auto in_four = std::ranges::count(planter.plant(sheet[e], e), 1u, &Rooted::layer);
    EXPECT_EQ(in_four, planter.counts(sheet[e], e)[1][0]) << e;
  }
}

// Where they do not fit, as between borders 25 µm apart, there are as many as do, of each type its share.
TEST(PlantElements, WhereThereIsNoRoomThereAreAsManyAsFit) {
  Recipe recipe;
  recipe.types = {{"a", "c"}, {"b", "c"}}, recipe.soma_gap = .5f;
  recipe.layers = {{"III", 900.f, 16'000., {}, {.5, .5}},
                   {"IV", 25.f, 100'000., {}, {.75, .25}},
                   {"V", 600.f, 50'000., {}, {.5, .5}}};
  const std::vector<Candidate> wide{{"c", "c", 8.7f, 0.f}};
  const ElementPlanter planter(recipe, wide, 2);
  const Hexahedron element = cortex::folded_sheet(4, 2)[2];
  const auto wanted = planter.counts(element, 2);
  std::array<std::size_t, 3> all{};
  std::array<double, 2> in_four{};
  for (const Rooted& r : planter.plant(element, 2)) {
    ++all[r.layer];
    if (r.layer == 1) ++in_four[r.type];
  }
  EXPECT_EQ(all[0], wanted[0][0] + wanted[0][1]);
  EXPECT_EQ(all[2], wanted[2][0] + wanted[2][1]);
  EXPECT_LT(all[1], wanted[1][0] + wanted[1][1]);
  EXPECT_GT(all[1], 100u);
  EXPECT_NEAR(in_four[0] / double(all[1]), .75, 2. / double(all[1]));
}

TEST(PlantElements, ManyMoreSomataThanPackOneByOneFit) {
  LONG_TEST();
  Recipe recipe;
  recipe.radius = 100.f, recipe.types = {{"c", "c"}}, recipe.layers = {{"L", 1.f, 400'000., {}, {1.}}};
  const std::vector<Candidate> wide{{"c", "c", 6.1f, 0.f}};  // 38 % of the volume
  const Hexahedron element = cortex::folded_sheet(2, 1)[1];
  const auto rooted = ElementPlanter(recipe, wide, 2).plant(element, 0);
  EXPECT_EQ(rooted.size(), std::size_t(std::lround(4e-4 * element.volume())));
  const std::vector<Candidate> wider{{"c", "c", 6.9f, 0.f}};
  EXPECT_THAT(refused([&] { ElementPlanter(recipe, wider, 2); }), HasSubstr("do not fit into layer L"));
}

TEST(PlantElements, PlacesAreEvenInVolumeWithinALayerAndStayInIt) {
  const ElementPlanter planter(layered(), candidates, 11, {.scale = 4.});
  const Hexahedron element = cortex::folded_sheet(8, 1)[5];
  constexpr int n = 6;
  std::array<double, n> across{}, deep{}, across_volume{}, deep_volume{};
  const double top = planter.depths()[1];
  double count = 0.;
  for (const Rooted& r : planter.plant(element, 0)) {
    EXPECT_GE(r.uvw[2], r.layer ? planter.depths()[r.layer - 1] : 0.);
    EXPECT_LT(r.uvw[2], planter.depths()[r.layer]);
    if (r.layer != 2) continue;
    across[std::size_t(r.uvw[0] * n)] += 1., deep[std::size_t((r.uvw[2] - top) / (1. - top) * n)] += 1.,
        count += 1.;
  }
  const double all = element.volume(top, 1.);
  Hexahedron rest = element;
  for (int i = 0; i < n; ++i) {
    const auto halves = cortex::split(rest, 0, 1. / (n - i));
    across_volume[std::size_t(i)] = (i + 1 < n ? halves[0] : rest).volume(top, 1.) / all * count;
    rest = halves[1];
    deep_volume[std::size_t(i)] =
        element.volume(top + (1. - top) * i / n, top + (1. - top) * (i + 1) / n) / all * count;
  }
  EXPECT_GT(p_of(across, across_volume), 1e-3);
  EXPECT_GT(p_of(deep, deep_volume), 1e-3);
  // The negative control: parameters are not even, as the element is curved.
  const std::array<double, n> flat{count / n, count / n, count / n, count / n, count / n, count / n};
  EXPECT_LT(p_of(across, flat), 1e-3);
}

// Tissue around an edge of the white matter, 200 µm thick there and 2200 at the pia, and not the same everywhere.
TEST(PlantElements, LayersShareTheVolumeAlsoWhereWDoesNotAndDoNotTouch) {
  cortex::Elements edge = cortex::make_slab(2, [](const Place& p) {
    const double angle = (p.x() - 500.) / 2200., r = 2200. + p.z();
    return Place(r * std::sin(angle), p.y() + .05 * p.z() * angle, r * std::cos(angle));
  });
  edge.depth = cortex::even_depth(edge, Progress::none());
  const ElementPlanter planter(layered(), candidates, 3);
  std::vector<Rooted> all;
  for (std::size_t e = 0; e < edge.size(); ++e) {
    const cortex::Layers layers(edge, e);
    const Hexahedron element = edge.hexahedron(e);
    const auto wanted = planter.counts(element, e, layers);
    std::array<std::size_t, 3> seen{};
    double before = 0.;
    for (const Rooted& r : planter.plant(element, e, layers)) {
      ++seen[r.layer];
      // By where it is: depth is a share of the ring's area.
      const double radius = std::hypot(double(r.position.x()), double(r.position.z()));
      const double depth = (2200. * 2200. - radius * radius) / (2200. * 2200. - 200. * 200.);
      EXPECT_GT(depth, (r.layer ? planter.depths()[r.layer - 1] : 0.) - .01);
      EXPECT_LT(depth, planter.depths()[r.layer] + .01);
      all.push_back(r);
    }
    for (std::size_t l = 0; l < 3; ++l) {
      EXPECT_EQ(seen[l], wanted[l][0] + wanted[l][1]);
      EXPECT_NEAR(double(seen[l]),
                  planter.density(l) * 1e-9 * (planter.depths()[l] - before) * element.volume(), 1.);
      before = planter.depths()[l];
    }
  }
  EXPECT_GT(least_gap(all), .5);
}

// Layers that were measured: the second one begins at .1 of the way on one side of the element and at .5 on the other.
TEST(PlantElements, LayersEndWhereTheyWereMeasured) {
  const ElementPlanter planter(layered(), candidates, 3);
  const Hexahedron element = cortex::folded_sheet(8, 1)[5];
  const cortex::Borders borders(std::array<std::vector<double>, 4>{
      std::vector{.1, .6, 1.}, std::vector{.5, .6, 1.}, std::vector{.1, .6, 1.}, std::vector{.5, .6, 1.}});
  const auto wanted = planter.counts(element, 0, borders);
  std::array<std::size_t, 3> seen{};
  const auto rooted = planter.plant(element, 0, borders);
  for (const Rooted& r : rooted) {
    ++seen[r.layer];
    EXPECT_GE(r.uvw[2], borders.begin(r.uvw[0], r.uvw[1], r.layer));
    EXPECT_LT(r.uvw[2], borders.end(r.uvw[0], r.uvw[1], r.layer));
  }
  for (std::size_t l = 0; l < 3; ++l) {
    EXPECT_EQ(seen[l], wanted[l][0] + wanted[l][1]);
    EXPECT_NEAR(double(seen[l]), planter.density(l) * 1e-9 * borders.volume(element, l), 1.);
  }
  EXPECT_GT(least_gap(rooted), .5);
  // The negative control: by volume they would not.
  std::size_t elsewhere = 0;
  for (const Rooted& r : planter.plant(element, 0))
    elsewhere += r.uvw[2] < borders.begin(r.uvw[0], r.uvw[1], r.layer) ||
                 r.uvw[2] >= borders.end(r.uvw[0], r.uvw[1], r.layer);
  EXPECT_GT(elsewhere, 1000u);
}

TEST(PlantElements, NeuronsPointToThePiaAlongW) {
  const ElementPlanter planter(layered(), candidates, 4);
  const Hexahedron element = cortex::folded_sheet(8, 1)[5];
  double worst = 0., farthest = 0.;
  for (const Rooted& r : planter.plant(element, 0)) {
    const cortex::Linear here = linear(element, r.uvw);
    const Place up = (r.orientation * Vec3::UnitY()).cast<double>(), w = -here.jacobian.col(2).normalized();
    worst = std::max(worst, std::atan2(up.cross(w).norm(), up.dot(w)) * 180. / std::numbers::pi);
    farthest = std::max(farthest, (here.at - r.position.cast<double>()).norm());
  }
  EXPECT_LT(worst, .01);
  EXPECT_LT(farthest, .01);
}

// Rigid ones go as far up as they are tall, bent ones as the grid does right at the soma.
TEST(PlantElements, NeuronsEndUnderThePiaWhereTheirTypeHasAnyThatDo) {
  // w grows slowly under the pia and fast above the white matter.
  const auto uneven = [](const Place& p) {
    return Place(p.x(), p.y(), p.z() * (1. - .3 * (2000. + p.z()) / 2000.));
  };
  const Hexahedron sheet = cortex::folded_sheet(2, 1)[0], slab = cortex::make_slab(1, uneven).hexahedron(0);
  for (const Hexahedron& element : {sheet, slab})
    for (const bool bent : {false, true}) {
      const ElementPlanter planter(layered(), candidates, 4, {.bent = bent});
      std::array<std::size_t, 5> seen{};
      std::size_t tall = 0, beyond = 0;
      for (const Rooted& r : planter.plant(element, 0)) {
        ++seen[r.candidate];
        const double room = bent ? r.uvw[2] * element.jacobian(r.uvw).col(2).norm() : double(r.depth);
        EXPECT_GE(room, r.candidate == 1 ? 600. : r.candidate == 3 ? 900. : 0.);
        tall += r.candidate == 3, beyond += r.candidate == 3 && room < 930.;
      }
      for (const std::size_t c : {0, 1, 2, 3}) EXPECT_GT(seen[c], 100u) << c;
      EXPECT_GT(beyond, tall / 1000) << tall;  // as soon as there is room
      EXPECT_EQ(seen[4], 0u);                  // its soma is too wide for both layers
      EXPECT_EQ(planter.left_out(1), 1u);
    }
}

TEST(PlantElements, CountsOfARecipeAreThoseOfItsColumn) {
  Recipe recipe = layered();
  recipe.neurons = 1000;
  const double column_volume = std::numbers::pi * 200. * 200. * 1600.;
  EXPECT_NEAR(mean_density(recipe), 1000. / column_volume * 1e9, 20.);
  const ElementPlanter planter(recipe, candidates, 1);
  const auto wanted = counts(recipe);
  for (std::size_t l = 0; l < 3; ++l)
    EXPECT_NEAR(planter.density(l) * 1e-9 * column(recipe).volume(l), wanted[l][0] + wanted[l][1], 1e-6);
}

TEST(PlantElements, RefuseWhatCannotBePlanted) {
  const std::vector<Candidate> none{{"s1", "s", 4.f, 150.f}};
  EXPECT_THAT(refused([&] { ElementPlanter(layered(), none, 1); }), HasSubstr("population l is empty"));
  EXPECT_THAT(refused([&] { ElementPlanter(layered(), candidates, 1, {.scale = 0.}); }),
              HasSubstr("positive"));
  EXPECT_THAT(refused([&] { ElementPlanter(layered(), candidates, 1, {.scale = 100.}); }),
              HasSubstr("do not fit into layer L2"));
}

}  // namespace
}  // namespace forest::circuit
