// SPDX-License-Identifier: Apache-2.0
#include "forest/geometry/bezier.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <Eigen/Sparse>

namespace forest {
namespace {

double cross(const Place& a, const Place& b) { return a.x() * b.y() - a.y() * b.x(); }

constexpr std::array<double, 5> gauss_places{-.9061798459386640, -.5384693101056831, 0., .5384693101056831,
                                             .9061798459386640};
constexpr std::array<double, 5> gauss_weights{.2369268850561891, .4786286704993665, .5688888888888889,
                                              .4786286704993665, .2369268850561891};

double length(const Cubic& cubic, double from, double to) {
  if (cubic.straight()) {  // whose speed is not even, and whose derivative has zeros at its ends
    const auto share = [](double t) { return t * t * (3. - 2. * t); };
    return (share(to) - share(from)) * (cubic.points[3] - cubic.points[0]).norm();
  }
  double sum = 0.;
  constexpr int parts = 4;
  const double half = (to - from) / (2. * parts);
  for (int part = 0; part < parts; ++part)
    for (std::size_t k = 0; k < 5; ++k)
      sum += gauss_weights[k] * cubic.derivative(from + half * (2 * part + 1 + gauss_places[k])).norm();
  return half * sum;
}

void flatten(const Cubic& cubic, double tolerance, std::vector<Place>& into) {
  into.push_back(cubic.points[0]);
  if (cubic.straight()) return;
  // The farthest that n chords lie from a cubic: its second derivative is largest at an end (Wang 1984).
  const auto& p = cubic.points;
  const double bend = 6. * std::max((p[0] - 2. * p[1] + p[2]).norm(), (p[1] - 2. * p[2] + p[3]).norm());
  const double parts = std::clamp(std::ceil(std::sqrt(bend / (8. * tolerance))), 1., 1e4);
  for (int i = 1; i < int(parts); ++i) into.push_back(cubic.at(i / parts));
}

// Points all along a closed polygon, each for so much of its length.
struct Samples {
  std::vector<Place> places;
  std::vector<double> lengths;        // µm
  std::vector<double> weights;        // µm: lengths times what counts there
  std::vector<std::size_t> first_of;  // the first sample behind each breakpoint …
  std::vector<Place>
      breaks;  // … where pieces may begin and end: the polygon's corners, and more in long edges
  double total = 0.;

