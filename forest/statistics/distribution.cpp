// SPDX-License-Identifier: Apache-2.0
// Maximum likelihood of the gamma family after Minka 2002, of the von Mises family after Mardia & Jupp 2000, whose
// distribution function is summed after Hill 1977 (ACM Trans Math Softw 3:279).
#include "forest/statistics/distribution.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <boost/math/special_functions/digamma.hpp>
#include <boost/math/special_functions/erf.hpp>
#include <boost/math/special_functions/gamma.hpp>
#include <boost/math/special_functions/trigamma.hpp>
#include <fmt/format.h>

#include "forest/statistics/minimise.h"

namespace forest::statistics {
namespace {

using P = Parameters;
using Values = std::span<const double>;
constexpr double pi = std::numbers::pi, degree = pi / 180.;
constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

double weight(Values w, std::size_t i) { return w.empty() ? 1. : w[i]; }

/// Weighted mean of f(x).
template <class F>
double mean_of(Values x, Values w, F&& f) {
  double sum = 0., all = 0.;
  for (std::size_t i = 0; i < x.size(); ++i) sum += weight(w, i) * f(x[i]), all += weight(w, i);
  return all > 0. ? sum / all : nan;
}

struct Moments {
  double mean, sd;  // sd: of all, not of a sample
};
template <class F>
Moments moments(Values x, Values w, F&& f) {
  const double mean = mean_of(x, w, f);
  const double square = mean_of(x, w, [&](double v) { return (f(v) - mean) * (f(v) - mean); });
  return {mean, std::sqrt(square)};
}

/// Whether the values really differ, as far as doubles can tell.
bool spread(const Moments& m) {
  return std::isfinite(m.sd) && m.sd > 1e-13 * std::abs(m.mean) && m.sd > 1e-150;
}

constexpr auto self = [](double x) { return x; };
constexpr auto logarithm = [](double x) { return std::log(x); };

double phi(double z) { return 0.5 * std::erfc(-z / std::numbers::sqrt2); }
double phi_inverse(double p) { return -std::numbers::sqrt2 * boost::math::erfc_inv(2. * p); }
double log_phi_density(double z) { return -0.5 * z * z - 0.5 * std::log(2. * pi); }

// ── normal: mean, sd ──

double normal_log(const P& p, double x) { return log_phi_density((x - p[0]) / p[1]) - std::log(p[1]); }
double normal_cdf(const P& p, double x) { return phi((x - p[0]) / p[1]); }
double normal_quantile(const P& p, double u) { return p[0] + p[1] * phi_inverse(u); }
double normal_draw(const P& p, Random& random) { return random.normal(p[0], p[1]); }
bool normal_fit(Values x, Values w, P& out) {
  const Moments m = moments(x, w, self);
  out = {m.mean, m.sd};
  return spread(m);
}

// ── truncnormal: mean, sd, low, high ──

/// log(Φ(b) − Φ(a)), also far out on one side.
double log_phi_between(double a, double b) {
  if (a > 0.) return log_phi_between(-b, -a);
  const double part = phi(b) - phi(a);
  if (part > 1e-300) return std::log(part);
  // Of a side so far out that only its edge counts: Mills' ratio.
  return log_phi_density(b) - std::log(std::max(-b, 1.)) +
         std::log1p(-std::exp(std::max(-700., b * (b - a))));
}

double truncnormal_log(const P& p, double x) {
  if (x < p[2] || x > p[3]) return -infinity;
  return normal_log(p, x) - log_phi_between((p[2] - p[0]) / p[1], (p[3] - p[0]) / p[1]);
}
double truncnormal_cdf(const P& p, double x) {
  if (x <= p[2]) return 0.;
  if (x >= p[3]) return 1.;
  const double a = (p[2] - p[0]) / p[1], b = (p[3] - p[0]) / p[1], z = (x - p[0]) / p[1];
  return std::clamp(std::exp(log_phi_between(a, z) - log_phi_between(a, b)), 0., 1.);
}
double truncnormal_quantile(const P& p, double u) {
  double low = p[2], high = p[3];
  for (int i = 0; i < 80 && low < high; ++i) {
    const double middle = 0.5 * (low + high);
    (truncnormal_cdf(p, middle) < u ? low : high) = middle;
  }
  return high;
}
double truncnormal_draw(const P& p, Random& random) {
  return random.truncated_normal(p[0], p[1], p[2], p[3]);
}
bool truncnormal_fit(Values x, Values w, P& out) {
  const Moments m = moments(x, w, self);
  if (!spread(m)) return false;
  const auto [low, high] = std::ranges::minmax(x);
  const double range = high - low;
  // Where the likelihood grows towards an exponential slope it has no maximum; a mean five ranges away looks the same.
  const auto parameters = [&](std::span<const double> t) {
    return P{std::clamp(t[0], low - 5. * range, high + 5. * range),
             std::clamp(std::exp(t[1]), 1e-3 * range, 10. * range), low, high};
  };
  const auto cost = [&](std::span<const double> t) {
    const P p = parameters(t);
    const double shift = (m.mean - p[0]) / p[1], width = m.sd / p[1];
    return 0.5 * (shift * shift + width * width) + std::log(p[1] / m.sd) +
           log_phi_between((low - p[0]) / p[1], (high - p[0]) / p[1]);
  };
  out = parameters(minimise(cost, {m.mean, std::log(m.sd)}, {0.5 * m.sd, 0.3}));
  return true;
}

// ── lognormal: mean and sd of the logarithm ──

double lognormal_log(const P& p, double x) {
  return x > 0. ? normal_log(p, std::log(x)) - std::log(x) : -infinity;
}
double lognormal_cdf(const P& p, double x) { return x > 0. ? normal_cdf(p, std::log(x)) : 0.; }
double lognormal_quantile(const P& p, double u) { return std::exp(normal_quantile(p, u)); }
double lognormal_draw(const P& p, Random& random) { return std::exp(random.normal(p[0], p[1])); }
bool lognormal_fit(Values x, Values w, P& out) {
  const Moments m = moments(x, w, logarithm);
  out = {m.mean, m.sd};
  return std::isfinite(m.mean) && m.sd > 1e-9;
}

// ── gamma: shape, scale ──

double gamma_log(const P& p, double x) {
  if (!(x > 0.)) return -infinity;
  return (p[0] - 1.) * std::log(x / p[1]) - x / p[1] - std::lgamma(p[0]) - std::log(p[1]);
}
double gamma_cdf(const P& p, double x) { return x > 0. ? boost::math::gamma_p(p[0], x / p[1]) : 0.; }
double gamma_quantile(const P& p, double u) { return p[1] * boost::math::gamma_p_inv(p[0], u); }
double gamma_draw(const P& p, Random& random) { return random.gamma(p[0], p[1]); }
bool gamma_fit(Values x, Values w, P& out) {
  const double mean = mean_of(x, w, self), s = std::log(mean) - mean_of(x, w, logarithm);
  if (!(s > 1e-12 && std::isfinite(s))) return false;
  double k = (3. - s + std::sqrt((s - 3.) * (s - 3.) + 24. * s)) / (12. * s);
  for (int i = 0; i < 50; ++i) {  // Minka's generalised Newton steps, which cannot leave k > 0
    const double slope =
        (std::log(k) - boost::math::digamma(k) - s) / (k * k * (1. / k - boost::math::trigamma(k)));
    const double next = 1. / (1. / k + slope);
    if (!(next > 0. && std::isfinite(next))) return false;
    const bool done = std::abs(next - k) < 1e-12 * k;
    k = next;
    if (done) break;
  }
  out = {k, mean / k};
  return true;
}

// ── exponential: mean ──

double exponential_log(const P& p, double x) { return x >= 0. ? -x / p[0] - std::log(p[0]) : -infinity; }
double exponential_cdf(const P& p, double x) { return x > 0. ? -std::expm1(-x / p[0]) : 0.; }
double exponential_quantile(const P& p, double u) { return -p[0] * std::log1p(-u); }
double exponential_draw(const P& p, Random& random) { return random.exponential(p[0]); }
bool exponential_fit(Values x, Values w, P& out) {
  out = {mean_of(x, w, self)};
  return out[0] > 0. && std::isfinite(out[0]);
}

// ── weibull: shape, scale ──

double weibull_log(const P& p, double x) {
  if (!(x > 0.)) return -infinity;
  const double l = std::log(x / p[1]);
  return std::log(p[0] / p[1]) + (p[0] - 1.) * l - std::exp(p[0] * l);
}
double weibull_cdf(const P& p, double x) { return x > 0. ? -std::expm1(-std::pow(x / p[1], p[0])) : 0.; }
double weibull_quantile(const P& p, double u) { return p[1] * std::pow(-std::log1p(-u), 1. / p[0]); }
double weibull_draw(const P& p, Random& random) { return p[1] * std::pow(random.exponential(1.), 1. / p[0]); }
bool weibull_fit(Values x, Values w, P& out) {
  const Moments m = moments(x, w, logarithm);
  if (!(std::isfinite(m.mean) && m.sd > 1e-6)) return false;
  const double top = std::log(*std::ranges::max_element(x));  // powers of x / max never overflow
  std::vector<double> y(x.size());
  std::ranges::transform(x, y.begin(), [&](double v) { return std::log(v) - top; });
  double k = 1.2 / m.sd, low = 0., high = infinity, powers = 0.;
  for (int i = 0; i < 60; ++i) {
    double s0 = 0., s1 = 0., s2 = 0., all = 0.;
    for (std::size_t j = 0; j < y.size(); ++j) {
      const double e = weight(w, j) * std::exp(k * y[j]);
      s0 += e, s1 += e * y[j], s2 += e * y[j] * y[j], all += weight(w, j);
    }
    powers = s0 / all;
    const double f = s1 / s0 - 1. / k - (m.mean - top);  // rises with k
    const double slope = (s2 * s0 - s1 * s1) / (s0 * s0) + 1. / (k * k);
    (f < 0. ? low : high) = k;
    double next = k - f / slope;
    if (!(next > low && next < high)) next = std::isfinite(high) ? 0.5 * (low + high) : 2. * k;
    const bool done = std::abs(next - k) < 1e-12 * k;
    k = next;
    if (done) break;
  }
  out = {k, std::exp(top + std::log(powers) / k)};
  return std::isfinite(k) && std::isfinite(out[1]) && out[1] > 0.;
}

// ── vonmises: mean, concentration; degrees in (-180, 180] ──

double log_bessel_0(double k) {  // of the modified Bessel function of the first kind, order 0
  if (k < 50.) return std::log(std::cyl_bessel_i(0., k));
  return k - 0.5 * std::log(2. * pi * k) +
         std::log1p((1. + 9. / (16. * k) + 225. / (384. * k * k)) / (8. * k));
}
double mean_length(double k) {  // I1(k) / I0(k)
  if (k < 50.) return std::cyl_bessel_i(1., k) / std::cyl_bessel_i(0., k);
  return 1. - (1. + (0.25 + 0.25 / k) / k) / (2. * k);
}
double vonmises_log(const P& p, double x) {
  return p[1] * std::cos((x - p[0]) * degree) - log_bessel_0(p[1]) - std::log(360.);
}
/// From the side opposite to the mean to `turn` degrees from it; one more for each whole turn.
double vonmises_swept(double k, double turn) {
  const double whole = std::round(turn / 360.), x = (turn - 360. * whole) * degree;
  if (k < 1e-9) return whole + 0.5 + x / (2. * pi);
  if (k > 500.) return whole + phi(2. * std::sqrt(k - 0.5) * std::sin(0.5 * x));
  const int terms = int(28. + 0.5 * k - 100. / (k + 5.)) + 2;
  const double s = std::sin(x), c = std::cos(x);
  double sn = std::sin(terms * x), cn = std::cos(terms * x), r = 0., v = 0.;
  for (int n = terms - 1; n > 0; --n) {
    const double before = sn;
    sn = sn * c - cn * s, cn = cn * c + before * s;
    r = 1. / (2. * n / k + r);
    v = r * (sn / n + v);
  }
  return whole + std::clamp(0.5 + x / (2. * pi) + v / pi, 0., 1.);
}
double vonmises_cdf(const P& p, double x) {
  if (x <= -180.) return 0.;
  if (x >= 180.) return 1.;
  return std::clamp(vonmises_swept(p[1], x - p[0]) - vonmises_swept(p[1], -180. - p[0]), 0., 1.);
}
double vonmises_quantile(const P& p, double u) {
  double low = -180., high = 180.;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (vonmises_cdf(p, middle) < u ? low : high) = middle;
  }
  return high;
}
double vonmises_draw(const P& p, Random& random) { return random.von_mises(p[0], p[1]); }
bool vonmises_fit(Values x, Values w, P& out) {
  const double c = mean_of(x, w, [](double v) { return std::cos(v * degree); });
  const double s = mean_of(x, w, [](double v) { return std::sin(v * degree); });
  const double length = std::hypot(c, s);
  if (!(length < 1. - 1e-12)) return false;
  double k = length < 0.53   ? length * (2. + length * length * (1. + 5. / 6. * length * length))
             : length < 0.85 ? -0.4 + 1.39 * length + 0.43 / (1. - length)
                             : 1. / (2. * (1. - length));
  for (int i = 0; i < 30 && k > 1e-9; ++i) {
    const double a = mean_length(k), slope = 1. - a * a - a / k;
    const double next = std::max(0.1 * k, k - (a - length) / slope);
    const bool done = std::abs(next - k) < 1e-11 * k;
    k = next;
    if (done) break;
  }
  out = {std::atan2(s, c) / degree, k};
  return std::isfinite(k);
}

// ── uniform: low, high ──

double uniform_log(const P& p, double x) {
  return x >= p[0] && x <= p[1] ? -std::log(p[1] - p[0]) : -infinity;
}
double uniform_cdf(const P& p, double x) { return std::clamp((x - p[0]) / (p[1] - p[0]), 0., 1.); }
double uniform_quantile(const P& p, double u) { return p[0] + u * (p[1] - p[0]); }
double uniform_draw(const P& p, Random& random) { return random.uniform(p[0], p[1]); }
bool uniform_fit(Values x, Values, P& out) {
  const auto [low, high] = std::ranges::minmax(x);
  out = {low, high};
  return low < high;
}

#define FOREST_FAMILY(name) name##_log, name##_cdf, name##_quantile, name##_draw, name##_fit
constexpr std::array no{false, false, false, false};
constexpr std::array second{false, true, false, false}, both{true, true, false, false};
constexpr Family table[] = {
    {"normal",
     2,
     {"mean", "sd"},
     "mean, standard deviation",
     Family::line,
     no,
     second,
     FOREST_FAMILY(normal)},
    {"truncnormal",
     4,
     {"mean", "sd", "low", "high"},
     "a normal distribution of which only low to high is kept",
     Family::interval,
     {false, false, true, true},
     second,
     FOREST_FAMILY(truncnormal)},
    {"gamma", 2, {"shape", "scale"}, "mean shape * scale", Family::positive, no, both, FOREST_FAMILY(gamma)},
    {"lognormal",
     2,
     {"mean", "sd"},
     "mean and standard deviation of the natural logarithm",
     Family::positive,
     no,
     second,
     FOREST_FAMILY(lognormal)},
    {"exponential", 1, {"mean"}, "mean", Family::positive, no, both, FOREST_FAMILY(exponential)},
    {"weibull",
     2,
     {"shape", "scale"},
     "1 - exp(-(x / scale)^shape) lie below x",
     Family::positive,
     no,
     both,
     FOREST_FAMILY(weibull)},
    {"vonmises",
     2,
     {"mean", "concentration"},
     "the normal distribution of the circle, degrees",
     Family::circle,
     no,
     second,
     FOREST_FAMILY(vonmises)},
    {"uniform",
     2,
     {"low", "high"},
     "evenly from low to high",
     Family::interval,
     both,
     no,
     FOREST_FAMILY(uniform)},
};
#undef FOREST_FAMILY

/// What is left of x when values count in steps: the end of the step it is in.
double step_end(double x, double step) { return (std::floor(x / step + 1e-9) + 0.5) * step; }

}  // namespace

