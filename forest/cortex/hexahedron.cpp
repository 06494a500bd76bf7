// SPDX-License-Identifier: Apache-2.0
// The coefficients of det J: the partial derivatives are evaluated at 9×9×9 nodes, their determinant there is the
// polynomial's value, and the inverse of the Bernstein matrix of degree 8, applied along each parameter, makes coefficients of
// values. Nodes are those of Chebyshev and Lobatto, as that inverse is least there (its norm is 184; at even steps 560).
#include "forest/cortex/hexahedron.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <type_traits>
#include <vector>

#include <Eigen/LU>

#include "forest/core/clones.h"
#include "forest/cortex/gauss.h"

namespace forest::cortex {
namespace {

constexpr int nodes = 9;  // a parameter

std::array<double, 4> cubic(double t) {
  const double s = 1. - t;
  return {s * s * s, 3. * s * s * t, 3. * s * t * t, t * t * t};
}
std::array<double, 4> cubic_derivative(double t) {
  const double s = 1. - t;
  return {-3. * s * s, 3. * s * (s - 2. * t), 3. * t * (2. * s - t), 3. * t * t};
}

// What is multiplied along one parameter, with a column a node, so that loops run over nodes.
struct Tables {
  double cubic[4][nodes], quadratic[3][nodes], to_bernstein[nodes][nodes];
  double norm;  // of the last, largest sum of absolute values

