// SPDX-License-Identifier: Apache-2.0
#include "forest/fitting/resampling.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/lsystem/sample.h"
#include "forest/statistics/summary.h"

namespace forest::fitting {
namespace {

using statistics::Arbors;
using statistics::Branch;
using Out = std::back_insert_iterator<std::string>;

// What sets the branches of one neuron apart from those of another, and the names that the grammar gives it.
enum { reach, wander, girth, grain, depth, spread, thinning, extent, number, styles };
constexpr std::array<const char*, styles> style_names{"reach",  "wander",   "girth",  "grain", "depth",
                                                      "spread", "thinning", "extent", "forks"};
using Style = std::array<double, styles>;

constexpr double least_diameter = .05;  // µm: where none was measured

constexpr std::size_t most_daughters = 3;  // of a fork; those with more are not learned from

constexpr int none = -1;  // no fork

struct Stem {
  std::size_t cell;
  int kind;
  double tips, ahead, length, end_diameter;  // ahead: path from its beginning to the farthest tip, µm
  Vec3 place, heading;                       // of its beginning, from the soma's centre
  Vec3 aim;                                  // its farthest tip, from there
  std::vector<Point> points;
  int next = none;  // the fork at its end
};

struct Fork {
  std::size_t cell;
  int kind;
  double tips, ahead, path, order, diameter;  // of the branch that ends here; ahead: to its farthest tip, µm
  double side, height, depth;                 // from the soma: across, above and before it, µm
  Vec3 heading, aim;                          // aim: unit, towards the farthest tip
  // How far to the right of the way out from the soma it heads, in the plane of the slice.
  double lean() const {
    return (side * double(heading.y()) - height * double(heading.x())) /
           std::max(1., std::hypot(side, height, depth));
  }
  struct Daughter {
    double tips, ahead, length, end_diameter;
    Vec3 aim;  // its farthest tip, from the fork
    std::vector<Point> points;
    int next = none;  // the fork at its end
  };
  std::vector<Daughter> daughters;  // fewest tips first
  std::size_t main = 0;             // the daughter with the farthest tip
  bool turned = false;              // … though the one with more came first
};

// What is true of one kind of section of a neuron.
struct Manner {
  Style style{};
  double thinnest = least_diameter;  // diameter, µm
  double winding = .01;              // mean of the logarithm of path / chord
};

struct Cell {
  double soma = 0.;    // diameter, µm
  double fibre = -1.;  // … of the point where it begins, when it has no soma, as an insect's tracing
  std::map<int, Manner> kinds;
  std::vector<Stem> stems;
};

std::vector<lsystem::Trace::Stop> stops_of(std::span<const Point> points) {
  std::vector<lsystem::Trace::Stop> stops;
  for (const Point& p : points.subspan(1))
    stops.push_back({p.position() - points[0].position(), 2.f * p.radius});
  return stops;
}

// Where a branch heads at its end, and at its beginning.
Vec3 end_heading(std::span<const Point> points) {
  return lsystem::heading_at_end(Vec3::Zero(), stops_of(points));
}
Vec3 start_heading(std::span<const Point> points) {
  const std::vector<Point> back(points.rbegin(), points.rend());
  return -end_heading(back);
}

double diameter_of(const Point& p) { return std::max(least_diameter, 2. * double(p.radius)); }

/// What is learned from: forks and stems of all neurons, and what each neuron is like.
struct Traced {
  std::vector<Cell> cells;
  std::vector<Fork> forks;
  std::map<int, Style> deviations;  // among cells, by kind

  void take(const Morphology& neuron, const Resampling& options) {
    if (!neuron.roots().empty()) learn(Arbors(neuron, options.kinds));
  }

 private:
  void learn(const Arbors& arbors) { Learner(*this, arbors).learn(); }

  // Of one neuron.
  struct Learner {
    Traced& traced;
    const Arbors& arbors;
    const Vec3 soma = arbors.origin().position();
    std::span<const Branch> all = arbors.sections();
    std::vector<double> beyond =
        std::vector<double>(all.size(), 0.);  // path from a section's end to its farthest tip
    std::vector<int> fork_at = std::vector<int>(all.size(), none);  // its number among all forks
    std::vector<Vec3> farthest = std::vector<Vec3>(all.size());     // that tip
    std::vector<std::vector<std::uint32_t>> daughters = std::vector<std::vector<std::uint32_t>>(all.size());
    std::vector<std::uint32_t> stems = std::vector<std::uint32_t>(all.size());  // that sections grow from
    std::vector<double> tips = std::vector<double>(all.size(), 0.);

    Learner(Traced& into, const Arbors& of) : traced(into), arbors(of) {}