std::span<const Family> families() { return table; }

const Family* find_family(std::string_view name) {
  const auto row = std::ranges::find(table, name, &Family::name);
  return row == std::end(table) ? nullptr : row;
}

double Distribution::density(double x) const {
  double sum = 0.;
  for (const Component& c : components)
    sum += c.weight * std::exp(c.family->log_density(c.parameters, counted(x)));
  return sum;
}

double Distribution::cdf(double x) const {
  if (std::isnan(x)) return nan;
  const double end = step > 0. ? step_end(x, step) : x;
  double sum = 0.;
  for (const Component& c : components) {
    const double below = c.family->cdf(c.parameters, counted(end));
    sum += c.weight * (downwards ? 1. - below : below);
  }
  for (const Atom& a : atoms) sum += a.value <= x ? a.weight : 0.;
  return std::min(sum, 1.);
}

// The least value there is (p = 0), or the greatest (1); NaN where there is none.
static double end_of(const Distribution& d, double p) {
  const auto& [components, atoms, step, origin, downwards] = d;
  double low = infinity, high = -infinity;
  const auto take = [&](double x) { low = std::min(low, x), high = std::max(high, x); };
  for (const Component& c : components) {
    const Family::Support support = c.family->support;
    const bool first = p == (downwards ? 1. : 0.);
    if (support == Family::positive && first)
      take(origin);
    else if (support == Family::interval)
      take(d.placed(c.family->quantile(c.parameters, first ? 0. : 1.)));
    else
      return nan;
  }
  if (step > 0. && !components.empty())
    low = step * std::round(low / step), high = step * std::round(high / step);
  for (const Atom& a : atoms) take(a.value);
  return p == 0. ? low : high;
}