  Tables() {
    using Exact = long double;
    Eigen::Matrix<Exact, nodes, nodes> values;
    for (int n = 0; n < nodes; ++n) {
      const Exact t = n == nodes - 1 ? 1.L : (1.L - std::cos(std::numbers::pi_v<Exact> * n / 8)) / 2,
                  s = 1 - t;
      Exact binomial = 1;
      for (int i = 0; i < nodes; ++i) {
        values(n, i) = binomial * std::pow(t, Exact(i)) * std::pow(s, Exact(8 - i));
        binomial = binomial * (8 - i) / (i + 1);
      }
      const Exact three[4] = {s * s * s, 3 * s * s * t, 3 * s * t * t, t * t * t};
      for (int i = 0; i < 4; ++i) cubic[i][n] = double(three[i]);
      const Exact two[3] = {s * s, 2 * s * t, t * t};
      for (int i = 0; i < 3; ++i) quadratic[i][n] = double(two[i]);
    }
    const Eigen::Matrix<Exact, nodes, nodes> inverse = values.fullPivLu().inverse();
    norm = 0.;
    for (int i = 0; i < nodes; ++i) {
      double sum = 0.;
      for (int n = 0; n < nodes; ++n) sum += std::abs(to_bernstein[n][i] = double(inverse(i, n)));
      norm = std::max(norm, sum);
    }
    for (int n = 0; n < nodes; ++n)  // the ends are values themselves
      to_bernstein[n][0] = n == 0 ? 1. : 0., to_bernstein[n][nodes - 1] = n == nodes - 1 ? 1. : 0.;
  }
  static const Tables& get() {
    static const Tables tables;
    return tables;
  }
};

// out[r][n] = Σ in[r][i] table[i][n], for `rows` rows of `terms`: along the parameter that runs fastest.
template <int terms>
[[gnu::always_inline]] inline void along_fast(const double* in, int rows, const double (*table)[nodes],
                                              double* out) {
  for (int r = 0; r < rows; ++r, in += terms, out += nodes) {
    double sum[nodes] = {};
    for (int i = 0; i < terms; ++i)
      for (int n = 0; n < nodes; ++n) sum[n] += in[i] * table[i][n];
    for (int n = 0; n < nodes; ++n) out[n] = sum[n];
  }
}
// out[b][n][x] = Σ in[b][i][x] table[i][n], where x runs over `width`: along another.
template <int terms, int width>
[[gnu::always_inline]] inline void along_slow(const double* in, int blocks, const double (*table)[nodes],
                                              double* out) {
  for (int b = 0; b < blocks; ++b, in += terms * width, out += nodes * width)
    for (int n = 0; n < nodes; ++n) {
      double* const row = out + n * width;
      for (int x = 0; x < width; ++x) row[x] = in[x] * table[0][n];
      for (int i = 1; i < terms; ++i)
        for (int x = 0; x < width; ++x) row[x] += in[i * width + x] * table[i][n];
    }
}

// Values at all nodes of three components with a, b, c coefficients along u, v, w.
template <int a, int b, int c>
[[gnu::always_inline]] inline void at_nodes(const double* in, const Tables& t, double (*out)[729]) {
  double first[3 * c * b * nodes], second[3 * c * nodes * nodes];
  const auto table = [&](auto terms) {
    if constexpr (terms.value == 4)
      return t.cubic;
    else
      return t.quadratic;
  };
  along_fast<a>(in, 3 * c * b, table(std::integral_constant<int, a>()), first);
  along_slow<b, nodes>(first, 3 * c, table(std::integral_constant<int, b>()), second);
  along_slow<c, nodes * nodes>(second, 3, table(std::integral_constant<int, c>()), out[0]);
}

// The control points of ∂x/∂u, ∂x/∂v, ∂x/∂w over 3, as [component][k][j][i], to the coefficients of the determinant.
FOREST_CLONES
void coefficients_of(const double* du, const double* dv, const double* dw, const Tables& t, double* out) {
  double u[3][729], v[3][729], w[3][729], a[729], b[729];
  at_nodes<3, 4, 4>(du, t, u);
  at_nodes<4, 3, 4>(dv, t, v);
  at_nodes<4, 4, 3>(dw, t, w);
  for (int n = 0; n < 729; ++n)
    a[n] = 27. * (u[0][n] * (v[1][n] * w[2][n] - v[2][n] * w[1][n]) +
                  u[1][n] * (v[2][n] * w[0][n] - v[0][n] * w[2][n]) +
                  u[2][n] * (v[0][n] * w[1][n] - v[1][n] * w[0][n]));
  along_fast<nodes>(a, 81, t.to_bernstein, b);
  along_slow<nodes, nodes>(b, 9, t.to_bernstein, a);
  along_slow<nodes, nodes * nodes>(a, 1, t.to_bernstein, out);
}

constexpr std::array<int, 3> stride{1, nodes, nodes* nodes};

struct Box {
  Coefficients coefficients;
  Eigen::Vector3d low = Eigen::Vector3d::Zero();
  Eigen::Vector3d size = Eigen::Vector3d::Ones();
  int halvings = 0;
};

Eigen::Vector3d place_of(const Box& box, std::size_t coefficient) {
  const Eigen::Vector3d at(double(coefficient % 9), double(coefficient / 9 % 9), double(coefficient / 81));
  return box.low + box.size.cwiseProduct(at / 8.);
}

FOREST_CLONES
double least_of(const double* c) {
  double least[nodes];
  std::copy_n(c, nodes, least);
  for (int r = 1; r < 81; ++r)
    for (int x = 0; x < nodes; ++x) least[x] = c[9 * r + x] < least[x] ? c[9 * r + x] : least[x];
  return *std::min_element(least, least + nodes);
}

// The axis along which neighbouring coefficients differ most. Sums are kept apart as far as vectors reach.
FOREST_CLONES
int steepest(const double* c) {
  double u[8] = {}, v[9] = {}, w[81] = {};
  for (int r = 0; r < 81; ++r)
    for (int i = 0; i < 8; ++i) u[i] += std::abs(c[9 * r + i + 1] - c[9 * r + i]);
  for (int k = 0; k < 9; ++k)
    for (int j = 0; j < 8; ++j)
      for (int i = 0; i < 9; ++i) v[i] += std::abs(c[81 * k + 9 * j + 9 + i] - c[81 * k + 9 * j + i]);
  for (int k = 0; k < 8; ++k)
    for (int x = 0; x < 81; ++x) w[x] += std::abs(c[81 * k + 81 + x] - c[81 * k + x]);
  const std::array sums{std::accumulate(u, u + 8, 0.), std::accumulate(v, v + 9, 0.),
                        std::accumulate(w, w + 81, 0.)};
  return int(std::ranges::max_element(sums) - sums.begin());
}

// visit(i, r, x): of the i-th of nine on the r-th of 81 lines along an axis where it is among all.
template <class Visit>
[[gnu::always_inline]] inline void on_lines(int axis, Visit&& visit) {
  const int step = stride[std::size_t(axis)];
  for (int i = 0; i < nodes; ++i)
    for (int r = 0, first = i * step; r < 81; first += nodes * step)
      for (int x = 0; x < step; ++x, ++r) visit(i, r, first + x);
}

// All becomes the lower half along an axis: de Casteljau's algorithm at the middle, on all lines at once.
FOREST_CLONES
void halve(double* lower, double* upper, int axis) {
  double line[nodes][81], end[nodes][81];
  on_lines(axis, [&](int i, int r, int x) { line[i][r] = lower[x]; });
  for (int level = 0; level < nodes; ++level) {
    for (int i = nodes - 1; level > 0 && i >= level; --i)
      for (int r = 0; r < 81; ++r) line[i][r] = .5 * (line[i - 1][r] + line[i][r]);
    std::copy_n(line[nodes - 1], 81, end[nodes - 1 - level]);
  }
  on_lines(axis, [&](int i, int r, int x) { lower[x] = line[i][r], upper[x] = end[i][r]; });
}

// A box becomes its lower half, and what was a copy of it the upper one.
void halve(Box& lower, Box& upper) {
  const int axis = steepest(lower.coefficients.data());
  halve(lower.coefficients.data(), upper.coefficients.data(), axis);
  lower.size[axis] *= .5;
  upper.size[axis] = lower.size[axis];
  upper.low[axis] += lower.size[axis];
  upper.halvings = ++lower.halvings;
}

// Control points of the cubic through f at 0, 1/3, 2/3 and 1.
void through_thirds(Eigen::Vector3d* f, std::size_t step) {
  const Eigen::Vector3d a = f[0], b = f[step], c = f[2 * step], d = f[3 * step];
  f[step] = (-5. * a + 18. * b - 9. * c + 2. * d) / 6.;
  f[2 * step] = (2. * a - 9. * b + 18. * c - 5. * d) / 6.;
}

}  // namespace

Eigen::Vector3d Patch::at(double s, double t) const {
  const auto bs = cubic(s), bt = cubic(t);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t j = 0; j < 4; ++j)
    for (std::size_t i = 0; i < 4; ++i) sum += bs[i] * bt[j] * points[i + 4 * j];
  return sum;
}