    int kind_of(const Branch& b) const { return int(arbors.neuron().section(b.id).kind); }
    std::span<const Point> points(std::uint32_t i) const { return arbors.points(all[i]); }
    // A root of one point, from which others leave: no branch.
    bool begins(std::uint32_t i) const { return all[i].parent < 0 && points(i).size() < 2; }
    // The section that this one goes on: none (-1) for a stem, which leaves the soma, a section of another kind, or the
    // point where a fibre begins.
    std::int32_t above(std::size_t i) const {
      const std::int32_t parent = all[i].parent;
      return parent < 0 || begins(std::uint32_t(parent)) ||
                     kind_of(all[std::size_t(parent)]) != kind_of(all[i])
                 ? -1
                 : parent;
    }
    bool drawn(std::uint32_t i) const { return points(i).size() >= 2 && all[i].length > 0.; }
    bool learned(std::uint32_t i) const {  // the fork at the end of this section
      return !daughters[i].empty() && daughters[i].size() <= most_daughters &&
             std::ranges::all_of(daughters[i], [&](std::uint32_t d) { return drawn(d); });
    }
    std::vector<Point> copy(std::uint32_t i) const { return {points(i).begin(), points(i).end()}; }

    void learn() {
      for (std::uint32_t i = 0; i < all.size(); ++i) farthest[i] = points(i).back().position();
      for (std::size_t i = all.size(); i-- > 0;)
        if (above(i) >= 0) {
          const auto before = std::size_t(above(i));
          if (all[i].length + beyond[i] < beyond[before]) continue;
          beyond[before] = all[i].length + beyond[i];
          farthest[before] = farthest[i];
        }
      for (std::uint32_t i = 0; i < all.size(); ++i)
        if (above(i) >= 0) daughters[std::size_t(above(i))].push_back(i);
      for (std::uint32_t i = 0, row = std::uint32_t(traced.forks.size()); i < all.size(); ++i)
        if (learned(i)) fork_at[i] = int(row++);
      for (std::uint32_t i = 0; i < all.size(); ++i)
        stems[i] = above(i) < 0 ? i : stems[std::size_t(above(i))];
      for (std::size_t i = all.size(); i-- > 0;) {
        if (daughters[i].empty()) tips[i] = 1.;
        if (above(i) >= 0) tips[std::size_t(above(i))] += tips[i];
      }
      Cell cell{.soma = 2. * double(arbors.origin().radius), .kinds = manners(), .stems = {}};
      if (arbors.neuron().soma().kind == SomaKind::none) cell.fibre = cell.soma;
      for (std::uint32_t i = 0; i < all.size(); ++i)
        if (above(i) < 0 && drawn(i)) cell.stems.push_back(stem(i));
      if (cell.stems.empty()) return;
      for (std::uint32_t i = 0; i < all.size(); ++i)
        if (learned(i)) traced.forks.push_back(fork(i));
      traced.cells.push_back(std::move(cell));
    }

    Stem stem(std::uint32_t i) const {
      const Branch& b = all[i];
      return {.cell = traced.cells.size(),
              .kind = kind_of(b),
              .tips = tips[i],
              .ahead = b.length + beyond[i],
              .length = b.length,
              .end_diameter = diameter_of(points(i).back()),
              .place = points(i).front().position() - soma,
              .heading = start_heading(points(i)),
              .aim = farthest[i] - soma,
              .points = copy(i),
              .next = fork_at[i]};
    }

    Fork fork(std::uint32_t i) const {
      const Branch& b = all[i];
      const Vec3 place = points(i).back().position() - soma;
      Fork fork{.cell = traced.cells.size(),
                .kind = kind_of(b),
                .tips = tips[i],
                .ahead = beyond[i],
                .path = b.path_distance - (all[stems[i]].path_distance - all[stems[i]].length),
                .order = double(arbors.neuron().order(b.id) - arbors.neuron().order(all[stems[i]].id)),
                .diameter = diameter_of(points(i).back()),
                .side = double(place.x()),
                .height = double(place.y()),
                .depth = double(place.z()),
                .heading = end_heading(points(i)),
                .aim = (farthest[i] - points(i).back().position()).normalized(),
                .daughters = {}};
      for (const std::uint32_t d : daughters[i])
        fork.daughters.push_back({.tips = tips[d],
                                  .ahead = beyond[d],
                                  .length = all[d].length,
                                  .end_diameter = diameter_of(points(d).back()),
                                  .aim = farthest[d] - points(i).back().position(),
                                  .points = copy(d),
                                  .next = fork_at[d]});
      fork.turned = fork.daughters.front().tips > fork.daughters.back().tips;
      std::ranges::stable_sort(fork.daughters, {}, &Fork::Daughter::tips);
      fork.main = std::size_t(
          std::ranges::max_element(fork.daughters, {}, [](const auto& d) { return d.length + d.ahead; }) -
          fork.daughters.begin());
      return fork;
    }

