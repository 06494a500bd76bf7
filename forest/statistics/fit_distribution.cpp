// SPDX-License-Identifier: Apache-2.0
// Mixtures by expectation and maximisation (Dempster, Laird & Rubin 1977), the measure of fit and its p after Anderson &
// Darling 1954 and Stute, Gonzáles Manteiga & Presedo Quindimil 1993.
#include "forest/statistics/fit_distribution.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include <Eigen/Dense>
#include <boost/math/special_functions/erf.hpp>
#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/parallel.h"

namespace forest::statistics {
namespace {

using Values = std::vector<double>;
using Components = std::vector<Component>;
using Spec = std::vector<const Family*>;  // of the components
constexpr double nan = DistributionFit::nan, infinity = std::numeric_limits<double>::infinity();
constexpr std::size_t coarse = 2000;  // sorted values that stand for all of them where a little less will do
constexpr std::size_t tested = 1000;

double normal_quantile(double confidence) { return std::numbers::sqrt2 * boost::math::erf_inv(confidence); }

// ── What the values are ──

struct Sample {
  Values
      x;  // sorted, without atoms; spread over the steps that they were counted in; as counted from where they begin
  std::vector<Atom> atoms;
  double step = 0.;
  std::size_t count = 0, left_out = 0;
  Distribution place;               // where values begin, without any component
  std::optional<double> beginning;  // the limit that this is
  double farthest = infinity;       // the other limit, as counted from it
};

struct Run {  // of values that are equal but for the rounding of coordinates in single precision
  double value;
  std::size_t count;
  std::size_t first;  // of the sorted values
};

/// How far values lie apart that are equal.
struct Tolerance {
  double spread = 0.;  // how far all are from their median

