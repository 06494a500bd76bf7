// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/evening.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include <Eigen/IterativeLinearSolvers>
#include <Eigen/SparseCore>

#include "forest/core/parallel.h"
#include "forest/geometry/triangle_tree.h"

namespace forest::cortex {
namespace {

using Edge = std::pair<std::uint32_t, std::uint32_t>;

// Lines of one kind, to be asked for the nearest place and the direction there.
struct Nearest {
  Nearest(std::span<const Line> lines, Line::Kind kind)
      : tree(pieces(lines, kind)), along(directions(lines, kind)) {}
  TriangleTree tree;
  std::vector<Place> along;  // of every piece in the tree
};

class Evening {
 public:
  Evening(Quads& quads, const Ribbon& ribbon, const Guides& guides, double volume)
      : quads_(quads),
        ribbon_(ribbon),
        guides_(guides),
        wanted_(volume / double(quads.quads.size())),
        locator_(ribbon),
        borders_(guides.lines, Line::Kind::border),
        valleys_(guides.lines, Line::Kind::valley),
        crests_(guides.lines, Line::Kind::crest),
        at_(quads.middle.size()),
        of_(quads.middle.size()),
        ways_(quads.middle.size(), Place::Zero()) {
    quads.points.resize(size());
    for (std::uint32_t q = 0; q < quads.quads.size(); ++q)
      for (const std::uint32_t v : quads.quads[q]) of_[v].push_back(q);
    std::map<Edge, int> sides;
    for (const Quad& q : quads.quads)
      for (std::size_t e = 0; e < 4; ++e) ++sides[std::minmax(q[e], q[(e + 1) % 4])];
    for (const auto& [edge, times] : sides) {
      sides_.push_back(edge);
      if (times == 1) ++at_[edge.first].border, ++at_[edge.second].border, rim_.push_back(edge);
    }
    put_back();
  }

  void operator()(int rounds, Progress& progress) {
    constexpr int smooth_rounds = 10, last_rounds = 15, settlings = 3, mending_rounds = 3;
    progress.begin("evening volumes", std::size_t(rounds) + std::size_t(settlings));
    std::vector<Place> moved(size()), along_border(size());  // the latter: the sum of both neighbours
    const auto step_all = [&](double shape, bool last, auto&& on_border) {
      parallel_for(size(), 1024, [&](std::size_t v) {
        moved[v] =
            at_[v].border ? on_border(v) : Place(quads_.middle[v] + step(std::uint32_t(v), shape, last));
      });
      quads_.middle.swap(moved);
      put_back();
    };
    for (int round = 0; round < rounds; ++round) {
      const double shape = .3 + (least_shape - .3) * double(round) / double(rounds);
      const bool last = round + last_rounds >= rounds;  // in the end only what is bent is mended
      for (const auto& [a, b] : rim_) along_border[a] = along_border[b] = Place::Zero();
      for (const auto& [a, b] : rim_)
        along_border[a] += quads_.middle[b], along_border[b] += quads_.middle[a];
      find_ways();
      step_all(shape, last, [&](std::size_t v) {  // a border becomes smooth and stays
        return at_[v].border == 2 && round < smooth_rounds
                   ? Place(.5 * quads_.middle[v] + .25 * along_border[v])
                   : quads_.middle[v];
      });
      progress.advance();
    }
    for (int round = 0; rounds > 0 && round < settlings; ++round) {
      settle();
      put_back();
      progress.advance();
    }
    for (int round = 0; rounds > 0 && round < mending_rounds; ++round) {
      find_ways();
      step_all(least_shape, true, [&](std::size_t v) { return quads_.middle[v]; });
    }
    progress.end();
  }

 private:
  static constexpr double least_shape = .06;

  struct At {  // a vertex
    Place up = Place::Zero(), arm = Place::Zero(),
          valley = Place::Zero();  // the direction of the valley it lies on
    double height = 0.;
    double held = 0.;         // to the direction of a line
    std::uint8_t border = 0;  // sides that only one face has
  };

  std::size_t size() const { return quads_.middle.size(); }
  double height(const Quad& q) const {
    return .25 * (at_[q[0]].height + at_[q[1]].height + at_[q[2]].height + at_[q[3]].height);
  }