    std::map<int, Manner> manners() const {
      struct Sums {
        std::array<std::vector<double>, styles> values;
        double farthest = 0., sections = 0., thinnest = INFINITY;
      };
      std::map<int, Sums> by_kind;
      for (std::uint32_t i = 0; i < all.size(); ++i) {
        if (begins(i)) continue;
        Sums& of = by_kind[kind_of(all[i])];
        of.sections += 1.;
        of.farthest = std::max(of.farthest, double((points(i).back().position() - soma).norm()));
        for (const Point& p : points(i)) of.thinnest = std::min(of.thinnest, diameter_of(p));
        if (drawn(i)) measure(i, of.values);
      }
      std::map<int, Manner> manners;
      for (auto& [kind, of] : by_kind) {
        of.values[extent] = {std::log(1. + of.farthest)}, of.values[number] = {std::log(of.sections)};
        Manner& manner = manners[kind];
        for (std::size_t s = 0; s < styles; ++s)
          manner.style[s] = of.values[s].empty() ? 0. : statistics::mean(of.values[s]);
        manner.thinnest = of.thinnest, manner.winding = std::max(.01, manner.style[wander]);
      }
      return manners;
    }

    void measure(std::uint32_t i, std::array<std::vector<double>, styles>& values) const {
      constexpr double straight = 10.;  // µm: shorter ones tell nothing of how they wind
      const Branch& b = all[i];
      const Vec3 chord = points(i).back().position() - points(i).front().position();
      const double across = double(chord.norm());
      values[reach].push_back(std::log(b.length));
      if (b.length > straight && across > 0.) values[wander].push_back(std::log(b.length / across));
      values[girth].push_back(std::log(diameter_of(points(i)[points(i).size() / 2])));
      values[grain].push_back(std::log(b.length / double(points(i).size() - 1)));
      values[depth].push_back(std::log(1. + std::abs(double(points(i).back().z - soma.z()))));
      if (above(i) < 0) return;
      const auto before = points(std::uint32_t(above(i)));
      if (across > 0.)
        values[spread].push_back(
            std::acos(std::clamp(double(end_heading(before).dot(chord)) / across, -1., 1.)));
      values[thinning].push_back(std::log(diameter_of(points(i)[1]) / diameter_of(before.back())));
    }
  };
};

double deviation(const std::vector<double>& values) { return statistics::summarize(values).sd; }

// In standard deviations from the mean of all neurons.
void standardise(Traced& traced) {
  std::map<int, std::vector<Style*>> by_kind;
  for (Cell& c : traced.cells)
    for (auto& [kind, of] : c.kinds) by_kind[kind].push_back(&of.style);
  for (const auto& [kind, of] : by_kind)
    for (std::size_t s = 0; s < styles; ++s) {
      std::vector<double> values;
      for (const Style* style : of) values.push_back((*style)[s]);
      const double mean = statistics::mean(values), sd = deviation(values);
      traced.deviations[kind][s] = sd;
      for (Style* style : of) (*style)[s] = sd > 0. ? ((*style)[s] - mean) / sd : 0.;
    }
}

// What a neuron begins with, in `growth` and when there are some without a soma.
constexpr std::string_view with_soma = "axiom: Soma(cells.soma(me)) Plan(0)\n", with_fibre = R"(module Begin
axiom: Begin Plan(0)
body: Begin : cells.fibre(me) < 0 -> Soma(cells.soma(me))
fibre: Begin -> Kind(plans.kind(plans(me, 0))) Fibre(cells.fibre(me))
)";

// What grows of all this. @style stands for a neuron's own style.
constexpr std::string_view growth = R"(
# Of n tips, those of a daughter that had `part` of `whole` where it was traced, when `others` share the rest: a single one
# stays single.
function share(part, whole, n, others) =
  if(part == 1, 1, max(min(2, n - others), min(n - others, round(n * part / whole))))
# How many times longer a branch is drawn than it was traced, so that its farthest tip is as far as it should be.
function longer(wanted, traced) = max(0.6, min(1.6, wanted / max(traced, 1)))
# How many times farther from its chord a branch bends than in the neuron it comes from.
function bending(kind, s, u, v, donor) = max(0.5, min(2, sqrt(
  max(0.01, styles.winding(s) + sd_wander(kind) * stray * (styles.wander(u) - styles.wander(v))) / styles.winding(donor))))
function nth(i, a, b, c) = if(i == 0, a, if(i == 1, b, c))
# The cosine of the angle between a direction and that to the farthest tip where a fork was traced.
function cosine(x, y, z, u, v, w) = (x * u + y * v + z * w) / max(1, sqrt((x^2 + y^2 + z^2) * (u^2 + v^2 + w^2)))
function along(r, x, y, z) = cosine(x, y, z, nth(forks.main(r), forks.t1x(r), forks.t2x(r), forks.t3x(r)),
  nth(forks.main(r), forks.t1y(r), forks.t2y(r), forks.t3y(r)), nth(forks.main(r), forks.t1z(r), forks.t2z(r), forks.t3z(r)))
# A fork whose diameters are those of this one: all of one neuron, alike to this.
distribution calibre(kind, r, tips, ahead, d) =
  calibres(kind, forks.daughters(r), thin_as, log(tips), log(forks.n1(r)), log(max(ahead, 1)), log(forks.l1(r)), log(max(forks.l2(r), 1)), log(d))

module Plan(i), Twig(kind, donor, next, run, mirror, tips, ahead, path, order, d, ax, ay, az)
module Fork(kind, r, q, run, tips, path, order, mirror, thick, scale, ax, ay, az, px, py, pz)
module Limb(kind, r, q, run, i, tips, path, order, mirror, thick, scale, ax, ay, az, px, py, pz)
axiom: Soma(cells.soma(me)) Plan(0)

# Stems leave the soma as planned, each drawn from a stem alike.
stem: Plan(i) : i < cells.stems(me)
  { p = plans(me, i), kind = plans.kind(p), s = styles(me, kind), u = styles(one, kind), v = styles(other, kind),
    tips = max(1, round(plans.tips(p) * exp(normal(0, jitter) + sd_forks(kind) * (own(styles.forks(s), styles.forks(u), styles.forks(v)) - styles.forks(s))))),
    ahead = plans.ahead(p) * exp(normal(0, jitter) + sd_extent(kind) * (own(styles.extent(s), styles.extent(u), styles.extent(v)) - styles.extent(s))), q = footings(kind, thin_as, log(tips), log(plans.length(p))), d = footings.d(q), x = plans.hx(p), y = plans.hy(p), z = plans.hz(p),
    away = ahead / max(1, plans.ahead(p)), r = stems(kind, me, log(tips), log(ahead), log(plans.length(p)), x, y, z, log(d)@style),
    scale = longer(ahead, stems.ahead(r)) }
  -> [ Kind(kind) At(plans.x(p), plans.y(p), plans.z(p)) Head(x, y, z)
       Trace(stems, r, 0, scale, 0, 0, bending(kind, s, u, v, styles(stems.donor(r), kind)), q)
       Twig(kind, stems.donor(r), stems.next(r), 1, 0, tips, scale * (stems.ahead(r) - stems.length(r)), scale * stems.length(r), 0, d,
         away * plans.tx(p), away * plans.ty(p), away * plans.tz(p))
       ?P(0, 0, 0) ?H(0, 0, 0) ] Plan(i + 1)
planned: Plan(i) ->

# A branch with one tip to come ends; another forks, or goes on as another section. Left and right are alike; a
# neuron may lie anywhere between the faces of its slice.
end: Twig(kind, donor, next, run, mirror, tips, ahead, path, order, d, ax, ay, az) : tips < 2 ->
on: Twig(kind, donor, next, run, mirror, tips, ahead, path, order, d, ax, ay, az) > ?P(px, py, pz)
  : next >= 0 & run < longest & forks.tips(max(0, next)) == tips
    & along(max(0, next), if(mirror, px - ax, ax - px), ay - py, az - pz) > agreed
  { q = calibre(kind, next, tips, ahead, d) }
  -> Fork(kind, next, q, run + 1, tips, path, order + 1, mirror, d / calibres.d(q), longer(ahead, forks.ahead(next)),
          ax, ay, az, px, py, pz) : follow
fork: Twig(kind, donor, next, run, mirror, tips, ahead, path, order, d, ax, ay, az) > ?P(px, py, pz) ?H(x, y, z)
  { s = styles(me, kind), u = styles(one, kind), v = styles(other, kind), mx = if(chance(0.5), 1, -1),
    far = max(1, sqrt((ax - px)^2 + (ay - py)^2 + (az - pz)^2)),
    r = forks(kind, donor, log(tips), log(max(ahead, 1)), path, order, log(d), x * mx, y, z,
      mx * (px * y - py * x) / max(1, sqrt(px^2 + py^2 + pz^2)), px * mx, py, pz,
      mx * (ax - px) / far, (ay - py) / far, (az - pz) / far@style),
    q = calibre(kind, r, tips, ahead, d) }
  -> Fork(kind, r, q, 1, tips, path, order + 1, mx < 0, d / calibres.d(q), longer(ahead, forks.ahead(r)),
          ax, ay, az, px, py, pz)
one: Fork(kind, r, q, run, tips, path, order, mirror, thick, scale, ax, ay, az, px, py, pz) : forks.daughters(r) == 1
  -> Limb(kind, r, q, run, 0, tips, path, order, mirror, thick, scale, ax, ay, az, px, py, pz)
two: Fork(kind, r, q, run, tips, path, order, mirror, thick, scale, ax, ay, az, px, py, pz) : forks.daughters(r) == 2 & !forks.turned(r)
  { n = share(forks.n1(r), forks.tips(r), tips, 1) }
  -> [ Limb(kind, r, q, run, 0, n, path, order, mirror, thick, scale, ax, ay, az, px, py, pz) ]
     [ Limb(kind, r, q, run, 1, tips - n, path, order, mirror, thick, scale, ax, ay, az, px, py, pz) ]
turned: Fork(kind, r, q, run, tips, path, order, mirror, thick, scale, ax, ay, az, px, py, pz) : forks.daughters(r) == 2 & forks.turned(r)
  { n = share(forks.n1(r), forks.tips(r), tips, 1) }
  -> [ Limb(kind, r, q, run, 1, tips - n, path, order, mirror, thick, scale, ax, ay, az, px, py, pz) ]
     [ Limb(kind, r, q, run, 0, n, path, order, mirror, thick, scale, ax, ay, az, px, py, pz) ]
three: Fork(kind, r, q, run, tips, path, order, mirror, thick, scale, ax, ay, az, px, py, pz) : forks.daughters(r) == 3
  { n = share(forks.n1(r), forks.tips(r), tips, 2), m = share(forks.n2(r), forks.tips(r), tips - n, 1) }
  -> [ Limb(kind, r, q, run, 0, n, path, order, mirror, thick, scale, ax, ay, az, px, py, pz) ]
     [ Limb(kind, r, q, run, 1, m, path, order, mirror, thick, scale, ax, ay, az, px, py, pz) ]
     [ Limb(kind, r, q, run, 2, tips - n - m, path, order, mirror, thick, scale, ax, ay, az, px, py, pz) ]
limb: Limb(kind, r, q, run, i, tips, path, order, mirror, thick, scale, ax, ay, az, px, py, pz)
  { s = styles(me, kind), u = styles(one, kind), v = styles(other, kind), donor = forks.donor(r), thin = styles.thinnest(styles(thin_as, kind)),
    length = scale * nth(i, forks.l1(r), forks.l2(r), forks.l3(r)),
    m = if(mirror, -1, 1), main = i == forks.main(r),
    beyond = scale * nth(i, forks.b1(r), forks.b2(r), forks.b3(r)),
    d = max(thin, thick * nth(i, calibres.d1(q), calibres.d2(q), calibres.d3(q))) }
  -> Trace(forks, r, i, scale, mirror, turn, bending(kind, s, u, v, styles(donor, kind)), q, thick, thin)
     Twig(kind, donor, nth(i, forks.next1(r), forks.next2(r), forks.next3(r)), run, mirror, tips, beyond, path + length, order, d,
       if(main, ax, px + scale * m * nth(i, forks.t1x(r), forks.t2x(r), forks.t3x(r))),
       if(main, ay, py + scale * nth(i, forks.t1y(r), forks.t2y(r), forks.t3y(r))),
       if(main, az, pz + scale * nth(i, forks.t1z(r), forks.t2z(r), forks.t3z(r)))) ?P(0, 0, 0) ?H(0, 0, 0)
)";

