// SPDX-License-Identifier: Apache-2.0
#include "forest/lsystem/turtle.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/lsystem/body.h"
#include "forest/lsystem/exclusion.h"

namespace forest::lsystem {
namespace {

// What Trace is told, in the order of its parameters. The first three are needed.
struct Tracing {
  double sample = 0., row = 0., branch = 0., scale = 1., mirror = 0., turn = 1., bent = 1., like = -1.,
         thickness = 1., thinnest = 0., x = 0., y = 0., z = 0., last = -1., steep = 1., stairs = 1.,
         kinked = 1., kinks = 1., climbing = 0., about = 0., levelled = 0.;
};
constexpr std::size_t tracing_needs = 3, tracing_takes = sizeof(Tracing) / sizeof(double);
constexpr auto tracing_values = std::bit_cast<std::array<double, tracing_takes>>(Tracing{});

constexpr double round_soma[] = {0., 0., 0., 0.};
constexpr double spines_as_usual[] = {1.2, .5, .15, .3, 0.};

constexpr TurtleSymbol symbol_table[] = {
    {"F", "length, diameter", "draw a segment; it tapers to the diameter, when given", Action::draw, 0, 2},
    {"f", "length", "move without drawing", Action::move, 0, 1},
    {"+", "angle", "turn left", Action::turn_left, 0, 1},
    {"-", "angle", "turn right", Action::turn_right, 0, 1},
    {"&", "angle", "pitch down", Action::pitch_down, 0, 1},
    {"^", "angle", "pitch up", Action::pitch_up, 0, 1},
    {"\\", "angle", "roll left", Action::roll_left, 0, 1},
    {"/", "angle", "roll right", Action::roll_right, 0, 1},
    {"|", "", "turn around", Action::turn_around, 0, 0},
    {"$", "", "roll until the left is horizontal", Action::level, 0, 0},
    {"[", "", "begin a branch: remember everything", Action::push, 0, 0},
    {"]", "", "end a branch: be as at its beginning", Action::pop, 0, 0},
    {"!", "diameter", "set the diameter; alone, divide it by the square root of 2", Action::diameter, 0, 1},
    {"T", "strength, x, y, z",
     "from here on bend by strength towards a direction, (0, 1, 0) when not given; 0 ends it",
     Action::tropism, 1, 4},
    {"Soma", "diameter, a2, b2, a3, b3",
     "a soma here; with the others not round: seen along z its outline is diameter / 2 × (1 + a2 cos 2φ + b2 "
     "sin 2φ + "
     "a3 cos 3φ + b3 sin 3φ) from its middle, φ from +x to +y",
     Action::soma, 1, 5, round_soma},
    {"Axon", "", "what follows is axon", Action::axon, 0, 0},
    {"Basal", "", "what follows is basal dendrite", Action::basal, 0, 0},
    {"Apical", "", "what follows is apical dendrite", Action::apical, 0, 0},
    {"Glia", "", "what follows is a glial process", Action::glia, 0, 0},
    {"Kind", "number", "what follows is of this SWC type", Action::kind, 1, 1},
    {"Outward", "strength", "from here on bend away from the soma by strength; 0 ends it", Action::outward, 1,
     1},
    {"Flat", "strength, x, y, z",
     "from here on bend by strength into the plane across a direction, (0, 0, 1) when not given; 0 ends it",
     Action::flat, 1, 4},
    {"At", "x, y, z", "stand at a place, counted from the soma, without drawing", Action::place, 3, 3},
    {"Head", "x, y, z", "turn the shortest way to head into a direction", Action::head, 3, 3},
    {"Trace",
     "sample, row, branch, scale, mirror, turn, bent, like, thickness, thinnest, x, y, z, last, steep, "
     "stairs, kinked, kinks, climbing, about, levelled",
     "draw a branch of a sample's row as it was traced, times `scale`; mirror 1: x, 2: z, 3: both; turned "
     "about z by the share `turn` of "
     "the angle from what it left there to the heading; `bent` times as far from its chord; as thick as the "
     "branch of row `like` (below 0: its own), "
     "times `thickness`, at its end `last` (below 0: the same), and no thinner than `thinnest`; its end "
     "drawn aside by (x, y, "
     "z), all of it in "
     "proportion; `steep` times as far along z; how steep its "
     "steps are to the power of "
     "`stairs`; angles between them `kinked` times as large, and to the power of `kinks`; of "
     "what is drawn aside along z the share `climbing` in proportion to how far each step goes along it; "
     "turned about z by `about` degrees beside; and of its steps that are not level the share `levelled` "
     "becomes "
     "so, or below 0 of those that are as large a share climbs",
     Action::trace, int(tracing_needs), int(tracing_takes), std::span(tracing_values).subspan(tracing_needs)},
    {"Gauge", "sample, row, even",
     "from here on every diameter of `Trace` is the nearest of those that the first branch of the row has, "
     "which must rise; in the end all that is drawn under it is taken by the share `even`, 0 when not given, "
     "to having "
     "each as often as the x of its place says",
     Action::gauge, 2, 3},
    {"Fibre", "diameter", "a neuron without soma begins here: what is drawn next leaves this point",
     Action::fibre, 1, 1},
    {"Spiny", "density, reach, head, neck, spread, dice",
     "from here on what is drawn bears so many spines per µm, anywhere and to any side, as `dice`, a number "
     "of chance, "
     "says: heads `reach` from the axis (1.2), in logarithms with this spread (0.3), `head` and `neck` wide "
     "(0.5, 0.15), µm; density 0 ends it",
     Action::spiny, 1, 6, spines_as_usual},
    {"Avoid", "gap",
     "from here on keep this far from somata, the own one included, and below the pia, by bending around; "
     "below 0 ends it",
     Action::avoid, 1, 1},
    {"Seek", "strength",
     "from here on bend by strength to where attractors are denser, below 0 away from it; 0 ends it",
     Action::seek, 1, 1},
    {"Shun", "strength, reach",
     "from here on bend away from the nearest soma of another cell by strength, which falls with the "
     "distance by a "
     "factor of e within the reach; 0 ends it",
     Action::shun, 1, 2},
    {"?P", "x, y, z", "after every step, where the turtle is here, counted from the soma", Action::ask_place,
     3, 3},
    {"?H", "x, y, z", "… and where it heads: a unit vector", Action::ask_heading, 3, 3},
    {"?S", "x, y, z", "… and the direction of the last step: a unit vector, 0 when nothing was drawn",
     Action::ask_step, 3, 3},
    {"?D", "depth, layer, above, below",
     "… how deep below the pia it is, in which layer, and how far from the upper and lower border of that",
     Action::ask_depth, 1, 4},
    {"?N", "distance, x, y, z",
     "… how far the surface of the nearest soma of another cell is, and the unit vector to its centre",
     Action::ask_near, 1, 4},
    {"?A", "density, x, y, z", "… how dense attractors are, and the unit vector to where they are denser",
     Action::ask_attraction, 1, 4},
};

static_assert([] {
  for (std::size_t i = 0; i < std::size(symbol_table); ++i)
    if (std::size_t(symbol_table[i].action) != i) return false;
  return true;
}());

constexpr std::uint32_t none = 0xffffffffu;

// A drawn point; its segment begins at `parent` (none: at `from`).
struct Drawn {
  Eigen::Vector3d position;
  float radius, start_radius;
  std::uint32_t parent;
  std::uint32_t children;
  std::int32_t tag;
  SectionKind kind;
  std::uint32_t gauge, spines;  // among Turtle::gauges_, Turtle::spines_
};

struct State {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Matrix3d frame;                           // columns: heading, left, up
  Eigen::Vector3d step = Eigen::Vector3d::Zero();  // the direction of the last one
  double diameter = 1., tropism = 0., outward = 0., flat = 0., seek = 0., shun = 0.;
  double shun_reach = 10.;
  double avoid = -1.;                                  // µm kept free; below 0: it goes through everything
  Eigen::Vector3d towards = Eigen::Vector3d::UnitY();  // of tropism
  Eigen::Vector3d across = Eigen::Vector3d::UnitZ();   // of flattening
  std::uint32_t node = none;                           // the drawn point the turtle stands on
  std::uint32_t begun = none;                          // … and that where the traced branch to it began
  SectionKind kind = SectionKind::undefined;
  std::int32_t tag = 0;
  std::uint32_t gauge = 0, spines = 0;  // among Turtle::gauges_, Turtle::spines_
};

class Turtle {
 public:
  Turtle(const Word& word, const Grammar& grammar, const cortex::Site& site)
      : word_(word),
        grammar_(grammar),
        environment_(site.environment ? *site.environment : nothing()),
        at_(site.at.cast<double>()) {
    state_.frame.col(0) = Eigen::Vector3d::UnitY();
    state_.frame.col(1) = -Eigen::Vector3d::UnitX();
    state_.frame.col(2) = Eigen::Vector3d::UnitZ();
  }