Eigen::Vector3d Hexahedron::at(double u, double v, double w) const {
  const auto bu = cubic(u), bv = cubic(v), bw = cubic(w);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < 4; ++k)
    for (std::size_t j = 0; j < 4; ++j) {
      const Eigen::Vector3d* const row = &points[4 * (j + 4 * k)];
      sum += (bv[j] * bw[k]) * (bu[0] * row[0] + bu[1] * row[1] + bu[2] * row[2] + bu[3] * row[3]);
    }
  return sum;
}

Linear linear(const Hexahedron& hexahedron, const Eigen::Vector3d& uvw) {
  const auto bu = cubic(uvw[0]), bv = cubic(uvw[1]), bw = cubic(uvw[2]);
  const auto du = cubic_derivative(uvw[0]), dv = cubic_derivative(uvw[1]), dw = cubic_derivative(uvw[2]);
  Linear result{Eigen::Vector3d::Zero(), Eigen::Matrix3d::Zero()};
  for (std::size_t k = 0; k < 4; ++k) {
    Eigen::Vector3d at = Eigen::Vector3d::Zero(), along_u = at, along_v = at;
    for (std::size_t j = 0; j < 4; ++j) {
      const Eigen::Vector3d* const row = &hexahedron.points[4 * (j + 4 * k)];
      const Eigen::Vector3d value = bu[0] * row[0] + bu[1] * row[1] + bu[2] * row[2] + bu[3] * row[3];
      const Eigen::Vector3d slope = du[0] * row[0] + du[1] * row[1] + du[2] * row[2] + du[3] * row[3];
      at += bv[j] * value;
      along_u += bv[j] * slope;
      along_v += dv[j] * value;
    }
    result.at += bw[k] * at;
    result.jacobian.col(0) += bw[k] * along_u;
    result.jacobian.col(1) += bw[k] * along_v;
    result.jacobian.col(2) += dw[k] * at;
  }
  return result;
}

