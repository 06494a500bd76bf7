// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/depth.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <ranges>

#include <Eigen/LU>

#include "forest/core/distinct.h"
#include "forest/core/parallel.h"
#include "forest/cortex/elements.h"
#include "forest/cortex/gauss.h"
#include "forest/cortex/neighbourhood.h"

namespace forest::cortex {
namespace {

constexpr int steps = Depth::steps;

// A cubic through all knots that rises where they rise (Fritsch & Carlson 1980, "Monotone piecewise cubic interpolation"): its slopes
// at knots are harmonic means of those on both sides.
double slope_at(const std::array<double, steps + 1>& y, int k) {
  if (k == 0 || k == steps) {  // of the parabola through three, as far as it does not turn
    const double one = k == 0 ? y[1] - y[0] : y[steps] - y[steps - 1];
    const double two = k == 0 ? y[2] - y[1] : y[steps - 1] - y[steps - 2];
    const double slope = 1.5 * one - .5 * two;
    return std::clamp(slope, 0., 3. * std::max(0., one));
  }
  const double before = y[std::size_t(k)] - y[std::size_t(k) - 1],
               after = y[std::size_t(k) + 1] - y[std::size_t(k)];
  return before > 0. && after > 0. ? 2. * before * after / (before + after) : 0.;
}

double between(const std::array<double, steps + 1>& y, double depth) {
  const double at = std::clamp(depth, 0., 1.) * steps;
  const int k = std::min(steps - 1, int(at));
  const double t = at - k, low = y[std::size_t(k)], high = y[std::size_t(k) + 1];
  const double a = slope_at(y, k), b = slope_at(y, k + 1);
  return low + t * (a + t * (3. * (high - low) - 2. * a - b + t * (2. * (low - high) + a + b)));
}

double bump(double u, double v) { return 16. * u * (1. - u) * v * (1. - v); }

// Integrals over a footprint by Gauss and Legendre.
constexpr std::size_t side = GaussRule::size, columns = side * side;
struct Footprint {
  std::array<double, columns> u, v, weight;
};
const Footprint& footprint() {
  static const Footprint result = [] {
    const auto& [at, weight] = gauss_rule();
    Footprint f;
    for (std::size_t j = 0; j < side; ++j)
      for (std::size_t i = 0; i < side; ++i)
        f.u[side * j + i] = .5 + .5 * at[i], f.v[side * j + i] = .5 + .5 * at[j],
                       f.weight[side * j + i] = weight[i] / 2. * (weight[j] / 2.);
    return f;
  }();
  return result;
}

// Along w det J is a polynomial of degree 8: known at nine places, it is known.
constexpr int degree = 8;
using Polynomial = Eigen::Matrix<double, degree + 1, 1>;
struct Fit {
  std::array<double, degree + 1> at;
  Eigen::Matrix<double, degree + 1, degree + 1> coefficients;  // by the values there
};
const Fit& fit() {
  static const Fit result = [] {
    Fit f;
    Eigen::Matrix<double, degree + 1, degree + 1> powers;
    for (int i = 0; i <= degree; ++i) {
      f.at[std::size_t(i)] = .5 - .5 * std::cos((i + .5) * std::numbers::pi / (degree + 1));
      for (int p = 0; p <= degree; ++p) powers(i, p) = std::pow(f.at[std::size_t(i)], p);
    }
    f.coefficients = powers.inverse();
    return f;
  }();
  return result;
}

// The volume over a place (u, v) of a footprint, as it grows with w.
class Column {
 public:
  Column() = default;
  Column(const Hexahedron& h, double u, double v) {
    Polynomial values;
    for (int i = 0; i <= degree; ++i) values[i] = h.jacobian(u, v, fit().at[std::size_t(i)]).determinant();
    above_ = fit().coefficients * values;
    for (int p = 1; p <= degree; ++p) above_[p] /= p + 1;
  }
  double above(double w) const {
    double sum = 0.;
    for (int p = degree; p >= 0; --p) sum = sum * w + above_[p];
    return sum * w;
  }