  double side(std::uint32_t v) const {  // of a face there
    constexpr double least = 200.;      // µm of height: beside the wall there may be none
    return std::sqrt(wanted_ / std::max(least, at_[v].height));
  }
  const Place& corner(const Quad& q, std::size_t k) const { return quads_.middle[q[k % 4]]; }
  Place up_of(const Quad& q) const {
    return (at_[q[0]].up + at_[q[1]].up + at_[q[2]].up + at_[q[3]].up).normalized();
  }

  // What a face lacks of the volume that it should have, as a share of it, no more than half; and how it grows with the place of a
  // corner.
  double lack(const Quad& q) const {
    constexpr double most = .5;
    const double has = up_of(q).dot(.5 * (corner(q, 2) - corner(q, 0)).cross(corner(q, 3) - corner(q, 1))) *
                       height(q) / wanted_;
    return std::clamp(1. - has, -most, most);
  }
  Place growth(const Quad& q, std::size_t k) const {
    return .5 * height(q) / wanted_ * at_[q[k]].up.cross(corner(q, k + 3) - corner(q, k + 1));
  }

  // How much a crest counts from there, 0 to 1: nothing from one side of an element on.
  double heed(double distance) const { return std::min(1., 2. * (1. - distance / std::cbrt(wanted_))); }

  void put_back() {
    parallel_for(size(), 256, [&](std::size_t v) { put_back(v); });
  }
  // Onto the ribbon, and the line that it lies on.
  void put_back(std::size_t v) {
    constexpr double hold = .6;
    const double side = std::cbrt(wanted_);
    At& at = at_[v];
    Place& middle = quads_.middle[v];
    if (at.border)
      if (const auto hit = borders_.tree.nearest(middle, 1.5 * side)) middle = hit->at;
    if (quads_.on_valley[v] && !at.border)
      if (const auto hit = valleys_.tree.nearest(middle))
        middle = hit->at, at.valley = valleys_.along[hit->triangle];
    const RibbonPoint point = locator_.nearest(middle);
    quads_.points[v] = point, middle = on(ribbon_.middle, ribbon_, point);
    const Triangle& c = ribbon_.triangles[point.triangle];
    const Place& w = point.weights;
    std::size_t main = 0;
    for (const std::size_t k : {1u, 2u})
      if (w[Eigen::Index(k)] > w[Eigen::Index(main)]) main = k;
    at.arm = guides_.arms[c[main]];
    at.held = guides_.by[c[main]] ? hold : 0.;
    // By a crest sides run along it and across it, the more so the nearer.
    if (const auto hit = at.border ? std::nullopt : crests_.tree.nearest(middle, side)) {
      const Place& normal = guides_.curvatures[c[main]].normal;
      const double share = heed(hit->distance);
      Place along = crests_.along[hit->triangle];
      if (std::abs(along.dot(normal.cross(at.arm))) > std::abs(along.dot(at.arm)))
        along = along.cross(normal);
      at.arm = ((1. - share) * at.arm + std::copysign(share, along.dot(at.arm)) * along).normalized();
      at.held = std::max(at.held, share * hold);
    }
    at.height = 0., at.up = Place::Zero();
    for (std::size_t k = 0; k < 3; ++k) {
      at.height += w[Eigen::Index(k)] * guides_.heights[c[k]];
      at.up += w[Eigen::Index(k)] * guides_.curvatures[c[k]].normal;
    }
    at.up.normalize();
  }

  // The shortest ways by which volumes become even.
  void find_ways() {
    constexpr double ease =
        .01;  // so that regions of more than some ten faces are evened over several rounds
    constexpr int iterations = 20;  // from the multipliers of the round before
    const auto faces = Eigen::Index(quads_.quads.size());
    // How the share of a face grows with the way of each corner, in sides of a face.
    std::vector<std::array<Place, 4>> grow(quads_.quads.size());
    Eigen::VectorXd lacks(faces);
    parallel_for(grow.size(), 1024, [&](std::size_t i) {
      const Quad& q = quads_.quads[i];
      lacks[Eigen::Index(i)] = lack(q);
      for (std::size_t k = 0; k < 4; ++k) {
        const At& at = at_[q[k]];
        Place& own = grow[i][k];
        own = side(q[k]) * growth(q, k);
        if (at.border)
          own.setZero();
        else if (quads_.on_valley[q[k]])
          own = at.valley * at.valley.dot(own);
      }
    });
    Eigen::SparseMatrix<double, Eigen::RowMajor> grows(faces, Eigen::Index(3 * size()));
    grows.reserve(Eigen::VectorXi::Constant(faces, 12));
    for (std::size_t i = 0; i < grow.size(); ++i)
      for (std::size_t k = 0; k < 4; ++k)
        for (Eigen::Index one = 0; one < 3; ++one)
          grows.insert(Eigen::Index(i), 3 * Eigen::Index(quads_.quads[i][k]) + one) = grow[i][k][one];
    grows.makeCompressed();
    Eigen::SparseMatrix<double, Eigen::RowMajor> system = grows * grows.transpose();
    system.diagonal().array() += ease;
    Eigen::ConjugateGradient<Eigen::SparseMatrix<double, Eigen::RowMajor>, Eigen::Lower | Eigen::Upper>
        gradients;
    gradients.setMaxIterations(iterations);
    gradients.compute(system);
    if (multipliers_.size() != faces) multipliers_.setZero(faces);
    multipliers_ = gradients.solveWithGuess(lacks, multipliers_).eval();
    const Eigen::VectorXd ways = grows.transpose() * multipliers_;
    for (std::uint32_t v = 0; v < size(); ++v) ways_[v] = side(v) * ways.segment<3>(3 * Eigen::Index(v));
  }

