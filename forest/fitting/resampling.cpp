// SPDX-License-Identifier: Apache-2.0
#include "forest/fitting/resampling.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <iterator>
#include <map>
#include <numbers>
#include <numeric>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/fitting/evening.h"
#include "forest/fitting/mixing.h"
#include "forest/fitting/parametric.h"
#include "forest/fitting/ring.h"
#include "forest/fitting/traced.h"
#include "forest/fitting/tuning.h"
#include "forest/statistics/summary.h"
#include "forest/statistics/two_samples.h"

namespace forest::fitting {
namespace {

using Out = std::back_insert_iterator<std::string>;

// How narrowly forks are chosen by what sets tracers apart beside the mean: of few neurons, hardly, since none are alike in all of
// it.
double habits_of_many(double width, std::size_t neurons) {
  return width * std::pow(std::max(1., 100. / double(neurons)), 3.);
}

// … and how much of that difference a branch makes up for.
double habits_kept(std::size_t neurons) { return std::pow(std::min(1., double(neurons) / 75.), 3.); }

double deviation(const std::vector<double>& values) { return statistics::summarize(values).sd; }

// What a neuron begins with, in `growth` and when there are some without a soma.
constexpr std::string_view with_soma = "axiom: Soma(cells.soma(me)) Plan(0)\n", with_fibre = R"(module Begin
axiom: Begin Plan(0)
body: Begin : cells.fibre(me) < 0 -> Soma(cells.soma(me))
fibre: Begin -> Kind(plans.kind(plan(0))) Fibre(cells.fibre(me))
)";

// … and when some somata are not round: of the neuron whose diameters it has, so that a soma's size and shape are of two.
constexpr std::string_view round_soma = "Soma(cells.soma(me))",
                           outlined_soma =
                               "Soma(cells.soma(me), cells.a2(thin_as), cells.b2(thin_as), "
                               "cells.a3(thin_as), cells.b3(thin_as))";

// What stems bear beside their diameters where some were traced with spines.
constexpr std::string_view gauged = "Gauge(gauges, gauges(thin_as, kind), even)", bearing = R"(
       Spiny(spines.density(spines(whose(kind), kind)), spines.reach(spines(whose(kind), kind)), spines.head(spines(whose(kind), kind)),
         spines.neck(spines(whose(kind), kind)), spines.spread(spines(whose(kind), kind)), dice = uniform(0, 1)))";

// What grows of all this. @style stands for a neuron's own style.
constexpr std::string_view growth = R"(
# Of n tips, those of a daughter that had `part` of `whole` where it was traced, when `others` share the rest: a single one
# stays single.
function share(part, whole, n, others) =
  if(part == 1, 1, max(min(2, n - others), min(n - others, round(n * part / whole))))
# The traced neuron whose style branches of a kind have, and the stems, one after the other.
function whose(kind) = if(kind == 3, basal_as, others_as)
distribution plan(i) = arbors.plan(arbors(me, i))
distribution pose(i) = arbors.pose(arbors(me, i))
# How many times longer a branch is drawn than it was traced, so that its farthest tip is as far along it as it should be.
function longer(wanted, traced) = max(0.5, min(2.5, wanted / max(traced, 1)))
# How many times farther from its chord a branch bends than in the neuron it comes from.
distribution bending(kind, donor) = max(0.5, min(2, straighter(kind) * sqrt(styles.winding(styles(me, kind)) / styles.winding(donor))))
# How many times steeper a branch is drawn than it was traced, `rise` of its length along z, so that branches of this neuron are as
# steep as its style says and differ as much.
function slope(kind, style) = max(0.02, mean_slope(kind) + sd_slope(kind) * style)
function risen(rise, theirs, mine, uneven) = mine * max(0.1, 1 + uneven^ragged * (rise / theirs - 1)) / max(0.01, rise)
distribution steeper(kind, donor, rise) = climb(kind) *
  max(0.5, min(2, risen(rise, slope(kind, styles.slope(donor)), slope(kind, styles.slope(styles(me, kind))),
                        styles.uneven(styles(me, kind)) / styles.uneven(donor))^steep))
# How much more unevenly steep it is drawn, how many times as large the angles between its steps are, and how much more they differ,
# as this neuron's tracer would have done.
distribution stepped(kind, donor) = rugged(kind) * max(0.4, min(2.5, (styles.stepped(styles(me, kind)) / styles.stepped(donor))^(2 * habits)))
distribution turned(kind, donor) = kinked(kind) * max(0.6, min(1.6, (styles.angle(styles(me, kind)) / styles.angle(donor))^habits))
distribution kinky(kind, donor) = max(0.5, min(2, (styles.kinky(styles(me, kind)) / styles.kinky(donor))^(1.6 * habits)))
# Of steps that climbed, the share that stays level now, as this neuron's tracer kept more of them in one plane of focus; below 0, of
# level ones the share that climbs.
function more(mine, theirs) = (mine - theirs) / max(0.01, if(mine > theirs, 1 - theirs, theirs))
distribution levelled(kind, donor) = more(styles.level(styles(me, kind)), styles.level(donor))
function nth(i, a, b, c) = if(i == 0, a, if(i == 1, b, c))
# The share of a way aside, of all the tips of a fork, that those of a daughter take: the more the more there are, so that all
# together take the whole.
function rest(r) = forks.tips(r) - forks.n1(r) - forks.n2(r)
function borne(r, i) = forks.tips(r) * nth(i, forks.n1(r), forks.n2(r), rest(r)) / (forks.n1(r)^2 + forks.n2(r)^2 + rest(r)^2)
# The cosine of the angle between a direction and that to the middle of the tips where a fork was traced.
function cosine(x, y, z, u, v, w) = (x * u + y * v + z * w) / max(1, sqrt((x^2 + y^2 + z^2) * (u^2 + v^2 + w^2)))
function along(r, x, y, z) = cosine(x, y, z, forks.tx(r), forks.ty(r), forks.tz(r))
# By which angle about z a fork is turned, of that between the headings where it was traced and here, and of that by which the middle of
# its tips then lies beside the heading; less where either leaves the plane of the slice.
function swing(kind, m, r, x, y) = turn(kind) * sqrt(forks.ux(r)^2 + forks.uy(r)^2) * sqrt(x^2 + y^2) *
  atan2(m * forks.ux(r) * y - forks.uy(r) * x, m * forks.ux(r) * x + forks.uy(r) * y)
