// SPDX-License-Identifier: Apache-2.0
#include "apps/studio/target_list.h"

#include <algorithm>

#include <fmt/format.h>

#include "forest/core/error.h"

namespace forest::studio {
namespace {

using frame::State;
using scene::Appearance;
using scene::ColourBy;

// Okabe & Ito's colours.
constexpr TargetColour colour_table[] = {
    {"As the view", {}, {}},
    {"Orange", 0xE69F00, {}},
    {"Sky blue", 0x56B4E9, {}},
    {"Green", 0x009E73, {}},
    {"Yellow", 0xF0E442, {}},
    {"Blue", 0x0072B2, {}},
    {"Vermilion", 0xD55E00, {}},
    {"Purple", 0xCC79A7, {}},
    {"Grey", 0x8A93A0, {}},
    {"By cell type", {}, ColourBy::type},
    {"By layer", {}, ColourBy::layer},
    {"By kind of branch", {}, ColourBy::kind},
    {"By neuron", {}, ColourBy::neuron},
    {"By depth", {}, ColourBy::depth},
};
constexpr const char* kind_table[] = {"By size",      "Dots", "Lines", "Capsules",
                                      "Somata alone", "Skin", "Bricks"};

bool same(const Appearance& a, const Appearance& b) { return a.name == b.name && a.branch == b.branch; }

Appearance named(const std::string& name) {
  Appearance a;
  a.name = name;
  return a;
}

bool says_nothing(const Appearance& a) {
  Appearance bare = named(a.name);
  bare.branch = a.branch;
  return a == bare;
}

void show_state(const State& state, TargetRow& row) {
  row.kind = state.kind;
  row.opacity = float(state.opacity) / 255.f;
  row.simulated = state.is(State::simulated);
}

// Colours of branches that are seen, in the order of the classes.
void show_colours(std::uint32_t classes, const scene::Colouring& colouring, TargetRow& row) {
  for (std::uint32_t c = 0; c < scene::colour_classes; ++c) {
    if (!(classes >> c & 1) || colouring.gauged >> c & 1) continue;
    const Vec3& colour = colouring.palette[8u * c + std::uint32_t(SectionKind::apical)];
    if (std::ranges::find(row.colours, colour) == row.colours.end()) row.colours.push_back(colour);
  }
}

void show_members(const circuit::Members& members, const scene::Colouring& colouring, TargetRow& row) {
  std::size_t visible = 0;
  std::uint32_t classes = 0;  // bits of those that are seen
  const State* first = nullptr;
  for (const std::uint32_t i : members) {
    const State& state = colouring.states[i];
    if (state.is(State::visible)) ++visible, classes |= 1u << state.colour_class;
    if (!first || (!first->is(State::visible) && state.is(State::visible))) first = &state;
  }
  row.count = members.size();
  row.seen = visible == 0                ? TargetRow::Seen::none
             : visible == members.size() ? TargetRow::Seen::all
                                         : TargetRow::Seen::some;
  show_colours(classes, colouring, row);
  if (first) show_state(*first, row);
}

TargetRow row_of(const scene::Targets& targets, const scene::Colouring& colouring, const std::string& name,
                 const std::string& origin) {
  TargetRow row{.who = named(name), .title = name, .origin = origin, .colours = {}, .problem = ""};
  try {
    show_members(targets.find(name), colouring, row);
  } catch (const Error& error) {
    row.problem = error.what();
  }
  return row;
}

TargetRow row_of(const scene::Branch& branch, const scene::Colouring& colouring) {
  TargetRow row{.who = {}, .title = "", .origin = "selection", .colours = {}, .problem = ""};
  row.who.branch = branch;
  const bool whole = branch.section == scene::soma_section;
  row.title = whole ? fmt::format("Neuron {}", branch.neuron)
                    : fmt::format("Neuron {}, section {} and its branches", branch.neuron, branch.section);
  State state = colouring.states[branch.neuron];
  for (const scene::Part& part : colouring.parts)
    if (part.instance == branch.neuron && part.section == branch.section) state = part.state;
  row.count = 1;
  row.seen = state.is(State::visible) ? TargetRow::Seen::all : TargetRow::Seen::none;
  if (row.seen == TargetRow::Seen::all) show_colours(1u << state.colour_class, colouring, row);
  show_state(state, row);
  return row;
}

}  // namespace

std::vector<TargetRow> target_rows(const scene::Targets& targets, const scene::View& view,
                                   const scene::Colouring& colouring,
                                   const std::optional<scene::Branch>& selected) {
  std::vector<TargetRow> rows;
  if (selected) rows.push_back(row_of(*selected, colouring));
  const std::size_t first = rows.size();
  const std::vector<scene::TargetFacts> known = targets.list();
  for (const Appearance& a : view.targets)
    if (!a.branch && std::ranges::find(known, a.name, &scene::TargetFacts::name) == known.end() &&
        std::ranges::find(rows.begin() + std::ptrdiff_t(first), rows.end(), a.name, &TargetRow::title) ==
            rows.end())
      rows.push_back(row_of(targets, colouring, a.name, "expression"));
  for (const scene::TargetFacts& facts : known) {
    // A name that means two things is asked for by what it is.
    const bool shared = std::ranges::count(known, facts.name, &scene::TargetFacts::name) > 1;
    const std::string asked =
        shared ? (facts.origin == "node set" ? "set" : facts.origin) + ":" + facts.name : facts.name;
    rows.push_back(row_of(targets, colouring, asked, facts.origin));
    rows.back().title = facts.name;
  }
  return rows;
}

void change_target(scene::View& view, const Appearance& who, const Appearance& what, bool own_colour) {
  std::vector<Appearance>& all = view.targets;
  for (Appearance& a : all) {
    if (!same(a, who)) continue;
    if (what.visible) a.visible.reset();
    if (what.simulated) a.simulated.reset();
    if (what.kind) a.kind.reset();
    if (what.opacity) a.opacity.reset();
    if (what.colour || what.colour_by || !own_colour) a.colour.reset(), a.colour_by.reset();
  }
  std::erase_if(all, says_nothing);
  if (says_nothing(what)) return;
  if (all.empty() || !same(all.back(), who)) {
    Appearance fresh;
    fresh.name = who.name, fresh.branch = who.branch;
    all.push_back(fresh);
  }
  Appearance& last = all.back();
  if (what.visible) last.visible = what.visible;
  if (what.simulated) last.simulated = what.simulated;
  if (what.kind) last.kind = what.kind;
  if (what.opacity) last.opacity = what.opacity;
  if (what.colour) last.colour = what.colour;
  if (what.colour_by) last.colour_by = what.colour_by;
}

void show_only(scene::View& view, const Appearance& all, const Appearance& who) {
  Appearance hidden, seen;
  hidden.visible = false, seen.visible = true;
  for (Appearance& a : view.targets) a.visible.reset();
  std::erase_if(view.targets, says_nothing);
  change_target(view, all, hidden);
  change_target(view, who, seen);
}

void show_all(scene::View& view) {
  for (Appearance& a : view.targets) a.visible.reset();
  std::erase_if(view.targets, says_nothing);
}

std::span<const TargetColour> target_colours() { return colour_table; }
std::span<const char* const> kind_words() { return kind_table; }

}  // namespace forest::studio