/// Writes the grammar, part by part.
class Writer {
 public:
  Writer(const Traced& traced, const std::string& title, const Resampling& options)
      : traced_(traced), options_(options) {
    for (std::size_t s = 0; s < styles; ++s)  // how finely a neuron was traced is the same all over it
      kernels_ += fmt::format(", {} ~ {:.2g}", style_names[s], (s == grain ? .2 : 1.) * options.style);
    put("# Resampled from {} traced neurons with {} forks.\ntitle: {}\nsteps: 1000\nlimit: 1000000\n",
        traced.cells.size(), traced.forks.size(), title);
    cells();
    styles_of_cells();
    alike();
    plans();
    stems();
    footings();
    forks();
    calibres();
    productions();
  }
  std::string text() && { return std::move(text_); }

 private:
  template <class... T>
  void put(fmt::format_string<T...> format, T&&... values) {
    fmt::format_to(Out(text_), format, std::forward<T>(values)...);
  }
  // Between the rows of a sample.
  void row(bool first) { put("{}\n  ", first ? "" : ";"); }

  void cells() {
    put("\n# Neurons: the diameter of their soma (µm), of the point where they begin when they have none "
        "(else -1), and how "
        "many stems they have.\nsample cells(-> soma, fibre, stems) =");
    for (const Cell& c : traced_.cells) {
      row(&c == traced_.cells.data());
      put("{} {} {}", rounded(c.soma, 1e3), rounded(c.fibre, 1e3), c.stems.size());
    }
  }