function beside(tx, ty, tz, x, y) = sqrt((tx^2 + ty^2) / max(0.001, tx^2 + ty^2 + tz^2)) * sqrt(x^2 + y^2) *
  atan2(tx * y - ty * x, tx * x + ty * y)
function spin(kind, a, m, r, x, y) = a + (1 - wide(kind)) *
  beside(cos(a) * m * forks.tx(r) - sin(a) * forks.ty(r), sin(a) * m * forks.tx(r) + cos(a) * forks.ty(r), forks.tz(r), x, y)
# The share of a way aside that the branch takes which is `length` of the path to the farthest tip; not more than it can bend.
function drawn(length, beyond, x, y, z) = length / max(1, length + beyond) *
  min(1, most * (length + beyond) / max(1, sqrt(x^2 + y^2 + z^2)))
# Tips as forks and stems are asked by them: as far apart as their logarithms but for few. A fork of two cannot bear three, as a daughter
# that ended where it was traced has no way to go on.
function crowd(tips) = log(tips) - 30 / tips^3
# How many times thicker a stem is than where it was traced, as the neuron is whose diameters it has.
distribution thicker(kind, p) = min(plans.most(p),
  exp(stout * sd_girth(kind) * (styles.girth(styles(thin_as, kind)) - styles.girth(styles(plans.cell(p), kind)))))
# How many tips a stem has, and how far the farthest is: by the styles of whom it is of, and of the two by which it strays.
distribution tips_of(p, kind, s, u, v, least) = max(least, min(most_tips(kind), round(plans.tips(p) *
  exp(normal(0, jitter) + sd_forks(kind) * (own(styles.forks(s), styles.forks(u), styles.forks(v)) - styles.forks(s))))))
distribution ahead_of(p, kind, s, u, v) = min(most_ahead(kind), plans.ahead(p) *
  exp(normal(0, jolt) + bold * sd_extent(kind) * (own(styles.extent(s), styles.extent(u), styles.extent(v)) - styles.extent(s))))
# A fork whose diameters are those of this one: all of one neuron, alike to this.
distribution calibre(kind, r, tips, ahead, d) =
  calibres(kind, daughters = forks.daughters(r), cell = thin_as, tips = log(tips), first = log(forks.n1(r)), ahead = log(max(ahead, 1)),
    l1 = log(forks.l1(r)), l2 = log(max(forks.l2(r), 1)), d = log(d), seldom = 0)

module Plan(i), Twig(kind, donor, next, run, mirror, tips, ahead, path, order, d, ax, ay, az)
module Fork(kind, r, q, run, tips, path, order, mirror, thick, scale, ax, ay, az, px, py, pz, phi)
module Limb(kind, r, q, run, i, tips, path, order, mirror, thick, scale, ax, ay, az, px, py, pz, phi)
axiom: Soma(cells.soma(me)) Plan(0)

# Stems leave the soma as planned, each drawn from a stem alike.
stem: Plan(i) : if(i < planned, plans.length(plan(i)), 0) > 0
  { p = plan(i), g = pose(i), kind = plans.kind(p), s = styles(whose(kind), kind), t = styles(me, kind), u = styles(one, kind), v = styles(other, kind),
    tips = tips_of(p, kind, s, u, v, 1), ahead = ahead_of(p, kind, s, u, v), thick = thicker(kind, p), d = thick * plans.d(p),
    away = ahead / max(1, plans.ahead(g)), ax = away * plans.tx(g), ay = away * plans.ty(g), az = away * plans.tz(g),
    r = stems(kind, cell = plans.cell(p), tips = crowd(tips), ahead = log(ahead), length = log(max(0.05, plans.length(p))),
      hx = plans.hx(g), hy = plans.hy(g), hz = plans.hz(g), d = log(d),
      @style, seldom = 0),
    from = styles(stems.donor(r), kind), sz = steeper(kind, from, stems.rise(r)), scale = longer(ahead, stems.ahead(r)), length = scale * stems.length(r), beyond = scale * (stems.ahead(r) - stems.length(r)),
    ex = ax - plans.x(g) - scale * stems.tx(r), ey = ay - plans.y(g) - scale * stems.ty(r), ez = az - plans.z(g) - sz * scale * stems.tz(r),
    part = steer * drawn(length, beyond, ex, ey, ez) }
  -> [ Kind(kind) Gauge(gauges, gauges(thin_as, kind), even) At(plans.x(g), plans.y(g), plans.z(g)) Head(plans.hx(g), plans.hy(g), plans.hz(g))
       Trace(stems, r, 0, scale, turn = 0, bent = bending(kind, from), like = p, thickness = thick,
         x = part * ex, y = part * ey, z = part * ez, steep = sz, stairs = stepped(kind, from), kinked = turned(kind, from),
         kinks = kinky(kind, from), climbing = 1, levelled = levelled(kind, from))
       Twig(kind, stems.donor(r), stems.next(r), 1, 0, tips, scale * (stems.ahead(r) - stems.length(r)), scale * stems.length(r), 0, d, ax, ay, az)
       ?P(0, 0, 0) ?H(0, 0, 0) ?S(0, 0, 0) ] Plan(i + 1)