  explicit Tolerance(const Values& sorted) {
    for (const double v : sorted) spread += std::abs(v - sorted[sorted.size() / 2]) / double(sorted.size());
  }
  double operator()(double v) const {
    constexpr double rounding = 3e-7, of_spread = 1e-5;
    return std::min(rounding * std::abs(v), 1e-3 * spread) + of_spread * spread;
  }
};

std::vector<Run> runs_of(const Values& sorted) {
  const Tolerance tolerance(sorted);
  std::vector<Run> runs;
  for (std::size_t i = 0, end = 0; i < sorted.size(); i = end) {
    const double near = tolerance(sorted[i]), far = 20. * near;
    for (end = i + 1;
         end < sorted.size() && sorted[end] - sorted[end - 1] <= near && sorted[end] - sorted[i] <= far;)
      ++end;
    const double middle = sorted[i + (end - i) / 2];
    runs.push_back({std::abs(middle) <= tolerance(0.) ? 0. : middle, end - i, i});
  }
  return runs;
}

/// The step that nearly all values are whole multiples of, where ties say that there is one; else 0.
double step_of(const std::vector<Run>& runs, std::size_t count) {
  if (count < 20 || runs.size() < 5 || runs.size() * 3 > count) return 0.;
  const double most = std::max(std::abs(runs.front().value), std::abs(runs.back().value));
  Values gaps;
  for (std::size_t i = 1; i < runs.size(); ++i)
    if (const double gap = runs[i].value - runs[i - 1].value; gap > 1e-5 * most) gaps.push_back(gap);
  if (gaps.size() < 4) return 0.;
  std::ranges::sort(gaps);
  for (double step : {gaps.front(), gaps[gaps.size() / 10], gaps[gaps.size() / 2]}) {
    // A step known from small values, which files round, is told more exactly by large ones: the regression of values on
    // their numbers of steps.
    for (const double far : {8., 40., 1e9}) {
      double steps = 0., squares = 0.;
      for (const Run& r : runs)
        if (const double k = std::round(r.value / step);
            std::abs(k) <= far && std::abs(r.value / step - k) < 0.15)
          steps += double(r.count) * k * r.value, squares += double(r.count) * k * k;
      if (squares > 0.) step = steps / squares;
    }
    std::size_t fitting = 0;
    for (const Run& r : runs)
      if (std::abs(r.value / step - std::round(r.value / step)) < 0.06) fitting += r.count;
    // Where the step is small every value is a multiple.
    if (fitting * 20 >= count * 19 && gaps[gaps.size() / 2] <= 3.5 * step) return step;
  }
  return 0.;
}

/// Takes the values out that come back more often than their neighbours or a smooth density would have them.
std::vector<Run> take_atoms(std::vector<Run>& runs, std::size_t count, bool stepped) {
  const auto least = std::max<std::size_t>(5, (count + 49) / 50);
  std::vector<Run> atoms;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    if (runs[i].count < least) continue;
    if (stepped) {
      // What the neighbours let expect; at an end what follows goes on as it falls.
      const auto count_at = [&](std::size_t k) { return double(runs[k].count); };
      double usual = 0.;
      if (i > 0 && i + 1 < runs.size())
        usual = std::max(count_at(i - 1), count_at(i + 1));
      else if (runs.size() > 2)
        usual = i == 0 ? count_at(1) * count_at(1) / count_at(2)
                       : count_at(i - 1) * count_at(i - 1) / count_at(i - 2);
      if (count_at(i) < 1.7 * usual + 5. * std::sqrt(usual + 1.)) continue;
    }
    atoms.push_back(runs[i]);
  }
  std::ranges::sort(atoms, std::greater(), &Run::count);
  if (atoms.size() > 8) atoms.resize(8);
  std::ranges::sort(atoms, {}, &Run::value);
  std::erase_if(runs,
                [&](const Run& r) { return std::ranges::find(atoms, r.value, &Run::value) != atoms.end(); });
  return atoms;
}

/// Sets where values begin, and takes out those that lie there; nothing where one lies beyond.
/// @return  how many those are
std::size_t begin_at_limit(Sample& sample, const FitOptions& options) {
  constexpr double of_limit = 3e-6,
                   of_spread = 3e-5;  // straight lines of single precision are so nearly straight
  Values& x = sample.x;               // sorted
  if (x.empty() || options.angles || !(options.least || options.most)) return 0;
  const double median = x[x.size() / 2];
  const bool down = options.most && (!options.least || *options.most - median < median - *options.least);
  const double limit = down ? *options.most : *options.least;
  const double on_it = of_limit * std::abs(limit) + of_spread * Tolerance(x).spread;
  if (down ? x.back() > limit + on_it : x.front() < limit - on_it) return 0;
  if (sample.step > 0. && (down || limit != 0.)) return 0;
  sample.beginning = limit;
  sample.place.origin = limit, sample.place.downwards = down;
  if (options.least && options.most) sample.farthest = *options.most - *options.least;
  if (sample.step > 0.) return 0;  // what is rounded to it lies there, too
  return std::erase_if(x, [&](double v) { return std::abs(v - limit) <= on_it; });
}

Sample sample_of(std::span<const double> values, const FitOptions& options) {
  Sample sample;
  Values& x = sample.x;
  for (double v : values) {
    if (!(std::abs(v) <= 1e100)) continue;
    if (options.angles) v = std::remainder(v, 360.), v = v == -180. ? 180. : v;
    x.push_back(v == 0. ? 0. : v);  // there is one zero
  }
  std::ranges::sort(x);
  sample.count = x.size(), sample.left_out = values.size() - x.size();
  if (x.empty()) return sample;
  if (options.atoms) sample.step = step_of(runs_of(x), x.size());
  const std::size_t on_limit = begin_at_limit(sample, options);
  const Values sorted = x;
  std::vector<Run> runs = runs_of(sorted);
  std::vector<Run> atoms;
  if (options.atoms || runs.size() == 1) atoms = take_atoms(runs, x.size(), sample.step > 0.);
  x.clear();
  for (const Run& r : runs)
    for (std::size_t i = 0; i < r.count; ++i) {
      if (sample.step == 0.) {
        x.push_back(sorted[r.first + i]);
        continue;
      }
      const double at = (double(i) + 0.5) / double(r.count) - 0.5;
      x.push_back(r.value +
                  sample.step * (r.value == 0. && runs.front().value >= 0. ? 0.5 * std::abs(at) + 1e-6 : at));
    }
  for (double& v : x) v = sample.place.counted(v);
  std::ranges::sort(x);
  if (x.size() < 4 || x.front() == x.back()) {  // too few for any family: the values themselves
    atoms.insert(atoms.end(), runs.begin(), runs.end());
    std::ranges::sort(atoms, {}, &Run::value);
    x.clear(), sample.step = 0.;
  }
  if (on_limit) atoms.push_back({*sample.beginning, on_limit, 0}), std::ranges::sort(atoms, {}, &Run::value);
  for (const Run& r : atoms) sample.atoms.push_back({r.value, double(r.count) / double(sample.count)});
  return sample;
}

/// At most `most` of the sorted values, evenly: nearly the same distribution function.
Values thinned(const Values& x, std::size_t most) {
  if (x.size() <= most) return x;
  Values some(most);
  for (std::size_t i = 0; i < most; ++i) some[i] = x[(2 * i + 1) * x.size() / (2 * most)];
  return some;
}

// ── Maximum likelihood ──

double log_density(const Components& components, double x) {
  if (components.size() == 1) return components[0].family->log_density(components[0].parameters, x);
  double logs[3], most = -infinity;
  for (std::size_t j = 0; j < components.size(); ++j) {
    const Component& c = components[j];
    logs[j] = c.weight > 0. ? std::log(c.weight) + c.family->log_density(c.parameters, x) : -infinity;
    most = std::max(most, logs[j]);
  }
  if (!std::isfinite(most)) return most;
  double sum = 0.;
  for (std::size_t j = 0; j < components.size(); ++j) sum += std::exp(logs[j] - most);
  return most + std::log(sum);
}

double log_likelihood(const Components& components, const Values& x) {
  double sum = 0.;
  for (const double v : x) sum += log_density(components, v);
  return sum;
}

/// Whether a part of a mixture has shrunk to a spike, where the likelihood grows without end, or is hardly used.
bool collapsed(const Components& components, const Values& x) {
  const double width = x[x.size() - 1 - x.size() / 20] - x[x.size() / 20];
  return std::ranges::any_of(components, [&](const Component& c) {
    const auto at = [&](double p) { return c.family->quantile(c.parameters, p); };
    return c.weight * double(x.size()) < std::max(5., 0.01 * double(x.size())) ||
           !(at(0.9) - at(0.1) > 1e-3 * width);
  });
}

bool improve(Components& components, const Values& x, int rounds) {
  const std::size_t n = x.size(), k = components.size();
  std::vector<Values> share(k, Values(n));
  double before = -infinity;
  for (int round = 0; round < rounds; ++round) {
    double now = 0.;
    for (std::size_t i = 0; i < n; ++i) {
      double most = -infinity, sum = 0.;
      for (std::size_t j = 0; j < k; ++j) {
        share[j][i] = std::log(components[j].weight) +
                      components[j].family->log_density(components[j].parameters, x[i]);
        most = std::max(most, share[j][i]);
      }
      if (!std::isfinite(most)) return false;
      for (std::size_t j = 0; j < k; ++j) sum += share[j][i] = std::exp(share[j][i] - most);
      for (std::size_t j = 0; j < k; ++j) share[j][i] /= sum;
      now += most + std::log(sum);
    }
    for (std::size_t j = 0; j < k; ++j) {
      components[j].weight = std::accumulate(share[j].begin(), share[j].end(), 0.) / double(n);
      if (!components[j].family->fit(x, share[j], components[j].parameters)) return false;
    }
    if (collapsed(components, x)) return false;
    if (now - before < 1e-8 * std::abs(now)) break;
    before = now;
  }
  return true;
}

/// @param begin  parameters nearby, when they are known
std::optional<Components> fitted(const Spec& spec, const Values& x, bool angles,
                                 const Components* begin = nullptr) {
  if (spec.size() == 1 && angles && spec[0]->support == Family::interval)
    return Components{{spec[0], {-180., 180.}}};
  if (spec.size() == 1) {
    Component c{spec[0]};
    if (!c.family->fit(x, {}, c.parameters)) return std::nullopt;
    return Components{c};
  }
  Components components;
  if (begin) {
    components = *begin;
  } else {
    for (std::size_t j = 0; j < spec.size(); ++j) {
      const std::size_t first = j * x.size() / spec.size(), last = (j + 1) * x.size() / spec.size();
      Component c{spec[j], {}, 1. / double(spec.size())};
      if (!c.family->fit(std::span(x).subspan(first, last - first), {}, c.parameters)) return std::nullopt;
      components.push_back(c);
    }
    // The likelihood's shape is known from few values; all of them say where exactly its top is.
    if (!improve(components, thinned(x, coarse), 300)) return std::nullopt;
  }
  if ((begin || x.size() > coarse) && !improve(components, x, begin ? 40 : 4)) return std::nullopt;
  if (std::ranges::all_of(spec, [&](const Family* f) { return f == spec[0]; }))
    std::ranges::sort(components, {},
                      [](const Component& c) { return c.family->quantile(c.parameters, 0.5); });
  return components;
}

// What the criteria charge for. A limit counts for two parameters: the likelihood falls off from an outermost value in steps of 1/n, not of 1/√n, so that
// taking the limit from there gains log n, where half of that is what a parameter of a smooth likelihood is charged.
int parameters_of(const Spec& spec, bool angles) {
  int sum = int(spec.size()) - 1;
  for (const Family* f : spec)
    if (!(angles && f->support == Family::interval))  // the circle is as it is
      sum += f->count + int(std::ranges::count(f->is_limit, true));
  return sum;
}

/// @param prefix  of what they count from
std::string name_of(const Spec& spec, const std::string& prefix) {
  std::string name;
  for (const Family* f : spec) name += (name.empty() ? "" : " + ") + std::string(f->name);
  return prefix + (spec.size() > 1 && !prefix.empty() ? '(' + name + ')' : name);
}

Spec spec_of(const std::string& text) {
  Spec spec;
  for (std::size_t at = 0; at <= text.size();) {
    const std::size_t end = std::min(text.find('+', at), text.size());
    std::string_view word = std::string_view(text).substr(at, end - at);
    while (!word.empty() && word.front() == ' ') word.remove_prefix(1);
    while (!word.empty() && word.back() == ' ') word.remove_suffix(1);
    spec.push_back(find_family(word));
    if (!spec.back()) {
      std::string known;
      for (const Family& f : families()) known += (known.empty() ? "" : ", ") + std::string(f.name);
      throw Error(fmt::format("there is no family of distributions called '{}'; there are {}", word, known));
    }
    at = end + 1;
  }
  if (spec.size() > 3) throw Error(fmt::format("'{}' mixes more than three; name three at most", text));
  return spec;
}

bool allows(const Family& family, const Values& x, bool angles) {
  switch (family.support) {
    case Family::positive:
      return !angles && (x.front() > 0. || (x.front() == 0. && family.name == "exponential"));
    case Family::circle:
      return angles;
    case Family::interval:
      return family.count == 2 || (!angles && x.size() >= 20);
    case Family::line:
      break;
  }
  return !angles;
}

std::vector<Spec> candidates_of(const Values& x, const FitOptions& options) {
  std::vector<Spec> specs;
  for (const std::string& text : options.families) {
    const Spec spec = spec_of(text);
    if (std::ranges::all_of(spec, [&](const Family* f) { return allows(*f, x, options.angles); }))
      specs.push_back(spec);
  }
  if (!options.families.empty()) return specs;
  for (const Family& f : families()) {
    if (!allows(f, x, options.angles)) continue;
    specs.push_back({&f});
    if (f.support == Family::interval || f.name == "weibull" || f.name == "exponential") continue;
    if (!options.mixtures) continue;
    if (x.size() >= 100) specs.push_back({&f, &f});
    if (x.size() >= 300 && f.support != Family::circle) specs.push_back({&f, &f, &f});
  }
  return specs;
}

// ── How sure ──

/// The parameters of components as a vector in which the likelihood is smooth, and back.
struct Coordinates {
  struct Place {
    std::size_t component;
    int parameter;  // -1: its weight
    bool logarithm;
  };
  std::vector<Place> places;