  std::size_t count() const { return breaks.size(); }
};

Samples sampled(std::span<const Place> polygon, const FitOptions& options) {
  Samples samples;
  const auto counts = [&](const Place& at) {
    double times = 1.;
    for (const Emphasis& close : options.closer)
      if ((close.at - at).squaredNorm() < close.within * close.within) times = std::max(times, close.times);
    return times;
  };
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Place &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    const double edge = (b - a).norm();
    if (edge == 0.) continue;
    const int parts = int(std::clamp(std::ceil(edge / (40. * options.tolerance)), 1., 8.));
    for (int part = 0; part < parts; ++part) {
      samples.breaks.push_back(a + double(part) / parts * (b - a));
      samples.first_of.push_back(samples.places.size());
      const bool closer = counts(a + (part + .5) / parts * (b - a)) > 1.;
      const int points =
          closer ? 8 : int(std::clamp(std::ceil(edge / parts / (8. * options.tolerance)), 2., 8.));
      for (int k = 0; k < points; ++k) {
        samples.places.push_back(a + (part + (k + .5) / points) / parts * (b - a));
        samples.lengths.push_back(edge / parts / points);
        samples.weights.push_back(samples.lengths.back() * counts(samples.places.back()));
      }
    }
    samples.total += edge;
  }
  return samples;
}

struct PieceFit {
  Cubic cubic;
  double error = 0.;  // the integral of the squared distance
  double cost = 0.;   // of the squared distance times what counts
};

// One step of Newton's method towards the place on a cubic that is nearest to a point.
double nearer(const Cubic& cubic, double t, const Place& point) {
  const auto& p = cubic.points;
  const Place off = cubic.at(t) - point, first = cubic.derivative(t);
  const Place second = 6. * ((1. - t) * (p[2] - 2. * p[1] + p[0]) + t * (p[3] - 2. * p[2] + p[1]));
  double slope = first.squaredNorm() + off.dot(second);
  if (slope < .3 * first.squaredNorm()) slope = first.squaredNorm();
  if (!(slope > 0.)) return t;
  return std::clamp(t + std::clamp(-off.dot(first) / slope, -.2, .2), 0., 1.);
}

// The cubic between two breakpoints with the controls that fit best, judged at `most` of the samples at most.
// @param t  where on it those samples are
PieceFit fit_piece(const Samples& samples, std::size_t from, std::size_t breaks, std::vector<double>& t,
                   std::size_t most = std::size_t(-1)) {
  const std::size_t n = samples.count(), to = (from + breaks) % n;
  const Place a = samples.breaks[from], b = samples.breaks[to];
  const std::size_t all = samples.places.size(), first = samples.first_of[from];
  const std::size_t behind = samples.first_of[to];
  const std::size_t count = behind > first ? behind - first : behind + all - first;
  const std::size_t stride = (count - 1) / most + 1;
  const auto sample = [&](std::size_t k) { return (first + k * stride) % all; };
  const std::size_t taken = (count - 1) / stride + 1;
  t.resize(taken);
  double along = 0., seen = 0.;
  for (std::size_t s = 0; s < count; ++s) {
    const double length = samples.lengths[(first + s) % all];
    if (s % stride == 0) t[s / stride] = along + length / 2., seen += length;
    along += length;
  }
  for (double& one : t) one /= along;
  PieceFit fit{.cubic = {{a, a + (b - a) / 3., b - (b - a) / 3., b}}};
  for (int round = 0; round < 4; ++round) {
    double m00 = 1e-9 * along, m01 = 0., m11 = 1e-9 * along;
    Place r0 = m00 * fit.cubic.points[1], r1 = m11 * fit.cubic.points[2];
    for (std::size_t s = 0; s < taken; ++s) {
      const double u = t[s], r = 1. - u, weight = samples.weights[sample(s)];
      const double b1 = 3. * r * r * u, b2 = 3. * r * u * u;
      const Place rest = samples.places[sample(s)] - r * r * r * a - u * u * u * b;
      m00 += weight * b1 * b1, m01 += weight * b1 * b2, m11 += weight * b2 * b2;
      r0 += weight * b1 * rest, r1 += weight * b2 * rest;
    }
    const double det = m00 * m11 - m01 * m01;
    fit.cubic.points[1] = (m11 * r0 - m01 * r1) / det;
    fit.cubic.points[2] = (m00 * r1 - m01 * r0) / det;
    fit.error = fit.cost = 0.;
    for (std::size_t s = 0; s < taken; ++s) {
      const Place& point = samples.places[sample(s)];
      t[s] = nearer(fit.cubic, t[s], point);
      const double off = (fit.cubic.at(t[s]) - point).squaredNorm();
      fit.error += samples.lengths[sample(s)] * off, fit.cost += samples.weights[sample(s)] * off;
    }
    fit.error *= along / seen, fit.cost *= along / seen;
  }
  return fit;
}

// Where pieces begin: the cheapest way around, with what each piece fits badly and a price a piece, by dynamic
// programming; the price is what brings the error to the tolerance.
class Division {
 public:
  Division(const Samples& samples, double tolerance) : samples_(samples) {
    const std::size_t n = samples.count();
    const double allowed = tolerance * tolerance * samples.total;
    start_ = sharpest();
    costs_.resize(n);
    std::vector<double> t;
    // Two pieces are cheaper than one that costs more, whatever price is tried.
    const double most = std::min(allowed, 600. * tolerance * tolerance * tolerance);
    for (std::size_t i = 0; i < n; ++i) {
      const std::size_t from = (start_ + i) % n;
      int over = 0;
      // All short pieces, and of long ones some lengths.
      for (std::size_t k = 1; i + k <= n && k < n && over < 3; k += 1 + k / 12) {
        const PieceFit fit = fit_piece(samples, from, k, t, 96);
        costs_[i].push_back({k, fit.error, fit.cost});
        over = fit.cost > most ? over + 1 : 0;
      }
    }
  }

