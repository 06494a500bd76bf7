// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/playback.h"

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/parallel.h"
#include "forest/scene/pick.h"

namespace forest::scene {
namespace {

using reports::Level;

constexpr std::uint32_t none = 0xffffffffu;
constexpr float dimmest = 1.f / float(flash_steps);  // of a flash that is still drawn …
constexpr float dimmest_over_value = .4f;            // … over a branch whose own value would be seen

// Of the marks of spikes alone.
constexpr float dimmest_mark = .15f, fading = .55f;  // brightness of the last that is seen; of fading_entry
constexpr float least_branch = 1.f / 1000.f,
                least_soma = 1.f / 260.f;  // radius of a new mark at least, in heights of the picture
constexpr float through = .3f;             // marks are drawn at this share of their distance

using Clock = std::chrono::steady_clock;
double milliseconds_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

// Calls take(at, instance, first, count) for what an item draws: segments that follow one another, those between that are not
// drawn too, of which the first is number `at` of the item; straws are of a neuron each, and have the colour of the segment
// that they come from.
void each_run(const frame::Geometry& geometry, const frame::Item& item, auto&& take) {
  if (!geometry.straw(item)) {
    take(0, item.instance, item.first_segment, std::uint32_t(std::bit_width(item.drawn)));
    return;
  }
  for (std::uint32_t drawn = item.drawn; drawn; drawn &= drawn - 1) {
    const auto at = std::uint32_t(std::countr_zero(drawn));
    const frame::Owner& owner = geometry.owner(item.first_segment + std::size_t(at));
    take(at, owner.instance, owner.segment, 1);
  }
}

// Whether segments [first, first + count) are among `size` of a shape that begins at `begin`.
bool within(std::uint32_t first, std::uint32_t count, std::uint32_t begin, std::size_t size) {
  return first >= begin && std::size_t(first - begin) + count <= size;
}

// Of the neuron that stands out, and of all others.
std::array<std::uint8_t, 256> entries_of(const reports::Range& range, const ActivityView& view, bool others) {
  const std::uint32_t steps = view.neuron ? half_map_steps : map_steps,
                      first = view.neuron && others ? steps : 0;
  std::array<std::uint8_t, 256> entries;
  entries.fill(std::uint8_t(no_value_entry));
  for (std::size_t code = 0; code < reports::no_value; ++code) {
    const float value = range.value(reports::Code(code));
    const float at = std::clamp((value - view.low) / (view.high - view.low), 0.f, 1.f);
    entries[code] = std::uint8_t(view.threshold && value < *view.threshold
                                     ? below_entry
                                     : first + std::uint32_t(std::lround(at * float(steps - 1))));
  }
  return entries;
}

}  // namespace

Playback::Playback(Forest forest, reports::Activity activity, const std::string& name)
    : forest_(std::move(forest)), activity_(std::move(activity)) {
  const auto refuse = [&](const std::string& what) {
    throw InputError(name, 0, what + "; make the activity file and the forest file from the same circuit");
  };
  const auto neurons = forest_.neurons();
  const auto& names = forest_.circuit().morphologies;
  const reports::Facts& facts = activity_.facts();
  if (facts.instances != forest_.instances().size())
    refuse(fmt::format("is of the circuit '{}' with {} neurons and the forest has {}", facts.circuit,
                       facts.instances, forest_.instances().size()));
  row_of_.assign(forest_.instances().size(), none);
  for (std::uint32_t r = 0; r < activity_.rows().size(); ++r) {
    const reports::Row& row = activity_.rows()[r];
    const std::uint32_t shape = activity_.layout(row.layout).morphology;
    if (row.instance >= row_of_.size())
      refuse(fmt::format("names neuron {} and the forest has {}", row.instance, row_of_.size()));
    const std::uint32_t planted = forest_.instances()[row.instance].morphology;
    if (shape != planted)
      refuse(fmt::format("has shape {} for neuron {}, which in the forest has shape {}, '{}'", shape,
                         row.instance, planted, names[planted]));
    row_of_[row.instance] = r;
  }
  for (std::size_t l = 0; l < activity_.layout_count(); ++l) {
    const auto layout = activity_.layout(std::uint32_t(l));
    if (layout.morphology >= neurons.size())
      refuse(fmt::format("names shape {} and the forest has {}", layout.morphology, neurons.size()));
    for (const reports::SectionRun& run : layout.sections)
      if (run.section != reports::soma_run && run.section >= neurons[layout.morphology].section_count)
        refuse(fmt::format("names section {} of '{}', which has {} in the forest", run.section,
                           names[layout.morphology], neurons[layout.morphology].section_count));
  }

  shapes_.resize(neurons.size());
  parallel_for(shapes_.size(), 1, [&](std::size_t i) {
    const Neuron& n = neurons[i];
    Shape& shape = shapes_[i];
    shape.first_segment = n.first_segment;
    const std::uint32_t count = end_of(forest_, n) - n.first_segment;
    shape.distance.assign(count, -1.f);
    for (std::uint32_t s = 0; s < count; ++s) {
      const reports::Place& place = forest_.places()[n.first_segment + s];
      if (place.section == soma_section) shape.distance[s] = 0.f;
      if (place.section >= n.section_count) continue;
      const SectionFacts& section = forest_.sections()[n.first_section + place.section];
      if (section.kind == std::uint32_t(SectionKind::axon))
        shape.distance[s] = std::max(0.f, section.path_distance - (1.f - place.position) * section.length);
    }
  });
  for (const Shape& shape : shapes_)
    for (const float d : shape.distance) farthest_ = std::max(farthest_, d);

  tables_.resize(activity_.layout_count());
  parallel_for(tables_.size(), 1, [&](std::size_t l) {
    const auto layout = activity_.layout(std::uint32_t(l));
    const Neuron& n = neurons[layout.morphology];
    const std::size_t count = shapes_[layout.morphology].distance.size();
    const auto places = forest_.places().subspan(n.first_segment, count);
    std::vector<std::uint32_t> parents;
    for (const SectionFacts& s : forest_.sections().subspan(n.first_section, n.section_count))
      parents.push_back(s.parent);
    const auto runs = layout.runs(parents.size());
    const bool soma_alone = std::ranges::all_of(runs, [](std::uint32_t run) { return run == none; });
    Table& table = tables_[l];
    table.value[0] = compartments_at(layout, parents, places);
    for (std::size_t level = 1; level < levels; ++level) table.value[level].assign(count, none);
    for (std::size_t s = 0; s < count; ++s) {
      const std::uint32_t section = places[s].section;
      std::uint32_t& compartment = table.value[0][s];
      if (!soma_alone && section < parents.size() && runs[section] == none) {
        compartment = none;  // it may do anything there
        continue;
      }
      const auto run =
          std::size_t(std::ranges::upper_bound(layout.sections, compartment, {}, &reports::SectionRun::end) -
                      layout.sections.begin());
      table.value[1][s] = std::uint32_t(run);
      table.value[2][s] = layout.branch_of(run);
      table.value[3][s] = section == soma_section;  // beside its mean a neuron has the value of its soma
    }
    double total = 0.;  // µm
    for (const reports::Compartment& c : layout.compartments) total += .1 * double(c.weight);
    const auto mean = [&](std::size_t values) {
      return float(total / double(std::max<std::size_t>(1, values)));
    };
    table.length = {0.f, mean(layout.sections.size()), mean(layout.branches.size()), 0.f};
    if (n.cluster_count) table.length[3] = 2.f * forest_.clusters()[n.first_cluster].radius;
    for (std::size_t level = 1; level < levels; ++level)
      table.length[level] = std::max(table.length[level], table.length[level - 1]);
  });
  shown_.resize(forest_.instances().size());
  counted_.resize(forest_.instances().size());
}

Playback Playback::open(const Forest& forest, const std::filesystem::path& path) {
  return Playback(forest, reports::Activity::open(path), path.string());
}

ActivityView Playback::view() const {
  ActivityView view;
  const reports::Range shown = activity_.facts().shown();
  view.low = shown.low, view.high = shown.high;
  return view;
}

ActivityView Playback::fitted(ActivityView view) const {
  if (view.time) view.time = std::clamp(*view.time, begin(), end());
  if (view.neuron && *view.neuron >= shown_.size()) view.neuron.reset();
  return view;
}

std::uint64_t Playback::step_at(double time) const {
  const reports::Facts& facts = activity_.facts();
  const double at = std::floor((time - facts.start) / facts.step + 1e-6);
  return std::uint64_t(std::clamp(at, 0., double(facts.steps - 1)));
}

Level Playback::level(std::uint32_t row, float magnification, float pixels) const {
  const Table& table = tables_[activity_.rows()[row].layout];
  std::size_t level = levels - 1;
  while (level > 0 && table.length[level] * magnification > pixels) --level;
  return Level(level);
}

std::optional<Playback::Compartment> Playback::compartment(std::uint32_t instance,
                                                           std::uint32_t segment) const {
  if (instance >= row_of_.size() || row_of_[instance] == none) return std::nullopt;
  const std::uint32_t row = row_of_[instance];
  const auto& values = tables_[activity_.rows()[row].layout].value[0];
  const std::uint32_t first = shapes_[forest_.instances()[instance].morphology].first_segment;
  if (!within(segment, 1, first, values.size()) || values[segment - first] == none) return std::nullopt;
  return Compartment{row, values[segment - first]};
}

void Playback::colour(Cut& cut, const Eye& eye, const ActivityView& view, const PlaybackOptions& options) {
  if (view.neuron && *view.neuron >= shown_.size())
    throw Error(fmt::format("neuron {} is to stand out, and there are {}; name one from 0 to {}",
                            *view.neuron, shown_.size(), shown_.size() - 1));
  auto start = Clock::now();
  const double time = view.time.value_or(begin());
  for (const std::uint32_t i : in_sight_) shown_[i] = {};
  in_sight_.clear();
  const frame::Geometry geometry = forest_.geometry();
  for (const auto* list : {&cut.dots, &cut.lines, &cut.capsules})
    for (const frame::Item& item : *list) {
      figures_.segments += std::uint64_t(std::popcount(item.drawn));
      each_run(geometry, item, [&](std::uint32_t, std::uint32_t instance, std::uint32_t, std::uint32_t) {
        if (Shown& s = shown_[instance]; !s.in_sight) {
          s.in_sight = true;
          s.simulated = options.states.empty() || options.states[instance].is(frame::State::simulated);
          in_sight_.push_back(instance);
        }
      });
    }
  read(eye, options, time);
  find_spikes(time, view, options);
  for (const std::uint32_t i : in_sight_) counted_[i] = true;
  figures_.gather += milliseconds_since(start);

  start = Clock::now();
  const reports::Range& range = activity_.facts().range;
  const std::array entry_of{entries_of(range, view, false), entries_of(range, view, true)};
  Cut::Entries& entries = cut.entries.emplace();
  entries.of_activity = true;
  const auto paint_list = [&](std::span<const frame::Item> list, std::size_t each,
                              std::vector<std::uint8_t>& out) {
    out.assign(list.size() * each, std::uint8_t(no_value_entry));
    parallel_ranges(list.size(), 512, [&](std::size_t from, std::size_t to) {
      for (std::size_t i = from; i < to; ++i)
        each_run(geometry, list[i],
                 [&](std::uint32_t at, std::uint32_t instance, std::uint32_t first, std::uint32_t count) {
                   paint(instance, first, count, entry_of[instance != view.neuron], view, time,
                         options.window, &out[i * each + at]);
                 });
    });
  };
  paint_list(cut.dots, 1, entries.dots);
  paint_list(cut.lines, frame::cluster_size, entries.lines);
  paint_list(cut.capsules, frame::cluster_size, entries.capsules);
  figures_.paint += milliseconds_since(start);
}

// Reads the values of what is in sight, each neuron's in its level: a matter of the eye and the neuron alone, so that what
// hides parts of it changes no colour.
void Playback::read(const Eye& eye, const PlaybackOptions& options, double time) {
  wanted_.clear();
  std::uint64_t values = 0;
  const auto want = [&](std::uint32_t row, Level level) {
    wanted_.push_back({row, level});
    values += activity_.count(row, level);
  };
  for (const std::uint32_t i : in_sight_) {
    const std::uint32_t row = row_of_[i];
    Shown& s = shown_[i];
    if (row == none || !s.simulated) continue;
    const frame::Instance& instance = forest_.instances()[i];
    const Cluster& root = forest_.clusters()[forest_.neurons()[instance.morphology].first_cluster];
    const Quat turn(instance.qw, instance.qx, instance.qy, instance.qz);
    const Vec3 middle = Vec3(instance.x, instance.y, instance.z) + turn * Vec3(root.x, root.y, root.z);
    s.level = level(row, eye.magnification({middle, root.radius}), options.pixels);
    s.first = values;
    want(row, s.level);
    if (s.level == Level::neuron) want(row, Level::soma);
    figures_.neurons += !counted_[i];
  }
  // All steps since the picture before.
  const std::uint64_t last = step_at(time), before = step_at(time - options.window);
  const std::uint64_t first = time - options.window < begin() ? 0 : std::min(before + 1, last);
  codes_.resize(values);
  activity_.greatest(wanted_, options.window > 0. ? first : last, last + 1, codes_);
  figures_.values += values;
}

// The spikes whose flashes are still on their way.
void Playback::find_spikes(double time, const ActivityView& view, const PlaybackOptions& options) {
  spikes_.clear();
  if (!(view.speed > 0.f)) return;
  const double under_way =
      double(farthest_ / view.speed) + double(view.fade) * std::log(double(flash_steps)) + options.window;
  for (const reports::Spike& s :
       activity_.spikes(time - under_way, std::nextafter(time, std::numeric_limits<double>::infinity())))
    if (s.instance < shown_.size() && shown_[s.instance].in_sight && shown_[s.instance].simulated)
      spikes_.push_back(s);
  std::ranges::stable_sort(spikes_, {}, &reports::Spike::instance);
  for (std::uint32_t i = 0; i < spikes_.size(); ++i) {
    Shown& s = shown_[spikes_[i].instance];
    if (s.spikes_end == 0) s.spikes = i;
    s.spikes_end = i + 1;
  }
  figures_.flashes += std::uint64_t(
      std::ranges::count_if(spikes_, [&](const reports::Spike& s) { return !counted_[s.instance]; }));
}

bool Playback::has_values() const { return numbers() || activity_.spikes(-INFINITY, INFINITY).empty(); }

bool Playback::numbers() const {
  return activity_.facts().not_numbers < activity_.width(Level::compartment) * activity_.facts().steps;
}

double Playback::busiest(const ActivityView& view) const {
  constexpr double infinite = std::numeric_limits<double>::infinity();
  const auto spikes = activity_.spikes(begin(), infinite);
  const double seen = double(view.fade);
  double best = begin();
  std::size_t most = 0, first = 0;
  for (std::size_t i = 0; i < spikes.size(); ++i) {
    while (spikes[i].time - spikes[first].time > seen) ++first;
    if (i + 1 - first > most) most = i + 1 - first, best = spikes[i].time;
  }
  // A little later the last of them has begun to run.
  return std::clamp(best + .25 * double(view.fade), begin(), end());
}

std::vector<frame::Overlay> Playback::flashes(const frame::Camera& camera, float height,
                                              const Colouring& colouring, const ActivityView& view,
                                              const PlaybackOptions& options) {
  const auto start = Clock::now();
  std::vector<frame::Overlay> marks;
  if (!(view.speed > 0.f)) return marks;
  const double time = view.time.value_or(begin());
  const double lasts = double(view.fade) * -std::log(double(dimmest_mark)) + options.window;
  const auto spikes = activity_.spikes(time - double(farthest_ / view.speed) - lasts,
                                       std::nextafter(time, std::numeric_limits<double>::infinity()));
  const Vec3 forward = -camera.axes().col(2);
  for (std::size_t k = spikes.size(); k-- > 0 && marks.size() < most_flash_marks;) {
    const std::uint32_t instance = spikes[k].instance;
    if (instance >= shown_.size()) continue;
    const frame::State& state = colouring.states[instance];
    if (!state.is(frame::State::visible) || !state.is(frame::State::simulated)) continue;
    const Neuron& neuron = forest_.neurons()[forest_.instances()[instance].morphology];
    const Shape& shape = shapes_[forest_.instances()[instance].morphology];
    const std::size_t before = marks.size();
    for (std::uint32_t i = 0; i < neuron.original_count && marks.size() < most_flash_marks; ++i) {
      if (shape.distance[i] < 0.f) continue;
      const double age = time - spikes[k].time - double(shape.distance[i] / view.speed);
      if (age < 0. || age > lasts) continue;
      const std::uint32_t kind = forest_.segments()[neuron.first_segment + i].meta & 7u;
      const bool soma = kind == 1;
      // Of a soma its sphere, wholly covered; the cones that join its stems would stick out as a flower.
      if (soma && i > 0) continue;
      if (state.kind == frame::Kind::somata && !soma) continue;
      if (colouring.opacities[8u * state.colour_class + kind] < 26 || state.opacity < 26) continue;
      const float bright = std::exp(-float(std::max(0., age - options.window)) / view.fade);
      const RoundCone cone = in_world(forest_, instance, neuron.first_segment + i);
      const float depth = (.5f * (cone.a + cone.b) - camera.eye).dot(forward);
      if (!camera.orthographic() && depth < camera.near) continue;
      const float least =
          (soma ? least_soma : least_branch) * height * camera.pixel_size(height, std::max(depth, 0.f));
      const float own = std::max(cone.radius_a, cone.radius_b);
      frame::Overlay mark{cone.a, cone.b,
                          std::max(soma ? 1.05f : 0.f, .3f + .8f * bright) * std::max(own, least),
                          bright > fading ? spike_entry : fading_entry};
      // As large in the picture and nearer, so that it is seen through the tissue.
      if (camera.orthographic()) {
        const Vec3 nearer = (1.f - through) * std::max(depth, 0.f) * forward;
        mark.a -= nearer, mark.b -= nearer;
      } else {
        const float share = std::min(1.f, std::max(through, 1.05f * camera.near / depth));
        mark.a = camera.eye + share * (mark.a - camera.eye);
        mark.b = camera.eye + share * (mark.b - camera.eye);
        mark.radius *= share;
      }
      marks.push_back(mark);
    }
    figures_.flashes += marks.size() > before;
  }
  figures_.segments += marks.size();
  figures_.gather += milliseconds_since(start);
  return marks;
}

void make_quiet(frame::Palette& palette, Background background) {
  const bool light = background != Background::dark;
  for (std::uint32_t i = 0; i < synapse_entry; ++i) {
    const Vec3 grey =
        Vec3::Constant(.2126f * palette[i].x() + .7152f * palette[i].y() + .0722f * palette[i].z());
    const Vec3 pale = .65f * palette[i] + .35f * grey;
    palette[i] = light ? Vec3(.2f * pale + .8f * light_of(0xDDE3EB)) : Vec3(.2f * pale);
  }
  palette[spike_entry] = light ? light_of(0xC00018) : Vec3(1.f, .98f, .86f);
  palette[fading_entry] = light ? light_of(0xE8602C) : light_of(0xFFA02C);
}

void Playback::paint(std::uint32_t instance, std::uint32_t first_segment, std::uint32_t count,
                     const std::array<std::uint8_t, 256>& entry_of, const ActivityView& view, double time,
                     double window, std::uint8_t* out) const {
  const Shown& s = shown_[instance];
  const Shape& shape = shapes_[forest_.instances()[instance].morphology];
  if (!within(first_segment, count, shape.first_segment, shape.distance.size())) return;
  const std::size_t first = first_segment - shape.first_segment;
  if (const std::uint32_t row = row_of_[instance]; row != none && s.simulated) {
    const auto& value = tables_[activity_.rows()[row].layout].value[std::size_t(s.level)];
    for (std::uint32_t i = 0; i < count; ++i)
      if (const std::uint32_t v = value[first + i]; v != none) out[i] = entry_of[codes_[s.first + v]];
  }
  for (std::uint32_t k = s.spikes; k < s.spikes_end; ++k)
    for (std::uint32_t i = 0; i < count; ++i) {
      const float distance = shape.distance[first + i];
      if (distance < 0.f) continue;
      const double age = time - spikes_[k].time - double(distance / view.speed);  // since it arrived there
      if (age < 0.) continue;
      const float bright = std::exp(-float(std::max(0., age - window)) / view.fade);
      const bool lit = out[i] >= flash_entry && out[i] < flash_entry + flash_steps;
      if (bright < (lit || out[i] == no_value_entry ? dimmest : dimmest_over_value)) continue;
      const auto step = std::min(std::uint32_t(bright * float(flash_steps)), flash_steps);
      const auto entry = std::uint8_t(flash_entry + step - 1);
      out[i] = lit ? std::max(out[i], entry) : entry;
    }
}

}  // namespace forest::scene
