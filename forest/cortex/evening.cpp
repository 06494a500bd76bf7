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
    for (const auto& [edge, times] : sides)
      if (times == 1) ++at_[edge.first].border, ++at_[edge.second].border, rim_.push_back(edge);
    parallel_for(size(), 256, [&](std::size_t v) { put_back(v); });
  }

  void operator()(int rounds, Progress& progress) {
    progress.begin("evening volumes", std::size_t(rounds));
    constexpr int smooth_rounds = 10, last_rounds = 15;
    std::vector<Place> moved(size()), along_border(size());  // the latter: the sum of both neighbours
    for (int round = 0; round < rounds; ++round) {
      const double shape = .3 + (.06 - .3) * double(round) / double(rounds);
      const bool last = round + last_rounds >= rounds;  // in the end only what is bent is mended
      for (const auto& [a, b] : rim_) along_border[a] = along_border[b] = Place::Zero();
      for (const auto& [a, b] : rim_)
        along_border[a] += quads_.middle[b], along_border[b] += quads_.middle[a];
      find_ways();
      parallel_for(size(), 1024, [&](std::size_t v) {
        if (at_[v].border)  // it becomes smooth and stays
          moved[v] = at_[v].border == 2 && round < smooth_rounds
                         ? Place(.5 * quads_.middle[v] + .25 * along_border[v])
                         : quads_.middle[v];
        else
          moved[v] = quads_.middle[v] + step(std::uint32_t(v), shape, last);
      });
      quads_.middle.swap(moved);
      parallel_for(size(), 256, [&](std::size_t v) { put_back(v); });
      progress.advance();
    }
    progress.end();
  }

 private:
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
      const double share = std::min(1., 2. * (1. - hit->distance / side));
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
        .01;                     // so that regions of more than some ten faces are evened over several rounds
    constexpr double most = .5;  // of the volume, that a face may lack
    constexpr int iterations = 20;  // from the multipliers of the round before
    const auto faces = Eigen::Index(quads_.quads.size());
    const auto side = [&](std::uint32_t v) { return std::sqrt(wanted_ / at_[v].height); };
    // How the share of a face grows with the way of each corner, in sides of a face.
    std::vector<std::array<Place, 4>> grow(quads_.quads.size());
    Eigen::VectorXd lacks(faces);
    parallel_for(grow.size(), 1024, [&](std::size_t i) {
      const Quad& q = quads_.quads[i];
      const auto corner = [&](std::size_t k) -> const Place& { return quads_.middle[q[k % 4]]; };
      const double share = height(q) / wanted_;
      const Place up = (at_[q[0]].up + at_[q[1]].up + at_[q[2]].up + at_[q[3]].up).normalized();
      const double has = up.dot(.5 * (corner(2) - corner(0)).cross(corner(3) - corner(1))) * share;
      lacks[Eigen::Index(i)] = std::clamp(1. - has, -most, most);
      for (std::size_t k = 0; k < 4; ++k) {
        const At& at = at_[q[k]];
        Place& own = grow[i][k];
        own = .5 * share * side(q[k]) * at.up.cross(corner(k + 3) - corner(k + 1));
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

  // Of a vertex inside: the way to even volumes, towards the mean of its neighbours and to where its sides run along the cross; the
  // more a face around it is bent out of shape, the more it is that mean.
  Place step(std::uint32_t v, double shape, bool last) const {
    constexpr double evenly = .3;  // of the way: more at once, and sides turn from crests
    const At& at = at_[v];
    const Place &here = quads_.middle[v], side = at.up.cross(at.arm);
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
        const double a = way.dot(at.arm), b = way.dot(side);
        const Place straight = std::abs(a) > std::abs(b) ? Place(at.arm * std::copysign(way.norm(), a))
                                                         : Place(side * std::copysign(way.norm(), b));
        mean += way, aligned += way - straight, sides += 1.;
      }
    }
    const double bent = std::clamp((.5 - worst) / .5, 0., 1.);
    if (last && bent == 0.) return Place::Zero();
    Place pull = (1. - bent) * (shape * .5 * mean + std::max(shape, at.held) * aligned) / sides +
                 bent * .5 * mean / sides;
    pull -= at.up * at.up.dot(pull);
    Place result = (last ? 1. - bent : 1. - .7 * bent) * evenly * ways_[v] + pull;
    const double most = .25 * std::sqrt(wanted_ / at.height);
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
  std::vector<Edge> rim_;
  std::vector<Place> ways_;
  Eigen::VectorXd multipliers_;
};

}  // namespace

void even_volumes(Quads& quads, const Ribbon& ribbon, const Guides& guides, double volume, int rounds,
                  Progress& progress) {
  Evening(quads, ribbon, guides, volume)(rounds, progress);
}

}  // namespace forest::cortex