  // Breakpoints in their order, for a price in µm³.
  std::pair<std::vector<std::size_t>, double> cheapest(double price) const {
    const std::size_t n = samples_.count();
    std::vector<double> best(n + 1, HUGE_VAL), error(n + 1, 0.);
    std::vector<std::size_t> from(n + 1, 0);
    best[0] = 0.;
    for (std::size_t i = 0; i < n; ++i)
      for (const auto& [k, off, badly] : costs_[i]) {
        const double cost = best[i] + badly + price;
        if (cost < best[i + k]) best[i + k] = cost, from[i + k] = i, error[i + k] = error[i] + off;
      }
    std::vector<std::size_t> breaks;
    for (std::size_t at = n; at > 0; at = from[at]) breaks.push_back((start_ + from[at]) % n);
    std::ranges::reverse(breaks);
    return {breaks, error[n]};
  }

  std::vector<std::size_t> within(double error) const {
    double low = 0., high = error;
    auto best = cheapest(0.);
    for (int step = 0; step < 40; ++step) {
      const double price = (low + high) / 2.;
      auto found = cheapest(price);
      if (found.second <= error)
        low = price, best = std::move(found);
      else
        high = price;
    }
    return best.first;
  }

 private:
  std::size_t sharpest() const {
    const std::size_t n = samples_.count();
    std::size_t best = 0;
    double least = HUGE_VAL;
    for (std::size_t i = 0; i < n; ++i) {
      const Place in = samples_.breaks[i] - samples_.breaks[(i + n - 1) % n],
                  out = samples_.breaks[(i + 1) % n] - samples_.breaks[i];
      const double cosine = in.dot(out) / (in.norm() * out.norm());
      if (cosine < least - 1e-12) least = cosine, best = i;
    }
    return best;
  }

  const Samples& samples_;
  std::size_t start_ = 0;
  struct Way {
    std::size_t breaks;  // along
    double error, cost;
  };
  std::vector<std::vector<Way>> costs_;  // by first breakpoint
};

// All pieces at once, between nodes that may move: Gauss-Newton on the distances along the normal (tangent distance
// minimisation: Wang, Pottmann & Liu 2006). At a smooth node both controls lie on one line through it.
class Refinement {
 public:
  Refinement(const Samples& samples, std::span<const std::size_t> breaks, double corner) : samples_(samples) {
    const std::size_t n = samples.count(), count = breaks.size();
    std::vector<double> t;
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t steps = (breaks[(i + 1) % count] + n - breaks[i] - 1) % n + 1;
      pieces_.push_back(fit_piece(samples, breaks[i], steps, t).cubic);
      for (std::size_t s = 0; s < t.size(); ++s)
        spots_.push_back({i, t[s], (samples.first_of[breaks[i]] + s) % samples.places.size()});
    }
    smooth_.resize(count);
    for (std::size_t i = 0; i < count; ++i) {
      Cubic& before = pieces_[(i + count - 1) % count];
      Cubic& behind = pieces_[i];
      const Place in = before.points[3] - before.points[2], out = behind.points[1] - behind.points[0];
      const auto turns = [&](const Place& u, const Place& v, double by) {
        return std::abs(std::atan2(cross(u, v), u.dot(v))) > by;
      };
      const Place here = samples.breaks[breaks[i]];
      const auto polygon_turns = [&] {
        return turns(here - samples.breaks[(breaks[i] + n - std::min<std::size_t>(2, n - 1)) % n],
                     samples.breaks[(breaks[i] + 2) % n] - here, corner / 3.);
      };
      const std::size_t sample = samples.first_of[breaks[i]];
      const bool much_closer = samples.weights[sample] > 50. * samples.lengths[sample];
      smooth_[i] = in.norm() > 0. && out.norm() > 0. &&
                   !(much_closer ? turns(in, out, .1) : turns(in, out, corner) && polygon_turns());
      if (!smooth_[i]) continue;
      // The tangent in between, by the longer handle more.
      const Place direction = (in + out).normalized();
      before.points[2] = before.points[3] - in.norm() * direction;
      behind.points[1] = behind.points[0] + out.norm() * direction;
    }
    hold();
  }