double Distribution::quantile(double p) const {
  if (!(p >= 0. && p <= 1.)) return nan;
  if (p == 0. || p == 1.) return end_of(*this, p);
  // All of them lie between the quantiles of the parts.
  const double inside = std::clamp(p, 1e-12, 1. - 1e-12);
  double low = infinity, high = -infinity;
  const auto take = [&](double x) { low = std::min(low, x), high = std::max(high, x); };
  for (const Component& c : components)
    take(placed(c.family->quantile(c.parameters, downwards ? 1. - inside : inside)));
  for (const Atom& a : atoms) take(a.value);
  if (components.size() == 1 && atoms.empty()) return step > 0. ? step * std::round(high / step) : high;
  if (step > 0.) low -= step, high += step;
  if (cdf(low) >= p) return low;
  for (int i = 0; i < 200 && low < high; ++i) {
    const double middle = low + 0.5 * (high - low);
    if (middle == low || middle == high) break;
    (cdf(middle) >= p ? high : low) = middle;
  }
  return high;
}

double Distribution::draw(Random& random) const {
  // In the order of expression(), so that both are the same chances.
  double u = random.uniform();
  for (const Atom& a : atoms)
    if ((u -= a.weight) < 0.) return a.value;
  if (components.empty()) return atoms.empty() ? nan : atoms.back().value;
  const auto found =
      std::ranges::find_if(components, [&](const Component& c) { return (u -= c.weight) < 0.; });
  const Component& c = found == components.end() ? components.back() : *found;
  const double x = placed(c.family->draw(c.parameters, random));
  return step > 0. ? step * std::round(x / step) : x;
}