  void styles_of_cells() {
    put("\n\n# Their styles, in standard deviations, of each kind of section: how long, winding, thick and "
        "coarsely traced branches are,\n"
        "# how deep in the slice, how wide their forks, how much thinner daughters, how far they reach and "
        "how often they fork; the\n"
        "# thinnest diameter (µm), and the mean logarithm of path by chord.\n"
        "sample styles(cell =, kind = -> {}, thinnest, winding) =",
        fmt::join(style_names, ", "));
    bool first = true;
    for (std::size_t i = 0; i < traced_.cells.size(); ++i)
      for (const auto& [kind, sd] : traced_.deviations) {
        const auto found = traced_.cells[i].kinds.find(kind);
        const Manner of = found == traced_.cells[i].kinds.end() ? Manner() : found->second;
        row(std::exchange(first, false));
        put("{} {} ->", i, kind);
        style(of.style);
        put(" {} {}", rounded(of.thinnest, 1e3), rounded(of.winding, 1e4));
      }
  }

  std::size_t kin() const { return std::min<std::size_t>(options_.kin, traced_.cells.size() - 1); }

  void alike() {
    put("\n\n# To each neuron those most like it in style, the most alike first.\nsample alike(cell =, rank "
        "= -> cell) =");
    const auto apart = [](const Cell& a, const Cell& b) {
      double sum = 0.;
      for (const auto& [kind, of] : a.kinds) {
        const auto found = b.kinds.find(kind);
        for (std::size_t s = 0; s < styles; ++s)
          sum += std::pow(of.style[s] - (found == b.kinds.end() ? 0. : found->second.style[s]), 2);
      }
      return sum;
    };
    for (std::size_t i = 0; i < traced_.cells.size(); ++i) {
      std::vector<std::pair<double, std::size_t>> others;
      for (std::size_t j = 0; j < traced_.cells.size(); ++j)
        if (j != i) others.emplace_back(apart(traced_.cells[i], traced_.cells[j]), j);
      std::ranges::sort(others);
      for (std::size_t k = 0; k < kin(); ++k) {
        row(!i && !k);
        put("{} {} -> {}", i, k, others[k].second);
      }
    }
  }

