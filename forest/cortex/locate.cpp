// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/locate.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/parallel.h"

namespace forest::cortex {
namespace {

using Place = Eigen::Vector3d;

constexpr double near_enough = 1e-6;  // µm, where Newton's method ends
constexpr double on_face = 1e-5;      // µm: outside by no more is inside
constexpr int most_cells = 64'000'000;

struct Box {
  Place low, high;
  bool contains(const Place& p, double slack) const {
    return ((p - low).array() >= -slack).all() && ((high - p).array() >= -slack).all();
  }
};
Box box_of(const Hexahedron& h) {
  Box box{h.points[0], h.points[0]};
  for (const Place& p : h.points) box.low = box.low.cwiseMin(p), box.high = box.high.cwiseMax(p);
  return box;
}

// From a start; none where it runs out of the element or does not settle.
std::optional<Place> newton(const Hexahedron& h, const Place& place, Place t) {
  constexpr double beyond = .25;  // how far outside it may pass
  for (int step = 0; step < 16; ++step) {
    const Linear here = linear(h, t);
    const Place rest = place - here.at;
    const double distance = rest.norm();
    if (distance <= near_enough) {
      const Place inside = t.cwiseMax(0.).cwiseMin(1.);
      if (inside == t || (place - h.at(inside)).norm() <= on_face) return inside;
      return std::nullopt;
    }
    const auto a = here.jacobian.col(0), b = here.jacobian.col(1), c = here.jacobian.col(2);
    const Place bc = b.cross(c);
    const double det = a.dot(bc);
    if (!(std::abs(det) > 0.)) return std::nullopt;
    Place move(rest.dot(bc), rest.dot(c.cross(a)), rest.dot(a.cross(b)));
    move /= det;
    const double longest = move.cwiseAbs().maxCoeff();
    if (!(longest < std::numeric_limits<double>::infinity())) return std::nullopt;
    if (longest > .5) move *= .5 / longest;
    const Place next = (t + move).cwiseMax(-beyond).cwiseMin(1. + beyond);
    if (next == t) return std::nullopt;
    t = next;
  }
  return std::nullopt;
}

// The nearest place of the element in the sense of Newton's method with (u, v, w) held in [0, 1]³: what lies outside by less than
// the slack, beyond a face, an edge or a corner.
std::optional<Place> beside(const Hexahedron& h, const Place& place, Place t, double slack) {
  for (int step = 0; step < 20; ++step) {
    const Linear here = linear(h, t);
    const Place next = (t + here.jacobian.partialPivLu().solve(place - here.at)).cwiseMax(0.).cwiseMin(1.);
    if (!next.allFinite()) return std::nullopt;
    const bool settled = (next - t).cwiseAbs().maxCoeff() < 1e-12;
    t = next;
    if (settled) break;
  }
  if ((place - h.at(t)).norm() <= slack) return t;
  return std::nullopt;
}

std::optional<Place> by_halving(const Hexahedron& whole, const Place& place, double slack) {
  struct Part {
    Hexahedron h;
    Place low = Place::Zero(), size = Place::Ones();
    int depth = 0;
  };
  std::vector<Part> open{{whole}};
  constexpr int deepest = 30, most = 4096;
  for (int looked = 0; !open.empty() && looked < most; ++looked) {
    const Part part = std::move(open.back());
    open.pop_back();
    if (!box_of(part.h).contains(place, slack)) continue;
    if (part.depth % 3 == 0) {
      const Place middle = part.low + .5 * part.size;
      if (const auto found = newton(whole, place, middle)) return found;
      if (const auto found = beside(whole, place, middle, slack)) return found;
    }
    if (part.depth == deepest) continue;
    const int axis = part.depth % 3;
    auto halves = split(part.h, axis);
    for (const int upper : {1, 0}) {
      Part half{halves[std::size_t(upper)], part.low, part.size, part.depth + 1};
      half.size[axis] *= .5;
      if (upper) half.low[axis] += half.size[axis];
      open.push_back(std::move(half));
    }
  }
  return std::nullopt;
}

}  // namespace

std::optional<Place> invert(const Hexahedron& hexahedron, const Place& place, double slack) {
  if (!place.allFinite() || !box_of(hexahedron).contains(place, slack)) return std::nullopt;
  if (const auto found = newton(hexahedron, place, Place::Constant(.5))) return found;
  return by_halving(hexahedron, place, slack);
}

Locator::Locator(std::span<const Hexahedron> elements, double slack) : elements_(elements), slack_(slack) {
  std::vector<Box> boxes(elements.size());
  frames_.resize(elements.size());
  parallel_for(elements.size(), 256, [&](std::size_t n) {
    const Hexahedron& h = elements[n];
    for (const Place& p : h.points)
      if (!p.allFinite())
        throw Error(fmt::format("a control point of element {} is not a number; build the elements anew", n));
    boxes[n] = box_of(h);
    Frame& frame = frames_[n];
    const Linear middle = linear(h, Place::Constant(.5));
    frame.inverse = middle.jacobian.inverse();
    if (!frame.inverse.allFinite() || !(std::abs(middle.jacobian.determinant()) > 0.))
      frame.inverse.setZero();  // nothing is ruled out
    frame.origin = Place::Constant(.5) - frame.inverse * middle.at;
    frame.low = frame.high = frame.inverse * h.points[0] + frame.origin;
    for (const Place& p : h.points) {
      const Place at = frame.inverse * p + frame.origin;
      frame.low = frame.low.cwiseMin(at), frame.high = frame.high.cwiseMax(at);
    }
    const Place margin = slack * frame.inverse.rowwise().norm() + Place::Constant(1e-9);
    frame.low -= margin, frame.high += margin;
  });
  if (elements.empty()) {
    first_ = {0, 0};
    return;
  }
  Box all = boxes[0];
  double extent = 0.;
  for (const Box& box : boxes) {
    all.low = all.low.cwiseMin(box.low), all.high = all.high.cwiseMax(box.high);
    extent += (box.high - box.low).sum() / 3.;
  }
  // Cells half as wide as the mean box, as long as there are not too many.
  low_ = all.low - Place::Constant(slack);
  const Place whole = all.high - all.low + Place::Constant(2. * slack);
  cell_ = std::max({.5 * extent / double(elements.size()), std::cbrt(whole.prod() / most_cells),
                    whole.maxCoeff() / 1000., std::numeric_limits<double>::min()});
  for (int a = 0; a < 3; ++a) size_[a] = int(whole[a] / cell_) + 1;
  const auto for_cells = [&](const Box& box, auto&& act) {
    Eigen::Vector3i from, to;
    for (int a = 0; a < 3; ++a) {
      from[a] = std::clamp(int((box.low[a] - slack - low_[a]) / cell_), 0, size_[a] - 1);
      to[a] = std::clamp(int((box.high[a] + slack - low_[a]) / cell_), 0, size_[a] - 1);
    }
    for (int z = from[2]; z <= to[2]; ++z)
      for (int y = from[1]; y <= to[1]; ++y)
        for (int x = from[0]; x <= to[0]; ++x)
          act((std::size_t(z) * std::size_t(size_[1]) + std::size_t(y)) * std::size_t(size_[0]) +
              std::size_t(x));
  };
  first_.assign(std::size_t(size_[0]) * std::size_t(size_[1]) * std::size_t(size_[2]) + 1, 0);
  for (const Box& box : boxes) for_cells(box, [&](std::size_t cell) { ++first_[cell + 1]; });
  for (std::size_t cell = 1; cell < first_.size(); ++cell) first_[cell] += first_[cell - 1];
  listed_.resize(first_.back());
  std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
  for (std::size_t n = 0; n < boxes.size(); ++n)
    for_cells(boxes[n], [&](std::size_t cell) { listed_[next[cell]++] = std::uint32_t(n); });
}

std::size_t Locator::cell_of(const Place& place) const {
  if (elements_.empty() || !place.allFinite()) return no_cell;
  std::size_t cell = 0;
  for (int a = 2; a >= 0; --a) {
    const double at = (place[a] - low_[a]) / cell_;
    if (!(at >= 0.) || at >= double(size_[a])) return no_cell;
    cell = cell * std::size_t(size_[a]) + std::size_t(at);
  }
  return cell;
}

Location Locator::find(const Place& place) const {
  const std::size_t cell = cell_of(place);
  if (cell == no_cell) return {};
  struct Candidate {
    double outside;  // how far the first guess is
    std::uint32_t element;
    Place guess;
  };
  constexpr std::size_t most = 12;  // in order of that; more are rare, and looked at last
  std::array<Candidate, most> candidates;
  std::size_t count = 0;
  bool more = false;
  for (std::uint32_t i = first_[cell]; i < first_[cell + 1]; ++i) {
    const std::uint32_t element = listed_[i];
    const Frame& frame = frames_[element];
    const Place guess = frame.inverse * place + frame.origin;
    if ((guess.array() < frame.low.array()).any() || (guess.array() > frame.high.array()).any()) continue;
    const double outside = (guess - Place::Constant(.5)).cwiseAbs().maxCoeff();
    std::size_t at = count;
    while (at > 0 && outside < candidates[at - 1].outside) --at;
    if (count == most) more = true;
    if (at == most) continue;
    const std::size_t last = std::min(count, most - 1);
    for (std::size_t n = last; n > at; --n) candidates[n] = candidates[n - 1];
    candidates[at] = {outside, element, guess};
    count = last + 1;
  }
  for (std::size_t n = 0; n < count; ++n) {
    const Candidate& c = candidates[n];
    if (const auto found = newton(elements_[c.element], place, c.guess.cwiseMax(0.).cwiseMin(1.)))
      return {c.element, *found};
  }
  for (std::size_t n = 0; n < count; ++n)
    if (const auto found = by_halving(elements_[candidates[n].element], place, slack_))
      return {candidates[n].element, *found};
  if (more)
    for (std::uint32_t i = first_[cell]; i < first_[cell + 1]; ++i)
      if (const auto found = invert(elements_[listed_[i]], place, slack_)) return {listed_[i], *found};
  return {};
}

std::vector<Location> Locator::find(std::span<const Place> places) const {
  // In the order of cells: an element is a kilobyte and a half, and fetched once for all places in it.
  std::vector<Keyed> order(places.size());
  parallel_for(places.size(), 4096, [&](std::size_t n) { order[n] = {cell_of(places[n]), n}; });
  parallel_sort(order);
  std::vector<Location> result(places.size());
  parallel_for(places.size(), 1024, [&](std::size_t n) {
    const std::size_t place = order[n].second;
    result[place] = find(places[place]);
  });
  return result;
}

}  // namespace forest::cortex
