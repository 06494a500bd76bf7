// SPDX-License-Identifier: Apache-2.0
#include "forest/statistics/distribution.h"

#include <cmath>
#include <numeric>

#include <boost/math/distributions/chi_squared.hpp>
#include <gtest/gtest.h>

#include "forest/core/error.h"
#include "forest/statistics/fit_distribution.h"

namespace forest::statistics {
namespace {

Component part(const char* family, Parameters parameters, double weight = 1.) {
  return {find_family(family), parameters, weight};
}

// One of each family, of very different sizes.
std::vector<Component> zoo_of_families() {
  return {part("normal", {3, 2}),
          part("normal", {-1e6, 1e-3}),
          part("truncnormal", {5, 2, 3, 6}),
          part("truncnormal", {9, 2, 3, 6}),
          part("gamma", {0.7, 20}),
          part("gamma", {40, 1e-5}),
          part("lognormal", {1, 0.4}),
          part("exponential", {17}),
          part("weibull", {0.8, 3}),
          part("weibull", {4, 300}),
          part("vonmises", {170, 3}),
          part("vonmises", {-20, 0.3}),
          part("vonmises", {10, 900}),
          part("uniform", {-2, 5})};
}

std::vector<double> drawn(const Distribution& d, std::size_t count, std::uint64_t seed) {
  Random random(seed, 5);
  std::vector<double> x(count);
  for (double& v : x) v = d.draw(random);
  return x;
}

// p of Pearson's test that the draws fall into 40 bins as the distribution function says.
double chi_squared_p(const Distribution& d, std::span<const double> x) {
  constexpr int bins = 40;
  std::vector<double> seen(bins, 0.);
  for (const double v : x) ++seen[std::size_t(std::clamp(int(bins * d.cdf(v)), 0, bins - 1))];
  double sum = 0.;
  const double expected = double(x.size()) / bins;
  for (const double n : seen) sum += (n - expected) * (n - expected) / expected;
  return boost::math::cdf(boost::math::complement(boost::math::chi_squared(bins - 1), sum));
}

TEST(Family, DrawsFollowTheDistributionFunction) {
  for (const Component& c : zoo_of_families()) {
    const Distribution d{{c}, {}, 0.};
    EXPECT_GT(chi_squared_p(d, drawn(d, 40000, 3)), 1e-4) << d.expression();
  }
}

TEST(Family, TheDensityIsTheSlopeOfTheDistributionFunctionAndTheQuantileItsInverse) {
  for (const Component& c : zoo_of_families()) {
    const Distribution d{{c}, {}, 0.};
    for (const double p : {0.01, 0.2, 0.5, 0.77, 0.995}) {
      const double x = d.quantile(p);
      EXPECT_NEAR(d.cdf(x), p, 2e-6) << d.expression();
      const double h = 1e-4 * (d.quantile(0.75) - d.quantile(0.25));
      const double slope = (d.cdf(x + h) - d.cdf(x - h)) / (2. * h);
      EXPECT_NEAR(d.density(x) / slope, 1., 2e-3) << d.expression() << " at " << x;
    }
  }
}

// By scipy 1.10: the likelihoods at their tops, and where these are.
TEST(Family, MaximumLikelihoodIsTheKnownOne) {
  const std::vector<double> x{1.2, 3.4, 0.7, 5.9, 2.2, 2.8, 4.1, 1.9, 7.3, 3.3};
  const std::vector<double> angles{10, -20, 35, 5, -170, 50, 0, 22, -8, 14};
  const struct {
    const char* family;
    double first, second, log_likelihood;
  } known[] = {
      {"normal", 3.28, 1.949256268, -20.863864322},
      {"lognormal", 0.9877088849, 0.6719069129, -20.090119477},
      {"exponential", 3.28, 0, -21.878434224},
      {"gamma", 2.65316225, 1.23626062, -19.810265240},
      {"weibull", 1.76626832, 3.69713285, -19.837785308},
      {"vonmises", 12.1016541304, 2.3295744761, -52.124193920},
  };
  for (const auto& row : known) {
    const auto& values = std::string(row.family) == "vonmises" ? angles : x;
    const Family& f = *find_family(row.family);
    Parameters p{};
    ASSERT_TRUE(f.fit(values, {}, p)) << row.family;
    EXPECT_NEAR(p[0], row.first, 2e-6) << row.family;
    EXPECT_NEAR(p[1], row.second, 2e-6) << row.family;
    double sum = 0.;
    for (const double v : values) sum += f.log_density(p, v);
    EXPECT_NEAR(sum, row.log_likelihood, 1e-5) << row.family;
  }
  // And where scipy's vonmises has gone so far around.
  const double swept[] = {0.00837104, 0.2243964, 0.30566069, 0.60303351, 0.98713187},
               at[] = {-100, -10, 0, 30, 120};
  for (int i = 0; i < 5; ++i) EXPECT_NEAR(find_family("vonmises")->cdf({20, 2.5}, at[i]), swept[i], 1e-7);
}

TEST(Family, WeightsCountAsRepeatedValues) {
  const std::vector<double> once{1.5, 2.5, 4.5, 7.}, often{1.5, 1.5, 1.5, 2.5, 4.5, 4.5, 7.},
      weights{3, 1, 2, 1};
  for (const Family& f : families()) {
    Parameters a{}, b{};
    ASSERT_TRUE(f.fit(once, weights, a) && f.fit(often, {}, b)) << f.name;
    for (int i = 0; i < f.count; ++i)
      EXPECT_NEAR(a[std::size_t(i)], b[std::size_t(i)], 1e-6 * std::abs(b[std::size_t(i)])) << f.name;
  }
}

TEST(Distribution, WritesItselfAsAnExpression) {
  EXPECT_EQ((Distribution{{part("gamma", {2, 15})}, {}, 0.}.expression()), "gamma(2, 15)");
  EXPECT_EQ((Distribution{{part("gamma", {2, 15}, 0.8)}, {{1., 0.2}}, 0.}.expression()),
            "if(chance(0.2), 1, gamma(2, 15))");
  EXPECT_EQ((Distribution{{part("normal", {1, 2}, 0.25), part("normal", {5, 1}, 0.25)}, {{0., 0.5}}, 0.26}
                 .expression()),
            "if(chance(0.5), 0, 0.26 * round(if(chance(0.5), normal(1, 2), normal(5, 1)) / 0.26))");
  EXPECT_EQ((Distribution{{}, {{2., 0.5}, {3., 0.5}}, 0.}.declaration("x")),
            "distribution x = if(chance(0.5), 2, 3)");
  EXPECT_EQ((Distribution{{}, {{2., 1.}}, 0.}.declaration("x")), "function x = 2");
}

TEST(Distribution, CountsFromWhereValuesBegin) {
  const Distribution below{
      {part("gamma", {2, 0.05}, 0.6), part("weibull", {2, 0.3}, 0.3)}, {{1., 0.1}}, 0., 1., true},
      above{{part("lognormal", {-1, 0.5})}, {}, 0., 1.};
  EXPECT_EQ(below.expression(),
            "if(chance(0.1), 1, 1 - if(chance(0.666667), gamma(2, 0.05), weibull(2, 0.3)))");
  EXPECT_EQ(above.expression(), "1 + lognormal(-1, 0.5)");
  for (const Distribution* d : {&below, &above}) {
    const auto x = drawn(*d, 40000, 6);
    const auto [least, most] = std::ranges::minmax(x);
    EXPECT_EQ(d->downwards ? most : std::min(least, 1.), 1.);
    for (const double p : {0.02, 0.3, 0.5, 0.88}) {
      const double at = d->quantile(p), h = 1e-4;
      EXPECT_NEAR(d->cdf(at), p, 1e-6);
      EXPECT_NEAR(double(std::ranges::count_if(x, [&](double v) { return v <= at; })) / 40000., p, 0.01);
      EXPECT_NEAR(d->density(at), (d->cdf(at + h) - d->cdf(at - h)) / (2. * h), 2e-3);
    }
  }
}

TEST(Fit, NothingLiesBeyondALimit) {
  const Distribution truth{{part("gamma", {1.5, 0.06}, 0.9)}, {{1., 0.1}}, 0., 1., true};
  const auto x = drawn(truth, 1500, 4);
  const DistributionFit free = fit_distribution(x), fit = fit_distribution(x, {.least = 0., .most = 1.});
  EXPECT_EQ(fit.name, "1 - gamma");
  EXPECT_EQ(fit.candidates.front().name, fit.name);
  ASSERT_EQ(fit.distribution.atoms.size(), 1u);
  EXPECT_EQ(fit.distribution.atoms[0].value, 1.);
  EXPECT_NEAR(fit.distribution.components[0].parameters[0], 1.5, 0.2);
  EXPECT_LT(fit.kolmogorov, 0.03);
  EXPECT_GT(fit.p, 0.01);
  EXPECT_LT(fit.kolmogorov, free.kolmogorov);
  EXPECT_EQ(fit.distribution.cdf(2.) - fit.distribution.cdf(1.), 0.);
  for (const Candidate& c : fit.candidates) EXPECT_EQ(c.name.find("- normal"), std::string::npos) << c.name;
  // A family without an end there is as good where next to nothing lies beyond.
  EXPECT_EQ(fit_distribution(drawn({{part("normal", {105, 25})}, {}, 0.}, 500, 3), {.least = 0.}).name,
            "normal");
  const auto ratios = drawn({{part("lognormal", {-1, 0.6})}, {}, 0., 1.}, 900, 5);
  EXPECT_EQ(fit_distribution(ratios, {.least = 1.}).name, "1 + lognormal");
}

TEST(Fit, WhatLiesOnALimitIsAnAtomHoweverSeldom) {
  for (const std::size_t count : {300u, 300'000u}) {
    std::vector<double> lengths = drawn({{part("gamma", {1, 15})}, {}, 0.}, count, 9);
    lengths[7] = 0.;
    const DistributionFit fit =
        fit_distribution(lengths, {.families = {"gamma", "weibull"}, .least = 0., .replicates = 0});
    EXPECT_GE(fit.in_atoms, 1u) << count;
    EXPECT_LE(fit.in_atoms, 20u) << count;  // those within .5 nm of it
    EXPECT_EQ(fit.candidates.size(), 2u) << count;
  }
  // Where one lies beyond it there is none.
  std::vector<double> values = drawn({{part("gamma", {2, 15})}, {}, 0.}, 300, 9);
  values[7] = -4.;
  EXPECT_EQ(fit_distribution(values, {.least = 0.}).name, fit_distribution(values).name);
  // Of values in steps what lies on it may have been rounded.
  const auto diameters = drawn({{part("gamma", {1.2, 0.3})}, {}, 0.26}, 3000, 2);
  const DistributionFit stepped = fit_distribution(diameters, {.least = 0.});
  EXPECT_NEAR(stepped.distribution.step, 0.26, 1e-6);
  EXPECT_EQ(stepped.in_atoms, 0u);
  EXPECT_NEAR(stepped.distribution.cdf(0.), double(std::ranges::count(diameters, 0.)) / 3000., 0.03);
}

TEST(Distribution, AtomsAreJumps) {
  const Distribution d{{part("uniform", {0, 2}, 0.5)}, {{1., 0.5}}, 0.};
  EXPECT_DOUBLE_EQ(d.cdf(0.999999), 0.24999975);
  EXPECT_DOUBLE_EQ(d.cdf(1.), 0.75);
  EXPECT_NEAR(d.quantile(0.5), 1., 1e-9);
  EXPECT_NEAR(d.quantile(0.875), 1.5, 1e-9);
  const auto x = drawn(d, 20000, 8);
  EXPECT_NEAR(double(std::ranges::count(x, 1.)) / 20000., 0.5, 0.02);
}

TEST(Distribution, EndsWhereAllItsPartsDo) {
  const Distribution two{{part("uniform", {0, 2}, 0.4), part("gamma", {2, 3}, 0.4)}, {{-1., 0.2}}, 0.};
  EXPECT_EQ(two.quantile(0.), -1.);
  EXPECT_TRUE(std::isnan(two.quantile(1.)));
  const Distribution endless{{part("normal", {0, 1}, 0.5), part("normal", {3, 1}, 0.5)}, {}, 0.};
  EXPECT_TRUE(std::isnan(endless.quantile(0.)) && std::isnan(endless.quantile(1.)));
  Distribution down{{part("gamma", {2, 3}, 0.5)}, {{0.5, 0.5}}, 0.};
  down.origin = 1., down.downwards = true;
  EXPECT_EQ(down.quantile(1.), 1.);
  EXPECT_TRUE(std::isnan(down.quantile(0.)));
}

// ── Fitting ──

TEST(Fit, FindsTheFamilyAndItsParametersAgain) {
  for (const Component& c : zoo_of_families()) {
    const Distribution truth{{c}, {}, 0.};
    const auto x = drawn(truth, 4000, 11);
    const bool angles = c.family->support == Family::circle;
    const DistributionFit f =
        fit_distribution(x, {.families = {std::string(c.family->name)}, .angles = angles});
    ASSERT_EQ(f.name, c.family->name);
    EXPECT_GT(f.p, 0.01) << truth.expression();
    EXPECT_LT(f.kolmogorov, 0.03) << truth.expression();
    for (const double p : {0.05, 0.3, 0.6, 0.9})
      EXPECT_NEAR(truth.cdf(f.distribution.quantile(p)), p, 0.03)
          << truth.expression() << " became " << f.distribution.expression();
  }
  // Free to choose, among families that differ much.
  const struct {
    Component truth;
    bool angles;
  } clear[] = {{part("normal", {0, 1}), false},      {part("gamma", {1.8, 20}), false},
               {part("lognormal", {2, 0.8}), false}, {part("exponential", {30}), false},
               {part("uniform", {-3, 4}), false},    {part("vonmises", {10, 3}), true}};
  for (const auto& row : clear) {
    const DistributionFit f =
        fit_distribution(drawn({{row.truth}, {}, 0.}, 3000, 4), {.angles = row.angles, .replicates = 0});
    EXPECT_EQ(f.name, row.truth.family->name) << f.distribution.expression();
    EXPECT_GT(f.candidates.size(), 1u);
  }
}

TEST(Fit, IntervalsHoldTheTruthAsOftenAsTheySay) {
  const Component truths[] = {part("normal", {3, 2}),    part("gamma", {2, 5}),
                              part("weibull", {1.6, 5}), part("lognormal", {1, 0.5}),
                              part("exponential", {4}),  part("uniform", {1, 9}),
                              part("vonmises", {30, 4})};
  for (const Component& c : truths) {
    int inside = 0, all = 0;
    for (std::uint64_t seed = 0; seed < 200; ++seed) {
      const DistributionFit f =
          fit_distribution(drawn({{c}, {}, 0.}, 120, seed), {.families = {std::string(c.family->name)},
                                                             .angles = c.family->support == Family::circle,
                                                             .replicates = 0});
      for (int i = 0; i < c.family->count; ++i, ++all) {
        const ParameterEstimate& e = f.estimates[std::size_t(i)];
        EXPECT_LE(e.lower, e.value);
        EXPECT_GE(e.upper, e.value);
        inside += e.lower <= c.parameters[std::size_t(i)] && c.parameters[std::size_t(i)] <= e.upper;
      }
    }
    EXPECT_NEAR(double(inside) / all, 0.95, 0.04) << c.family->name;
  }
}

TEST(Fit, ThePValueIsEvenWhenTheFamilyIsRightAndSmallWhenItIsWrong) {
  int below_half = 0;
  for (std::uint64_t seed = 0; seed < 40; ++seed)
    below_half += fit_distribution(drawn({{part("gamma", {2, 5})}, {}, 0.}, 150, seed),
                                   {.families = {"gamma"}, .replicates = 39})
                      .p < 0.5;
  EXPECT_NEAR(below_half, 20, 11);
  EXPECT_LT(fit_distribution(drawn({{part("exponential", {5})}, {}, 0.}, 300, 1), {.families = {"normal"}}).p,
            0.02);
}

TEST(Fit, FindsMixtures) {
  const Distribution truth{{part("normal", {-4, 1}, 0.35), part("normal", {3, 2}, 0.65)}, {}, 0.};
  const DistributionFit f = fit_distribution(drawn(truth, 3000, 2));
  ASSERT_EQ(f.name, "normal + normal");
  EXPECT_NEAR(f.distribution.components[0].weight, 0.35, 0.03);
  EXPECT_NEAR(f.distribution.components[0].parameters[0], -4, 0.2);
  EXPECT_NEAR(f.distribution.components[1].parameters[1], 2, 0.2);
  EXPECT_GT(f.p, 0.01);
  ASSERT_EQ(f.estimates[0].name, "1 weight");
  EXPECT_LT(f.estimates[0].lower, 0.35);
  EXPECT_GT(f.estimates[0].upper, 0.35);
  // Of two families, when they are named.
  const Distribution two{{part("exponential", {2}, 0.5), part("normal", {30, 2}, 0.5)}, {}, 0.};
  EXPECT_NEAR(fit_distribution(drawn(two, 2000, 3), {.families = {"exponential + normal"}})
                  .distribution.components[0]
                  .parameters[0],
              2, 0.25);
  // One hump is not taken for two.
  EXPECT_EQ(fit_distribution(drawn({{part("normal", {0, 1})}, {}, 0.}, 1000, 5), {.replicates = 0}).name,
            "normal");
}

TEST(Fit, FindsAtoms) {
  const Distribution truth{{part("gamma", {3, 0.2}, 0.7)}, {{1., 0.3}}, 0.};
  const DistributionFit f = fit_distribution(drawn(truth, 2000, 6));
  ASSERT_EQ(f.distribution.atoms.size(), 1u);
  EXPECT_EQ(f.distribution.atoms[0].value, 1.);
  EXPECT_NEAR(f.distribution.atoms[0].weight, 0.3, 0.04);
  EXPECT_EQ(f.name, "gamma");
  EXPECT_EQ(f.estimates.back().name, "atom at 1");
  EXPECT_LT(f.estimates.back().lower, 0.3);
  EXPECT_GT(f.estimates.back().upper, 0.3);
}

TEST(Fit, FindsTheStepsOfATracerAndWhatComesBackBesideThem) {
  const Distribution truth{{part("gamma", {4, 0.5}, 0.85)}, {{1.04, 0.15}}, 0.26};
  std::vector<double> x = drawn(truth, 3000, 6);
  for (double& v : x) v = double(float(v));  // as files have them
  const DistributionFit f = fit_distribution(x, {.families = {"gamma", "normal"}});
  EXPECT_NEAR(f.distribution.step, 0.26, 1e-4);
  ASSERT_EQ(f.distribution.atoms.size(), 1u);
  EXPECT_NEAR(f.distribution.atoms[0].value, 1.04, 1e-6);
  EXPECT_EQ(f.name, "gamma");
  EXPECT_NEAR(f.distribution.components[0].parameters[0], 4, 0.5);
  for (const double v : drawn(f.distribution, 50, 1)) EXPECT_NEAR(v / 0.26, std::round(v / 0.26), 1e-3);
  EXPECT_EQ(fit_distribution(x, {.families = {"gamma"}, .atoms = false}).distribution.step, 0.);
}

// Grown branches go straight on, or in steps of 25 µm, to the last bit of their coordinates only.
TEST(Fit, TakesWhatRoundingMadeOfEqualValuesForEqual) {
  Random random(3);
  std::vector<double> turns, lengths;
  for (int i = 0; i < 2000; ++i) {
    const double noise = 1e-4 * random.normal();
    turns.push_back(i % 2 ? 20. + 10. * random.normal() : noise);
    lengths.push_back(25. * (1. + random.below(40)) * (1. + 1e-7 * random.normal()));
  }
  const DistributionFit turn = fit_distribution(turns, {.families = {"normal"}});
  ASSERT_EQ(turn.distribution.atoms.size(), 1u);
  EXPECT_EQ(turn.distribution.atoms[0].value, 0.);
  EXPECT_NEAR(turn.distribution.atoms[0].weight, .5, .01);
  EXPECT_NEAR(fit_distribution(lengths, {.families = {"uniform"}}).distribution.step, 25., 1e-3);
}

// Half a pixel of 0.22917 µm, written with two decimals, as in real files.
TEST(Fit, FindsStepsThatFilesHaveRounded) {
  const Distribution truth{{part("lognormal", {0.6, 0.5})}, {}, 0.22917};
  std::vector<double> x = drawn(truth, 200, 6);
  for (double& v : x) v = std::round(v * 100.) / 100.;
  const DistributionFit f = fit_distribution(x);
  EXPECT_NEAR(f.distribution.step, 0.22917, 1e-3);
  EXPECT_TRUE(f.distribution.atoms.empty());
  // What has no step has none.
  EXPECT_EQ(fit_distribution(drawn({truth.components, {}, 0.}, 200, 6)).distribution.step, 0.);
}

TEST(Fit, TorquesThatAreEvenAreUniform) {
  const DistributionFit f =
      fit_distribution(drawn({{part("uniform", {-180, 180})}, {}, 0.}, 800, 6), {.angles = true});
  EXPECT_EQ(f.distribution.expression(), "uniform(-180, 180)");
  EXPECT_TRUE(f.estimates.empty());
  EXPECT_GT(f.p, 0.01);
}

TEST(Fit, TakesWhateverItIsGiven) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN(),
                   infinity = std::numeric_limits<double>::infinity();
  EXPECT_EQ(fit_distribution({}).name, "none");
  const DistributionFit odd = fit_distribution(std::vector{nan, infinity, -infinity, 1e300});
  EXPECT_EQ(odd.name, "none");
  EXPECT_EQ(odd.left_out, 4u);
  const DistributionFit same = fit_distribution(std::vector<double>(500, 2.5));
  EXPECT_EQ(same.name, "values");
  EXPECT_EQ(same.distribution.expression(), "2.5");
  Random random(1);
  EXPECT_EQ(same.distribution.draw(random), 2.5);
  for (const std::vector<double>& few :
       {std::vector{7.}, {7., 8.}, {7., 7., 8.}, {-1., 0., 1.}, {0., 0., 0., 0.}}) {
    const DistributionFit f = fit_distribution(few);
    EXPECT_EQ(f.count, few.size());
    EXPECT_EQ(f.name, "values");
    EXPECT_NEAR(f.distribution.cdf(1e9), 1., 1e-12);
    EXPECT_EQ(f.distribution.cdf(-1e9), 0.);
  }
  for (const double size : {1e-90, 1e-12, 1., 1e12, 1e90}) {
    std::vector<double> x = drawn({{part("gamma", {2, 1})}, {}, 0.}, 400, 3);
    for (double& v : x) v *= size;
    x.push_back(nan);
    const DistributionFit f = fit_distribution(x, {.replicates = 9});
    EXPECT_EQ(f.left_out, 1u);
    EXPECT_LT(f.kolmogorov, 0.1) << size << ' ' << f.name;
    EXPECT_NEAR(f.distribution.cdf(f.distribution.quantile(0.5)), 0.5, 1e-3) << size;
  }
  // Whole numbers, one far off, two values only.
  std::vector<double> counts{1, 2, 2, 3, 3, 3, 4, 4, 5, 6, 1e9};
  EXPECT_EQ(fit_distribution(counts).count, 11u);
  std::vector<double> two(300, 1.);
  std::fill_n(two.begin(), 100, 4.);
  EXPECT_EQ(fit_distribution(two).distribution.atoms.size(), 2u);
  EXPECT_THROW(fit_distribution(counts, {.families = {"zipf"}}), Error);
  EXPECT_THROW(fit_distribution({}, {.families = {"normal + "}}), Error);
  EXPECT_THROW(fit_distribution(counts, {.families = {"normal+normal+normal+normal"}}), Error);
}

TEST(Fit, IsTheSameEveryTime) {
  const auto x = drawn({{part("weibull", {2, 3})}, {}, 0.}, 300, 9);
  const DistributionFit a = fit_distribution(x), b = fit_distribution(x);
  EXPECT_EQ(a.p, b.p);
  EXPECT_EQ(a.distribution.expression(), b.distribution.expression());
}

TEST(Fit, ChanceHasWilsonsInterval) {
  const ParameterEstimate e = chance_of("fork", 5, 20);
  EXPECT_DOUBLE_EQ(e.value, 0.25);
  EXPECT_NEAR(e.lower, 0.1119, 1e-4);
  EXPECT_NEAR(e.upper, 0.4687, 1e-4);
  EXPECT_EQ(chance_of("none", 0, 10).lower, 0.);
  EXPECT_TRUE(std::isnan(chance_of("nothing", 0, 0).value));
}

}  // namespace
}  // namespace forest::statistics