  void plans() {
    put("\n\n# Their stems, in the order of the sample of stems: tips, where they leave the soma's centre "
        "(µm) and head, their diameter where they end, and the path to the farthest tip.\n"
        "sample plans(cell =, stem = -> kind, tips, x, y, z, hx, hy, hz, d, ahead, length, tx, ty, tz) =");
    bool first = true;
    for (std::size_t c = 0; c < traced_.cells.size(); ++c)
      for (std::size_t i = 0; i < traced_.cells[c].stems.size(); ++i) {
        const Stem& s = traced_.cells[c].stems[i];
        row(std::exchange(first, false));
        put("{} {} -> {} {} ", c, i, s.kind, s.tips);
        vector(s.place, 1e2);
        put(" ");
        vector(s.heading, 1e3);
        put(" {} {} {}", rounded(s.end_diameter, 1e3), rounded(s.ahead, 10.), rounded(s.length, 1e2));
        put(" ");
        vector(s.aim, 10.);
      }
  }

  void stems() {
    put("\n\n# Stems as they were traced; tips, path and diameter are logarithms.\n"
        "sample stems(kind =, cell !=, tips ~ 0.1, ahead ~ {}, length ~ 0.4, hx ~ 0.2, hy ~ 0.2, hz ~ {}, "
        "d ~ 0.3{}\n  -> donor, next, ahead, length) =",
        options_.ahead, 2. * options_.heading_across, kernels_);
    bool first = true;
    for (const Cell& c : traced_.cells)
      for (const Stem& s : c.stems) {
        row(std::exchange(first, false));
        put("{} {} {} {} {} ", s.kind, s.cell, logarithm(s.tips), logarithm(s.ahead), logarithm(s.length));
        vector(s.heading, 1e3);
        put(" {}", logarithm(s.end_diameter));
        style(c.kinds.at(s.kind).style);
        put(" -> {} {} {} {}", s.cell, s.next, rounded(s.ahead, 10.), rounded(s.length, 1e2));
        trace(s.heading, s.points);
      }
  }

