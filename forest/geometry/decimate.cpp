// SPDX-License-Identifier: Apache-2.0
#include "forest/geometry/decimate.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <queue>
#include <tuple>

#include "forest/core/distinct.h"
#include "forest/core/parallel.h"
#include "forest/core/progress.h"
#include "forest/geometry/triangle_tree.h"

namespace forest {
namespace {

using Point = Eigen::Vector3d;
using Corners = std::array<Point, 3>;
constexpr std::uint32_t none = std::uint32_t(-1);

// What a triangle may become: turned no further than this (cosine), no thinner than what it replaces or this (1: all sides
// alike), and folded back on no neighbour (cosine).
constexpr double most_turn = .2, least_shape = .15, sharpest_fold = -.9;
// So far beyond its border a triangle is tested (µm), that coordinates may be rounded when they are written.
constexpr double clearance = .5;

// Everything in between rounds: triangles, and for each vertex of the first mesh the triangle that it is kept by.
struct State {
  Mesh mesh;
  std::vector<Vec3> first;
  std::vector<std::uint32_t> keeper;
  std::vector<std::uint8_t> settled;  // vertices whose edges were tried in an earlier round
};

struct Box {
  Point low, high;

  bool touches(const Box& other) const {
    return (low.array() <= other.high.array()).all() && (other.low.array() <= high.array()).all();
  }
};

Box box_of(const Corners& t) {
  return {t[0].cwiseMin(t[1]).cwiseMin(t[2]), t[0].cwiseMax(t[1]).cwiseMax(t[2])};
}

Point across(const Corners& t) { return (t[1] - t[0]).cross(t[2] - t[0]); }

double shape(const Corners& t) {
  const double sides =
      (t[1] - t[0]).squaredNorm() + (t[2] - t[1]).squaredNorm() + (t[0] - t[2]).squaredNorm();
  return sides > 0. ? 2. * std::numbers::sqrt3 * across(t).norm() / sides : 0.;
}

double side(const Point& a, const Point& b, const Point& c, const Point& d) {
  return (b - a).cross(c - a).dot(d - a);
}

// Whether an edge goes through a triangle that is somewhat larger than it is.
bool pierces(const Point& p, const Point& q, const Corners& t) {
  const double below = side(t[0], t[1], t[2], p), above = side(t[0], t[1], t[2], q);
  const double slack = clearance * across(t).norm();
  if ((below > slack && above > slack) || (below < -slack && above < -slack)) return false;
  if (below == above) return false;  // along it
  const double share = std::clamp(below / (below - above), 0., 1.);
  const Point at = p + share * (q - p);
  const Point normal = across(t).stableNormalized();
  for (std::size_t k = 0; k < 3; ++k) {
    const Point along = t[(k + 1) % 3] - t[k];
    if (normal.cross(along).dot(at - t[k]) < -clearance * along.norm()) return false;
  }
  return true;
}

// Whether one lies wholly on one side of the other's plane.
bool beside(const Corners& s, const Corners& t) {
  const Point normal = across(t);
  const double slack = clearance * normal.norm();
  const double a = normal.dot(s[0] - t[0]), b = normal.dot(s[1] - t[0]), c = normal.dot(s[2] - t[0]);
  return (a > slack && b > slack && c > slack) || (a < -slack && b < -slack && c < -slack);
}

// As `pierces`, where the edge and the triangle have a corner in common next to which they lie close by nature.
bool pierces_strictly(const Point& p, const Point& q, const Corners& t) {
  const double below = side(t[0], t[1], t[2], p), above = side(t[0], t[1], t[2], q);
  if (!((below < 0. && above > 0.) || (below > 0. && above < 0.))) return false;
  const double u = side(p, q, t[0], t[1]), v = side(p, q, t[1], t[2]), w = side(p, q, t[2], t[0]);
  return (u > 0. && v > 0. && w > 0.) || (u < 0. && v < 0. && w < 0.);
}

// Ericson (2005), "Real-time collision detection", 5.1.5.
double square_from(const Point& p, const Corners& t) {
  const Point ab = t[1] - t[0], ac = t[2] - t[0], ap = p - t[0];
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0. && d2 <= 0.) return ap.squaredNorm();
  const Point bp = p - t[1];
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0. && d4 <= d3) return bp.squaredNorm();
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0. && d1 >= 0. && d3 <= 0.) return (ap - ab * (d1 / (d1 - d3))).squaredNorm();
  const Point cp = p - t[2];
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0. && d5 <= d6) return cp.squaredNorm();
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0. && d2 >= 0. && d6 <= 0.) return (ap - ac * (d2 / (d2 - d6))).squaredNorm();
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0. && d4 - d3 >= 0. && d5 - d6 >= 0.)
    return (bp - (t[2] - t[1]) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)))).squaredNorm();
  const double all = va + vb + vc;
  return all > 0. ? (ap - ab * (vb / all) - ac * (vc / all)).squaredNorm() : ap.squaredNorm();
}