  Morphology draw(const Annotations& annotations) {
    drawn_.reserve(word_.modules.size() / 2);
    walk();
    even_out();
    return build(annotations);
  }
  // Draws nothing, and writes its answers into the word.
  void answer(std::vector<double>& parameters) {
    answers_ = &parameters;
    const std::vector<std::uint32_t> ends = ends_of_silent_branches();
    for (std::uint32_t i = 0; i < ends.size(); ++i)
      if (ends[i] != none)
        i = ends[i];
      else
        act(word_.modules[i]);
  }

 private:
  void walk() {
    for (const Module& m : word_.modules) act(m);
    if (!stack_.empty()) fail("a branch is not closed");
  }

  // For every [ of a branch with no answer that a production could look at its ], else none; for all modules up to the last question.
  // Contexts see what is on their own branch and on those before; into others they look only where they have brackets.
  std::vector<std::uint32_t> ends_of_silent_branches() const {
    struct Branch {
      std::uint32_t begin = none;
      bool asks = false, grows = false, stands = false;  // … the soma, from which places are counted
    };
    const bool looks_into = std::ranges::any_of(grammar_.productions, [](const Production& p) {
      return std::ranges::any_of(p.right, [](const Shape& s) { return s.symbol == Symbol(Action::push); });
    });
    std::vector<std::uint32_t> ends;
    std::vector<Branch> open(1);
    std::size_t asked = 0;  // modules up to the last question
    for (const Module& m : word_.modules) {
      const auto i = std::uint32_t(ends.size());
      ends.push_back(none);
      if (!grammar_.productions_of[m.symbol].empty()) open.back().grows = true;
      const Symbol s = grammar_.drawn_as[m.symbol];
      if (s >= std::size(symbol_table)) continue;
      const Action action = symbol_table[s].action;
      if (action == Action::push) {
        open.push_back({.begin = i});
      } else if (action == Action::pop) {
        if (open.size() == 1) fail("a ] closes nothing");
        const Branch inner = open.back();
        open.pop_back();
        if (!inner.stands && !(inner.asks && (inner.grows || looks_into))) ends[inner.begin] = i;
        Branch& outer = open.back();
        outer.asks |= inner.asks, outer.grows |= inner.grows, outer.stands |= inner.stands;
      } else if (action == Action::soma) {
        open.back().stands = true;
      } else if (is_question(action)) {
        open.back().asks = true, asked = i + 1;
      }
    }
    ends.resize(asked);
    return ends;
  }