  void forks() {
    const std::span<const Fork> forks = traced_.forks;
    put("\n\n# Widths of kernels, by kind.\n");
    widths("near_path", options_.path, [](const Fork& f) { return f.path; });
    widths("near_order", options_.order, [](const Fork& f) { return f.order; });
    widths("near_d", options_.diameter, [](const Fork& f) { return std::log(f.diameter); });
    widths("near_side", options_.height, [](const Fork& f) { return f.side; });
    widths("near_height", options_.height, [](const Fork& f) { return f.height; });
    widths("near_before", options_.depth, [](const Fork& f) { return f.depth; });
    put("\n# Forks as they were traced: the branch that ends there (tips, the path to the farthest and the "
        "diameter are logarithms; heading and\n"
        "# place, from the soma), and its daughters, fewest tips first (turned: traced last first): tips, "
        "lengths, paths beyond their ends.\n"
        "sample forks(kind =, cell !=, tips ~ {}, ahead ~ {}, path ~ near_path(kind), order ~ "
        "near_order(kind), d ~ near_d(kind),\n"
        "    hx ~ {}, hy ~ {}, hz ~ {}, lean ~ {}, side ~ near_side(kind), height ~ near_height(kind), "
        "before ~ "
        "near_before(kind), gx ~ {}, gy ~ {}, gz ~ {}{}\n"
        "  -> donor, daughters, turned, main, tips, ahead, n1, n2, l1, l2, l3, b1, b2, b3, next1, next2, "
        "next3, "
        "t1x, t1y, t1z, t2x, t2y, t2z, t3x, t3y, t3z) =",
        options_.tips, options_.ahead, options_.heading, options_.heading, options_.heading_across,
        options_.lean, options_.aim, options_.aim, options_.aim, kernels_);
    for (const Fork& f : forks) {
      row(&f == forks.data());
      put("{} {} {} {} {} {} {} ", f.kind, f.cell, logarithm(f.tips), logarithm(f.ahead),
          rounded(f.path, 10.), f.order, logarithm(f.diameter));
      vector(f.heading, 1e3);
      put(" {} {} {} {}", rounded(f.lean(), 1e3), rounded(f.side, 10.), rounded(f.height, 10.),
          rounded(f.depth, 10.));
      put(" ");
      vector(f.aim, 1e3);
      style(traced_.cells[f.cell].kinds.at(f.kind).style);
      put(" -> {} {} {} {} {} {}", f.cell, f.daughters.size(), int(f.turned), f.main, f.tips,
          rounded(f.ahead, 10.));
      const auto each = [&](double Fork::Daughter::*what, std::size_t most, double steps) {
        for (std::size_t i = 0; i < most; ++i)
          put(" {}", i < f.daughters.size() ? rounded(f.daughters[i].*what, steps) : 0.);
      };
      each(&Fork::Daughter::tips, 2, 1.);
      each(&Fork::Daughter::length, most_daughters, 1e2);
      each(&Fork::Daughter::ahead, most_daughters, 10.);
      for (std::size_t i = 0; i < most_daughters; ++i)
        put(" {}", i < f.daughters.size() ? f.daughters[i].next : none);
      for (std::size_t i = 0; i < most_daughters; ++i) {
        put(" ");
        vector(i < f.daughters.size() ? f.daughters[i].aim : Vec3(Vec3::Zero()), 10.);
      }
      for (const Fork::Daughter& d : f.daughters) trace(f.heading, d.points);
    }
  }

  void footings() {
    put("\n\n# The same stems, row by row, asked by how thick they are: the diameter where they end, µm.\n"
        "sample footings(kind =, cell ~ 0.1, tips ~ 0.25, length ~ 0.5 -> d) =");
    bool first = true;
    for (const Cell& c : traced_.cells)
      for (const Stem& s : c.stems) {
        row(std::exchange(first, false));
        put("{} {} {} {} -> {}", s.kind, s.cell, logarithm(s.tips), logarithm(s.length),
            rounded(s.end_diameter, 1e3));
      }
  }

  void calibres() {
    put("\n\n# The same forks, row by row, asked by how thick they are: the diameters where the branch ends "
        "and its daughters end, µm.\n"
        "sample calibres(kind =, daughters =, cell ~ 0.1, tips ~ 0.25, first ~ 0.15, ahead ~ 0.4, l1 ~ 0.5, "
        "l2 ~ 0.5, d "
        "~ 0.08\n"
        "  -> d, d1, d2, d3) =");
    for (const Fork& f : traced_.forks) {
      row(&f == traced_.forks.data());
      put("{} {} {} {} {} {} {} {} {} -> {}", f.kind, f.daughters.size(), f.cell, logarithm(f.tips),
          logarithm(f.daughters[0].tips), logarithm(f.ahead), logarithm(f.daughters[0].length),
          logarithm(f.daughters.size() > 1 ? f.daughters[1].length : 1.), logarithm(f.diameter),
          rounded(f.diameter, 1e3));
      for (std::size_t i = 0; i < most_daughters; ++i)
        put(" {}", i < f.daughters.size() ? rounded(f.daughters[i].end_diameter, 1e3) : 0.);
    }
  }