  explicit Coordinates(const Components& components) {
    for (std::size_t j = 0; j < components.size(); ++j) {
      const Family& f = *components[j].family;
      for (int i = 0; i < f.count; ++i)
        if (!f.is_limit[std::size_t(i)]) places.push_back({j, i, f.is_positive[std::size_t(i)]});
      if (j + 1 < components.size()) places.push_back({j, -1, false});
    }
  }
  double get(const Components& components, const Place& p) const {
    const Component& c = components[p.component];
    const double value = p.parameter < 0 ? c.weight : c.parameters[std::size_t(p.parameter)];
    return p.logarithm ? std::log(value) : value;
  }
  void move(Components& components, const Place& p, double by) const {
    Component& c = components[p.component];
    if (p.parameter < 0) {
      c.weight += by, components.back().weight -= by;
    } else {
      double& value = c.parameters[std::size_t(p.parameter)];
      value = p.logarithm ? value * std::exp(by) : value + by;
    }
  }
};

/// Half the width of the interval of each coordinate, by the curvature of the likelihood; NaN where it has none.
Values half_widths(const Components& best, const Coordinates& coordinates, const Values& all,
                   double confidence) {
  const Values x = thinned(all, coarse);
  const double scale = double(all.size()) / double(x.size());
  const auto& places = coordinates.places;
  const auto n = Eigen::Index(places.size());
  const double top = log_likelihood(best, x) * scale;
  const auto fall = [&](Eigen::Index a, double by_a, Eigen::Index b, double by_b) {
    Components moved = best;
    coordinates.move(moved, places[std::size_t(a)], by_a);
    if (by_b != 0.) coordinates.move(moved, places[std::size_t(b)], by_b);
    const double value = top - log_likelihood(moved, x) * scale;
    return std::isfinite(value) ? value : 1e10;
  };
  Eigen::VectorXd h(n);
  for (Eigen::Index i = 0; i < n; ++i) {  // so far that the likelihood falls by about a tenth
    h[i] = 1e-3 * std::max(std::abs(coordinates.get(best, places[std::size_t(i)])), 1e-12);
    const auto falls = [&] { return 0.5 * (fall(i, h[i], i, 0.) + fall(i, -h[i], i, 0.)); };
    for (int k = 0; k < 200 && falls() > 0.2; ++k) h[i] *= 0.5;
    for (int k = 0; k < 200 && falls() < 0.05; ++k) h[i] *= 1.7;
  }
  Eigen::MatrixXd information(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    information(i, i) = (fall(i, h[i], i, 0.) + fall(i, -h[i], i, 0.)) / (h[i] * h[i]);
    for (Eigen::Index j = 0; j < i; ++j)
      information(i, j) = information(j, i) = (fall(i, h[i], j, h[j]) + fall(i, -h[i], j, -h[j]) -
                                               fall(i, h[i], j, -h[j]) - fall(i, -h[i], j, h[j])) /
                                              (4. * h[i] * h[j]);
  }
  const double z = normal_quantile(confidence);
  Values widths(places.size(), nan);
  const Eigen::LLT<Eigen::MatrixXd> root(information);
  if (!information.allFinite() || root.info() != Eigen::Success) return widths;
  const Eigen::MatrixXd covariance = root.solve(Eigen::MatrixXd::Identity(n, n));
  for (Eigen::Index i = 0; i < n; ++i)
    if (covariance(i, i) > 0.) widths[std::size_t(i)] = z * std::sqrt(covariance(i, i));
  return widths;
}

std::vector<ParameterEstimate> estimates_of(const Components& best, const Values& x, double part,
                                            double confidence) {
  const Coordinates coordinates(best);
  const Values widths = half_widths(best, coordinates, x, confidence);
  const auto first_weight = std::size_t(
      std::ranges::find(coordinates.places, -1, &Coordinates::Place::parameter) - coordinates.places.begin());
  std::vector<ParameterEstimate> out;
  for (std::size_t j = 0; j < best.size(); ++j) {
    const Family& f = *best[j].family;
    const std::string before = best.size() > 1 ? fmt::format("{} ", j + 1) : "";
    const auto width = [&](int parameter) {
      const auto place = std::ranges::find_if(
          coordinates.places, [&](const auto& p) { return p.component == j && p.parameter == parameter; });
      return place == coordinates.places.end() ? nan
                                               : widths[std::size_t(place - coordinates.places.begin())];
    };
    if (best.size() > 1) {
      const double w = best[j].weight, wide = j + 1 < best.size() ? width(-1)
                                              : best.size() == 2  ? widths[first_weight]
                                                                  : nan;
      out.push_back(
          {before + "weight", w * part, std::max(0., w - wide) * part, std::min(1., w + wide) * part});
      if (std::isnan(wide)) out.back().lower = out.back().upper = nan;
    }
    for (int i = 0; i < f.count; ++i) {
      ParameterEstimate e{before + std::string(f.parameters[std::size_t(i)]),
                          best[j].parameters[std::size_t(i)], nan, nan};
      if (f.is_limit[std::size_t(i)]) {
        // The outermost value lies about 1 / (n f) inside of the limit, where f is the density there.
        const double reach =
            -std::log1p(-confidence) /
            (double(x.size()) * best[j].weight * std::exp(f.log_density(best[j].parameters, e.value)));
        const bool low = f.parameters[std::size_t(i)] == "low";
        e.lower = low ? e.value - reach : e.value, e.upper = low ? e.value : e.value + reach;
      } else if (f.is_positive[std::size_t(i)]) {
        e.lower = e.value * std::exp(-width(i)), e.upper = e.value * std::exp(width(i));
      } else {
        e.lower = e.value - width(i), e.upper = e.value + width(i);
      }
      out.push_back(std::move(e));
    }
  }
  return out;
}

// ── How well ──

double cdf(const Components& components, double x) {
  double sum = 0.;
  for (const Component& c : components) sum += c.weight * c.family->cdf(c.parameters, x);
  return sum;
}

struct Distance {
  double kolmogorov, anderson_darling;
};
Distance distance(const Components& components, const Values& sorted) {
  const std::size_t n = sorted.size();
  Values f(n);
  for (std::size_t i = 0; i < n; ++i) f[i] = std::clamp(cdf(components, sorted[i]), 1e-12, 1. - 1e-12);
  double most = 0., sum = 0.;
  for (std::size_t i = 0; i < n; ++i) {
    most = std::max({most, f[i] - double(i) / double(n), double(i + 1) / double(n) - f[i]});
    sum += double(2 * i + 1) * (std::log(f[i]) + std::log1p(-f[n - 1 - i]));
  }
  return {most, -double(n) - sum / double(n)};
}

/// Of `tested` values at most.
double p_of(const Spec& spec, const Components& best, const Values& x, const FitOptions& options) {
  Values some = x;
  if (x.size() > tested) {
    Random random(options.seed, 0, 1);
    for (std::size_t i = 0; i < tested; ++i)
      std::swap(some[i], some[i + random.below(std::uint32_t(some.size() - i))]);
    some.resize(tested);
    std::ranges::sort(some);
  }
  const auto refitted = fitted(spec, some, options.angles, &best);
  if (!refitted) return nan;
  const double here = distance(*refitted, some).anderson_darling;
  std::vector<char> further(options.replicates, 0);
  parallel_for(options.replicates, 1, [&](std::size_t r) {
    Random random(options.seed, r + 1, 1);
    const Distribution drawn_from{*refitted, {}, 0.};
    Values drawn(some.size());
    for (double& v : drawn) v = drawn_from.draw(random);
    std::ranges::sort(drawn);
    const auto again = fitted(spec, drawn, options.angles, &*refitted);
    further[r] = again && distance(*again, drawn).anderson_darling >= here;
  });
  return (1. + double(std::ranges::count(further, 1))) / (1. + double(options.replicates));
}

}  // namespace