// Triangles of a box by place. What moves is put in again; what it was before is found in vain.
class Cells {
 public:
  Cells() = default;
  explicit Cells(const Box& box) : low_(box.low) {
    size_ = ((box.high - box.low) / count).cwiseMax(1e-3);
    cells_.resize(std::size_t(count * count * count));
  }
  void put(std::uint32_t triangle, const Box& box) {
    visit(box, [&](std::vector<std::uint32_t>& cell) { cell.push_back(triangle); });
  }
  template <class Visit>
  void visit(const Box& box, Visit&& visit) {
    const auto from = cell_of(box.low), to = cell_of(box.high);
    for (int z = from[2]; z <= to[2]; ++z)
      for (int y = from[1]; y <= to[1]; ++y)
        for (int x = from[0]; x <= to[0]; ++x) visit(cells_[std::size_t((z * count + y) * count + x)]);
  }

 private:
  static constexpr int count = 20;
  std::array<int, 3> cell_of(const Point& p) const {
    std::array<int, 3> cell{};
    for (int k = 0; k < 3; ++k)
      cell[std::size_t(k)] = int(std::clamp(std::floor((p[k] - low_[k]) / size_[k]), 0., count - 1.));
    return cell;
  }
  Point low_, size_;
  std::vector<std::vector<std::uint32_t>> cells_;
};

// The triangles that lie wholly in a box, and those around them that stay as they are.
class Piece {
 public:
  Piece(const State& state, const TriangleTree& given, std::span<const std::uint32_t> own,
        std::span<const std::uint32_t> still, std::span<const std::uint8_t> locked,
        std::span<const std::uint32_t> sample_first, std::span<const std::uint32_t> samples,
        const DecimateOptions& options)
      : state_(state), given_(given), options_(options), own_(own) {
    for (const auto list : {own, still})
      for (const std::uint32_t t : list)
        vertices_.insert(vertices_.end(), state.mesh.triangles[t].begin(), state.mesh.triangles[t].end());
    vertices_ = distinct(std::move(vertices_));
    places_.reserve(vertices_.size());
    for (const std::uint32_t v : vertices_) places_.push_back(state.mesh.positions[v].cast<double>());
    Box all{Point::Constant(HUGE_VAL), Point::Constant(-HUGE_VAL)};
    for (const Point& p : places_) all.low = all.low.cwiseMin(p), all.high = all.high.cwiseMax(p);
    cells_ = Cells(all);
    around_.resize(vertices_.size()), version_.resize(vertices_.size(), 0);
    locked_.resize(vertices_.size());
    for (std::size_t v = 0; v < vertices_.size(); ++v) locked_[v] = locked[vertices_[v]];
    for (const auto list : {own, still})
      for (const std::uint32_t t : list) {
        Triangle local{};
        for (std::size_t k = 0; k < 3; ++k)
          local[k] = std::uint32_t(std::ranges::lower_bound(vertices_, state.mesh.triangles[t][k]) -
                                   vertices_.begin());
        triangles_.push_back(local);
      }
    kept_.resize(own.size());
    for (std::uint32_t i = 0; i < own.size(); ++i) {
      for (const std::uint32_t v : triangles_[i]) around_[v].push_back(i);
      kept_[i].assign(samples.begin() + sample_first[own[i]], samples.begin() + sample_first[own[i] + 1]);
    }
    for (std::uint32_t i = 0; i < triangles_.size(); ++i) {
      boxes_.push_back(box_of(corners(i)));
      cells_.put(i, boxes_[i]);
    }
    looked_.resize(triangles_.size(), 0);
  }