  void refine() {
    project(3);
    double error = measure(), damping = 1e-3;
    for (int round = 0; round < 10; ++round) {
      const auto pieces = pieces_;
      const auto spots = spots_;
      step(damping);
      project(2);
      const double now = measure();
      if (now < error) {
        const bool done = now > .99 * error;
        error = now, damping = std::max(damping / 5., 1e-7);
        if (done) break;
      } else {
        pieces_ = pieces, spots_ = spots, damping *= 10.;
        if (damping > 1e3) break;
      }
    }
  }

  Fit result() {
    Fit fit;
    fit.samples = spots_.size();
    for (const Spot& spot : spots_) {
      const double away = off(spot).norm();
      fit.rms += samples_.lengths[spot.sample] * away * away / samples_.total;
      fit.greatest = std::max(fit.greatest, away);
    }
    fit.rms = std::sqrt(fit.rms);
    for (const Cubic& cubic : pieces_)
      fit.curve.points.insert(fit.curve.points.end(), cubic.points.begin(), cubic.points.begin() + 3);
    fit.corners = std::size_t(std::ranges::count(smooth_, false));
    return fit;
  }

 private:
  struct Spot {  // the place on the curve that is nearest to a sample
    std::size_t piece;
    double t;
    std::size_t sample;
  };

  Place off(const Spot& spot) const { return pieces_[spot.piece].at(spot.t) - samples_.places[spot.sample]; }

  double measure() const {
    double sum = 0.;
    for (const Spot& spot : spots_) sum += samples_.weights[spot.sample] * off(spot).squaredNorm();
    return sum;
  }

  void project(int steps) {
    for (Spot& spot : spots_) {
      const Place& point = samples_.places[spot.sample];
      for (int k = 0; k < steps; ++k) spot.t = nearer(pieces_[spot.piece], spot.t, point);
      const bool first = spot.t == 0., last = spot.t == 1.;
      if (!first && !last) continue;
      // Perhaps nearer to the neighbour.
      const std::size_t n = pieces_.size(), other = (spot.piece + (last ? 1 : n - 1)) % n;
      double t = last ? .1 : .9;
      for (int k = 0; k < 3; ++k) t = nearer(pieces_[other], t, point);
      if ((pieces_[other].at(t) - point).squaredNorm() < off(spot).squaredNorm())
        spot.piece = other, spot.t = t;
    }
  }

