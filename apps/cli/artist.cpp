// SPDX-License-Identifier: Apache-2.0
#include "apps/cli/artist.h"

#include <cmath>
#include <cstdio>
#include <map>
#include <string>
#include <utility>

#include <CLI/App.hpp>
#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/frame/matte.h"
#include "forest/io/png.h"
#include "forest/scene/colour_bar.h"
#include "forest/scene/gallery.h"
#include "forest/scene/gauge.h"
#include "forest/scene/scale_bar.h"
#include "forest/scene/slice_picture.h"

#include "apps/choice.h"
#include "apps/cli/clock.h"
#include "apps/cli/console.h"
#include "apps/cli/reel.h"

namespace forest::cli {

Artist::Artist(scene::Forest forest, Drawer drawer, circuit::NodeSets sets)
    : forest_(std::move(forest)),
      targets_(forest_, std::move(sets)),
      chooser_(forest_),
      renderer_(make_renderer(drawer)),
      foveated_(forest_, [drawer] { return make_renderer(drawer); }),
      outline_(scene::outline(forest_)),
      dressing_(forest_) {
  renderer_->load(forest_.geometry());
}

Drawn Artist::draw_transparent(scene::View view, std::uint32_t width, std::uint32_t height,
                               const Wanted& wanted) {
  view.behind = 0.f;
  Drawn on_black = draw(view, width, height, wanted);
  view.behind = 1.f;
  const Drawn on_white = draw(view, width, height, wanted);
  on_black.cull += on_white.cull, on_black.draw += on_white.draw, on_black.resolve += on_white.resolve;
  on_black.image = frame::matted(on_black.image, on_white.image);
  return on_black;
}

Drawn Artist::draw(const scene::View& view, std::uint32_t width, std::uint32_t height, Wanted wanted) {
  if (view.background == scene::Background::transparent && !view.behind)
    return draw_transparent(view, width, height, wanted);
  if (!colouring_ || view.colour_by != coloured_by_ || view.background != coloured_for_ ||
      view.targets != shown_as_) {
    colouring_ = scene::colour(targets_, view);
    coloured_by_ = view.colour_by, coloured_for_ = view.background, shown_as_ = view.targets;
  }
  Drawn drawn;
  if (playback_) playback_->begin_picture();
  std::vector<frame::Overlay> marks;
  if (wanted.outline) marks = outline_;
  std::optional<frame::Glass> glass;
  if (view.plane) {
    glass = scene::plane_glass(forest_, *view.plane, view.background);
    const auto edge = scene::plane_marks(forest_, *view.plane);
    marks.insert(marks.end(), edge.begin(), edge.end());
  }
  const bool spikes_alone = playback_ && !playback_->has_values(), coloured = playback_ && !spikes_alone;
  std::optional<scene::Colouring> quiet;
  if (spikes_alone) {
    const auto flashes = playback_->flashes(view.camera, float(height), *colouring_,
                                            view.activity.value_or(playback_->view()), {.window = window_});
    marks.insert(marks.end(), flashes.begin(), flashes.end());
    make_quiet(quiet.emplace(*colouring_).palette, view.background);
  }
  const std::span<const frame::Overlay> lines = marks;
  const scene::Colouring& colouring = quiet ? *quiet : *colouring_;
  scene::Chooser::Painter painter;
  if (coloured)
    painter = [this, &colouring, look = view.activity.value_or(playback_->view())](scene::Cut& cut,
                                                                                   const scene::Eye& from) {
      playback_->colour(cut, from, look, {.window = window_, .states = colouring.states});
    };
  else if (colouring.gauge)
    painter = [this, &colouring](scene::Cut& cut, const scene::Eye&) { paint(forest_, colouring, cut); };
  auto start = Clock::now();
  dressing_.begin();
  // A card draws no large pixels: they save work of the processor's kind.
  if (scene::layered(view) && (view.detail.gaze || !on_card())) {
    Foveated::Dresser dress;
    if (dressing_.wanted(view, colouring))
      dress = [&](frame::Frame& frame, const scene::Cut& near, const scene::Eye& eye) {
        dressing_.put_on(frame, view, near, eye, colouring, coloured, painter);
      };
    drawn.image =
        foveated_.draw(view, width, height, colouring, lines, glass, 0, view.samples, painter, dress);
    for (std::size_t i = 3; i < drawn.image.pixels.size(); i += 4) drawn.image.pixels[i] = 255;
    const Foveated::Figures& f = foveated_.figures();
    drawn.cull = f.cull, drawn.draw = f.draw, drawn.read = f.unite;
    drawn.segments = f.segments, drawn.reached = f.drawn, drawn.neurons = f.neurons;
    drawn.synapses = dressing_.chosen.balls.size();
    if (playback_) drawn.activity = playback_->figures();
    return drawn;
  }
  const frame::Viewport viewport{float(width), float(height)};
  const scene::Eye eye(view.camera, viewport, scene::detail_for(view, width, height));
  const scene::Cut& cut = chooser_.choose(eye, colouring.shown(), painter);
  drawn.cull = milliseconds_since(start);
  frame::Frame frame = scene::compose(forest_, view, colouring, cut, width, height, lines);
  frame.glass = glass;
  chooser_.complete(frame);
  start = Clock::now();
  DressingLimits limits;
  limits.skin.progress = wanted.progress;
  dressing_.put_on(frame, view, cut, eye, colouring, coloured, painter, limits);
  drawn.cull += milliseconds_since(start);
  drawn.synapses = dressing_.chosen.balls.size();
  const frame::Timing timing = renderer_->draw(frame);
  chooser_.remember(renderer_->seen(), renderer_->reached());
  drawn.segments = chooser_.segments();
  drawn.neurons = chooser_.neurons();
  drawn.draw = timing.draw, drawn.resolve = timing.resolve, drawn.reached = timing.drawn;
  start = Clock::now();
  drawn.image = wanted.pixels ? renderer_->read() : frame::Image{width, height, {}, renderer_->covered()};
  drawn.read = milliseconds_since(start);
  if (playback_) drawn.activity = playback_->figures();
  return drawn;
}

Artist::Words Artist::words(const scene::View& view, const Marks& marks,
                            const frame::Viewport& picture) const {
  Words words;
  const auto add = [&](std::optional<scene::Block> block) {
    if (block) words.blocks.push_back(std::move(*block));
    return block.has_value();
  };
  std::vector<scene::ColourBar> bars;
  if (marks.legend && playback_)
    bars.push_back(scene::bar_of(*playback_, view.activity.value_or(playback_->view()), view.background));
  if (marks.legend && !playback_ && colouring_)
    if (const auto of_branches = scene::bar_of(*colouring_, view.background)) bars.push_back(*of_branches);
  if (const auto of_surfaces = scene::bar_of(dressing_.surfaces); marks.legend && of_surfaces)
    bars.push_back(*of_surfaces);
  const bool barred = add(scene::block_of(bars, picture, view.background));
  std::vector<scene::LegendEntry> names;
  if (marks.names && colouring_ && !playback_)
    names = colouring_->legend;  // else the simulation's colours are shown
  if (marks.names && dressing_.surfaces.visibility > 0.f)
    std::ranges::copy(dressing_.surfaces.legend(), std::back_inserter(names));
  const bool with_synapses = !dressing_.chosen.balls.empty() && view.synapses != scene::SynapseColour::none;
  if ((marks.names || playback_) && marks.legend && with_synapses &&
      (playback_ || view.synapses == scene::SynapseColour::sign))
    std::ranges::move(scene::synapse_legend(view.background), std::back_inserter(names));
  const bool named = add(scene::block_of(names, picture, view.background));
  const bool scaled = marks.scale && add(scene::scale_block(view.camera, picture, view.background));
  std::vector<const char*> no_room;
  if (marks.scale && !scaled) no_room.push_back("scale bar");
  if (marks.names && !names.empty() && !named) no_room.push_back("legend");
  if (marks.names && !playback_ && names.empty() && !barred)
    words.missing = forest_.instances().empty() && !dressing_.surfaces.empty()
                        ? "a legend names colours of neurons, areas and values, and there are none"
                        : "the colours of neurons mean nothing here, so there is no legend";
  else if (!no_room.empty())
    words.missing = fmt::format("the picture has no room for a {}; draw it larger, by --size",
                                fmt::join(no_room, " nor a "));
  return words;
}

void Artist::name_cells(const scene::View& view, const Marks& marks, frame::Image& image) const {
  if (marks.names && marks.cells && scene::is_gallery(forest_)) scene::paint_names(image, forest_, view);
}

std::string Artist::explain(const scene::View& view, const Marks& marks, frame::Image& image,
                            scene::Arrangement& places) const {
  name_cells(view, marks, image);
  const Words all = words(view, marks, {float(image.width), float(image.height)});
  places.paint(image, scene::paper_of(view.background), all.blocks);
  return all.missing;
}

bool Artist::look_at(const scene::View& view, const Marks& marks, frame::Image& image,
                     scene::Arrangement& places) const {
  name_cells(view, marks, image);
  const Words all = words(view, marks, {float(image.width), float(image.height)});
  places.look_at(image, scene::paper_of(view.background), all.blocks);
  return !all.blocks.empty();
}

void must_have_ground(scene::Background background) {
  if (background == scene::Background::transparent)
    throw Error(
        "a film has no transparent background; take --background dark or light, or make single pictures by "
        "'brainforest render'");
}

FilmFigures film(Artist& artist, const scene::CameraPath& path, const FilmPlan& plan,
                 const std::filesystem::path& file, Progress& progress,
                 const std::optional<scene::ActivityView>& activity) {
  Reel reel(plan, file, progress);
  const int count = reel.count();
  std::uint64_t segments = 0;
  const double picture_ms = plan.rate / plan.frames_per_second;
  artist.set_window(picture_ms);
  const auto view_at = [&](int i) {
    scene::View view = path.at(count > 1 ? float(i) / float(count - 1) : 0.f);
    plan.look.put_on(view);
    view.targets.insert(view.targets.end(), plan.targets.begin(), plan.targets.end());
    view.samples = plan.samples.value_or(artist.sees_through(view) ? 32 : 8);
    must_have_ground(view.background);
    if (plan.synapses) view.synapses = *plan.synapses;
    if (plan.gaze) view.detail.gaze = plan.gaze->at(1000. * i / plan.frames_per_second);
    if (activity) {
      view.activity = activity;
      view.activity->time = std::min(plan.from + i * picture_ms, artist.playback()->end());
    }
    return view;
  };
  // Words stand where they hide least in all of it: of that a few moments tell, drawn quickly.
  constexpr int looks = 16;
  scene::Arrangement places;
  for (int look = 0, last = -1; look < looks; ++look) {
    const int i = (2 * look + 1) * count / (2 * looks);
    if (i == std::exchange(last, i)) continue;
    scene::View view = view_at(i);
    view.samples = 1, view.skin = false;
    frame::Image image = artist.draw(view, plan.width, plan.height).image;
    if (!artist.look_at(view, plan.marks, image, places)) break;
  }
  std::string missing;
  for (int i = 0; i < count; ++i) {
    const scene::View view = view_at(i);
    Drawn drawn = artist.draw(view, plan.width, plan.height, {.outline = plan.outline});
    segments += drawn.segments;
    missing = artist.explain(view, plan.marks, drawn.image, places);
    reel.add(drawn.image);
  }
  if (segments && reel.covered() == 0.)
    throw Error(
        fmt::format("the film shows nothing though {} segments were drawn; the OpenGL driver ({}) may be at "
                    "fault, try --renderer cpu",
                    segments, artist.renderer()));
  FilmFigures figures = reel.finish();
  figures.renderer = artist.renderer();
  figures.missing = std::move(missing);
  return figures;
}

void add_activity(CLI::App& command, ActivityOptions& options, const char* name, const char* help) {
  auto* activity = command.add_option(
      "--activity", options.file,
      "Colour the branches by a simulation: an activity file, made by 'brainforest activity'");
  command.add_option(name, options.time, help)->needs(activity);
}

void play(Artist& artist, const ActivityOptions& options, scene::View& view, Console& console) {
  if (options.file.empty()) return;
  artist.play(scene::Playback::open(artist.forest(), options.file));
  const scene::Playback& playback = *artist.playback();
  if (playback.has_values() && !playback.numbers())
    console.warn(options.file.string() + ": no value of it is a number (NaN); branches are grey for that");
  if (!view.activity) view.activity = playback.view();
  if (options.time) view.activity->time = options.time;
  const double time = view.activity->time.value_or(playback.has_values() ? playback.begin()
                                                                         : playback.busiest(*view.activity));
  if (!(time >= playback.begin() && time <= playback.end() + playback.activity().facts().step))
    throw Error(fmt::format("{}: holds no time {:g} ms; it runs from {:g} to {:g} ms", options.file.string(),
                            time, playback.begin(), playback.end()));
  view.activity->time = time;
}

namespace {

// An option that takes one of the words, which are those of `place`'s values in their order.
template <class T, std::size_t N>
void add_words(CLI::App& command, const char* name, std::optional<T>& place,
               const std::array<std::string_view, N>& words, const std::string& help) {
  std::map<std::string, T> values;
  for (std::size_t i = 0; i < N; ++i) values.emplace(words[i], T(i));
  command.add_option(name, place, help)
      ->transform(one_of(values))
      ->option_text(fmt::format("{}", fmt::join(words, "|")));
}

}  // namespace

void add_look(CLI::App& command, Look& look, const char* usual_background, const char* usual_colours) {
  add_words(
      command, "--background", look.background, scene::background_words,
      fmt::format("What lies behind; by default {}. Transparent: nothing, for slides and figures, in the "
                  "colours of light ground",
                  usual_background));
  add_words(command, "--colour-by", look.colour_by, scene::colour_by_words,
            fmt::format("What the colours of neurons mean; by default {}", usual_colours));
}

void add_marks(CLI::App& command, Marks& marks) {
  auto* none =
      command.add_flag("!--no-legend", marks.legend,
                       "Leave out what the colours of values mean (small pictures do so by themselves)");
  command.add_flag("--legend", marks.names, "Name the colours of neurons, too: types, layers, targets …")
      ->excludes(none);
  command.add_flag("--scale", marks.scale, "Draw a scale bar, true at the depth of what the camera looks at");
}

std::pair<std::uint32_t, std::uint32_t> parse_size(const std::string& text) {
  unsigned width = 0, height = 0;
  char end = 0;
  if (std::sscanf(text.c_str(), "%5ux%5u%c", &width, &height, &end) != 2 || !width || !height ||
      width > 16384 || height > 16384)
    throw Error(fmt::format(
        "'{}' is no size of a picture; give WIDTHxHEIGHT in pixels up to 16384, for example 1920x1080",
        text));
  return {width, height};
}

}  // namespace forest::cli