ParameterEstimate chance_of(std::string name, std::size_t hits, std::size_t count, double confidence) {
  if (count == 0) return {std::move(name), nan, nan, nan};
  const double n = double(count), p = double(hits) / n, z = normal_quantile(confidence), zz = z * z / n;
  const double centre = (p + 0.5 * zz) / (1. + zz),
               half = z / (1. + zz) * std::sqrt(p * (1. - p) / n + 0.25 * zz / n);
  return {std::move(name), p, hits == 0 ? 0. : centre - half, hits == count ? 1. : centre + half};
}

DistributionFit fit_distribution(std::span<const double> values, const FitOptions& options) {
  for (const std::string& text : options.families) spec_of(text);  // also of no value
  Sample sample = sample_of(values, options);
  const Values& x = sample.x;
  DistributionFit fit;
  fit.count = sample.count, fit.left_out = sample.left_out;
  if (sample.count == 0) return fit;
  fit.name = "values";
  fit.distribution.atoms = sample.atoms;
  fit.in_atoms = sample.count - x.size();
  fit.distribution.origin = sample.place.origin, fit.distribution.downwards = sample.place.downwards;

  struct Fitted {
    Spec spec;
    Components components;
    Candidate candidate;
  };
  std::vector<Fitted> all;
  const auto attempt = [&](const Spec& spec) {
    constexpr double before = 1e-4, beyond = 1e-3;  // of draws, that may lie outside of both limits
    const auto components = fitted(spec, x, options.angles);
    if (!components) return;
    if (sample.beginning && options.families.empty() &&
        (cdf(*components, 0.) > before || 1. - cdf(*components, sample.farthest) > beyond))
      return;
    const double likelihood = log_likelihood(*components, x), n = double(x.size()),
                 k = parameters_of(spec, options.angles);
    if (!std::isfinite(likelihood)) return;
    const double aicc = n > k + 1. ? 2. * k - 2. * likelihood + 2. * k * (k + 1.) / (n - k - 1.) : infinity;
    all.push_back({spec,
                   *components,
                   {name_of(spec, sample.place.prefix()), likelihood, int(k), aicc,
                    k * std::log(n) - 2. * likelihood}});
  };
  if (!x.empty()) {
    for (const Spec& spec : candidates_of(x, options)) attempt(spec);
    if (all.empty()) attempt({find_family("uniform")});  // values that hardly differ
  }
  std::ranges::stable_sort(all, {}, [&](const Fitted& f) {
    return options.criterion == InformationCriterion::aicc ? f.candidate.aicc : f.candidate.bic;
  });
  for (const Fitted& f : all) fit.candidates.push_back(f.candidate);
  const double part = double(x.size()) / double(sample.count);
  if (!all.empty()) {
    const Fitted& best = all.front();
    fit.name = best.candidate.name;
    fit.distribution.components = best.components;
    for (Component& c : fit.distribution.components) c.weight *= part;
    fit.distribution.step = sample.step;
    if (best.candidate.parameters > 0)
      fit.estimates = estimates_of(best.components, x, part, options.confidence);
    const Distance far = distance(best.components, x);
    fit.kolmogorov = far.kolmogorov, fit.anderson_darling = far.anderson_darling;
    if (options.replicates > 0) fit.p = p_of(best.spec, best.components, x, options);
  } else if (!x.empty()) {  // no family has them: at most a thousand of the values themselves
    const Values some = thinned(x, 1000);
    for (const double v : some)
      fit.distribution.atoms.push_back({sample.place.placed(v), part / double(some.size())});
    fit.in_atoms = sample.count;
  }
  for (const Atom& a : sample.atoms)
    fit.estimates.push_back(chance_of("atom at " + number_text(a.value),
                                      std::size_t(std::lround(a.weight * double(sample.count))), sample.count,
                                      options.confidence));
  return fit;
}

}  // namespace forest::statistics