  void step(double damping) {
    // Unknowns of node i from base[i] on: its place, then the angle of its tangent and the two lengths; or of a corner
    // the two controls.
    const std::size_t n = pieces_.size();
    std::vector<Eigen::Index> base(n + 1, 0);
    for (std::size_t i = 0; i < n; ++i) base[i + 1] = base[i] + (smooth_[i] ? 5 : 6);
    const Eigen::Index unknowns = base[n];
    using Row = Eigen::Matrix<double, 2, 12>;  // by the unknowns of a piece's two nodes, six each
    std::vector<Eigen::Matrix<double, 12, 12>> blocks(n, Eigen::Matrix<double, 12, 12>::Zero());
    std::vector<Eigen::Matrix<double, 12, 1>> sides(n, Eigen::Matrix<double, 12, 1>::Zero());
    for (const Spot& spot : spots_) {
      const Cubic& cubic = pieces_[spot.piece];
      const double t = spot.t, r = 1. - t;
      const double b0 = r * r * r, b1 = 3. * r * r * t, b2 = 3. * r * t * t, b3 = t * t * t;
      const std::size_t a = spot.piece, b = (a + 1) % n;
      Row row = Row::Zero();
      row.block<2, 2>(0, 0) = (smooth_[a] ? b0 + b1 : b0) * Eigen::Matrix2d::Identity();
      row.block<2, 2>(0, 6) = (smooth_[b] ? b2 + b3 : b3) * Eigen::Matrix2d::Identity();
      if (smooth_[a]) {
        const Place handle = cubic.points[1] - cubic.points[0];
        row.col(2) = b1 * Place(-handle.y(), handle.x());
        row.col(4) = b1 * handle.normalized();
      } else {
        row.block<2, 2>(0, 4) = b1 * Eigen::Matrix2d::Identity();
      }
      if (smooth_[b]) {
        const Place handle = cubic.points[2] - cubic.points[3];
        row.col(8) = b2 * Place(-handle.y(), handle.x());
        row.col(9) = b2 * handle.normalized();
      } else {
        row.block<2, 2>(0, 8) = b2 * Eigen::Matrix2d::Identity();
      }
      const Place away = off(spot), tangent = cubic.derivative(t).stableNormalized();
      const Place normal(-tangent.y(), tangent.x());
      const Eigen::Matrix2d metric =
          normal * normal.transpose() + (t > 0. && t < 1. ? .01 : 1.) * tangent * tangent.transpose();
      const double weight = samples_.weights[spot.sample];
      blocks[a] += weight * row.transpose() * metric * row;
      sides[a] -= weight * row.transpose() * metric * away;
    }
    std::vector<Eigen::Triplet<double>> entries;
    Eigen::VectorXd side = Eigen::VectorXd::Zero(unknowns), diagonal = Eigen::VectorXd::Zero(unknowns);
    for (std::size_t i = 0; i < n; ++i) {
      const std::size_t j = (i + 1) % n;
      const auto index = [&](int k) {
        const std::size_t node = k < 6 ? i : j;
        const int own = k % 6;
        return own < (smooth_[node] ? 5 : 6) ? base[node] + own : Eigen::Index(-1);
      };
      for (int k = 0; k < 12; ++k) {
        if (index(k) < 0) continue;
        side[index(k)] += sides[i][k], diagonal[index(k)] += blocks[i](k, k);
        for (int l = 0; l < 12; ++l)
          if (index(l) >= 0) entries.emplace_back(index(k), index(l), blocks[i](k, l));
      }
    }
    for (Eigen::Index k = 0; k < unknowns; ++k)
      entries.emplace_back(k, k, damping * diagonal[k] + 1e-9 * samples_.total / double(n));
    Eigen::SparseMatrix<double> matrix(unknowns, unknowns);
    matrix.setFromTriplets(entries.begin(), entries.end());
    const Eigen::VectorXd change = Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>(matrix).solve(side);
    if (!change.allFinite()) return;
    for (std::size_t i = 0; i < n; ++i) {
      Cubic& before = pieces_[(i + n - 1) % n];
      Cubic& behind = pieces_[i];
      const Place place = behind.points[0] + change.segment<2>(base[i]);
      if (smooth_[i]) {
        const Place in = before.points[3] - before.points[2], out = behind.points[1] - behind.points[0];
        const double angle = std::atan2((in + out).y(), (in + out).x()) + change[base[i] + 2];
        const Place direction(std::cos(angle), std::sin(angle));
        before.points[2] = place - std::max(in.norm() + change[base[i] + 3], .05 * in.norm()) * direction;
        behind.points[1] = place + std::max(out.norm() + change[base[i] + 4], .05 * out.norm()) * direction;
      } else {
        before.points[2] += change.segment<2>(base[i] + 2);
        behind.points[1] += change.segment<2>(base[i] + 4);
      }
      before.points[3] = behind.points[0] = place;
    }
    hold();
  }

  // No handle is longer than the polygon along its piece: on a straight way the curve would turn back, at no cost.
  void hold() {
    std::vector<double> along(pieces_.size(), 0.);
    for (const Spot& spot : spots_) along[spot.piece] += samples_.lengths[spot.sample];
    for (std::size_t i = 0; i < pieces_.size(); ++i) {
      auto& p = pieces_[i].points;
      const auto held = [&](const Place& handle) -> Place {
        return handle * std::min(1., along[i] / std::max(handle.norm(), 1e-9));
      };
      p[1] = p[0] + held(p[1] - p[0]), p[2] = p[3] + held(p[2] - p[3]);
    }
  }

  const Samples& samples_;
  std::vector<Cubic> pieces_;
  std::vector<bool> smooth_;  // where piece i begins
  std::vector<Spot> spots_;
};

}  // namespace

