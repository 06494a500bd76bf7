// SPDX-License-Identifier: Apache-2.0
#include "forest/lsystem/turtle.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/lsystem/body.h"
#include "forest/lsystem/drawing.h"
#include "forest/lsystem/exclusion.h"
#include "forest/lsystem/traced_branch.h"
#include "forest/lsystem/wanderer.h"

namespace forest::lsystem {

Stance::Stance() {
  frame.col(0) = Eigen::Vector3d::UnitY();
  frame.col(1) = -Eigen::Vector3d::UnitX();
  frame.col(2) = Eigen::Vector3d::UnitZ();
}

class Turtle {
 public:
  enum class Purpose { drawing, answering };

  Turtle(const Grammar& grammar, const cortex::Site& site, Purpose purpose)
      : draws_(purpose == Purpose::drawing),
        grammar_(grammar),
        environment_(site.environment ? *site.environment : nothing()),
        at_(site.at.cast<double>()) {}

  Morphology draw(const Word& word, const Annotations& annotations) {
    drawn_.reserve(word.modules.size() / 2);
    for (const Module& m : word.modules) act(m.symbol, word.of(m));
    if (!stack_.empty()) fail("a branch is not closed");
    drawn_.even_out();
    return drawn_.build(soma_ ? std::optional(soma()) : std::nullopt, annotations);
  }

  const Stance& stance() const { return state_; }
  void return_to(const Stance& stance) { state_ = stance; }
  bool has_soma() const { return soma_.has_value(); }

  // An answer is written where it is wanted, as much of it as there is room for.
  void act(Symbol module, std::span<const double> values, std::span<double> wanted = {}) {
    const Symbol drawn_as = grammar_.drawn_as[module];
    if (drawn_as >= symbols_.size()) return;
    const TurtleSymbol& symbol = symbols_[drawn_as];
    if (is_question(symbol.action) && wanted.empty()) return;
    const auto parameter = [&](std::size_t i, double otherwise) {
      if (i >= values.size()) return otherwise;
      if (!std::isfinite(values[i]))
        fail(fmt::format("module {} has a parameter that is not finite", symbol.symbol));
      return values[i];
    };
    const auto usual = [&](std::size_t i) {
      return parameter(i, symbol.defaults[i - std::size_t(symbol.least)]);
    };
    const auto towards = [&](const Eigen::Vector3d& otherwise) {
      return values.size() > 1 ? direction(parameter(1, 0.), parameter(2, 0.), parameter(3, 0.)) : otherwise;
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
        state_.towards = towards(Eigen::Vector3d::UnitY());
        return;
      case Action::flat:
        state_.flat = parameter(0, 0.);
        state_.across = towards(Eigen::Vector3d::UnitZ());
        return;
      case Action::outward:
        state_.outward = parameter(0, 0.);
        return;
      case Action::soma:
        return soma(parameter(0, 0.), {usual(1), usual(2), usual(3), usual(4)});
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
        return trace(values);
      case Action::gauge:
        state_.pen.gauge = gauge(parameter(0, 0.), parameter(1, 0.), parameter(2, 0.));
        return;
      case Action::spiny:
        return spiny({parameter(0, 0.), usual(1), usual(2), usual(3), usual(4), usual(5)});
      case Action::avoid:
        state_.avoid = parameter(0, 0.);
        return;
      case Action::seek:
        state_.seek = parameter(0, 0.);
        return;
      case Action::shun:
        state_.shun = parameter(0, 0.);
        state_.shun_reach = std::max(1e-6, usual(1));
        return;
      case Action::ask_place:
        return tell(wanted, Eigen::Vector3d(state_.position - soma_place_));
      case Action::ask_heading:
        return tell(wanted, Eigen::Vector3d(state_.frame.col(0)));
      case Action::ask_step:
        return tell(wanted, state_.step);
      case Action::ask_depth: {
        const auto stratum = environment_.stratum(here());
        return tell(wanted,
                    Eigen::Vector4d(environment_.depth(here()), stratum.layer, stratum.above, stratum.below));
      }
      case Action::ask_near: {
        const auto nearest = environment_.nearest_soma(here(), at_);
        return tell(wanted, with_direction(nearest.distance, nearest.direction));
      }
      case Action::ask_attraction: {
        const auto field = environment_.field(here());
        return tell(wanted, with_direction(field.density, field.direction));
      }
    }
  }