  static const cortex::Environment& nothing() {
    static const cortex::Environment empty;
    return empty;
  }

  [[noreturn]] void fail(std::string_view what) const {
    throw Error(fmt::format("{}: {}; mend the grammar", grammar_.file, what));
  }

  void act(const Module& m) {
    const Symbol drawn_as = grammar_.drawn_as[m.symbol];
    if (drawn_as >= std::size(symbol_table)) return;
    const TurtleSymbol& symbol = symbol_table[drawn_as];
    const std::span<const double> values = word_.of(m);
    const auto parameter = [&](std::size_t i, double otherwise) {
      if (i >= values.size()) return otherwise;
      if (!std::isfinite(values[i]))
        fail(fmt::format("module {} has a parameter that is not finite", symbol.symbol));
      return values[i];
    };
    const auto angle = [&] { return parameter(0, grammar_.angle) * (std::numbers::pi / 180.); };
    switch (symbol.action) {
      case Action::draw:
        return draw(parameter(0, grammar_.step), parameter(1, state_.diameter));
      case Action::move:
        return move(parameter(0, grammar_.step));
      case Action::turn_left:
        return rotate(0, 1, angle());
      case Action::turn_right:
        return rotate(0, 1, -angle());
      case Action::pitch_down:
        return rotate(0, 2, -angle());
      case Action::pitch_up:
        return rotate(0, 2, angle());
      case Action::roll_left:
        return rotate(1, 2, -angle());
      case Action::roll_right:
        return rotate(1, 2, angle());
      case Action::turn_around:
        state_.frame.leftCols<2>() *= -1.;
        return;
      case Action::level:
        return level();
      case Action::push:
        stack_.push_back(state_);
        return;
      case Action::pop:
        if (stack_.empty()) fail("a ] closes nothing");
        state_ = stack_.back();
        stack_.pop_back();
        return;
      case Action::diameter:
        state_.diameter = std::max(0., parameter(0, state_.diameter / std::numbers::sqrt2));
        return;
      case Action::tropism:
        state_.tropism = parameter(0, 0.);
        if (values.size() > 1)
          state_.towards = direction(parameter(1, 0.), parameter(2, 0.), parameter(3, 0.));
        return;
      case Action::flat:
        state_.flat = parameter(0, 0.);
        if (values.size() > 1)
          state_.across = direction(parameter(1, 0.), parameter(2, 0.), parameter(3, 0.));
        return;
      case Action::outward:
        state_.outward = parameter(0, 0.);
        return;
      case Action::soma:
        return soma(parameter(0, 0.),
                    {parameter(1, 0.), parameter(2, 0.), parameter(3, 0.), parameter(4, 0.)});
      case Action::axon:
        return become(SectionKind::axon);
      case Action::basal:
        return become(SectionKind::basal);
      case Action::apical:
        return become(SectionKind::apical);
      case Action::glia:
        return become(SectionKind::glia);
      case Action::kind:
        return become_numbered(parameter(0, 0.));
      case Action::fibre:
        return begin(parameter(0, state_.diameter));
      case Action::place:
        return stand(soma_place_ + Eigen::Vector3d(parameter(0, 0.), parameter(1, 0.), parameter(2, 0.)));
      case Action::head:
        return head(direction(parameter(0, 0.), parameter(1, 0.), parameter(2, 0.)));
      case Action::trace:
        return trace(m);
      case Action::gauge:
        state_.gauge = gauge(parameter(0, 0.), parameter(1, 0.), parameter(2, 0.));
        return;
      case Action::spiny:
        return spiny({parameter(0, 0.), parameter(1, spines_as_usual[0]), parameter(2, spines_as_usual[1]),
                      parameter(3, spines_as_usual[2]), parameter(4, spines_as_usual[3]),
                      parameter(5, spines_as_usual[4])});
      case Action::avoid:
        state_.avoid = parameter(0, 0.);
        return;
      case Action::seek:
        state_.seek = parameter(0, 0.);
        return;
      case Action::shun:
        state_.shun = parameter(0, 0.);
        state_.shun_reach = std::max(1e-6, parameter(1, state_.shun_reach));
        return;
      case Action::ask_place:
        return tell(m, Eigen::Vector3d(state_.position - soma_place_));
      case Action::ask_heading:
        return tell(m, Eigen::Vector3d(state_.frame.col(0)));
      case Action::ask_step:
        return tell(m, state_.step);
      case Action::ask_depth: {
        const auto stratum = environment_.stratum(here());
        return tell(m,
                    Eigen::Vector4d(environment_.depth(here()), stratum.layer, stratum.above, stratum.below));
      }
      case Action::ask_near: {
        const auto nearest = environment_.nearest_soma(here(), at_);
        return tell(m, with_direction(nearest.distance, nearest.direction));
      }
      case Action::ask_attraction: {
        const auto field = environment_.field(here());
        return tell(m, with_direction(field.density, field.direction));
      }
    }
  }