Place Cubic::at(double t) const {
  const double r = 1. - t;
  return r * r * r * points[0] + 3. * r * r * t * points[1] + 3. * r * t * t * points[2] +
         t * t * t * points[3];
}

Place Cubic::derivative(double t) const {
  const double r = 1. - t;
  return 3. * (r * r * (points[1] - points[0]) + 2. * r * t * (points[2] - points[1]) +
               t * t * (points[3] - points[2]));
}

bool BezierLoop::polygon() const {
  for (std::size_t i = 0; i < pieces(); ++i)
    if (!piece(i).straight()) return false;
  return true;
}

Cubic BezierLoop::piece(std::size_t i) const {
  return {{points[3 * i], points[3 * i + 1], points[3 * i + 2], points[(3 * i + 3) % points.size()]}};
}

BezierLoop straight_loop(std::span<const Place> polygon) {
  BezierLoop loop;
  loop.points.reserve(3 * polygon.size());
  for (std::size_t i = 0; i < polygon.size(); ++i)
    loop.points.insert(loop.points.end(), {polygon[i], polygon[i], polygon[(i + 1) % polygon.size()]});
  return loop;
}

std::vector<Place> flattened(const BezierLoop& loop, double tolerance) {
  std::vector<Place> polygon;
  for (std::size_t i = 0; i < loop.pieces(); ++i) flatten(loop.piece(i), tolerance, polygon);
  return polygon;
}

double length(const BezierLoop& loop) {
  double sum = 0.;
  for (std::size_t i = 0; i < loop.pieces(); ++i) sum += length(loop.piece(i), 0., 1.);
  return sum;
}

double area(const BezierLoop& loop) {
  // Half the integral of x dy - y dx along a cubic, whose controls it is a quadratic form of.
  double sum = 0.;
  for (std::size_t i = 0; i < loop.pieces(); ++i) {
    const auto p = loop.piece(i).points;
    sum += (6. * cross(p[0], p[1]) + 3. * cross(p[0], p[2]) + cross(p[0], p[3]) + 3. * cross(p[1], p[2]) +
            3. * cross(p[1], p[3]) + 6. * cross(p[2], p[3])) /
           20.;
  }
  return sum;
}

std::vector<Place> resampled(const BezierLoop& loop, std::size_t count) {
  std::vector<double> ends(loop.pieces());
  double total = 0.;
  for (std::size_t i = 0; i < ends.size(); ++i) ends[i] = total += length(loop.piece(i), 0., 1.);
  std::vector<Place> places;
  places.reserve(count);
  std::size_t i = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const double wanted = total * double(k) / double(count);
    while (i + 1 < ends.size() && ends[i] <= wanted) ++i;
    const Cubic cubic = loop.piece(i);
    const double rest = wanted - (i ? ends[i - 1] : 0.);
    double low = 0., high = 1.;
    for (int step = 0; step < 40 && rest > 0.; ++step) {
      const double middle = (low + high) / 2.;
      (length(cubic, 0., middle) < rest ? low : high) = middle;
    }
    places.push_back(cubic.at(rest > 0. ? (low + high) / 2. : 0.));
  }
  return places;
}

Fit fit_loop(std::span<const Place> polygon, const FitOptions& options) {
  const Samples samples = sampled(polygon, options);
  const Division division(samples, options.tolerance);
  const auto divided = [&](double share) {
    Refinement refinement(samples,
                          division.within(share * options.tolerance * options.tolerance * samples.total),
                          options.corner);
    refinement.refine();
    return refinement.result();
  };
  // What refinement makes of an error of the division is found by trying: the error goes with the share, about.
  Fit best;
  double share = 1.;
  for (int attempt = 0; attempt < 12 && (attempt < 3 || best.curve.points.empty()); ++attempt) {
    Fit fit = divided(share);
    const double over = fit.rms / options.tolerance;
    if (over <= 1. && (best.curve.points.empty() || fit.curve.points.size() < best.curve.points.size()))
      best = fit;
    if (over > .97 && over <= 1.) break;
    share *= std::clamp(.97 / (over * over + 1e-9), .2, 3.);
  }
  if (best.curve.points.empty()) best = divided(1e-6);
  return best;
}

}  // namespace forest