bud: Plan(i) : i < planned  # it forks where it leaves
  { p = plan(i), g = pose(i), kind = plans.kind(p), s = styles(whose(kind), kind), u = styles(one, kind), v = styles(other, kind),
    tips = tips_of(p, kind, s, u, v, 2), ahead = ahead_of(p, kind, s, u, v),
    away = ahead / max(1, plans.ahead(g)), d = thicker(kind, p) * plans.d(p) }
  -> [ Kind(kind) Gauge(gauges, gauges(thin_as, kind), even) At(plans.x(g), plans.y(g), plans.z(g)) Head(plans.hx(g), plans.hy(g), plans.hz(g)) Fibre(d)
       Twig(kind, -1, -1, 0, 0, tips, ahead, 0, 0, d, away * plans.tx(g), away * plans.ty(g), away * plans.tz(g))
       ?P(0, 0, 0) ?H(0, 0, 0) ?S(0, 0, 0) ] Plan(i + 1)
done: Plan(i) ->

# A branch with one tip to come ends; another forks, or goes on as another section. Left and right are alike; a
# neuron may lie anywhere between the faces of its slice.
end: Twig(kind, donor, next, run, mirror, tips, ahead, path, order, d, ax, ay, az) : tips < 2 ->
on: Twig(kind, donor, next, run, mirror, tips, ahead, path, order, d, ax, ay, az) > ?P(px, py, pz) ?H(x, y, z)
  : next >= 0 & run < longest & forks.tips(max(0, next)) == tips
    & along(max(0, next), if(mirror, px - ax, ax - px), ay - py, az - pz) > agreed
  { q = calibre(kind, next, tips, ahead, d), a = swing(kind, if(mirror, -1, 1), next, x, y), phi = spin(kind, a, if(mirror, -1, 1), next, x, y) }
  -> Fork(kind, next, q, run + 1, tips, path, order + 1, mirror, d / calibres.d(q), longer(ahead, forks.ahead(next)),
          ax, ay, az, px, py, pz, phi) : follow
fork: Twig(kind, donor, next, run, mirror, tips, ahead, path, order, d, ax, ay, az) > ?P(px, py, pz) ?H(x, y, z) ?S(sx, sy, sz)
  { s = styles(whose(kind), kind), t = styles(me, kind), u = styles(one, kind), v = styles(other, kind), mx = if(chance(0.5), 1, -1),
    far = max(1, sqrt((ax - px)^2 + (ay - py)^2 + (az - pz)^2)),
    r = forks(kind, cell = donor, other = if(chance(familiar), -1, whose(kind)), tips = crowd(tips), ahead = log(max(ahead, 1)),
      path = path, order = order, d = log(d), hx = x * mx, hy = y, hz = z,
      lean = mx * (px * y - py * x) / max(1, sqrt(px^2 + py^2 + pz^2)), swerve = mx * atan2(x * sy - y * sx, x * sx + y * sy),
      side = px * mx, height = py, before = pz,
      gx = mx * (ax - px) / far, gy = (ay - py) / far, gz = (az - pz) / far,
      @style, seldom = 0),
    q = calibre(kind, r, tips, ahead, d), a = swing(kind, mx, r, x, y), phi = spin(kind, a, mx, r, x, y) }
  -> Fork(kind, r, q, 1, tips, path, order + 1, mx < 0, d / calibres.d(q), longer(ahead, forks.ahead(r)),
          ax, ay, az, px, py, pz, phi)
one: Fork(kind, r, q, run, tips, path, order, mirror, thick, scale, ax, ay, az, px, py, pz, phi) : forks.daughters(r) == 1
  -> Limb(kind, r, q, run, 0, tips, path, order, mirror, thick, scale, ax, ay, az, px, py, pz, phi)
two: Fork(kind, r, q, run, tips, path, order, mirror, thick, scale, ax, ay, az, px, py, pz, phi) : forks.daughters(r) == 2 & !forks.turned(r)
  { n = share(forks.n1(r), forks.tips(r), tips, 1) }
  -> [ Limb(kind, r, q, run, 0, n, path, order, mirror, thick, scale, ax, ay, az, px, py, pz, phi) ]
     [ Limb(kind, r, q, run, 1, tips - n, path, order, mirror, thick, scale, ax, ay, az, px, py, pz, phi) ]
turned: Fork(kind, r, q, run, tips, path, order, mirror, thick, scale, ax, ay, az, px, py, pz, phi) : forks.daughters(r) == 2 & forks.turned(r)
  { n = share(forks.n1(r), forks.tips(r), tips, 1) }
  -> [ Limb(kind, r, q, run, 1, tips - n, path, order, mirror, thick, scale, ax, ay, az, px, py, pz, phi) ]
     [ Limb(kind, r, q, run, 0, n, path, order, mirror, thick, scale, ax, ay, az, px, py, pz, phi) ]
three: Fork(kind, r, q, run, tips, path, order, mirror, thick, scale, ax, ay, az, px, py, pz, phi) : forks.daughters(r) == 3
  { n = share(forks.n1(r), forks.tips(r), tips, 2), m = share(forks.n2(r), forks.tips(r), tips - n, 1) }
  -> [ Limb(kind, r, q, run, 0, n, path, order, mirror, thick, scale, ax, ay, az, px, py, pz, phi) ]
     [ Limb(kind, r, q, run, 1, m, path, order, mirror, thick, scale, ax, ay, az, px, py, pz, phi) ]
     [ Limb(kind, r, q, run, 2, tips - n - m, path, order, mirror, thick, scale, ax, ay, az, px, py, pz, phi) ]