  static Eigen::Vector3d direction(double x, double y, double z) {
    return Eigen::Vector3d(x, y, z).stableNormalized();
  }

  void rotate(int a, int b, double angle) {  // column a towards column b
    const double c = std::cos(angle), s = std::sin(angle);
    const Eigen::Vector3d from = state_.frame.col(a), to = state_.frame.col(b);
    state_.frame.col(a) = c * from + s * to;
    state_.frame.col(b) = c * to - s * from;
  }

  void level() {
    const Eigen::Vector3d heading = state_.frame.col(0), left = Eigen::Vector3d::UnitY().cross(heading);
    if (left.norm() < 1e-9) return;
    state_.frame.col(1) = left.normalized();
    state_.frame.col(2) = heading.cross(state_.frame.col(1));
  }

  // Prusinkiewicz & Lindenmayer, section 2.1: turn about heading × direction by strength * |heading ×
  // direction|.
  void bend(const Eigen::Vector3d& direction, double strength) {
    const Eigen::Vector3d axis = state_.frame.col(0).cross(direction);
    const double size = axis.norm();
    if (size < 1e-9) return;
    state_.frame =
        Eigen::AngleAxisd(std::clamp(strength * size, -std::numbers::pi, std::numbers::pi), axis / size) *
        state_.frame;
  }

  void draw(double length, double diameter) {
    diameter = std::max(0., diameter);
    const auto start = float(0.5 * state_.diameter);
    state_.diameter = diameter;
    if (length == 0.) return;
    const Eigen::Vector3d wanted = length * state_.frame.col(0),
                          step = clear(wanted, std::max(double(start), 0.5 * diameter));
    if (step.isZero(0.)) return;  // there is no room
    line_to(state_.position + step, start);
    state_.step = step.stableNormalized();
    if (step != wanted) head(step / std::copysign(step.norm(), length));
    if (state_.seek != 0.)
      if (const auto field = environment_.field(here()); field.density != 0.)
        bend(field.direction, state_.seek);
    if (state_.shun != 0.)
      if (const auto nearest = environment_.nearest_soma(here(), at_); nearest.soma)
        bend(-nearest.direction, state_.shun * std::exp(-std::max(0., nearest.distance) / state_.shun_reach));
    if (state_.tropism != 0.) bend(state_.towards, state_.tropism);
    if (state_.flat != 0.) {
      const Eigen::Vector3d heading = state_.frame.col(0);
      bend((heading - heading.dot(state_.across) * state_.across).stableNormalized(), state_.flat);
    }
    if (state_.outward != 0.) {
      const Eigen::Vector3d out = state_.position - soma_place_;
      if (const double distance = out.norm(); distance > 0.) bend(out / distance, state_.outward);
    }
  }

  // Points are kept in 32 bits.
  static constexpr double world = std::numeric_limits<float>::max();  // µm
  void must_be_in_world(const Eigen::Vector3d& place) const {
    if (!place.allFinite() || place.cwiseAbs().maxCoeff() > world) fail("the turtle has left the world");
  }

  void must_be_size(double diameter) const {
    if (!(diameter <= world)) fail("a diameter is larger than the world");
  }

  Eigen::Vector3d here() const { return at_ + state_.position; }  // in the tissue

  // What it draws in place of this step, so that a neurite of this radius keeps out of what it avoids.
  Eigen::Vector3d clear(const Eigen::Vector3d& step, double radius) {
    if (state_.avoid < 0.) return step;
    must_be_in_world(step);
    const double apart = state_.avoid + radius;
    obstacles_.balls.clear();
    if (soma_) obstacles_.balls.push_back({soma_place_, double(soma_->radius) + apart});
    environment_.for_somata(here(), step.norm() + apart, [&](const Sphere& soma) {
      if (!cortex::Environment::encloses(soma, at_))
        obstacles_.balls.push_back({soma.centre.cast<double>() - at_, double(soma.radius) + apart});
    });
    if (const auto pia = environment_.pia()) obstacles_.ceiling = *pia - at_.y() - apart;
    return clear_step(state_.position, step, state_.frame.col(1), obstacles_);
  }