  void thin() {
    for (std::uint32_t i = 0; i < own_.size(); ++i)
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t a = triangles_[i][k], b = triangles_[i][(k + 1) % 3];
        if (a < b && !(settled(a) && settled(b))) consider(a, b);
      }
    while (!queue_.empty()) {
      const Candidate best = queue_.top();
      queue_.pop();
      if (version_[best.a] + version_[best.b] != best.version || around_[best.b].empty()) continue;
      if (!draw_together(best)) continue;
      ++version_[best.a];
      for (const std::uint32_t n : neighbours(best.a)) consider(std::min(best.a, n), std::max(best.a, n));
    }
  }

  // Each piece writes only what is its own.
  void put_back(State& state) const {
    Mesh& mesh = state.mesh;
    for (std::uint32_t i = 0; i < own_.size(); ++i) {
      Triangle& t = mesh.triangles[own_[i]];
      for (std::size_t k = 0; k < 3; ++k) t[k] = is_gone(i) ? none : vertices_[triangles_[i][k]];
      for (const std::uint32_t sample : kept_[i]) state.keeper[sample] = own_[i];
    }
    for (std::size_t v = 0; v < vertices_.size(); ++v)
      if (!locked_[v])
        mesh.positions[vertices_[v]] = places_[v].cast<float>(), state.settled[vertices_[v]] = 1;
  }

 private:
  struct Candidate {
    double cost;
    std::uint32_t a, b, version;

    bool operator<(const Candidate& other) const {  // the top of the queue is the largest
      return std::tie(cost, a, b) > std::tie(other.cost, other.a, other.b);
    }
  };

  bool settled(std::uint32_t v) const { return state_.settled[vertices_[v]] != 0; }
  bool is_gone(std::uint32_t t) const { return triangles_[t][0] == none; }
  Corners corners(std::uint32_t t) const {
    return {places_[triangles_[t][0]], places_[triangles_[t][1]], places_[triangles_[t][2]]};
  }
  static bool has(const Triangle& t, std::uint32_t v) { return t[0] == v || t[1] == v || t[2] == v; }

  const std::vector<std::uint32_t>& neighbours(std::uint32_t v) {
    ring_.clear();
    for (const std::uint32_t t : around_[v])
      for (const std::uint32_t n : triangles_[t])
        if (n != v && std::ranges::find(ring_, n) == ring_.end()) ring_.push_back(n);
    return ring_;
  }

  // Where the planes around the edge are nearest to, and the squares of the distances from them, by area.
  std::pair<Point, double> meeting_point(std::uint32_t a, std::uint32_t b) const {
    const Point middle = (places_[a] + places_[b]) / 2.;
    Eigen::Matrix3d matrix = Eigen::Matrix3d::Zero();
    Point side = Point::Zero();
    double rest = 0., total = 0.;
    const auto add = [&](std::uint32_t t) {
      const Corners corner = corners(t);
      const Point cross = across(corner);
      const double twice = cross.norm();
      if (!(twice > 0.)) return;
      const Point normal = cross / twice;
      const double off = normal.dot(corner[0] - middle);
      matrix += twice * normal * normal.transpose();
      side += twice * off * normal, rest += twice * off * off, total += twice;
    };
    for (const std::uint32_t t : around_[a]) add(t);
    for (const std::uint32_t t : around_[b])
      if (!has(triangles_[t], a)) add(t);
    const double along = (places_[b] - places_[a]).norm();
    Eigen::Matrix3d firm = matrix;
    firm.diagonal().array() += 3e-3 * total;
    Point move = firm.ldlt().solve(side);
    if (!move.allFinite() || move.norm() > 2. * along) move = Point::Zero();
    if (move.dot(matrix * move) - 2. * move.dot(side) + rest > options_.error * options_.error * total)
      return {middle, HUGE_VAL};
    // Of edges that cost nothing the shortest come first.
    const double cost = move.dot(matrix * move) - 2. * move.dot(side) + rest + 3e-4 * along * along * total;
    return {(middle + move).cast<float>().cast<double>(), cost};
  }

  void consider(std::uint32_t a, std::uint32_t b) {
    if (locked_[a] || locked_[b]) return;
    const double cost = meeting_point(a, b).second;
    if (cost < HUGE_VAL) queue_.push({cost, a, b, version_[a] + version_[b]});
  }

  bool draw_together(const Candidate& candidate) {
    const auto [a, b] = std::pair(candidate.a, candidate.b);
    // The ends have two neighbours in common, those of the two triangles at the edge, which remain corners of others.
    const auto of_a = neighbours(a);
    const auto& of_b = neighbours(b);
    std::size_t common = 0;
    for (const std::uint32_t n : of_b)
      if (std::ranges::find(of_a, n) != of_a.end()) {
        ++common;
        if (around_[n].size() < 4 && !locked_[n]) return false;
      }
    if (common != 2 || of_a.size() + of_b.size() < 9) return false;

    Point place = meeting_point(a, b).first;
    if (!given_.nearest(place, options_.error)) place = places_[a];
    std::vector<std::uint32_t> changed, gone;
    double worst = least_shape;
    for (const std::uint32_t v : {a, b})
      for (const std::uint32_t t : around_[v]) {
        const bool both = has(triangles_[t], a) && has(triangles_[t], b);
        if (v == a || !both) worst = std::min(worst, shape(corners(t)));
        if (!both)
          changed.push_back(t);
        else if (v == a)
          gone.push_back(t);
      }
    std::vector<Corners> fresh;
    for (const std::uint32_t t : changed) {
      Corners before = corners(t), after = before;
      for (std::size_t k = 0; k < 3; ++k)
        if (triangles_[t][k] == a || triangles_[t][k] == b)
          after[k] = place;
        else if ((before[k] - place).squaredNorm() > options_.longest * options_.longest)
          return false;
      const Point from = across(before), to = across(after);
      if (!(from.dot(to) > most_turn * from.norm() * to.norm()) || shape(after) < worst) return false;
      fresh.push_back(after);
    }
    // Every vertex of the first mesh goes to the new triangle that is nearest.
    moving_.clear();
    const double most = options_.error * options_.error;
    for (const auto* list : {&changed, &gone})
      for (const std::uint32_t t : *list)
        for (const std::uint32_t sample : kept_[t]) {
          const Point p = state_.first[sample].cast<double>();
          double best = HUGE_VAL;
          std::uint32_t to = 0;
          for (std::uint32_t i = 0; i < fresh.size(); ++i)
            if (const double square = square_from(p, fresh[i]); square < best) best = square, to = i;
          if (!(best <= most)) return false;
          moving_.emplace_back(sample, to);
        }
    if (comes_to_cut(a, b, changed, gone, fresh)) return false;

    places_[a] = place;
    for (const std::uint32_t t : changed) kept_[t].clear();
    for (const auto& [sample, to] : moving_) kept_[changed[to]].push_back(sample);
    for (const std::uint32_t t : gone) {
      for (const std::uint32_t v : triangles_[t]) std::erase(around_[v], t);
      triangles_[t] = {none, none, none};
      kept_[t].clear();
    }
    for (const std::uint32_t t : changed)
      for (std::uint32_t& v : triangles_[t])
        if (v == b) v = a, around_[a].push_back(t);
    around_[b].clear();
    for (std::size_t i = 0; i < changed.size(); ++i)
      boxes_[changed[i]] = box_of(fresh[i]), cells_.put(changed[i], boxes_[changed[i]]);
    return true;
  }

  bool comes_to_cut(std::uint32_t a, std::uint32_t b, const std::vector<std::uint32_t>& changed,
                    const std::vector<std::uint32_t>& gone, const std::vector<Corners>& fresh) {
    // A corner of the new fan by its name: the drawn-together one is a.
    const auto renamed = [&](std::uint32_t t) {
      Triangle name = triangles_[t];
      for (std::uint32_t& v : name)
        if (v == b) v = a;
      return name;
    };
    const auto cuts = [&](const Triangle& m, const Corners& s, const Triangle& n, const Corners& t) {
      std::size_t shared = 0, of_m = 0, of_n = 0;
      for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 3; ++j)
          if (m[i] == n[j]) ++shared, of_m = i, of_n = j;
      if (shared == 0) {
        if (beside(s, t) || beside(t, s)) return false;
        for (std::size_t k = 0; k < 3; ++k)
          if (pierces(s[k], s[(k + 1) % 3], t) || pierces(t[k], t[(k + 1) % 3], s)) return true;
        return false;
      }
      if (shared == 1)  // only the sides across from the corner can go through
        return pierces_strictly(s[(of_m + 1) % 3], s[(of_m + 2) % 3], t) ||
               pierces_strictly(t[(of_n + 1) % 3], t[(of_n + 2) % 3], s);
      const Point u = across(s), v = across(t);
      return u.dot(v) < sharpest_fold * u.norm() * v.norm();
    };
    for (std::size_t i = 0; i < fresh.size(); ++i) {
      const Triangle name = renamed(changed[i]);
      for (std::size_t j = 0; j < i; ++j)
        if (cuts(name, fresh[i], renamed(changed[j]), fresh[j])) return true;
      Box box = box_of(fresh[i]);
      box.low.array() -= clearance, box.high.array() += clearance;
      bool cut = false;
      ++look_;
      cells_.visit(box, [&](const std::vector<std::uint32_t>& cell) {
        for (const std::uint32_t t : cell) {
          if (cut) return;
          if (looked_[t] == look_ || !box.touches(boxes_[t])) continue;
          looked_[t] = look_;
          if (is_gone(t) || std::ranges::find(changed, t) != changed.end() ||
              std::ranges::find(gone, t) != gone.end())
            continue;
          cut = cuts(name, fresh[i], triangles_[t], corners(t));
        }
      });
      if (cut) return true;
    }
    return false;
  }

  const State& state_;
  const TriangleTree& given_;
  const DecimateOptions& options_;
  std::span<const std::uint32_t> own_;  // the first of triangles_ are these
  Cells cells_;
  std::vector<std::uint32_t> vertices_;  // of the mesh, ascending; below each by its index here
  std::vector<Point> places_;
  std::vector<std::uint8_t> locked_;
  std::vector<std::uint32_t> version_;
  std::vector<std::vector<std::uint32_t>> around_;  // own triangles of a vertex
  std::vector<Triangle> triangles_;
  std::vector<Box> boxes_;             // of the triangles
  std::vector<std::uint32_t> looked_;  // when a triangle was last looked at: look_
  std::uint32_t look_ = 0;
  std::vector<std::vector<std::uint32_t>> kept_;  // vertices of the first mesh, of an own triangle
  std::priority_queue<Candidate> queue_;
  std::vector<std::uint32_t> ring_;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> moving_;
};