  void productions() {
    put("\n\n# This neuron has the stems of a traced one, and a style near that one's: it strays from it as "
        "two neurons alike to it differ.\n"
        "cell me = dealt({})\n#define kin {}\ncell one = alike.cell(alike(me, floor(uniform(0, kin))))\n"
        "cell other = alike.cell(alike(me, floor(uniform(0, kin))))\n"
        "cell thin_as = one\n#define stray {:.4g}\n"
        "function own(mine, one_s, other_s) = mine + stray * (one_s - other_s)\n",
        traced_.cells.size(), kin(), options_.smoothing);
    for (const auto& [name, style] : {std::pair{"forks", number}, {"extent", extent}, {"wander", wander}}) {
      std::vector<std::string> bins;
      for (const auto& [kind, sd] : traced_.deviations)
        bins.push_back(fmt::format("{}: {:.4g}", kind, sd[style]));
      put("table sd_{} = {}\n", name, fmt::join(bins, ", "));
    }
    std::string style;
    for (std::size_t i = 0; i < styles; ++i)
      style += fmt::format(
          fmt::runtime(i == girth || i == thinning ? ", styles.{0}(u)"
                                                   : ", own(styles.{0}(s), styles.{0}(u), styles.{0}(v))"),
          style_names[i]);
    put("#define agreed 0.85  # the least cosine between the ways to their farthest tips, for that\n"
        "#define follow 0.95  # how often a branch goes on as in the neuron it comes from\n"
        "#define longest 3   # branches from one neuron in a row, at most\n"
        "#define jitter 0.1  # of the logarithms of a stem's tips and of the path to its farthest\n"
        "#define turn 0.7    # share of the angle between headings where a fork was traced and where it is "
        "drawn\n");
    std::string rules(growth);
    if (std::ranges::any_of(traced_.cells, [](const Cell& c) { return c.fibre >= 0.; }))
      rules.replace(rules.find(with_soma), with_soma.size(), with_fibre);
    std::string_view rest = rules;
    for (std::size_t at; (at = rest.find("@style")) != rest.npos; rest.remove_prefix(at + 6))
      text_.append(rest.substr(0, at)).append(style);
    text_ += rest;
  }

  // A table of the widths of a kernel: a share of the standard deviation among the forks of each kind.
  void widths(const char* name, double share, auto&& what) {
    std::map<int, std::vector<double>> values;
    for (const Fork& f : traced_.forks) values[f.kind].push_back(what(f));
    std::vector<std::string> bins;
    for (const auto& [kind, of] : values) {
      const double sd = deviation(of);
      bins.push_back(fmt::format("{}: {:.4g}", kind, sd > 0. ? share * sd : 1.));
    }
    put("table {} = {}\n", name, fmt::join(bins, ", "));
  }

  void vector(const Vec3& v, double steps) {
    put("{} {} {}", rounded(double(v.x()), steps), rounded(double(v.y()), steps),
        rounded(double(v.z()), steps));
  }
  void style(const Style& of) {
    for (const double s : of) put(" {}", rounded(s, 1e2));
  }
  void trace(const Vec3& heading, std::span<const Point> points) {
    put(" | ");
    vector(heading, 1e3);
    put(" {}:", rounded(2. * double(points[0].radius), 1e3));
    const auto stops = stops_of(points);
    for (std::size_t i = 0; i < stops.size(); ++i) {
      put("{} ", i ? "," : "");
      vector(stops[i].at, 1e2);
      put(" {}", rounded(double(stops[i].diameter), 1e3));
    }
  }
  static double rounded(double value, double steps) { return std::round(value * steps) / steps; }
  static double logarithm(double value) { return rounded(std::log(value), 1e3); }

  const Traced& traced_;
  const Resampling& options_;
  std::string kernels_, text_;
};

}  // namespace

std::string resampling_grammar(std::span<const Morphology> neurons, const std::string& title,
                               const Resampling& options) {
  Traced traced;
  for (const Morphology& neuron : neurons) traced.take(neuron, options);
  if (traced.cells.size() < 2 || traced.forks.empty())
    throw Error(
        fmt::format("{} of {} neurons have stems and forks of these kinds; a model needs two such "
                    "neurons, name more of them or other kinds",
                    traced.cells.size(), neurons.size()));
  standardise(traced);
  return Writer(traced, title, options).text();
}

}  // namespace forest::fitting