  // A segment of the turtle's diameter at its end.
  void line_to(const Eigen::Vector3d& place, float start_radius) {
    const Eigen::Vector3d from = std::exchange(state_.position, place);
    must_be_in_world(place);
    must_be_size(state_.diameter);
    if (answers_) return;
    if (state_.node == none) {
      drawn_.push_back(
          {from, start_radius, start_radius, none, 0, state_.tag, state_.kind, state_.gauge, state_.spines});
      state_.node = std::uint32_t(drawn_.size() - 1);
    }
    // What differs by rounding alone is the same: else a file of points has the place of a fork once for each daughter.
    if (const float there = drawn_[state_.node].radius; std::abs(start_radius - there) <= 1e-5f * there)
      start_radius = there;
    ++drawn_[state_.node].children;
    drawn_.push_back({place, float(0.5 * state_.diameter), start_radius, state_.node, 0, state_.tag,
                      state_.kind, state_.gauge, state_.spines});
    state_.node = std::uint32_t(drawn_.size() - 1);
  }

  const lsystem::Trace& branch(double sample, double row, double which, std::string_view by = "Trace") const {
    const auto& samples = grammar_.lookups.samples;
    const auto counts = [](double number, std::size_t count) {
      return number >= 0. && number < double(count) && number == std::floor(number);
    };
    if (!counts(sample, samples.size())) fail(fmt::format("{} names no sample", by));
    const Sample& s = samples[std::size_t(sample)];
    if (!counts(row, s.rows()))
      fail(fmt::format("{} asks for row {} of sample {}, which has {}, counted from 0", by, row, s.name,
                       s.rows()));
    const auto branches = s.branches(std::size_t(row));
    if (!counts(which, branches.size()))
      fail(fmt::format("{} asks for branch {} of row {} of sample {}, which has {}, counted from 0", by,
                       which, row, s.name, branches.size()));
    return branches[std::size_t(which)];
  }

  // Its place among all there are.
  std::uint32_t gauge(double sample, double row, double even) {
    const std::span<const lsystem::Trace::Stop> stops = branch(sample, row, 0., "Gauge").stops;
    if (!std::ranges::is_sorted(stops, {}, &lsystem::Trace::Stop::diameter))
      fail("the diameters of a gauge do not rise");
    even = std::clamp(even, 0., 1.);
    const auto same = std::ranges::find_if(
        gauges_, [&](const Gauge& g) { return g.stops.data() == stops.data() && g.even == even; });
    if (same != gauges_.end()) return std::uint32_t(same - gauges_.begin());
    gauges_.emplace_back(stops, even);
    return std::uint32_t(gauges_.size() - 1);
  }
  double gauged(double diameter) const { return gauges_[state_.gauge].nearest(diameter); }

  // Thicker ones stay thicker, and equal ones equal: what is as thick as a share of all points under a gauge becomes as thick as that
  // share of its own.
  void even_out() {
    for (std::uint32_t g = 1; g < gauges_.size(); ++g) {
      const Gauge& gauge = gauges_[g];
      if (gauge.even == 0. || !(gauge.points > 0.)) continue;
      std::vector<float> radii;
      for (const Drawn& d : drawn_)
        if (d.gauge == g) radii.push_back(d.radius);
      std::ranges::sort(radii);
      std::vector<std::pair<float, float>> became;  // each once
      const auto evened = [&](float radius) {
        const auto known = std::ranges::lower_bound(became, radius, {}, &std::pair<float, float>::first);
        if (known != became.end() && known->first == radius) return known->second;
        const auto [from, to] = std::ranges::equal_range(radii, radius);
        const double share =
                         .5 * double((from - radii.begin()) + (to - radii.begin())) / double(radii.size()),
                     wanted = .5 * gauge.at_share(share);
        const double mixed = radius > 0.f && wanted > 0.
                                 ? double(radius) * std::pow(wanted / double(radius), gauge.even)
                                 : double(radius);
        return became.insert(known, {radius, float(.5 * gauge.nearest(2. * mixed))})->second;
      };
      for (Drawn& d : drawn_)
        if (d.gauge == g) d.radius = evened(d.radius), d.start_radius = evened(d.start_radius);
    }
  }