// Lists of numbers below `count`, one after the other: list k is all[first[k]] to all[first[k + 1]].
struct Lists {
  std::vector<std::uint32_t> first, all;

  std::span<const std::uint32_t> operator[](std::size_t k) const {
    return std::span(all).subspan(first[k], first[k + 1] - first[k]);
  }
};
Lists sorted_into(std::size_t count, const std::vector<std::pair<std::uint32_t, std::uint32_t>>& pairs) {
  Lists lists{.first = std::vector<std::uint32_t>(count + 1, 0),
              .all = std::vector<std::uint32_t>(pairs.size())};
  for (const auto& [to, what] : pairs) ++lists.first[to + 1];
  std::partial_sum(lists.first.begin(), lists.first.end(), lists.first.begin());
  auto next = lists.first;
  for (const auto& [to, what] : pairs) lists.all[next[to]++] = what;
  return lists;
}

void forget_gone(State& state) {
  std::vector<std::uint32_t> name(state.mesh.triangles.size());
  std::uint32_t left = 0;
  for (std::size_t t = 0; t < name.size(); ++t) {
    name[t] = left;
    if (state.mesh.triangles[t][0] != none) state.mesh.triangles[left++] = state.mesh.triangles[t];
  }
  state.mesh.triangles.resize(left);
  for (std::uint32_t& t : state.keeper) t = name[t];
}

