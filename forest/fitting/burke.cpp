// SPDX-License-Identifier: Apache-2.0
#include "forest/fitting/burke.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include <fmt/format.h>

#include "forest/fitting/parametric.h"
#include "forest/morphology/measure.h"
#include "forest/statistics/conditional.h"
#include "forest/statistics/distribution.h"
#include "forest/statistics/minimise.h"

namespace forest::fitting {
namespace {

using namespace statistics;
using Values = std::vector<double>;

/// log λ(d) = least of a + b d over one or two lines: the chance by µm that something happens at a diameter.
struct Rate {
  std::vector<std::array<double, 2>> lines;  // a, b

  double log_at(double d) const {
    double least = 1e300;
    for (const auto& [a, b] : lines) least = std::min(least, a + b * d);
    return least;
  }
  std::string text() const {
    std::string out;
    for (const auto& [a, b] : lines) {
      const std::string one = fmt::format("{} * exp({} * d)", number_text(std::exp(a)), number_text(b));
      out = out.empty() ? one : fmt::format("min({}, {})", out, one);
    }
    return out.empty() ? "0" : out;
  }
};

/// Length that was there to fork or end on, by diameter, and what happened on it.
struct Exposure {
  double diameter = 0., length = 0., forks = 0., ends = 0., loss = 0.;
};

/// Maximum likelihood of a Poisson process along the branches.
Rate rate_of(std::span<const Exposure> exposure, double Exposure::*events) {
  double happened = 0., length = 0., mean = 0.;
  for (const Exposure& e : exposure) happened += e.*events, length += e.length, mean += e.length * e.diameter;
  if (happened == 0. || length == 0.) return {};
  mean /= length;
  double width = 0.;
  for (const Exposure& e : exposure) width += e.length * (e.diameter - mean) * (e.diameter - mean);
  width = std::sqrt(width / length);
  const double level = std::log(happened / length);
  if (happened < 10. || !(width > 1e-6 * mean)) return {{{level, 0.}}};
  // In units of the spread of diameters about their mean, so that one step suits all; slopes stay within what cells show.
  const auto rate = [&](std::span<const double> x) {
    Rate r;
    for (std::size_t i = 0; i + 1 < x.size(); i += 2) {
      const double b = std::clamp(x[i + 1], -6., 6.) / width;
      r.lines.push_back({x[i] - b * mean, b});
    }
    return r;
  };
  const auto cost = [&](std::span<const double> x) {
    const Rate r = rate(x);
    double sum = 0.;
    for (const Exposure& e : exposure) {
      const double l = r.log_at(e.diameter);
      sum += e.length * std::exp(l) - e.*events * l;
    }
    return sum;
  };
  const Values one = minimise(cost, {level, 0.}, {0.3, 0.5});
  const Values two =
      minimise(cost, {one[0] + 0.2, one[1] + 1.5, one[0] + 0.2, one[1] - 0.5}, {0.3, 0.5, 0.3, 0.5});
  return rate(cost(one) - cost(two) > std::log(happened) ? two : one);
}

struct BurkeModel : KindModel {
  Values girths;
  double finest = 0., thickest = 0.;
  Rate fork, end;
  std::string loss, trend;  // rows of tables by diameter: of µm a µm; of the ratio over its mean
  double anticorrelation = 0., ratio_mean = 1., ratio_sd = 0.;
  // `correction` is of the chance to fork.
};

/// Thick parents have relatively thinner daughters. Burke's daughters are r + a s and s + a r of one distribution, here
/// times that trend: its mean, spread and a give back mean, variance and covariance of the ratios.
void fit_ratios(const Values& parents, const std::vector<std::array<double, 2>>& ratios, BurkeModel& model) {
  model.trend = "1: 1";
  if (ratios.empty()) return;
  const Values edges = bin_edges(parents, {.least = 40, .most = 8});
  Values sums(edges.size(), 0.), counts(edges.size(), 0.);
  double sum = 0.;
  for (std::size_t i = 0; i < ratios.size(); ++i) {
    const std::size_t bin = bin_of(edges, parents[i]);
    const double both = ratios[i][0] + ratios[i][1];
    sums[bin] += both, counts[bin] += 2., sum += both;
  }
  const double pairs = double(ratios.size()), mean = sum / (2. * pairs);
  if (!(mean > 0.)) return;
  const auto trend = [&](std::size_t bin) { return sums[bin] > 0. ? sums[bin] / counts[bin] / mean : 1.; };
  double squares = 0., products = 0.;
  for (std::size_t i = 0; i < ratios.size(); ++i) {
    const double t = trend(bin_of(edges, parents[i])), x = ratios[i][0] / t - mean,
                 y = ratios[i][1] / t - mean;
    squares += x * x + y * y, products += x * y;
  }
  model.trend.clear();
  for (std::size_t b = 0; b < edges.size(); ++b)
    model.trend += fmt::format("{}{}: {}", b ? ", " : "", number_text(edges[b]), number_text(trend(b)));
  const double variance = squares / (2. * pairs);
  const double together = variance > 1e-12 ? std::clamp(products / pairs / variance, -0.9, 0.9) : 0.;
  const double a = std::abs(together) < 1e-6 ? 0. : (1. - std::sqrt(1. - together * together)) / together;
  model.anticorrelation = a;
  model.ratio_mean = mean / (1. + a), model.ratio_sd = std::sqrt(variance / (1. + a * a));
}

/// What happens along the branches, by diameter.
void fit_rates(const std::vector<Exposure>& pieces, BurkeModel& model) {
  Values diameters;
  for (const Exposure& p : pieces) diameters.push_back(p.diameter);
  const Values edges = bin_edges(diameters, {.least = 1, .most = 200});
  std::vector<Exposure> bins(edges.size());
  Values weights(edges.size(), 0.);
  for (const Exposure& p : pieces) {
    Exposure& bin = bins[bin_of(edges, p.diameter)];
    const double w = p.length + 1e-9;
    weights[std::size_t(&bin - bins.data())] += w;
    bin.diameter += w * p.diameter, bin.length += p.length, bin.loss += p.loss;
    bin.forks += p.forks, bin.ends += p.ends;
  }
  for (std::size_t i = 0; i < bins.size(); ++i) bins[i].diameter /= weights[i];
  model.fork = rate_of(bins, &Exposure::forks), model.end = rate_of(bins, &Exposure::ends);
  constexpr std::size_t together = 14;  // of these bins are a row of the table
  for (std::size_t i = 0; i < bins.size(); i += together) {
    const std::size_t last = std::min(i + together, bins.size()) - 1;
    double loss = 0., length = 0.;
    for (std::size_t k = i; k <= last; ++k) loss += bins[k].loss, length += bins[k].length;
    model.loss += fmt::format("{}{}: {}", i ? ", " : "", number_text(edges[last]),
                              number_text(length > 0. ? loss / length : 0.));
  }
}

std::optional<BurkeModel> measured(std::span<const Morphology> cells, const Form& form, double step) {
  BurkeModel model;
  model.form = &form, model.correction.kind = form.kind;
  model.stems = stems_of(cells, form.kind), model.angles = angles_of(cells, form.kind, step);
  std::vector<Exposure> pieces;
  Values parents;  // at bifurcations
  std::vector<std::array<double, 2>> ratios;
  for (const Morphology& cell : cells) {
    const Arbors arbors(cell, {form.kind});
    std::size_t tips = 0;
    for (const Branch& b : arbors.sections()) {
      const auto points = arbors.points(b);
      const double first = first_diameter(arbors, b), last = 2. * points.back().radius;
      ++model.sections;
      tips += b.daughters == 0;
      model.extent = std::max(model.extent, b.path_distance);
      for (std::size_t i = 1; i < points.size(); ++i) {
        const double length = segment_length(points[i - 1], points[i]);
        const double from = i == 1 ? first : 2. * points[i - 1].radius, to = 2. * points[i].radius;
        const int parts = int(std::clamp(2. * length / step, 1., 100.));
        for (int k = 0; k < parts; ++k)
          pieces.push_back(
              {from + (to - from) * (k + 0.5) / parts, length / parts, 0., 0., (from - to) / parts});
        model.girths.push_back(to);
      }
      pieces.push_back({last, 0., double(b.daughters > 0), double(b.daughters == 0), 0.});
    }
    for (const Bifurcation& b : arbors.bifurcations()) {
      const double parent = 2. * arbors.points(arbors.section(b.parent)).back().radius;
      if (!(parent > 0.)) continue;
      const auto ratio = [&](std::uint32_t s) {
        return std::min(first_diameter(arbors, arbors.section(s)) / parent, 3.);
      };
      parents.push_back(parent), ratios.push_back({ratio(b.left), ratio(b.right)});
    }
    model.correction.tips += double(tips) / double(cells.size());
    model.most_abreast = std::max(model.most_abreast, abreast(arbors));
  }
  if (model.sections == 0 || model.girths.empty()) return std::nullopt;
  model.extent = std::min(model.extent, 1e5);  // 10 cm: a stray point must not make growth endless
  std::ranges::sort(model.girths);
  model.finest = std::max(0.05, model.girths[model.girths.size() / 100]);
  model.thickest = std::max(model.finest, *std::ranges::max_element(model.stems.diameters));
  fit_ratios(parents, ratios, model);
  fit_rates(pieces, model);
  return model;
}

std::string text_of(const BurkeModel& m) {
  const std::string k(m.form->suffix);
  std::string t = fmt::format("\n# {}: {} sections of {} cells\n", k, m.sections, m.stems.counts.size());
  t += drawn_as("spread_" + k, m.angles.spreads, {"truncnormal", "normal"});
  t += drawn_as("wander_" + k, m.angles.turns, {"weibull", "gamma", "lognormal"});
  t += m.ratio_sd > 0. ? fmt::format("distribution ratio_{} = truncnormal({}, {}, {}, {})\n", k,
                                     number_text(m.ratio_mean), number_text(m.ratio_sd),
                                     number_text(std::max(0.05, m.ratio_mean - 3. * m.ratio_sd)),
                                     number_text(std::max(0.1, m.ratio_mean + 3. * m.ratio_sd)))
                       : fmt::format("function ratio_{} = {}\n", k, number_text(m.ratio_mean));
  t += fmt::format(
      "#define a_{0} {1}  # what a daughter has of its sibling's draw\n"
      "#define extent_{0} {2}  # µm of path at most\n"
      "#define more_{0} {3}  # corrects the chance to fork: {4}\n"
      "table trend_{0} = {5}  # of ratios, by the parent's diameter\n"
      "table loss_{0} = {6}  # of diameter a µm, by diameter\n",
      k, number_text(m.anticorrelation), number_text(m.extent), number_text(m.correction.more),
      m.correction.comment(), m.trend, m.loss);
  t += fmt::format(
      "function girth_{0}(d) = min({1}, max({2}, d))\n"
      "function thin_{0}(d) = girth_{0}(d - dL * loss_{0}(d))\n"
      "function forks_{0}(d) = min(0.9, more_{0} * dL * {3})\n"
      "function ends_{0}(d) = min(0.9, dL * {4})\n",
      k, number_text(m.thickest), number_text(m.finest), m.fork.text(), m.end.text());
  t += fmt::format(
      "module Tip_{0}(d, path)\n"
      "total growing_{0} = Tip_{0}(d, path) : 1\n"
      "fork_{0}: Tip_{0}(d, path) : path > 0 & path < extent_{0} & growing_{0} < {1}\n"
      "  {{ r = ratio_{0}(), s = ratio_{0}(), b = spread_{0}(), u = uniform(0, 1), w = d * trend_{0}(d),\n"
      "    d1 = girth_{0}(w * (r + a_{0} * s)), d2 = girth_{0}(w * (s + a_{0} * r)),\n"
      "    e1 = thin_{0}(d1), e2 = thin_{0}(d2) }}\n"
      "  -> /(uniform(0, 180)) [ +(u * b) !(d1) F(dL, e1) Tip_{0}(e1, path + dL) ]\n"
      "  -((1 - u) * b) !(d2) F(dL, e2) Tip_{0}(e2, path + dL) : forks_{0}(d)\n"
      "end_{0}: Tip_{0}(d, path) : path > 0 -> : if(path < extent_{0}, ends_{0}(d), 1)\n"
      "grow_{0}: Tip_{0}(d, path) {{ e = thin_{0}(d) }}\n"
      "  -> /(uniform(0, 360)) &(wander_{0}()) F(dL, e) Tip_{0}(e, path + dL)\n",
      k, 4 * std::max<std::size_t>(m.most_abreast, 5));
  return t + text_of(m.stems, *m.form, fmt::format("Tip_{}(d, 0)", k));
}

std::string text_of(const std::vector<BurkeModel>& kinds, const Cells& shared, std::size_t cells,
                    const std::string& name) {
  std::vector<Part> parts;
  for (const BurkeModel& m : kinds)
    parts.push_back({*m.form, m.stems, m.most_abreast, m.extent / shared.step + 3., text_of(m)});
  return assembled(fmt::format("# Estimated from {} traced cells: what a branch does next depends on its "
                               "diameter alone, after Burke, Marks &\n"
                               "# Ulfhake, J Neurosci 12:2403 (1992). Chances are by µm of branch, by "
                               "maximum likelihood; lengths are µm.\n",
                               cells),
                   title_of(name) + " (after Burke, Marks & Ulfhake 1992)", "µm grown in a step", shared,
                   parts);
}

}  // namespace

std::string burke_grammar(std::span<const Morphology> cells, const std::string& name,
                          const ParametricOptions& options) {
  return corrected_grammar(cells, name, options, measured, text_of);
}

}  // namespace forest::fitting