limb: Limb(kind, r, q, run, i, tips, path, order, mirror, thick, scale, ax, ay, az, px, py, pz, phi)
  { s = styles(whose(kind), kind), donor = forks.donor(r), from = styles(donor, kind),
    thin = styles.thinnest(styles(thin_as, kind)),
    length = scale * nth(i, forks.l1(r), forks.l2(r), forks.l3(r)), beyond = scale * nth(i, forks.b1(r), forks.b2(r), forks.b3(r)),
    m = if(mirror, -1, 1), tx = m * nth(i, forks.t1x(r), forks.t2x(r), forks.t3x(r)), ty = nth(i, forks.t1y(r), forks.t2y(r), forks.t3y(r)),
    gx = px + scale * (cos(phi) * tx - sin(phi) * ty), gy = py + scale * (sin(phi) * tx + cos(phi) * ty),
    sz = steeper(kind, from, nth(i, forks.rise1(r), forks.rise2(r), forks.rise3(r))), gz = pz + sz * scale * nth(i, forks.t1z(r), forks.t2z(r), forks.t3z(r)),
    mx = m * forks.tx(r), my = forks.ty(r), bears = heed * borne(r, i),
    wx = gx + bears * (ax - px - scale * (cos(phi) * mx - sin(phi) * my)),
    wy = gy + bears * (ay - py - scale * (sin(phi) * mx + cos(phi) * my)),
    wz = max(cells.low(me), min(cells.high(me), deep(kind) * (gz + bears * (az - pz - sz * scale * forks.tz(r))))),
    part = steer * drawn(length, beyond, wx - gx, wy - gy, wz - gz),
    off = sqrt(gx^2 + gy^2 + gz^2), over = max(0, 1 - styles.farthest(s) / max(1, off)),
    back = (1 - steer) * over * drawn(length, beyond, over * gx, over * gy, over * gz),
    last = thick^exp(0 - length / fade), d = max(thin, last * nth(i, calibres.d1(q), calibres.d2(q), calibres.d3(q))) }
  -> Trace(forks, r, i, scale, mirror, turn = 0, about = phi, bent = bending(kind, from),
       like = q, thickness = thick, last = last, thinnest = thin,
       x = part * (wx - gx) - back * gx, y = part * (wy - gy) - back * gy, z = part * (wz - gz) - back * gz, steep = sz,
       stairs = stepped(kind, from), kinked = turned(kind, from), kinks = kinky(kind, from), climbing = 1, levelled = levelled(kind, from))
     Twig(kind, donor, nth(i, forks.next1(r), forks.next2(r), forks.next3(r)), run, mirror, tips, beyond, path + length, order, d,
       wx, wy, wz) ?P(0, 0, 0) ?H(0, 0, 0) ?S(0, 0, 0)
)";

// Neurons stray from one another by no more than this, in logarithms of how often they fork and how far they reach: axons of one
// tip beside those of hundreds would make it twice as much, and what is grown then nine times as large as what was traced.
constexpr double most_deviation = 1.2;