  // The directions in which a vertex may go, unit and at right angles: none on the border, one on a valley.
  std::array<Place, 2> directions_of(std::uint32_t v) const {
    const At& at = at_[v];
    if (at.border) return {Place::Zero(), Place::Zero()};
    if (quads_.on_valley[v]) return {at.valley, Place::Zero()};
    const Place level = at.arm - at.up * at.up.dot(at.arm);
    const Place arm = level.norm() > 1e-6 ? Place(level.normalized()) : Place(at.up.unitOrthogonal());
    return {arm, at.up.cross(arm)};
  }

  // All that is wanted at once, by least squares: volumes as they should be, faces by a crest across it, sides along the crosses,
  // neighbours that go the same way, and ways that are short.
  void settle() {
    constexpr double by_crest = 1., by_cross = .1, together = .5,
                     at_all = .1;  // weights, that of volumes being 1
    constexpr double most = .25;   // of a side, that a vertex goes
    constexpr int iterations = 60;
    std::vector<Eigen::Triplet<double>> entries;  // of the ways, two numbers a vertex, in sides of a face
    std::vector<double> wanted;
    std::vector<std::array<Place, 2>> directions(size());
    for (std::uint32_t v = 0; v < size(); ++v) directions[v] = directions_of(v);
    const auto ask = [&](double value) { wanted.push_back(value); };
    const auto of = [&](std::uint32_t v, const Place& gradient) {  // of what was asked last
      for (std::size_t k = 0; k < 2; ++k)
        if (const double value = side(v) * gradient.dot(directions[v][k]); value != 0.)
          entries.emplace_back(int(wanted.size() - 1), int(2 * v + k), value);
    };
    const double near = std::cbrt(wanted_);
    for (const Quad& q : quads_.quads) {
      ask(lack(q));
      for (std::size_t k = 0; k < 4; ++k) of(q[k], growth(q, k));
      const auto hit =
          crests_.tree.nearest(.25 * (corner(q, 0) + corner(q, 1) + corner(q, 2) + corner(q, 3)), near);
      if (!hit) continue;
      const Place up = up_of(q),
                  level = crests_.along[hit->triangle] - up * up.dot(crests_.along[hit->triangle]);
      if (level.norm() < 1e-6) continue;
      const Place along = level.normalized();
      std::array<Place, 2> ways{.5 * (corner(q, 1) - corner(q, 0) + corner(q, 2) - corner(q, 3)),
                                .5 * (corner(q, 3) - corner(q, 0) + corner(q, 2) - corner(q, 1))};
      const auto askew = [&](const Place& way) { return std::abs(along.dot(way.normalized())); };
      const bool second = askew(ways[1]) < askew(ways[0]);
      const double length = std::max(1., ways[second].norm());
      const Place across = ways[second] / length;
      const double weight = by_crest * heed(hit->distance);
      constexpr double share[2][4] = {{-.5, .5, .5, -.5}, {-.5, -.5, .5, .5}};
      ask(-weight * along.dot(across));
      for (std::size_t k = 0; k < 4; ++k)
        of(q[k], weight * share[second][k] / length * (along - across * across.dot(along)));
    }
    for (const auto& [a, b] : sides_) {
      const Place way = quads_.middle[b] - quads_.middle[a];
      const double length = std::max(1., way.norm());
      const Place &arm = at_[a].arm, other = at_[a].up.cross(arm);
      const Place aside =
          by_cross / length * (std::abs(way.dot(arm)) > std::abs(way.dot(other)) ? other : arm);
      ask(-aside.dot(way));
      of(b, aside), of(a, -aside);
      for (Eigen::Index k = 0; k < 3; ++k) {
        const Place apart = together / length * Place::Unit(k);
        ask(0.);
        of(b, apart), of(a, -apart);
      }
    }
    const auto ways = Eigen::Index(2 * size());
    for (Eigen::Index k = 0; k < ways; ++k) {
      ask(0.);
      entries.emplace_back(int(wanted.size() - 1), int(k), at_all);
    }
    using Sparse = Eigen::SparseMatrix<double, Eigen::RowMajor>;
    Sparse changes(Eigen::Index(wanted.size()), ways);
    changes.setFromTriplets(entries.begin(), entries.end());
    entries = {};
    const Sparse system = changes.transpose() * changes;
    Eigen::ConjugateGradient<Sparse, Eigen::Lower | Eigen::Upper> gradients;
    gradients.setMaxIterations(iterations);
    gradients.setTolerance(1e-4);
    gradients.compute(system);
    const Eigen::VectorXd go = gradients.solve(
        changes.transpose() * Eigen::Map<const Eigen::VectorXd>(wanted.data(), changes.rows()));
    for (std::uint32_t v = 0; v < size(); ++v) {
      const auto first = 2 * Eigen::Index(v);
      const Place way = go[first] * directions[v][0] + go[first + 1] * directions[v][1];
      quads_.middle[v] += side(v) * std::min(1., most / std::max(1e-9, way.norm())) * way;
    }
  }