 private:
  static const cortex::Environment& nothing() {
    static const cortex::Environment empty;
    return empty;
  }

  [[noreturn]] void fail(std::string_view what) const {
    throw Error(fmt::format("{}: {}; mend the grammar", grammar_.file, what));
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
    if (soma_) obstacles_.balls.push_back({soma_place_, soma_reach_ + apart});
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
    if (!draws_) return;
    if (state_.spines > 0.) bear(state_.spines * (place - from).norm());
    if (state_.node == Drawing::none) state_.node = drawn_.begin(from, start_radius, state_.pen);
    state_.node = drawn_.line(state_.node, place, start_radius, float(0.5 * state_.diameter), state_.pen);
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
    return drawn_.add_gauge(stops, std::clamp(even, 0., 1.));
  }

  void trace(std::span<const double> values) {
    const Tracing told = Tracing::told(values);
    if (!(told.mirror >= 0. && told.mirror <= 3. && told.mirror == std::floor(told.mirror)))
      fail(fmt::format("Trace has mirror {:g}, which is 0, 1, 2 or 3", told.mirror));
    const lsystem::Trace &way = branch(told.sample, told.row, told.branch),
                         &calibre = branch(told.sample, told.like < 0. ? told.row : told.like, told.branch);
    TracedBranch traced(told, way, calibre, drawn_.gauge(state_.pen.gauge), state_.position,
                        state_.frame.col(0));
    if (!draws_ && state_.avoid < 0.)
      line_to(traced.end(), 0.f);
    else
      follow(traced);
    state_.diameter = traced.last_diameter();
    const auto ahead = traced.ahead();
    if (!ahead) return;
    head(ahead->heading);
    state_.step = ahead->step;
  }

  void follow(TracedBranch& traced) {
    const bool free = state_.avoid < 0.;
    const auto before = free ? traced.step_before() : std::nullopt;
    if (before && state_.node != Drawing::none && state_.begun != Drawing::none)
      drawn_.approach(state_.begun, state_.node, *before);
    const Drawing::Node begun = state_.node == Drawing::none ? drawn_.next() : state_.node;
    Eigen::Vector3d slip = Eigen::Vector3d::Zero();  // by what it avoided
    traced.follow();
    for (std::size_t i = 0; i < traced.stops(); ++i) {
      const TracedBranch::Stop stop = traced.stop(i);
      state_.diameter = stop.diameter;
      Eigen::Vector3d next = stop.place;
      if (!free) {
        const Eigen::Vector3d wanted = next + slip - state_.position,
                              step = clear(wanted, .5 * std::max(stop.start, stop.diameter));
        slip += step - wanted;
        next = state_.position + step;
        if (step.isZero(0.)) continue;
      }
      line_to(next, float(.5 * stop.start));
      traced.drew(stop);
    }
    state_.begun = begun;
  }

  void head(const Eigen::Vector3d& direction) {
    if (direction.isZero(0.)) return;
    state_.frame = Eigen::Quaterniond::FromTwoVectors(state_.frame.col(0), direction) * state_.frame;
    state_.frame.col(0) = direction;
  }

  template <class Vector>
  static void tell(std::span<double> wanted, const Vector& answer) {
    std::copy_n(answer.data(), wanted.size(), wanted.begin());
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
    state_.pen.spines = 0, state_.spines = density;
    if (density == 0. || !draws_) return;
    state_.pen.spines = drawn_.add_spines(Spines(told));
  }
  void bear(double spines) {
    constexpr double most = 1e7;  // tens of times what any neuron bears
    if (!((borne_ += spines) <= most))
      fail(fmt::format("Spiny asks for more than {:.0f} spines on one neuron", most));
  }