Eigen::Matrix3d Hexahedron::jacobian(double u, double v, double w) const {
  return linear(*this, {u, v, w}).jacobian;
}

double Hexahedron::volume(double from_w, double to_w) const {
  const auto& [at, weight] = gauss_rule();
  double sum = 0.;
  for (std::size_t k = 0; k < 5; ++k)
    for (std::size_t j = 0; j < 5; ++j)
      for (std::size_t i = 0; i < 5; ++i) {
        const double w = .5 * (from_w + to_w) + .5 * (to_w - from_w) * at[k];
        sum +=
            weight[i] * weight[j] * weight[k] * jacobian(.5 + .5 * at[i], .5 + .5 * at[j], w).determinant();
      }
  return sum * (to_w - from_w) / 8.;
}

double below_outer_face(const Hexahedron& hexahedron, const Eigen::Vector3d& uvw) {
  const auto& [at, weight] = gauss_rule();
  const double half = .5 * uvw[2];
  double sum = 0.;
  for (std::size_t k = 0; k < 5; ++k)
    sum += weight[k] * hexahedron.jacobian(uvw[0], uvw[1], half + half * at[k]).col(2).norm();
  return sum * half;
}

double scaled_jacobian(const Hexahedron& hexahedron, int steps) {
  double least = std::numeric_limits<double>::infinity();
  for (int k = 0; k <= steps; ++k)
    for (int j = 0; j <= steps; ++j)
      for (int i = 0; i <= steps; ++i) {
        const Eigen::Matrix3d at =
            hexahedron.jacobian(double(i) / steps, double(j) / steps, double(k) / steps);
        const double lengths = at.colwise().norm().prod();
        least = std::min(least, lengths > 0. ? at.determinant() / lengths : 0.);
      }
  return least;
}

Patch Hexahedron::face(Face face) const {
  const int across = cortex::axis(face), first = across == 0 ? 1 : 0, second = across == 2 ? 1 : 2;
  Patch patch;
  std::array<int, 3> at{};
  at[std::size_t(across)] = is_far(face) ? 3 : 0;
  for (int t = 0; t < 4; ++t)
    for (int s = 0; s < 4; ++s) {
      at[std::size_t(first)] = s, at[std::size_t(second)] = t;
      patch.points[std::size_t(s + 4 * t)] = point(at[0], at[1], at[2]);
    }
  return patch;
}

Hexahedron through_lattice(const std::array<Eigen::Vector3d, 64>& places) {
  Hexahedron h{places};
  for (std::size_t n = 0; n < 16; ++n) through_thirds(&h.points[4 * n], 1);
  for (std::size_t n = 0; n < 16; ++n) through_thirds(&h.points[n % 4 + 16 * (n / 4)], 4);
  for (std::size_t n = 0; n < 16; ++n) through_thirds(&h.points[n], 16);
  return h;
}

Patch through_lattice(const std::array<Eigen::Vector3d, 16>& places) {
  Patch patch{places};
  for (std::size_t n = 0; n < 4; ++n) through_thirds(&patch.points[4 * n], 1);
  for (std::size_t n = 0; n < 4; ++n) through_thirds(&patch.points[n], 4);
  return patch;
}

Hexahedron from_corners(const std::array<Eigen::Vector3d, 8>& corners) {
  Hexahedron h;
  const auto blend = [](const Eigen::Vector3d& a, const Eigen::Vector3d& b, int i) -> Eigen::Vector3d {
    return i == 0 ? a : i == 3 ? b : Eigen::Vector3d((double(3 - i) * a + double(i) * b) / 3.);
  };
  for (int k = 0; k < 4; ++k)
    for (int j = 0; j < 4; ++j)
      for (int i = 0; i < 4; ++i)
        h.point(i, j, k) =
            blend(blend(blend(corners[0], corners[1], i), blend(corners[2], corners[3], i), j),
                  blend(blend(corners[4], corners[5], i), blend(corners[6], corners[7], i), j), k);
  return h;
}

