// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/grid.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "forest/core/random.h"
#include "forest/cortex/grid_domains.h"
#include "forest/cortex/grid_quality.h"

#include "tests/refused.h"

namespace forest::cortex {
namespace {

using testing::HasSubstr;
using Place = Eigen::Vector3d;

std::array<int, 3> steps_of(const Domain& domain) {
  return domain.plane ? std::array{12, 12, 1} : std::array{5, 5, 5};
}

Grid mapped(Grid grid, const std::function<Place(const Place&)>& map) {
  for (auto& p : grid.points) p = map(p);
  return grid;
}

Grid even_block(bool plane, const std::function<Place(const Place&)>& map) {
  Grid grid{{6, 5, plane ? 1 : 4}, {}};
  for (int k = 0; k < grid.size[2]; ++k)
    for (int j = 0; j < grid.size[1]; ++j)
      for (int i = 0; i < grid.size[0]; ++i)
        grid.points.push_back(map({i / 5., j / 4., plane ? 0. : k / 3.}));
  return grid;
}

double furthest(const Grid& a, const Grid& b, int dimensions) {
  double most = 0.;
  for (std::size_t n = 0; n < a.points.size(); ++n)
    most = std::max(most, (a.points[n] - b.points[n]).head(dimensions).norm());
  return most;
}

// Σ φ over the corners of all cells, as the functionals are defined.
double functional(const Grid& grid, const std::function<double(const Eigen::MatrixXd&)>& phi) {
  double sum = 0.;
  const int d = grid.dimensions();
  for (std::size_t n = 0; n < grid.cells(); ++n) {
    const Corners x = grid.corners(n);
    for (int c = 0; c < 1 << d; ++c) {
      Eigen::MatrixXd j(d, d);
      for (int a = 0; a < d; ++a)
        j.col(a) = (x[std::size_t(c | 1 << a)] - x[std::size_t(c & ~(1 << a))]).head(d);
      sum += phi(j.transpose() * j);
    }
  }
  return sum;
}

TEST(Generators, KeepEveryBoundaryPointBitForBit) {
  for (const Domain& domain : domains()) {
    const Grid start = boundary(domain, steps_of(domain));
    for (const Generator& row : generators()) {
      const Grid filled = generate(start, row.name);
      for (int k = 0; k < start.size[2]; ++k)
        for (int j = 0; j < start.size[1]; ++j)
          for (int i = 0; i < start.size[0]; ++i)
            if (start.on_boundary(i, j, k)) {
              ASSERT_EQ(filled.point(i, j, k), start.point(i, j, k)) << domain.name << " " << row.name;
            }
    }
  }
}

TEST(Generators, FillABoxEvenlyWhereverItStands) {
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(.7, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  const Eigen::Matrix3d turn_in_plane = Eigen::AngleAxisd(.7, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  for (const bool plane : {true, false})
    for (const Generator& row : generators()) {
      const Grid even = even_block(plane, [&](const Place& t) {
        return Place((plane ? turn_in_plane : turn) * Place(300. * t[0], 200. * t[1], 700. * t[2]) +
                     Place(1e4, -2e4, plane ? 0. : 3e4));
      });
      Grid empty = even;
      for (int k = 0; k < even.size[2]; ++k)
        for (int j = 0; j < even.size[1]; ++j)
          for (int i = 0; i < even.size[0]; ++i)
            if (!even.on_boundary(i, j, k)) empty.point(i, j, k).setZero();
      EXPECT_LT(furthest(generate(empty, row.name), even, even.dimensions()), .01) << row.name << plane;
    }
}

TEST(Generators, FollowTheBlockWhenItIsTurnedAndEnlarged) {
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(1.1, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const auto map = [&](const Place& p) { return Place(250. * (turn * p) + Place(7e4, -4e4, 1e3)); };
  for (const char* name : {"horseshoe", "crown"})
    for (const Generator& row : generators()) {
      const Grid start = boundary(domain(name), {8, 8, 6});
      const Grid one = mapped(generate(start, row.name), map), other = generate(mapped(start, map), row.name);
      EXPECT_LT(furthest(one, other, start.dimensions()), .25) << name << " " << row.name;  // a thousandth
    }
}

TEST(Generators, OnEveryDomainSomeGridIsValidAndTheChoiceFindsIt) {
  for (const Domain& domain : domains()) {
    const Best best = best_grid(boundary(domain, steps_of(domain)));
    EXPECT_TRUE(validity(best.grid).valid()) << domain.name;
    EXPECT_GT(best.least_scaled_jacobian, 0.) << domain.name;
  }
}

TEST(Generators, TheTransfiniteSwanFoldsAndTheEllipticOneDoesNot) {
  const Grid start = boundary(domain("swan"), {16, 16, 1});
  const Grid folded = generate(start, "transfinite");
  EXPECT_FALSE(validity(folded).valid());
  EXPECT_LT(std::ranges::min(measure(folded, cell_measure("scaled-jacobian"))), -.1);
  for (const char* name : {"winslow", "area-orthogonality", "foldover-free"}) {
    const Grid grid = generate(start, name);
    EXPECT_TRUE(validity(grid).valid()) << name;
    EXPECT_GT(std::ranges::min(measure(grid, cell_measure("scaled-jacobian"))), .3) << name;
  }
}

TEST(Generators, TheFoldoverFreeOneUnfoldsWhatItIsGiven) {
  Random random(3);
  for (const bool plane : {true, false}) {
    const Grid even = even_block(plane, [](const Place& t) { return t; });
    Grid shuffled = even;
    for (int k = 0; k < even.size[2]; ++k)
      for (int j = 0; j < even.size[1]; ++j)
        for (int i = 0; i < even.size[0]; ++i)
          if (!even.on_boundary(i, j, k))
            shuffled.point(i, j, k).head(even.dimensions()) =
                Place(random.uniform(), random.uniform(), random.uniform()).head(even.dimensions());
    ASSERT_FALSE(validity(shuffled).valid());
    EXPECT_LT(furthest(generator("foldover-free").fill(shuffled, {}), even, even.dimensions()), .01);
  }
}

TEST(Generators, ThoseThatMinimiseHaveFoundALeast) {
  const auto length = [](const Eigen::MatrixXd& g) { return g.trace(); };
  const auto liao = [](const Eigen::MatrixXd& g) { return g.squaredNorm(); };
  const auto area_orthogonality = [](const Eigen::MatrixXd& g) {
    double sum = 0.;
    for (int a = 0; a < g.rows(); ++a)
      for (int b = 0; b < a; ++b) sum += g(a, a) * g(b, b);
    return sum;
  };
  struct Row {
    const char* name;
    std::function<double(const Eigen::MatrixXd&)> phi;
  };
  for (const Row& row : {Row{"length", length}, {"liao", liao}, {"area-orthogonality", area_orthogonality}})
    for (const char* name : {"horseshoe", "swan", "fundus"}) {
      const Grid grid = generate(boundary(domain(name), {8, 8, 5}), row.name, {.tolerance = 1e-10});
      const double least = functional(grid, row.phi);
      EXPECT_LT(least, functional(generate(boundary(domain(name), {8, 8, 5}), "transfinite"), row.phi));
      Random random(1);
      for (int attempt = 0; attempt < 40; ++attempt) {
        Grid moved = grid;
        for (int k = 0; k < grid.size[2]; ++k)
          for (int j = 0; j < grid.size[1]; ++j)
            for (int i = 0; i < grid.size[0]; ++i)
              if (!grid.on_boundary(i, j, k))
                moved.point(i, j, k).head(grid.dimensions()) +=
                    1e-3 * Place(random.normal(), random.normal(), random.normal()).head(grid.dimensions());
        EXPECT_GT(functional(moved, row.phi), least) << name << " " << row.name;
      }
    }
}

// On a ring between radii 1 and 2 log r is harmonic, and so is the angle.
TEST(Generators, WinslowFindsTheHarmonicCoordinatesOfARing) {
  constexpr int n = 24;
  Grid ring{{n + 1, n + 1, 1}, std::vector<Place>(std::size_t(n + 1) * (n + 1), Place::Zero())};
  const auto exact = [](int i, int j) {
    const double r = std::pow(2., double(i) / n), angle = 1.2 * j / n;
    return Place(r * std::cos(angle), r * std::sin(angle), 0.);
  };
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i <= n; ++i)
      if (ring.on_boundary(i, j)) ring.point(i, j) = exact(i, j);
  const Grid grid = generate(ring, "winslow", {.tolerance = 1e-9});
  double most = 0., of_transfinite = 0.;
  const Grid straight = generate(ring, "transfinite");
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i <= n; ++i) {
      most = std::max(most, (grid.point(i, j) - exact(i, j)).norm());
      of_transfinite = std::max(of_transfinite, (straight.point(i, j) - exact(i, j)).norm());
    }
  EXPECT_LT(most, 1e-4);
  EXPECT_GT(of_transfinite, .01);
}

TEST(Tricubic, WithoutOrthogonalityIsNearlyTransfiniteAndWithItStandsNormalToTheBoundary) {
  const Grid start = boundary(domain("horseshoe"), {32, 32, 1});
  const Grid plain = generate(start, "transfinite");
  EXPECT_LT(furthest(generate(start, "tricubic", {.orthogonality = 0.}), plain, 2), 1e-3);
  const auto off = [&](const Grid& grid) {  // degrees, in the middle of the outer side
    const Place along = grid.point(32, 14) - grid.point(32, 12),
                across = grid.point(32, 13) - grid.point(31, 13);
    return std::abs(90. - std::acos(along.normalized().dot(across.normalized())) * 180. / 3.14159265358979);
  };
  EXPECT_GT(off(plain), 20.);
  EXPECT_LT(off(generate(start, "tricubic", {.orthogonality = 1.})), 8.);
}

TEST(Sample, OfAHexahedronLiesOnIt) {
  std::array<Place, 8> corners;
  for (int c = 0; c < 8; ++c) corners[std::size_t(c)] = Place(c & 1, c >> 1 & 1, c >> 2);
  corners[7] = Place(1.3, 1.2, 1.1);
  const Hexahedron h = from_corners(corners);
  const Grid grid = sample(h, {3, 4, 5});
  EXPECT_LT((grid.point(1, 2, 1) - h.at(.5, 2. / 3., .25)).norm(), 1e-15);
  EXPECT_EQ(grid.cells(), 24u);
  EXPECT_TRUE(validity(grid).valid());
  EXPECT_NEAR(volume(grid), h.volume(), 1e-12);
}

TEST(Validity, FindsAFoldBetweenCornersThatAreAllRight) {
  Random random(8);
  int found = 0;
  for (int attempt = 0; attempt < 500; ++attempt) {
    Grid cell{{2, 2, 2}, {}};
    for (int c = 0; c < 8; ++c)
      cell.points.push_back(Place(c & 1, c >> 1 & 1, c >> 2) +
                            .65 * Place(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)));
    if (measure(cell, cell_measure("jacobian"))[0] <= 0.) continue;
    const Validity result = validity(cell);
    double least = 1.;
    const Hexahedron h = from_corners(cell.corners(0));
    for (int n = 0; n < 1000; ++n)
      least = std::min(least, h.jacobian(n % 10 / 9., n / 10 % 10 / 9., n / 100 / 9.).determinant());
    if (least < 0.) ++found;
    EXPECT_EQ(result.valid(), least > 0.) << attempt << " " << least;
  }
  EXPECT_GT(found, 0);
}

TEST(Validity, CountsWhatIsFoldedAndNamesTheFirst) {
  Grid grid = even_block(true, [](const Place& t) { return t; });
  EXPECT_EQ(validity(grid).bad, 0u);
  grid.point(3, 2).x() = .9;  // beyond its right neighbour
  EXPECT_EQ(validity(grid).bad, 2u);
  EXPECT_EQ(validity(grid).first, 3u + 5u);
}

TEST(Best, RefusesABlockWhoseBoundaryCrossesItself) {
  Grid crossed = boundary(domain("chevron"), {8, 8, 1});
  for (int i = 0; i < 9; ++i) std::swap(crossed.point(i, 0).y(), crossed.point(8 - i, 8).y());
  for (int j = 0; j < 9; ++j) crossed.point(0, j).y() = -crossed.point(0, j).y();
  EXPECT_THAT(refused([&] { best_grid(crossed); }), HasSubstr("crosses itself"));
}

TEST(Grids, ThatAreNoneAreRefused) {
  Grid grid = boundary(domain("swan"), {4, 4, 1});
  EXPECT_THAT(refused([&] { generate(grid, "no such"); }), HasSubstr("transfinite, tricubic, length"));
  grid.point(4, 2).x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(refused([&] { generate(grid, "winslow"); }), HasSubstr("(4, 2, 0)"));
  grid.points.pop_back();
  EXPECT_THAT(refused([&] { check(grid); }), HasSubstr("give 25"));
  EXPECT_THAT(refused([&] { check(Grid{{1, 5, 5}, {}}); }), HasSubstr("1x5x5"));
  EXPECT_THAT(refused([&] { domain("goose"); }), HasSubstr("swan"));
  EXPECT_THAT(refused([&] { cell_measure("beauty"); }), HasSubstr("scaled-jacobian"));
}

TEST(CellMeasures, OfACubeAreBestAndDoNotChangeWhenItIsTurned) {
  Corners cube;
  for (int c = 0; c < 8; ++c) cube[std::size_t(c)] = Place(c & 1, c >> 1 & 1, c >> 2);
  Corners square = cube;
  for (int c = 4; c < 8; ++c) square[std::size_t(c)] = square[std::size_t(c - 4)];
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(.4, Eigen::Vector3d(1, -1, 2).normalized()).toRotationMatrix();
  const Eigen::Matrix3d in_plane = Eigen::AngleAxisd(.4, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  for (const CellMeasure& row : cell_measures()) {
    EXPECT_NEAR(row.of(cube, 3, 1.), row.best, 1e-12) << row.name;
    EXPECT_NEAR(row.of(square, 2, 1.), row.best, 1e-12) << row.name;
    Random random(5);
    Corners odd = cube, odd_square = square;
    for (int c = 0; c < 8; ++c)
      odd[std::size_t(c)] += .2 * Place(random.uniform(), random.uniform(), random.uniform());
    for (int c = 0; c < 4; ++c)
      odd_square[std::size_t(c)] += .2 * Place(random.uniform(), random.uniform(), 0.);
    Corners turned = odd, turned_square = odd_square;
    for (auto& p : turned) p = turn * p + Place(3, 4, 5);
    for (auto& p : turned_square) p = in_plane * p + Place(3, 4, 5);
    EXPECT_NEAR(row.of(turned, 3, 1.), row.of(odd, 3, 1.), 1e-6) << row.name;
    EXPECT_NEAR(row.of(turned_square, 2, 1.), row.of(odd_square, 2, 1.), 1e-6) << row.name;
    EXPECT_GT(std::abs(row.of(odd, 3, 1.) - row.best), 1e-3) << row.name;
    if (row.large_is_good && std::string(row.name) != "jacobian" && std::string(row.name) != "volume-ratio") {
      EXPECT_LT(row.of(odd, 3, 1.), row.best) << row.name;
    }
    if (!row.large_is_good) {
      EXPECT_GT(row.of(odd, 3, 1.), row.best) << row.name;
    }
  }
}

TEST(CellMeasures, OfABoxAndOfAShearedOneAreKnown) {
  Corners box, sheared;
  for (int c = 0; c < 8; ++c) {
    box[std::size_t(c)] = Place(c & 1, 2 * (c >> 1 & 1), 4 * (c >> 2));
    sheared[std::size_t(c)] =
        Place((c & 1) + .5 * (c >> 1 & 1), std::sqrt(.75) * (c >> 1 & 1), c >> 2);  // 60°
  }
  const auto of = [](const char* name, const Corners& x, double mean = 1.) {
    return cell_measure(name).of(x, 3, mean);
  };
  EXPECT_NEAR(of("jacobian", box), 8., 1e-12);
  EXPECT_NEAR(of("scaled-jacobian", box), 1., 1e-12);
  EXPECT_NEAR(of("aspect", box), 4., 1e-12);
  EXPECT_NEAR(of("edge-ratio", box), 4., 1e-12);
  EXPECT_NEAR(of("shape", box), 3. * 4. / 21., 1e-12);
  EXPECT_NEAR(of("condition", box), std::sqrt(21. * (1. + 1. / 4. + 1. / 16.)) / 3., 1e-12);
  EXPECT_NEAR(of("stretch", box), std::sqrt(3. / 21.), 1e-12);
  EXPECT_NEAR(of("volume-ratio", box, 4.), 2., 1e-12);
  EXPECT_NEAR(of("scaled-jacobian", sheared), std::sqrt(.75), 1e-12);
  EXPECT_NEAR(of("orthogonality", sheared), 30., 1e-9);
  EXPECT_NEAR(of("skew", sheared), .5, 1e-12);
  EXPECT_NEAR(of("diagonal", sheared), std::sqrt(2. / 4.), 1e-12);
  EXPECT_NEAR(of("taper", sheared), 0., 1e-12);
  Corners tapered = box;  // its far end half as wide
  for (int c = 4; c < 8; ++c) tapered[std::size_t(c)].x() *= .5;
  EXPECT_NEAR(of("taper", tapered), .25 / .75, 1e-12);
}

TEST(CellMeasures, OfFlatAndTurnedCellsSaySo) {
  Corners flat, turned;
  for (int c = 0; c < 8; ++c) {
    flat[std::size_t(c)] = Place(c & 1, c >> 1 & 1, 0.);
    turned[std::size_t(c)] = Place(-(c & 1), c >> 1 & 1, c >> 2);
  }
  EXPECT_EQ(cell_measure("scaled-jacobian").of(flat, 3, 1.), 0.);
  EXPECT_EQ(cell_measure("condition").of(flat, 3, 1.), std::numeric_limits<double>::infinity());
  EXPECT_NEAR(cell_measure("scaled-jacobian").of(turned, 3, 1.), -1., 1e-12);
  EXPECT_EQ(cell_measure("shape").of(turned, 3, 1.), 0.);
}

TEST(Quality, SumsUpWhatTheCellsSay) {
  const Grid grid = generate(boundary(domain("horseshoe"), {20, 20, 1}), "transfinite");
  const auto rows = quality(grid);
  ASSERT_EQ(rows.size(), cell_measures().size());
  for (const QualityRow& row : rows) {
    EXPECT_LE(row.least, row.p1);
    EXPECT_LE(row.p1, row.median);
    EXPECT_LE(row.median, row.p99);
    EXPECT_LE(row.p99, row.most);
    EXPECT_LE(row.least, row.mean);
    EXPECT_GE(row.most, row.mean);
    if (std::string(row.measure->name) == "volume-ratio") {
      EXPECT_NEAR(row.mean, 1., 1e-12);
    }
  }
}

}  // namespace
}  // namespace forest::cortex