  // Of a vertex inside: the way to even volumes, towards the mean of its neighbours and to where its sides run along the cross; the
  // more a face around it is bent out of shape, the more it is that mean.
  Place step(std::uint32_t v, double shape, bool last) const {
    constexpr double evenly = .3;  // of the way: more at once, and sides turn from crests
    const At& at = at_[v];
    const Place &here = quads_.middle[v], other = at.up.cross(at.arm);
    Place mean = Place::Zero(), aligned = Place::Zero();
    double sides = 0., worst = 1.;
    for (const std::uint32_t i : of_[v]) {
      const Quad& q = quads_.quads[i];
      const auto k = std::size_t(std::find(q.begin(), q.end(), v) - q.begin());
      for (std::size_t c = 0; c < 4; ++c) {
        const Place &p = quads_.middle[q[(k + c) % 4]], out = quads_.middle[q[(k + c + 1) % 4]] - p,
                    in = quads_.middle[q[(k + c + 3) % 4]] - p;
        worst = std::min(worst, at.up.dot(out.cross(in)) / (out.norm() * in.norm() + 1e-9));
      }
      for (const std::size_t next : {k + 1, k + 3}) {
        const Place way = quads_.middle[q[next % 4]] - here;
        const double a = way.dot(at.arm), b = way.dot(other);
        const Place straight = std::abs(a) > std::abs(b) ? Place(at.arm * std::copysign(way.norm(), a))
                                                         : Place(other * std::copysign(way.norm(), b));
        mean += way, aligned += way - straight, sides += 1.;
      }
    }
    const double bent = std::clamp((.5 - worst) / .5, 0., 1.);
    if (last && bent == 0.) return Place::Zero();
    Place pull = (1. - bent) * (shape * .5 * mean + std::max(shape, at.held) * aligned) / sides +
                 bent * .5 * mean / sides;
    pull -= at.up * at.up.dot(pull);
    Place result = (last ? 1. - bent : 1. - .7 * bent) * evenly * ways_[v] + pull;
    const double most = .25 * side(v);
    return result.norm() > most ? Place(result * (most / result.norm())) : result;
  }

  Quads& quads_;
  const Ribbon& ribbon_;
  const Guides& guides_;
  double wanted_;  // µm³, under each
  RibbonLocator locator_;
  Nearest borders_, valleys_, crests_;
  std::vector<At> at_;
  std::vector<std::vector<std::uint32_t>> of_;  // quads around a vertex
  std::vector<Edge> sides_, rim_;               // of all faces, and those that only one has
  std::vector<Place> ways_;
  Eigen::VectorXd multipliers_;
};

}  // namespace

void even_volumes(Quads& quads, const Ribbon& ribbon, const Guides& guides, double volume, int rounds,
                  Progress& progress) {
  Evening(quads, ribbon, guides, volume)(rounds, progress);
}

}  // namespace forest::cortex