  void trace(const Module& m) {
    auto values = tracing_values;
    std::ranges::copy(word_.of(m), values.begin());
    const auto told = std::bit_cast<Tracing>(values);
    const lsystem::Trace& t = branch(told.sample, told.row, told.branch);
    const lsystem::Trace& calibre = branch(told.sample, told.like < 0. ? told.row : told.like, told.branch);
    const double scale = told.scale;
    const auto mirror = int(told.mirror);
    const Eigen::Vector3d sides(mirror & 1 ? -1. : 1., 1., (mirror & 2 ? -1. : 1.) * told.steep);
    const auto mirrored = [&](const Vec3& v) {
      return Eigen::Vector3d(sides.cwiseProduct(v.cast<double>()));
    };
    const Eigen::Vector3d before = mirrored(t.heading), heading = state_.frame.col(0), from = state_.position;
    const double across = before.x() * heading.y() - before.y() * heading.x(),
                 along = before.x() * heading.x() + before.y() * heading.y();
    // Two that head nearly along z hardly have an angle about it.
    const double level = before.head<2>().norm() * heading.head<2>().norm();
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(
        level * told.turn * std::atan2(across, along) + told.about * (std::numbers::pi / 180.),
        Eigen::Vector3d::UnitZ()));
    // A branch that is level all along is not drawn aside along z, nor one with steps that are level by changing these.
    const double climbing = told.climbing, levelled = std::clamp(told.levelled, -1., 1.),
                 kept = climbing * (1. + std::min(levelled, 0.));
    const Eigen::Vector3d aside(told.x, told.y, (t.level ? 1. - kept : 1.) * told.z);
    const auto place = [&](const Vec3& at) { return Eigen::Vector3d(from + turn * (scale * mirrored(at))); };
    const double thickness = told.thickness, thickness_end = told.last < 0. ? thickness : told.last;
    // How many times as thick: from the first to the last as the diameter itself changes, so that what is as thick as what was
    // before it remains so.
    const bool changes = thickness_end != thickness && thickness > 0.;
    float changed = 0.f;  // times is of this share
    double times = thickness;
    const auto thick = [&](float diameter, float part) {
      if (changes && part != changed)
        times = thickness * std::pow(thickness_end / thickness, double(changed = part));
      return std::max(told.thinnest, times * double(diameter));
    };
    const bool free = state_.avoid < 0.;
    Eigen::Vector3d slip = Eigen::Vector3d::Zero();  // by what it avoided
    if (answers_ && free) {
      line_to(place(t.end()) + aside, 0.f);
    } else {
      if (free && !t.last_step.isZero(0.f)) approach((turn * mirrored(t.last_step)).stableNormalized());
      const std::uint32_t begun = state_.node == none ? std::uint32_t(drawn_.size()) : state_.node;
      Course course(t, float(scale));
      course.levels(float(levelled));
      if (told.stairs != 1.) course.stairs(float(told.stairs));
      if (told.kinked != 1. || told.kinks != 1.) course.kinks(float(told.kinked), float(told.kinks));
      const float whole = course.length();
      const std::vector<Calibre> diameters = calibres(calibre, course.lengths);
      float way = 0.f;
      const double along_z = scale * sides.z();
      const std::vector<float> heights =
          course.climbed(climbing > 0. && along_z != 0. ? float(aside.z() / along_z) : 0.f);
      const double thickness_last = thick(diameters.back().diameter, diameters.back().change);
      double thickness_before = thick(calibre.diameter, 0.f), drawn_before = gauged(thickness_before);
      for (std::size_t i = 0; i < course.places.size(); ++i) {
        const float part = whole > 0.f ? course.lengths[i] / whole : 1.f;
        const float step_length = float(scale) * (course.lengths[i] - std::exchange(way, course.lengths[i]));
        const double most = double(calibre.steepest) * double(step_length);
        double thickness_here = thick(diameters[i].diameter, diameters[i].change);
        const bool inner = calibre.steepest > 0.f && i > 0 && i + 1 < course.places.size();
        // As fast as it may change, it has to come to its end.
        const double left = double(calibre.steepest) * scale * double(whole - course.lengths[i]);
        if (inner) {
          thickness_here = std::clamp(thickness_here, thickness_before - most, thickness_before + most);
          thickness_here = std::clamp(thickness_here, thickness_last - left, thickness_last + left);
        }
        const auto start = float(0.5 * drawn_before);
        state_.diameter = gauged(thickness_here);
        if (inner && std::abs(state_.diameter - drawn_before) > most &&
            std::abs(drawn_before - thickness_last) <= left)
          state_.diameter = drawn_before;
        const Vec3 on_chord = t.end() * part;
        Eigen::Vector3d next =
            place(on_chord + float(told.bent) * (course.places[i] - on_chord)) + double(part) * aside;
        next.z() += climbing * (from.z() + along_z * double(heights[i]) - next.z());
        if (!free) {
          const Eigen::Vector3d wanted = next + slip - state_.position,
                                step = clear(wanted, std::max(double(start), 0.5 * state_.diameter));
          slip += step - wanted;
          next = state_.position + step;
          if (step.isZero(0.)) continue;
        }
        line_to(next, start);
        thickness_before = thickness_here, drawn_before = state_.diameter;
      }
      state_.begun = begun;
    }
    state_.diameter = gauged(thick(calibre.stops.back().diameter, 1.f));
    const double length = scale * double(t.length());
    if (t.ahead.isZero(0.f) || !(length > 0.)) return;
    head((turn * mirrored(t.ahead) + aside / length).stableNormalized());
    state_.step = (turn * mirrored(t.own_last) + aside / length).stableNormalized();
  }