void round(State& state, const TriangleTree& given, double shift, const DecimateOptions& options,
           Progress& progress) {
  Mesh& mesh = state.mesh;
  Point low = Point::Constant(HUGE_VAL), high = -low;
  for (const Triangle& t : mesh.triangles)
    for (const std::uint32_t v : t)
      low = low.cwiseMin(mesh.positions[v].cast<double>()),
      high = high.cwiseMax(mesh.positions[v].cast<double>());
  // So large that some thousand triangles lie in a box, where there are so many.
  const Point extent = (high - low).array() + 1.;
  constexpr double wanted = 8000.;
  const double size =
      std::max(std::cbrt(extent.prod() * wanted / double(mesh.triangles.size())), 8. * options.longest);
  const Point corner = low - Point::Constant(shift * size);
  std::array<std::uint32_t, 3> boxes{};
  for (int k = 0; k < 3; ++k) boxes[std::size_t(k)] = std::uint32_t((high[k] - corner[k]) / size) + 1;
  const auto box_at = [&](const Point& p) {
    std::array<std::uint32_t, 3> at{};
    for (int k = 0; k < 3; ++k)
      at[std::size_t(k)] = std::min(std::uint32_t((p[k] - corner[k]) / size), boxes[std::size_t(k)] - 1);
    return at;
  };
  const auto number = [&](std::uint32_t x, std::uint32_t y, std::uint32_t z) {
    return (z * boxes[1] + y) * boxes[0] + x;
  };
  const std::size_t count = std::size_t(boxes[0]) * boxes[1] * boxes[2];
  std::vector<std::uint8_t> locked(mesh.positions.size(), 0);
  std::vector<std::pair<std::uint32_t, std::uint32_t>> own, still;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const Triangle& corners = mesh.triangles[t];
    const Box box =
        box_of({mesh.positions[corners[0]].cast<double>(), mesh.positions[corners[1]].cast<double>(),
                mesh.positions[corners[2]].cast<double>()});
    const auto from = box_at(box.low), to = box_at(box.high);
    if (from == to) {
      own.emplace_back(number(from[0], from[1], from[2]), t);
      continue;
    }
    for (const std::uint32_t v : corners) locked[v] = 1;
    for (std::uint32_t z = from[2]; z <= to[2]; ++z)
      for (std::uint32_t y = from[1]; y <= to[1]; ++y)
        for (std::uint32_t x = from[0]; x <= to[0]; ++x) still.emplace_back(number(x, y, z), t);
  }
  // Settled is what lies in a box; what lay on its border waits for another round.
  const Lists of_box = sorted_into(count, own), by_box = sorted_into(count, still);
  own = {}, still = {};
  Lists samples;
  {
    std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs(state.keeper.size());
    for (std::uint32_t s = 0; s < pairs.size(); ++s) pairs[s] = {state.keeper[s], s};
    samples = sorted_into(mesh.triangles.size(), pairs);
  }
  parallel_for(count, 1, [&](std::size_t b) {
    if (!of_box[b].empty()) {
      Piece piece(state, given, of_box[b], by_box[b], locked, samples.first, samples.all, options);
      piece.thin();
      piece.put_back(state);
    }
    progress.advance();
  });
  forget_gone(state);
}

}  // namespace