/// Writes the grammar, part by part: first what a person may want to change, then what was traced, then how it grows.
class Writer {
 public:
  Writer(const Traced& traced, const std::vector<Mixed>& mixed, const std::string& title,
         const Resampling& options, const Seldom& seldom, const Tuning& tuning)
      : traced_(traced), options_(options), seldom_(seldom), tuning_(tuning), mixed_(mixed) {
    // How finely a neuron was traced is the same all over it; how unevenly steep its steps are no factor makes up for.
    for (std::size_t s = 0; s < trait::count; ++s)
      kernels_ += fmt::format(", {} ~ {:.2g}", style_names[s],
                              s == trait::grain    ? .2 * options.style
                              : s == trait::stairs ? .25 * habits_of_many(options.tracer, traced.cells.size())
                              : s == trait::kinks  ? habits_of_many(options.tracer, traced.cells.size())
                              : habit(s)           ? options.tracer
                                                   : options.style);
    cells();
    gauges();
    styles_of_cells();
    if (spiny()) spines();
    alike();
    plans();
    arbors();
    stems();
    forks();
    calibres();
    productions();
    const std::string body = std::exchange(text_, {});
    put("# Resampled from {} traced neurons with {} forks.\ntitle: {}\nsteps: 1000\nlimit: 1000000\n",
        traced.cells.size(), traced.forks.size(), title_of(title));
    settings();
    text_ += body;
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
    put(R"(
# Neurons: the diameter of their soma (µm), of the point where they begin when they have none (else -1),
# between which depths they lie, how many stems one like this has, and the neurons in whose style its basal
# dendrites are, in whose all others, and whose diameters it has; and, of as many places of a ring in which
# like ones lie side by side, the neuron there{}.
sample cells(-> soma, fibre, low, high, stems, basal_as, others_as, thin_as, ring{}) =)",
        outlined() ? "; then how its soma's outline is not round" : "", outlined() ? ", a2, b2, a3, b3" : "");
    const std::vector<std::size_t> around = ring(traced_, mixed_);
    for (std::size_t i = 0; i < traced_.cells.size(); ++i) {
      const Cell& c = traced_.cells[i];
      const Mixed& m = mixed_[i];
      row(!i);
      put("{} {} {} {} {} {} {} {} {}", rounded(c.soma, 1e3), rounded(c.fibre, 1e3), rounded(c.low, 10.),
          rounded(c.high, 10.), m.stems.size(), m.basal_as, m.others_as, m.thin_as, around[i]);
      if (outlined())
        for (const double one : c.outline) put(" {}", rounded(one, 1e3));
    }
  }
  bool outlined() const {
    return std::ranges::any_of(traced_.cells, [](const Cell& c) { return c.outline != Outline{}; });
  }

  void gauges() {
    put(R"(

# The diameters that each neuron's points of a kind have, µm, and of how many each is: a tracer has so many to choose from.
sample gauges(cell =, kind = -> points) =)");
    bool first = true;
    for (std::size_t i = 0; i < traced_.cells.size(); ++i)
      for (const auto& [kind, unused] : traced_.deviations) {
        const Diameters diameters = diameters_of(traced_.cells[i], kind);
        std::size_t points = 0;
        for (const auto& [diameter, count] : diameters) points += count;
        row(std::exchange(first, false));
        put("{} {} -> {} | 0 1 0 {}:", i, kind, points, diameters.begin()->first);
        std::string_view before;
        for (const auto& [diameter, count] : diameters)
          put("{} {} 0 0 {}", std::exchange(before, ","), count, diameter);
      }
  }
  static Manner manner_of(const Cell& cell, int kind) {
    const auto found = cell.kinds.find(kind);
    return found == cell.kinds.end() ? Manner() : found->second;
  }
  // Of a kind that it has not, those of all.
  static Diameters diameters_of(const Cell& cell, int kind) {
    if (const auto found = cell.diameters.find(kind); found != cell.diameters.end()) return found->second;
    Diameters all;
    for (const auto& [other, diameters] : cell.diameters)
      for (const auto& [diameter, count] : diameters) all[diameter] += count;
    return all;
  }

  void styles_of_cells() {
    put(R"(

# Their styles, in standard deviations, of each kind of section: how long, winding, thick and coarsely traced branches are,
# how steep and how kinked, and how unevenly so (stairs, kinks), how deep in the slice, how wide their forks, how much
# thinner daughters, how far they reach and how often they fork; the thinnest diameter and how far from the soma the farthest
# branch ends (µm), the mean logarithm of path by chord, the mean angle between segments, which share of them is level, and how
# much the others differ in how steep they are, those angles, and branches in how steep they are, in shares of the means.
sample styles(cell =, kind = -> {}, thinnest, farthest, winding, angle, level, stepped, kinky, uneven) =)",
        fmt::join(style_names, ", "));
    bool first = true;
    for (std::size_t i = 0; i < traced_.cells.size(); ++i)
      for (const auto& [kind, sd] : traced_.deviations) {
        const Manner of = manner_of(traced_.cells[i], kind);
        row(std::exchange(first, false));
        put("{} {} ->", i, kind);
        style(of.style);
        put(" {} {} {} {} {} {} {} {}", rounded(of.thinnest, 1e3), rounded(of.farthest, 10.),
            rounded(of.winding, 1e4), rounded(of.turn, 1e4), rounded(of.level, 1e3), rounded(of.stairs, 1e4),
            rounded(of.kinks, 1e4), rounded(of.uneven, 1e3));
      }
  }

  bool spiny() const {
    return std::ranges::any_of(traced_.cells, [](const Cell& c) {
      return std::ranges::any_of(c.kinds, [](const auto& kind) { return kind.second.spines.density > 0.; });
    });
  }
  void spines() {
    put(R"(

# Their spines: how many per µm, how far their heads are from the axis, how wide these and the necks are (µm), and the standard
# deviation of the logarithm of how far.
sample spines(cell =, kind = -> density, reach, head, neck, spread) =)");
    bool first = true;
    for (std::size_t i = 0; i < traced_.cells.size(); ++i)
      for (const auto& [kind, unused] : traced_.deviations) {
        const Spininess of = manner_of(traced_.cells[i], kind).spines;
        row(std::exchange(first, false));
        put("{} {} -> {} {} {} {} {}", i, kind, rounded(of.density, 1e4), rounded(of.reach, 1e3),
            rounded(of.head, 1e3), rounded(of.neck, 1e3), rounded(of.spread, 1e3));
      }
  }

  std::size_t kin() const { return std::min<std::size_t>(options_.kin, traced_.cells.size() - 1); }

  void alike() {
    put(R"(

# To each neuron those most like it in style, the most alike first.
sample alike(cell =, rank = -> cell) =)");
    for (std::size_t i = 0; i < traced_.cells.size(); ++i) {
      const std::vector<std::size_t>& others = mixed_[i].kin;
      for (std::size_t k = 0; k < kin(); ++k) {
        row(!i && !k);
        put("{} {} -> {}", i, k, others[k]);
      }
      for (std::size_t k = 0; k < kin(); ++k)
        for (std::size_t l = 0; l < kin(); ++l) differ(traced_.cells[others[k]], traced_.cells[others[l]]);
    }
  }

  void differ(const Cell& one, const Cell& other) {
    for (const auto& [kind, of] : one.kinds)
      if (const auto found = other.kinds.find(kind); found != other.kinds.end())
        for (std::size_t s = 0; s < trait::count; ++s, differences_ += 1.)
          squares_ += std::pow(of.style[s] - found->second.style[s], 2);
  }
  double stray() const {
    const auto count = double(traced_.cells.size());
    return options_.smoothing.value_or(count < 25. ? std::min(1.2, 10. / count) : 0.);
  }
  // What keeps styles as different among neurons as they are, when the differences of like ones are added.
  double kept() const {
    return differences_ > 0. ? 1. / std::sqrt(1. + std::pow(stray(), 2) * squares_ / differences_) : 1.;
  }

  // Where the stems of a neuron all reach as far, as to a fissure, they are to remain so: a quarter of how much they differ.
  double jolt() const {
    std::vector<double> differ;
    for (const Cell& c : traced_.cells)
      for (const auto& [kind, unused] : c.kinds) {
        std::vector<double> reaches;
        for (const Stem& s : c.stems)
          if (s.kind == kind && s.length > 0.) reaches.push_back(std::log(s.ahead));
        if (reaches.size() > 1) differ.push_back(deviation(reaches));
      }
    return differ.empty() ? options_.jitter
                          : std::min(options_.jitter, statistics::summarize(differ).median / 4.);
  }

  void plans() {
    put(R"(

# Their stems, in the order of the sample of stems: tips, where they leave the soma's centre (µm) and head, their diameter where
# they end, the path to the farthest tip, their length, where the middle of their tips is, and how many times thicker they may be,
# so that none ends or is thicker than the thickest that was traced.
sample plans(-> cell, kind, tips, x, y, z, hx, hy, hz, d, ahead, length, tx, ty, tz, most) =)");
    const auto end = [](const Stem& s) { return std::max(least_diameter, s.end_diameter); };
    const auto widest = [&](const Stem& s) {
      float radius = 0;
      for (const Point& p : s.points) radius = std::max(radius, p.radius);
      return std::max(end(s), 2. * double(radius));
    };
    const std::map<int, double> ends = largest(end), anywhere = largest(widest);
    bool first = true;
    for (const Cell& c : traced_.cells)
      for (const Stem& s : c.stems) {
        row(std::exchange(first, false));
        put("{} {} {} ", s.cell, s.kind, s.tips);
        vector(s.place, 1e2);
        put(" ");
        vector(s.heading, 1e3);
        put(" {} {} {}", rounded(s.end_diameter, 1e3), rounded(s.ahead, 10.), rounded(s.length, 1e2));
        put(" ");
        vector(s.aim, 10.);
        put(" {:.4g}", std::min(ends.at(s.kind) / end(s), anywhere.at(s.kind) / widest(s)));
      }
  }

  void arbors() {
    put(R"(

# The stems that one like each neuron has, and the stem as which each leaves the soma and heads for its tips.
sample arbors(cell =, stem = -> plan, pose) =)");
    std::vector<std::size_t> first_of(1, 0);  // the number of a neuron's first stem among all
    for (const Cell& c : traced_.cells) first_of.push_back(first_of.back() + c.stems.size());
    for (std::size_t i = 0; i < mixed_.size(); ++i)
      for (std::size_t k = 0; k < mixed_[i].stems.size(); ++k) {
        const auto number = [&](const Stem* stem) {
          return first_of[stem->cell] + std::size_t(stem - traced_.cells[stem->cell].stems.data());
        };
        row(!i && !k);
        put("{} {} -> {} {}", i, k, number(mixed_[i].stems[k]), number(mixed_[i].poses[k]));
      }
  }

  void stems() {
    put(R"(

# Stems as they were traced; tips as a crowd (below), path and diameter as logarithms.
sample stems(kind =, cell !=, tips ~ 0.1, ahead ~ {}, length ~ 0.4, hx ~ 0.2, hy ~ 0.2, hz ~ {}, d ~ 0.3{}, seldom ~ 1
  -> donor, next, ahead, length, rise, tx, ty, tz) =)",
        options_.ahead, 2. * options_.heading_across, kernels_);
    bool first = true;
    std::size_t stem = 0;
    for (const Cell& c : traced_.cells)
      for (const Stem& s : c.stems) {
        row(std::exchange(first, false));
        put("{} {} {} {} {} ", s.kind, s.cell, rounded(crowd(s.tips), 1e3), logarithm(s.ahead),
            logarithm(s.length));
        vector(s.heading, 1e3);
        put(" {}", logarithm(s.end_diameter));
        style(c.kinds.at(s.kind).style);
        put(" {} -> {} {} {} {} {} ", rounded(seldom_.stems[stem++], 1e3), s.cell, s.next,
            rounded(s.ahead, 10.), rounded(s.length, 1e2), rounded(slope_of(s.points), 1e3));
        vector(s.aim - s.place, 10.);
        trace(s.heading, Vec3::Zero(), s.points);
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
    put(R"(
# Forks as they were traced: the branch that ends there (tips as a crowd, the path to the farthest and the diameter as logarithms;
# heading and place, from the soma), and its daughters, fewest tips first (turned: traced last first): tips, lengths, paths beyond
# their ends, how steep they are (rise), and whither the middle of their tips is, and of all.
sample forks(kind =, cell !=, other !=, tips ~ {}, ahead ~ {}, path ~ near_path(kind), order ~ near_order(kind), d ~ near_d(kind),
    hx ~ {}, hy ~ {}, hz ~ {}, lean ~ {}, swerve ~ {}, side ~ near_side(kind), height ~ near_height(kind),
    before ~ near_before(kind), gx ~ {}, gy ~ {}, gz ~ {}{}, seldom ~ 1
  -> donor, ux, uy, daughters, turned, tips, ahead, n1, n2, l1, l2, l3, b1, b2, b3, rise1, rise2, rise3, next1, next2, next3,
     t1x, t1y, t1z, t2x, t2y, t2z, t3x, t3y, t3z, tx, ty, tz) =)",
        options_.tips, options_.ahead, options_.heading, options_.heading, options_.heading_across,
        options_.lean, options_.swerve, options_.aim, options_.aim, options_.aim_across, kernels_);
    for (const Fork& f : forks) {
      row(&f == forks.data());
      put("{} {} {} {} {} {} {} {} ", f.kind, f.cell, f.cell, rounded(crowd(f.tips), 1e3), logarithm(f.ahead),
          rounded(f.path, 10.), f.order, logarithm(f.diameter));
      vector(f.heading, 1e3);
      put(" {} {} {} {} {}", rounded(f.lean(), 1e3), rounded(f.swerve(), 10.), rounded(f.side, 10.),
          rounded(f.height, 10.), rounded(f.depth, 10.));
      put(" ");
      vector(f.aim, 1e3);
      style(traced_.cells[f.cell].kinds.at(f.kind).style);
      put(" {} -> {} {} {} {} {} {} {}", rounded(seldom_.forks[std::size_t(&f - forks.data())], 1e3), f.cell,
          rounded(double(f.heading.x()), 1e3), rounded(double(f.heading.y()), 1e3), f.daughters.size(),
          int(f.turned), f.tips, rounded(f.ahead, 10.));
      const auto each = [&](auto&& what, std::size_t most, double steps) {
        for (std::size_t i = 0; i < most; ++i)
          put(" {}", i < f.daughters.size() ? rounded(std::invoke(what, f.daughters[i]), steps) : 0.);
      };
      each(&Fork::Daughter::tips, 2, 1.);
      each(&Fork::Daughter::length, most_daughters, 1e2);
      each(&Fork::Daughter::ahead, most_daughters, 10.);
      each([](const Fork::Daughter& d) { return slope_of(d.points); }, most_daughters, 1e3);
      for (std::size_t i = 0; i < most_daughters; ++i)
        put(" {}", i < f.daughters.size() ? f.daughters[i].next : none);
      for (std::size_t i = 0; i < most_daughters; ++i) {
        put(" ");
        vector(i < f.daughters.size() ? f.daughters[i].aim : Vec3(Vec3::Zero()), 10.);
      }
      put(" ");
      vector(f.middle(), 10.);
      for (const Fork::Daughter& d : f.daughters) trace(f.heading, f.last_step, d.points);
    }
  }

  void calibres() {
    put(R"(

# The same forks, row by row, asked by how thick they are: the diameters where the branch ends and its daughters end, µm.
sample calibres(kind =, daughters =, cell ~ 0.1, tips ~ 0.08, first ~ 0.08, ahead ~ 0.8, l1 ~ 1, l2 ~ 1, d ~ 0.07, seldom ~ 1
  -> d, d1, d2, d3) =)");
    for (const Fork& f : traced_.forks) {
      row(&f == traced_.forks.data());
      put("{} {} {} {} {} {} {} {} {} {} -> {}", f.kind, f.daughters.size(), f.cell, logarithm(f.tips),
          logarithm(f.daughters[0].tips), logarithm(f.ahead), logarithm(f.daughters[0].length),
          logarithm(f.daughters.size() > 1 ? f.daughters[1].length : 1.), logarithm(f.diameter),
          rounded(seldom_.calibres[std::size_t(&f - traced_.forks.data())], 1e3), rounded(f.diameter, 1e3));
      for (std::size_t i = 0; i < most_daughters; ++i)
        put(" {}", i < f.daughters.size() ? rounded(f.daughters[i].end_diameter, 1e3) : 0.);
    }
  }

  void productions() {
    put(R"(

# This neuron is made of four traced ones, and its style strays as two neurons alike to it differ.
cell me = cells.ring(dealt({}))
cell one = alike.cell(alike(me, floor(uniform(0, kin))))
cell other = alike.cell(alike(me, floor(uniform(0, kin))))
cell planned = cells.stems(me)
cell basal_as = cells.basal_as(me)
cell others_as = cells.others_as(me)
cell thin_as = cells.thin_as(me)
function own(mine, one_s, other_s) = kept * (mine + stray * (one_s - other_s))
)",
        traced_.cells.size());
    for (const auto& [name, style] : {std::pair{"forks", trait::forks},
                                      {"extent", trait::extent},
                                      {"girth", trait::girth},
                                      {"slope", trait::slope}}) {
      const std::size_t of = style;
      table(fmt::format("sd_{}", name), traced_.deviations,
            [&](const Style& sd) { return std::min(sd[of], most_deviation); });
    }
    table("mean_slope", traced_.means, [](const Style& mean) { return mean[trait::slope]; });
    std::string style;
    for (std::size_t i = 0; i < trait::count; ++i)
      style += fmt::format(
          fmt::runtime(i == trait::girth || i == trait::thinning ? "{1}{0} = styles.{0}(u)"
                       : of_dealt(i)                             ? "{1}{0} = styles.{0}(t)"
                                     : "{1}{0} = own(styles.{0}(s), styles.{0}(u), styles.{0}(v))"),
          style_names[i],
          !i      ? ""
          : i % 3 ? ", "
                  : ",\n      ");
    std::string rules(growth);
    if (std::ranges::any_of(traced_.cells, [](const Cell& c) { return c.fibre >= 0.; }))
      rules.replace(rules.find(with_soma), with_soma.size(), with_fibre);
    const auto replace = [&](std::string_view from, std::string_view to) {
      for (std::size_t at = 0; (at = rules.find(from, at)) != rules.npos; at += to.size())
        rules.replace(at, from.size(), to);
    };
    if (outlined()) replace(round_soma, outlined_soma);
    if (spiny()) replace(gauged, std::string(gauged) + std::string(bearing));
    std::string_view rest = rules;
    for (std::size_t at; (at = rest.find("@style")) != rest.npos; rest.remove_prefix(at + 6))
      text_.append(rest.substr(0, at)).append(style);
    text_ += rest;
  }

  // What a person may want to change.
  void settings() {
    put(R"(
# How much neurons differ from those that were traced.
#define stray {:.4g}  # how far their styles stray, in differences of two neurons alike to them: 0 or more
#define kin {}  # of how many most alike these two are drawn: 1 to {}
#define kept {:.4g}  # times which styles are taken, so that grown neurons differ as much as traced ones
#define bold 0.5  # how much of what extents stray goes into how far stems reach: 0 to 1
#define jitter {:.4g}  # how much a stem's tips are changed: standard deviation of their logarithm
#define jolt {:.4g}  # how much its reach is: likewise
#define familiar {:.4g}  # how often a fork may come from the neuron whose stems these are: 0 to 1
#define follow 0.95  # how often a branch goes on as in the neuron that it comes from, where it can: 0 to 1
#define agreed 0.85  # … which it can when the cosine between the ways to its tips, there and here, is above this
#define longest 3  # branches in a row that come from one neuron, at most
# How branches are drawn.
#define steer 0.35  # how much of the way to where the middle of their tips should be they are drawn aside: 0 to 1
#define most 0.5  # how far they are drawn aside at most, in shares of their length
#define heed 0.5  # how much of what a fork misses of where its tips should be its daughters seek: 0 to 1
#define steep 1  # how much of the difference in slope between their neuron and its donor they make up for: 0 to 1
#define ragged 1  # … of how much its branches differ in slope: 0 to 1
#define habits {:.4g}  # the same of how unevenly steep and how kinked their steps are: 0 to 1
#define fade 20  # µm, along which they give up e times of how much thicker they are than what lends its diameters: above 0
#define stout 0.7  # by how much of the difference between neurons whose diameters are lent stems are as thick: 0 to 1
#define even 0.3  # how far diameters are taken to being as frequent as they are in the neuron that lends them: 0 to 1
)",
        stray(), kin(), kin(), kept(), options_.jitter, jolt(), options_.familiar,
        habits_kept(traced_.cells.size()));
    // The trunk of an apical dendrite forgets where the pia is when each fork is turned as its branch is.
    std::map<int, double> turns;
    for (const auto& [kind, unused] : traced_.means) turns[kind] = kind == int(SectionKind::apical) ? .4 : .7;
    table(
        "turn", turns, std::identity{},
        "by how much of the angle between headings, where it was traced and here, a fork is turned: 0 to 1");
    put("# Tuned by growing: how many times as much as traced branches those of each kind are told to do.\n");
    for (std::size_t k = 0; k < knobs.size(); ++k)
      table(
          knobs[k].name, tuning_, [&](const auto& values) { return values[k]; }, knobs[k].says);
    put(R"(# No stem has more tips, or reaches farther (µm), than half as much again as the largest that was traced.
)");
    std::map<int, double> tips = most(1., [](const Stem& stem) { return stem.tips; });
    for (auto& [kind, most_tips] : tips)
      if (!std::ranges::count(traced_.forks, kind, &Fork::kind)) most_tips = 1.;  // it has none to draw
    table("most_tips", tips, std::identity{}, "", 9);
    table("most_ahead", most(10., [](const Stem& stem) { return stem.ahead; }), std::identity{}, "", 9);
  }

  // A table by kind.
  void table(std::string_view name, const auto& by_kind, auto&& value, std::string_view says = "",
             int digits = 4) {
    std::vector<std::string> bins;
    for (const auto& [kind, of] : by_kind)
      bins.push_back(fmt::format("{}: {:.{}g}", kind, value(of), digits));
    put("table {} = {}{}{}\n", name, fmt::join(bins, ", "), says.empty() ? "" : "  # ", says);
  }

  // Of the stems of each kind.
  std::map<int, double> largest(auto&& of) const {
    std::map<int, double> result;
    for (const Cell& c : traced_.cells)
      for (const Stem& stem : c.stems) result[stem.kind] = std::max(result[stem.kind], of(stem));
    return result;
  }
  // Half as much again as the largest, rounded up.
  std::map<int, double> most(double steps, auto&& of) const {
    std::map<int, double> result = largest(of);
    for (auto& [kind, value] : result) value = std::ceil(1.5 * value * steps) / steps;
    return result;
  }

  // A table of the widths of a kernel: a share of the standard deviation among the forks of each kind.
  void widths(const char* name, double share, auto&& what) {
    std::map<int, std::vector<double>> values;
    for (const Fork& f : traced_.forks) values[f.kind].push_back(what(f));
    table(name, values, [&](const std::vector<double>& of) {
      const double sd = deviation(of);
      constexpr double same = 1e-6;  // but for what rounding makes of it
      return sd > same ? share * sd : 1.;
    });
  }

  void vector(const Vec3& v, double steps) {
    put("{} {} {}", rounded(double(v.x()), steps), rounded(double(v.y()), steps),
        rounded(double(v.z()), steps));
  }
  void style(const Style& of) {
    for (const double s : of) put(" {}", rounded(s, 1e2));
  }
  void trace(const Vec3& heading, const Vec3& last_step, std::span<const Point> points) {
    put(" | ");
    vector(heading, 1e3);
    put(" {}", rounded(2. * double(points[0].radius), 1e3));
    if (!last_step.isZero(0.f)) put(", "), vector(last_step, 1e3);
    put(":");
    const auto stops = stops_of(points);
    for (std::size_t i = 0; i < stops.size(); ++i) {
      put("{} ", i ? "," : "");
      vector(stops[i].at, 1e2);
      put(" {}", rounded(double(stops[i].diameter), 1e3));
    }
  }
  static double rounded(double value, double steps) { return std::round(value * steps) / steps; }
  static double crowd(double tips) { return std::log(tips) - 30. / std::pow(tips, 3); }  // as in the grammar
  static double logarithm(double value) { return rounded(std::log(std::max(least_length, value)), 1e3); }

  const Traced& traced_;
  const Resampling& options_;
  const Seldom& seldom_;
  const Tuning& tuning_;
  const std::vector<Mixed>& mixed_;
  double squares_ = 0., differences_ = 0.;  // of the styles of neurons that are like the same one
  std::string kernels_, text_;
};