 private:
  Polynomial above_;  // of w, w², …
};

class Growth {
 public:
  explicit Growth(const Hexahedron& h) {
    const Footprint& f = footprint();
    for (std::size_t c = 0; c < columns; ++c) {
      columns_[c] = Column(h, f.u[c], f.v[c]);
      all_ += f.weight[c] * columns_[c].above(1.);
    }
  }
  double all() const { return all_; }
  // The x in [low, high] at which the volume above the places w(c, x) is the wanted one; it grows with x.
  template <class Where>
  double solve(double wanted, double low, double high, Where&& where) const {
    constexpr double enough = 1e-6;
    while (high - low > enough) {
      const double x = .5 * (low + high);
      double sum = 0.;
      for (std::size_t c = 0; c < columns; ++c) sum += footprint().weight[c] * columns_[c].above(where(c, x));
      (sum < wanted ? low : high) = x;
    }
    return .5 * (low + high);
  }

 private:
  std::array<Column, columns> columns_;
  double all_ = 0.;
};

// What an element's own table has to add to those of its corners.
Depth::Table own_table(const Elements& elements, std::size_t element,
                       const std::vector<Depth::Table>& corners) {
  const Footprint& f = footprint();
  const Growth growth(elements.hexahedron(element));
  const auto at = elements.corners_of(element);
  Depth::Table own;
  std::array<double, columns> above{};  // where the depth before is: no column turns back
  for (std::size_t k = 0; k < own.size(); ++k) {
    const auto w = [&](std::size_t corner) { return double(corners[at[corner]][k]); };
    const auto where = [&](std::size_t c, double x) {
      const double level = (1. - f.u[c]) * (1. - f.v[c]) * w(0) + f.u[c] * (1. - f.v[c]) * w(1) +
                           (1. - f.u[c]) * f.v[c] * w(2) + f.u[c] * f.v[c] * w(3);
      return std::clamp(level + x * bump(f.u[c], f.v[c]), above[c], 1.);
    };
    own[k] = float(growth.solve(growth.all() * double(k + 1) / steps, -1., 1., where));
    for (std::size_t c = 0; c < columns; ++c) above[c] = where(c, own[k]);
  }
  return own;
}

// The table halfway between the least that is nowhere below this one and the greatest that is nowhere above, both with layers not thinner
// than a tenth of even ones.
void make_grow(Depth::Table& table) {
  constexpr float least = .1f / float(steps);
  Depth::Table low = table;
  float before = 0.f, after = 1.f;
  for (float& w : table) before = w = std::max(w, before + least);
  for (float& w : std::views::reverse(low)) after = w = std::min(w, after - least);
  for (std::size_t k = 0; k < table.size(); ++k)
    table[k] =
        std::clamp(.5f * (table[k] + low[k]), least * float(k + 1), 1.f - least * float(steps - 1 - int(k)));
}

// Where an element narrows otherwise than those around, the mean table of its corners is so far from its own that w would have to leave
// the element in its middle. The corners of such elements go towards what the elements around them want, most towards the one that
// wants most, by the same shares at all depths.
void calm_corners(const Elements& elements, Depth& depth) {
  constexpr int rounds = 24;
  constexpr float much = .2f;               // of w
  constexpr double share = .5 * (4. / 9.);  // half of what would do: the bump's mean is 4/9
  const Stars stars(elements);
  const auto wants = [&](std::size_t element) {
    float most = 0.f;
    for (const float own : depth.elements[element]) most = std::max(most, std::abs(own));
    return most;
  };
  for (int round = 0; round < rounds; ++round) {
    std::vector<std::uint32_t> corners, around;
    for (std::size_t e = 0; e < elements.size(); ++e)
      if (wants(e) > much)
        for (const std::uint32_t c : elements.corners_of(e)) corners.push_back(c);
    if (corners.empty()) return;
    corners = distinct(std::move(corners));
    for (const std::uint32_t c : corners) {
      Depth::Table& table = depth.corners[c];
      std::array<double, steps - 1> sum{};
      double weights = 0.;
      for (const std::uint32_t e : stars.of(c)) {
        const double squared = double(wants(e)) * double(wants(e)), weight = squared * squared;
        weights += weight;
        for (std::size_t k = 0; k < sum.size(); ++k) sum[k] += weight * depth.elements[e][k];
      }
      for (std::size_t k = 0; k < table.size(); ++k) table[k] += float(share * sum[k] / weights);
      make_grow(table);
      around.insert(around.end(), stars.of(c).begin(), stars.of(c).end());
    }
    around = distinct(std::move(around));
    parallel_for(around.size(), 16, [&](std::size_t i) {
      depth.elements[around[i]] = own_table(elements, around[i], depth.corners);
    });
  }
}

}  // namespace

Layers::Layers(const Elements& elements, std::size_t element) : Layers(elements, elements.depth, element) {}

Layers::Layers(const Elements& elements, const Depth& depth, std::size_t element) {
  plain_ = depth.corners.empty();
  if (plain_) return;
  const auto fill = [](Knots& knots, const Depth::Table& table, double last) {
    knots.front() = 0., knots.back() = last;
    std::copy(table.begin(), table.end(), knots.begin() + 1);
  };
  const auto corners = elements.corners_of(element);
  for (std::size_t c = 0; c < 4; ++c) fill(corners_[c], depth.corners[corners[c]], 1.);
  fill(own_, depth.elements[element], 0.);
}

Layers::Knots Layers::knots(double u, double v) const {
  const std::array<double, 4> share{(1. - u) * (1. - v), u * (1. - v), (1. - u) * v, u * v};
  const double own = bump(u, v);
  Knots result;
  for (std::size_t k = 0; k < result.size(); ++k) {
    result[k] = own * own_[k];
    for (std::size_t c = 0; c < 4; ++c) result[k] += share[c] * corners_[c][k];
    result[k] = std::clamp(result[k], k ? result[k - 1] : 0., 1.);
  }
  return result;
}

double Layers::w(double u, double v, double depth) const {
  return plain_ ? depth : between(knots(u, v), depth);
}

double Layers::depth(double u, double v, double w) const {
  if (plain_) return w;
  const Knots at = knots(u, v);
  double low = 0., high = 1.;
  for (int round = 0; round < 45; ++round) {
    const double middle = .5 * (low + high);
    (between(at, middle) < w ? low : high) = middle;
  }
  return .5 * (low + high);
}

std::pair<double, double> Layers::range(double from_depth, double to_depth) const {
  if (plain_) return {from_depth, to_depth};
  // The own table adds from nothing to all of itself; between knots w lies between theirs.
  const auto low = std::size_t(std::clamp(from_depth, 0., 1.) * steps);
  const auto high = std::size_t(std::ceil(std::clamp(to_depth, 0., 1.) * steps));
  std::pair result{1., 0.};
  for (const Knots& corner : corners_) {
    result.first = std::min(result.first, corner[low] + std::min(0., own_[low]));
    result.second = std::max(result.second, corner[high] + std::max(0., own_[high]));
  }
  return {std::max(0., result.first), std::min(1., result.second)};
}

double Layers::volume(const Hexahedron& element, double from_depth, double to_depth) const {
  return plain_ ? element.volume(from_depth, to_depth) : (to_depth - from_depth) * element.volume();
}

// Largest |V(0 → depth) / V − depth| at so many depths. Other places than the tables were made from: Gauss and Legendre in each half of the
// footprint.
class DepthError {
 public:
  DepthError(const Hexahedron& h, int levels) : levels_(levels) {
    for (std::size_t j = 0; j < side; ++j)
      for (std::size_t i = 0; i < side; ++i) columns_[side * j + i] = Column(h, at(i), at(j));
  }
  struct Error {
    double largest = 0.;
    double norm = 0.;  // the sum of eighth powers: knows of those that are nearly the largest, too
  };
  Error operator()(const Layers& layers) const {
    std::vector<double> above(std::size_t(levels_) + 1, 0.);
    for (std::size_t j = 0; j < side; ++j)
      for (std::size_t i = 0; i < side; ++i) {
        const Layers::Knots knots = layers.plain_ ? Layers::Knots{} : layers.knots(at(i), at(j));
        for (int k = 1; k <= levels_; ++k) {
          const double depth = double(k) / levels_;
          above[std::size_t(k)] +=
              weight(i) * weight(j) *
              columns_[side * j + i].above(layers.plain_ ? depth : between(knots, depth));
        }
      }
    Error result;
    for (int k = 1; k < levels_; ++k) {
      const double off = std::abs(above[std::size_t(k)] / above.back() - double(k) / levels_);
      result.largest = std::max(result.largest, off);
      result.norm += std::pow(off, 8);
    }
    return result;
  }