  /// Turns the end of the traced branch that leads here so that its last step has this direction: how a fork stands on the step
  /// before it belongs to the fork. The turn fades over the steps before; what lies farther away stays.
  void approach(const Eigen::Vector3d& direction) {
    constexpr double reach = 10.;  // µm
    if (state_.node == none || state_.begun == none) return;
    const Eigen::Vector3d end = drawn_[state_.node].position;
    std::uint32_t node = drawn_[state_.node].parent;
    // How the branch itself left the fork before it belongs to that one.
    const auto first = [&](std::uint32_t n) { return n == state_.begun || drawn_[n].parent == state_.begun; };
    if (node == none || first(node)) return;
    const Eigen::Vector3d step = end - drawn_[node].position;
    if (step.isZero(0.)) return;
    // Turned about z; as steep as it should be then, as far as steps before it that are not level can make up for that.
    std::vector<std::uint32_t> nodes;
    std::vector<double> ways, sloping;  // back to each, and how long the step to it is unless that is level
    const double length = step.norm();
    for (double way = 0.;
         !first(node) && drawn_[node].parent != none && drawn_[node].children == 1 && way < reach;) {
      nodes.push_back(node), ways.push_back(way);
      const Eigen::Vector3d back = drawn_[node].position - drawn_[drawn_[node].parent].position;
      sloping.push_back(std::abs(back.z()) > as_high ? back.norm() : 0.);
      way += back.norm(), node = drawn_[node].parent;
    }
    const double along = std::reduce(sloping.begin(), sloping.end()), level = direction.head<2>().norm(),
                 was = step.head<2>().norm();
    const double angle = level > 0. && was > 0.
                             ? std::atan2(step.x() * direction.y() - step.y() * direction.x(),
                                          step.head<2>().dot(direction.head<2>()))
                             : 0.;
    const double lower = std::clamp(step.z() - length * direction.z(), -along / 2., along / 2.);
    const double wide = std::sqrt(std::max(0., length * length - std::pow(step.z() - lower, 2)));
    const Eigen::Vector2d out =
        level > 0. ? Eigen::Vector2d((was - wide) / level * direction.head<2>()) : Eigen::Vector2d::Zero();
    double left = lower;
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      Eigen::Vector3d& place = drawn_[nodes[i]].position;
      const double share = 1. - ways[i] / reach;
      place.head<2>() =
          (end + Eigen::AngleAxisd(share * angle, Eigen::Vector3d::UnitZ()) * (place - end)).head<2>() +
          share * out;
      place.z() += left;
      if (along > 0.) left -= lower * sloping[i] / along;
    }
  }

  void head(const Eigen::Vector3d& direction) {
    if (direction.isZero(0.)) return;
    state_.frame = Eigen::Quaterniond::FromTwoVectors(state_.frame.col(0), direction) * state_.frame;
    state_.frame.col(0) = direction;
  }

  template <class Vector>
  void tell(const Module& m, const Vector& answer) {  // as much of it as is asked
    if (answers_) std::copy_n(answer.data(), std::size_t(m.count), answers_->begin() + m.first);
  }
  static Eigen::Vector4d with_direction(double number, const Eigen::Vector3d& direction) {
    return {number, direction.x(), direction.y(), direction.z()};
  }

  void spiny(const std::array<double, 6>& told) {
    const double density = told[0];
    if (!(*std::ranges::min_element(told.begin(), told.end() - 1) >= 0.))
      fail("Spiny has a parameter below 0");
    constexpr double most = 100.;  // per µm: hundreds of times what any dendrite bears
    if (density > most) fail(fmt::format("Spiny({:g}) asks for more than {:g} spines per µm", density, most));
    state_.spines = 0;
    if (density == 0. || answers_) return;
    spines_.emplace_back(told);
    state_.spines = std::uint32_t(spines_.size() - 1);
  }

  // A root of one point. Somata are kept together by their soma; this keeps together what has none.
  void begin(double diameter) {
    state_.diameter = std::max(0., diameter);
    if (answers_) return;
    const auto radius = float(0.5 * state_.diameter);
    drawn_.push_back(
        {state_.position, radius, radius, none, 0, state_.tag, state_.kind, state_.gauge, state_.spines});
    state_.node = std::uint32_t(drawn_.size() - 1);
  }

  void move(double length) {
    if (length != 0.) stand(state_.position + length * state_.frame.col(0));
  }
  void stand(const Eigen::Vector3d& place) {
    if (place == state_.position) return;
    state_.position = place;
    state_.node = none;
  }