Mesh decimated(const Mesh& mesh, const DecimateOptions& options, Progress& progress) {
  State state{.mesh = mesh,
              .first = mesh.positions,
              .keeper = std::vector<std::uint32_t>(mesh.positions.size(), 0),
              .settled = std::vector<std::uint8_t>(mesh.positions.size(), 0)};
  state.mesh.labels.resize(mesh.positions.size(), 0);
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
    for (const std::uint32_t v : mesh.triangles[t]) state.keeper[v] = t;
  progress.begin("fewer triangles", 0);
  const TriangleTree given(mesh);
  for (const double shift : {.0, .5, .25}) round(state, given, shift, options, progress);
  progress.end();
  // Vertices of no triangle go.
  std::vector<std::uint32_t> name(state.mesh.positions.size(), none);
  Mesh result{.positions = {}, .labels = {}, .triangles = std::move(state.mesh.triangles)};
  for (const Triangle& t : result.triangles)
    for (const std::uint32_t v : t) name[v] = 0;
  for (std::size_t v = 0; v < name.size(); ++v) {
    if (name[v] == none) continue;
    name[v] = std::uint32_t(result.positions.size());
    result.positions.push_back(state.mesh.positions[v]), result.labels.push_back(state.mesh.labels[v]);
  }
  for (Triangle& t : result.triangles)
    for (std::uint32_t& v : t) v = name[v];
  return result;
}

}  // namespace forest