std::string number_text(double value) { return fmt::format("{:.6g}", value); }

std::string Distribution::prefix() const {
  if (downwards) return number_text(origin) + " - ";
  return origin == 0. ? "" : number_text(origin) + " + ";
}

std::string Distribution::declaration(std::string_view name) const {
  const bool draws = !components.empty() || atoms.size() > 1;
  return fmt::format("{} {} = {}", draws ? "distribution" : "function", name, expression());
}

std::string Distribution::expression() const {
  struct Choice {
    double weight;
    std::string text;
  };
  const auto nested = [](const std::vector<Choice>& choices) {
    double left = 0.;
    for (const Choice& c : choices) left += c.weight;
    std::string text, end;
    for (std::size_t i = 0; i + 1 < choices.size(); ++i, end += ')') {
      text += fmt::format("if(chance({}), {}, ", number_text(choices[i].weight / left), choices[i].text);
      left -= choices[i].weight;
    }
    return text + (choices.empty() ? "0" : choices.back().text) + end;
  };
  std::vector<Choice> parts, all;
  double rest = 0.;
  for (const Component& c : components) {
    std::string text = fmt::format("{}({}", c.family->name, number_text(c.parameters[0]));
    for (int i = 1; i < c.family->count; ++i) text += ", " + number_text(c.parameters[std::size_t(i)]);
    parts.push_back({c.weight, text + ')'});
    rest += c.weight;
  }
  for (const Atom& a : atoms) all.push_back({a.weight, number_text(a.value)});
  if (!parts.empty()) {
    const std::string before = prefix(), text = before + nested(parts),
                      stepped = before.empty() ? text : '(' + text + ')';
    all.push_back(
        {rest, step > 0. ? fmt::format("{0} * round({1} / {0})", number_text(step), stepped) : text});
  }
  return nested(all);
}

}  // namespace forest::statistics