 private:
  static constexpr std::size_t side = 6;
  static double at(std::size_t i) {
    const double off = .5 * std::sqrt(.15);
    return (i < 3 ? .25 : .75) + off * (double(i % 3) - 1.);
  }
  static double weight(std::size_t i) { return i % 3 == 1 ? 8. / 36. : 5. / 36.; }

  int levels_;
  std::array<Column, side * side> columns_;
};

double depth_error(const Elements& elements, std::size_t element) {
  return DepthError(elements.hexahedron(element), 24)(Layers(elements, element)).largest;
}

double layer_bulge(const Elements& elements, std::size_t element) {
  const Hexahedron h = elements.hexahedron(element);
  const Layers layers(elements, element);
  double most = 0.;
  for (int k = 1; k < steps; ++k) {
    const double depth = double(k) / steps;
    double by_corners = 0.;
    for (const double u : {0., 1.})
      for (const double v : {0., 1.}) by_corners += .25 * layers.w(u, v, depth);
    most = std::max(most, (h.at(.5, .5, layers.w(.5, .5, depth)) - h.at(.5, .5, by_corners)).norm());
  }
  return most;
}

namespace {

// Tables are exact at their depths; where w leaps from one to the next it is not between them. Such an element's own table is changed
// here and there, by ever less, as long as the norm of its errors falls.
void settle(const Elements& elements, Depth& depth, std::size_t element) {
  constexpr double enough = .0045;
  constexpr int levels = 48;
  const DepthError error(elements.hexahedron(element), levels);
  Depth::Table& own = depth.elements[element];
  DepthError::Error best = error(Layers(elements, depth, element));
  for (float change = .02f; best.largest > enough && change > 2e-4f;) {
    bool gained = false;
    for (float& w : own)
      for (const float sign : {1.f, -1.f}) {
        const float before = w;
        w += sign * change;
        if (const DepthError::Error now = error(Layers(elements, depth, element)); now.norm < best.norm)
          best = now, gained = true;
        else
          w = before;
      }
    if (!gained) change /= 2.f;
  }
}

}  // namespace

Depth even_depth(const Elements& elements, Progress& progress) {
  Depth result;
  const std::size_t n = elements.size();
  // First of every element by itself, level in w; corners have the mean of those around; then what is still wanting.
  std::vector<Depth::Table> level(n);
  progress.begin("evening depths", 2 * n);
  parallel_ranges(n, 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t e = begin; e < end; ++e) {
      const Growth growth(elements.hexahedron(e));
      for (int k = 1; k < steps; ++k)
        level[e][std::size_t(k) - 1] =
            float(growth.solve(growth.all() * k / steps, 0., 1., [](std::size_t, double x) { return x; }));
    }
    progress.advance(end - begin);
  });
  result.corners.assign(elements.corners, Depth::Table{});
  std::vector<std::uint32_t> around(elements.corners, 0);
  for (std::size_t e = 0; e < n; ++e)
    for (const std::uint32_t c : elements.corners_of(e)) {
      ++around[c];
      for (std::size_t k = 0; k < level[e].size(); ++k) result.corners[c][k] += level[e][k];
    }
  for (std::size_t c = 0; c < result.corners.size(); ++c)
    for (std::size_t k = 0; k < result.corners[c].size(); ++k)
      result.corners[c][k] =
          around[c] ? result.corners[c][k] / float(around[c]) : float(k + 1) / float(steps);
  result.elements.assign(n, Depth::Table{});
  parallel_ranges(n, 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t e = begin; e < end; ++e) result.elements[e] = own_table(elements, e, result.corners);
    progress.advance(end - begin);
  });
  calm_corners(elements, result);
  parallel_for(n, 64, [&](std::size_t e) { settle(elements, result, e); });
  progress.end();
  return result;
}

}  // namespace forest::cortex