std::array<Hexahedron, 2> split(const Hexahedron& hexahedron, int axis, double at) {
  std::array<Hexahedron, 2> halves{hexahedron, hexahedron};
  const std::size_t step = axis == 0 ? 1 : axis == 1 ? 4 : 16;
  for (std::size_t n = 0; n < 64; ++n) {
    if (n / step % 4 != 0) continue;
    std::array<Eigen::Vector3d, 4> row;
    for (std::size_t i = 0; i < 4; ++i) row[i] = hexahedron.points[n + i * step];
    for (std::size_t level = 0; level < 4; ++level) {
      halves[0].points[n + level * step] = row[0];
      halves[1].points[n + (3 - level) * step] = row[3 - level];
      for (std::size_t i = 0; i + level < 3; ++i) row[i] = (1. - at) * row[i] + at * row[i + 1];
    }
  }
  return halves;
}

Coefficients determinant(const Hexahedron& hexahedron, double* margin) {
  double du[3 * 48], dv[3 * 48], dw[3 * 48];
  for (int c = 0; c < 3; ++c)
    for (int k = 0; k < 4; ++k)
      for (int j = 0; j < 4; ++j)
        for (int i = 0; i < 4; ++i) {
          const double here = hexahedron.point(i, j, k)[c];
          if (i < 3) du[((c * 4 + k) * 4 + j) * 3 + i] = hexahedron.point(i + 1, j, k)[c] - here;
          if (j < 3) dv[((c * 4 + k) * 3 + j) * 4 + i] = hexahedron.point(i, j + 1, k)[c] - here;
          if (k < 3) dw[((c * 3 + k) * 4 + j) * 4 + i] = hexahedron.point(i, j, k + 1)[c] - here;
        }
  const Tables& tables = Tables::get();
  Coefficients result;
  coefficients_of(du, dv, dw, tables, result.data());
  if (margin) {
    const auto largest = [](const double* d) {
      double most = 0.;
      for (int n = 0; n < 144; ++n) most = std::max(most, std::abs(d[n]));
      return 3. * most;
    };
    // With ε = 2⁻⁵³ a derivative has an error of at most 25 ε of the largest component of its control points (a difference, three
    // sums of four products, rounded weights), a determinant of 6 products so 80 ε of 6 such products; each of the three
    // transformations multiplies by the norm at most and adds 12 ε. Altogether 116 ε norm³; and 64 halvings, of which each adds 8 ε.
    const double epsilon = .5 * std::numeric_limits<double>::epsilon();
    const double scale = 6. * largest(du) * largest(dv) * largest(dw);
    *margin = (128. * std::pow(tables.norm, 3.) + 512.) * epsilon * scale;
  }
  return result;
}

Certificate certify(const Hexahedron& hexahedron, int halvings) {
  using enum Certificate::Verdict;
  double margin = 0.;
  std::vector<Box> open(1);
  open[0].coefficients = determinant(hexahedron, &margin);
  Certificate result{positive, std::numeric_limits<double>::infinity(), Eigen::Vector3d::Zero()};
  while (!open.empty()) {
    Box& box = open.back();
    const Coefficients& c = box.coefficients;
    for (const std::size_t corner : {0, 8, 72, 80, 648, 656, 720, 728})
      if (!(c[corner] > margin)) return {not_positive, c[corner], place_of(box, corner)};
    const double least = least_of(c.data()), bound = least - margin;
    if (!(bound > 0.) && box.halvings < halvings) {
      open.reserve(std::size_t(halvings) + 1);
      open.push_back(open.back());
      halve(open[open.size() - 2], open.back());
      continue;
    }
    if (!(bound > 0.)) result.verdict = undecided;
    if (bound < result.least)
      result.least = bound,
      result.where = place_of(box, std::size_t(std::ranges::find(c, least) - c.begin()));
    open.pop_back();
  }
  return result;
}

}  // namespace forest::cortex