  void soma(double diameter, const std::array<double, 4>& outline) {
    if (soma_) fail("there are two somata; a neuron has one");
    if (!(diameter >= 0.)) fail("the soma has a negative diameter");
    must_be_size(diameter);
    soma_ = Point{float(state_.position.x()), float(state_.position.y()), float(state_.position.z()),
                  float(0.5 * diameter)};
    soma_place_ = state_.position;
    double bent = 0.;
    for (const double one : outline) bent += std::abs(one);
    if (!(bent < 1.))
      fail(
          fmt::format("the soma's outline may reach its middle; what makes it not round must add up to less "
                      "than 1, and is {:g}",
                      bent));
    outline_ = outline;
  }
  Soma soma() const {
    if (outline_ == std::array<double, 4>{})
      return {.kind = SomaKind::sphere, .points = {*soma_}, .parents = {}, .contour_starts = {}};
    return outlined_soma(*soma_, outline_);
  }

  void become(SectionKind kind) { state_.kind = kind, state_.tag = std::int32_t(kind); }
  void become_numbered(double number) {
    if (!(number >= 0. && number <= 1e6 && number == std::floor(number)))
      fail(fmt::format("Kind({:g}) is no SWC type, which is a whole number from 0 on", number));
    const auto tag = std::int32_t(number);
    constexpr SectionKind known[] = {SectionKind::axon,     SectionKind::basal, SectionKind::apical,
                                     SectionKind::custom,   SectionKind::glia,  SectionKind::unspecified,
                                     SectionKind::undefined};
    const auto kind = std::ranges::find(known, tag, [](SectionKind k) { return std::int32_t(k); });
    state_.kind = kind == std::end(known) ? SectionKind::custom : *kind;
    state_.tag = tag;
  }

  // A section runs on while a point has one drawn daughter, which is the next point, of the same kind.
  Morphology build(const Annotations& annotations) {
    MorphologyBuilder builder;
    if (soma_) builder.set_soma(soma());
    const auto point = [](const Drawn& d, float radius) {
      return Point{float(d.position.x()), float(d.position.y()), float(d.position.z()), radius};
    };
    builder.reserve(drawn_.size() / 4, drawn_.size() + drawn_.size() / 4);
    std::vector<SectionId> section_of(drawn_.size());
    std::vector<Point> points;
    for (std::uint32_t i = 0; i < drawn_.size();) {
      points.clear();
      SectionId parent;
      const std::uint32_t begin = i;
      if (const Drawn& first = drawn_[i]; first.parent != none) {
        parent = section_of[first.parent];
        points.push_back(point(drawn_[first.parent], first.start_radius));
      }
      for (;; ++i) {
        points.push_back(point(drawn_[i], drawn_[i].radius));
        const bool goes_on = i + 1 < drawn_.size() && drawn_[i + 1].parent == i && drawn_[i].children == 1 &&
                             drawn_[i + 1].kind == drawn_[i].kind && drawn_[i + 1].tag == drawn_[i].tag;
        if (!goes_on) break;
      }
      const SectionId id = builder.add_section(parent, drawn_[begin].kind, points, drawn_[begin].tag,
                                               parent.valid() || !soma_ ? -1 : 0);
      for (std::uint32_t k = begin; k <= i; ++k) section_of[k] = id;
      double along = 0.;
      for (std::size_t k = 1; spines_.size() > 1 && k < points.size(); ++k) {
        const Drawn& end = drawn_[i - (points.size() - 1 - k)];
        if (end.spines != 0) spines_[end.spines].stand(builder, id, points[k - 1], points[k], along);
        along += double((points[k].position() - points[k - 1].position()).norm());
      }
      ++i;
    }
    for (const auto& [key, value] : annotations) builder.annotate(key, value);
    return builder.build();
  }

  const Word& word_;
  const Grammar& grammar_;
  State state_;
  std::vector<State> stack_;
  std::vector<Drawn> drawn_;
  std::vector<Gauge> gauges_{{}};           // the first: none
  std::vector<Spines> spines_{Spines()};    // likewise
  std::vector<double>* answers_ = nullptr;  // then nothing is drawn
  std::optional<Point> soma_;
  std::array<double, 4> outline_{};
  Eigen::Vector3d soma_place_ = Eigen::Vector3d::Zero();
  const cortex::Environment& environment_;
  Eigen::Vector3d at_;  // of the turtle's origin in the tissue
  Obstacles obstacles_;
};

}  // namespace

std::span<const TurtleSymbol> turtle_symbols() { return symbol_table; }

Morphology interpret(const Word& word, const Grammar& grammar, const Annotations& annotations,
                     const cortex::Site& site) {
  return Turtle(word, grammar, site).draw(annotations);
}

bool heeds_surroundings(const Grammar& grammar) {
  const auto heeds = [](const Shape& s) {
    return s.symbol < turtle_symbols().size() && turtle_symbols()[s.symbol].action >= Action::avoid;
  };
  return grammar.queries || std::ranges::any_of(grammar.axiom, heeds) ||
         std::ranges::any_of(grammar.productions,
                             [&](const Production& p) { return std::ranges::any_of(p.successor, heeds); });
}

void answer(Word& word, const Grammar& grammar, const cortex::Site& site) {
  Turtle(word, grammar, site).answer(word.parameters);
}

}  // namespace forest::lsystem