bool suffices(const Traced& traced) { return traced.cells.size() >= 2 && !traced.forks.empty(); }

}  // namespace

bool can_be_resampled(std::span<const Morphology> neurons, statistics::KindSet kinds) {
  return suffices(learn(neurons, kinds));
}

std::string resampling_grammar(std::span<const Morphology> neurons, const std::string& title,
                               const Resampling& options, Progress& progress) {
  const Traced traced = learn(neurons, options.kinds);
  if (!suffices(traced))
    throw Error(
        traced.cells.size() < 2
            ? fmt::format("{} of {} neurons have stems of these kinds; a model needs two such neurons, name "
                          "more of them or other kinds",
                          traced.cells.size(), neurons.size())
            : fmt::format(
                  "none of {} neurons has a fork of these kinds, so there is nothing to learn branching "
                  "from; name others",
                  neurons.size()));
  const std::vector<Mixed> mixed = mix(traced, options.kin);
  std::size_t stems = 0;
  for (const Cell& c : traced.cells) stems += c.stems.size();
  const std::size_t forks = traced.forks.size();
  const auto text = [&](const Seldom& seldom, const Tuning& tuning) {
    return Writer(traced, mixed, title, options, seldom, tuning).text();
  };
  Seldom seldom{std::vector<double>(stems), std::vector<double>(forks), std::vector<double>(forks)};
  Tuning tuning = untuned(traced);
  const auto grammar = [&] { return lsystem::parse(text(seldom, tuning), title); };
  if (options.evening.rounds) seldom = evened(grammar(), traced.cells.size(), options.evening, progress);
  if (options.tuning.rounds) tuning = tuned(grammar(), traced, options, progress);
  return text(seldom, tuning);
}

}  // namespace forest::fitting