  // A root of one point. Somata are kept together by their soma; this keeps together what has none.
  void begin(double diameter) {
    state_.diameter = std::max(0., diameter);
    if (!draws_) return;
    state_.node = drawn_.begin(state_.position, float(0.5 * state_.diameter), state_.pen);
  }

  void move(double length) {
    if (length != 0.) stand(state_.position + length * state_.frame.col(0));
  }
  void stand(const Eigen::Vector3d& place) {
    if (place == state_.position) return;
    state_.position = place;
    state_.node = Drawing::none;
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
    soma_reach_ = double(soma_->radius) * (1. + bent);
  }
  Soma soma() const {
    if (outline_ == std::array<double, 4>{})
      return {.kind = SomaKind::sphere, .points = {*soma_}, .parents = {}, .contour_starts = {}};
    return outlined_soma(*soma_, outline_);
  }

  void become(SectionKind kind) { state_.pen.kind = kind, state_.pen.tag = std::int32_t(kind); }
  void become_numbered(double number) {
    if (!(number >= 0. && number <= 1e6 && number == std::floor(number)))
      fail(fmt::format("Kind({:g}) is no SWC type, which is a whole number from 0 on", number));
    const auto tag = std::int32_t(number);
    constexpr SectionKind known[] = {SectionKind::axon,     SectionKind::basal, SectionKind::apical,
                                     SectionKind::custom,   SectionKind::glia,  SectionKind::unspecified,
                                     SectionKind::undefined};
    const auto kind = std::ranges::find(known, tag, [](SectionKind k) { return std::int32_t(k); });
    state_.pen.kind = kind == std::end(known) ? SectionKind::custom : *kind;
    state_.pen.tag = tag;
  }

  const std::span<const TurtleSymbol> symbols_ = turtle_symbols();
  const bool draws_;
  const Grammar& grammar_;
  Stance state_;
  std::vector<Stance> stack_;
  Drawing drawn_;
  std::optional<Point> soma_;
  std::array<double, 4> outline_{};
  double soma_reach_ = 0.;  // from its middle, of the place of its outline that is farthest at most
  double borne_ = 0.;       // spines, in the mean
  Eigen::Vector3d soma_place_ = Eigen::Vector3d::Zero();
  const cortex::Environment& environment_;
  Eigen::Vector3d at_;  // of the turtle's origin in the tissue
  Obstacles obstacles_;
};

Wanderer::Wanderer(const Grammar& grammar, const cortex::Site& site)
    : turtle_(std::make_unique<Turtle>(grammar, site, Turtle::Purpose::answering)) {}
Wanderer::~Wanderer() = default;
const Stance& Wanderer::stance() const { return turtle_->stance(); }
void Wanderer::return_to(const Stance& stance) { turtle_->return_to(stance); }
bool Wanderer::has_soma() const { return turtle_->has_soma(); }
void Wanderer::act(Symbol symbol, std::span<double> parameters) {
  turtle_->act(symbol, parameters, parameters);
}

Morphology interpret(const Word& word, const Grammar& grammar, const Annotations& annotations,
                     const cortex::Site& site) {
  return Turtle(grammar, site, Turtle::Purpose::drawing).draw(word, annotations);
}

bool heeds_surroundings(const Grammar& grammar) {
  const auto heeds = [](const Shape& s) {
    return s.symbol < turtle_symbols().size() && turtle_symbols()[s.symbol].action >= Action::avoid;
  };
  return grammar.queries || std::ranges::any_of(grammar.axiom, heeds) ||
         std::ranges::any_of(grammar.productions,
                             [&](const Production& p) { return std::ranges::any_of(p.successor, heeds); });
}

}  // namespace forest::lsystem
