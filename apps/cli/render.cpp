// SPDX-License-Identifier: Apache-2.0
// brainforest render and brainforest movie: a forest file becomes a picture or a film, without a display. Surfaces of a
// cortex can be in it, or be all of it.
#include <map>
#include <memory>

#include <CLI/App.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/io/png.h"

#include "apps/choice.h"
#include "apps/cli/artist.h"
#include "apps/cli/console.h"
#include "apps/cli/files.h"
#include "apps/cli/growth_film.h"
#include "apps/cli/options.h"
#include "apps/cli/surface_options.h"
#include "apps/cli/synapse_options.h"
#include "apps/cli/target_options.h"
#include "apps/cli/verb.h"
#include "apps/forest_files.h"
#include "apps/surface_files.h"
#include "apps/view_text.h"

namespace forest::cli {
namespace {

constexpr const char* view_help =
    "View as a JSON file or text (docs/scene/view.md); by default the whole forest";

const std::map<std::string, scene::Side> sides{{"left", scene::Side::left},   {"right", scene::Side::right},
                                               {"front", scene::Side::front}, {"back", scene::Side::back},
                                               {"above", scene::Side::above}, {"below", scene::Side::below}};

scene::Forest empty_forest() { return scene::Forest::from_bytes(scene::pack(circuit::Circuit{}, {})); }

// What was asked for and is slower than what is there.
void warn_of_slow(const Artist& artist, Drawer drawer, Console& console) {
  if (drawer == Drawer::opengl && artist.renderer().find("llvmpipe") != std::string::npos)
    console.warn(fmt::format("there is no graphics card, and {} draws slowly; --renderer cpu is faster",
                             artist.renderer()));
}

// Who is visible in a view that says nothing of it.
std::vector<frame::State> states_of(const scene::Targets& targets, const TargetOptions& shown) {
  scene::View plain;
  add_appearances(shown, plain.targets);
  return scene::colour(targets, plain).states;
}

// What is shown when nobody says what: the neurons that are visible, or the surfaces from one side.
scene::View default_view(const scene::Targets& targets, const TargetOptions& shown,
                         const scene::Surfaces& surfaces, std::optional<scene::Side> side, float aspect,
                         std::span<const frame::Overlay> drawn) {
  if (side && surfaces.empty())
    throw Error(
        "--from shows surfaces from a side, and there are none; give --surface, or say by --view where one "
        "is");
  if (!surfaces.empty() && (side || targets.forest().instances().empty())) {
    scene::View view;
    view.camera = surfaces.camera(side.value_or(surfaces.outside()), aspect);
    view.fog = 0.f;
    return view;
  }
  return scene::overview(targets.forest(), aspect, states_of(targets, shown), drawn);
}

// A picture without anything in it may be wanted; nobody should have to guess why it is so.
std::string nothing_shown(const Artist& artist, const Drawn& drawn) {
  if (artist.forest().instances().empty())
    return artist.shows_surfaces() ? "the picture shows nothing: the surfaces are transparent, or beside it"
                                   : "the forest has no neurons, so the picture shows none";
  if (!drawn.segments)
    return "the picture shows nothing: no neuron that is visible lies in this view; look elsewhere by "
           "--view, or hide less";
  const bool processor = artist.renderer() == "the processor";
  return fmt::format(
      "the picture shows nothing though {} segments were drawn: they are transparent, nearer than 'near', "
      "smaller than a "
      "pixel, hidden, or just beside it{}",
      drawn.segments,
      processor ? "" : fmt::format("; or {} is at fault: try --renderer cpu", artist.renderer()));
}

}  // namespace

std::function<void()> render(CLI::App& command, Console& console) {
  struct Options {
    std::vector<std::filesystem::path> forest;
    std::filesystem::path out;
    Look look;
    std::string view, size = "1920x1080";
    std::vector<float> gaze;
    bool outline = false;
    Marks marks;
    SurfaceOptions surfaces;
    bool skin = false;
    SynapseOptions synapses;
    std::optional<scene::Side> side;
    TargetOptions targets;
    Drawer drawer = Drawer::automatic;
    ActivityOptions activity;
  };
  const auto options = std::make_shared<Options>();
  command
      .add_option(
          "forest", options->forest,
          "Forest file, or traced neurons: files or folders of them, side by side; or the surface of a "
          "cortex")
      ->required();
  command.add_option("--view", options->view, view_help);
  add_look(command, options->look);
  add_surfaces(command, options->surfaces);
  command.add_flag("--skin", options->skin,
                   "Neurons near the eye have a smooth skin and spines (takes seconds)");
  add_synapses(command, options->synapses);
  command.add_option("--from", options->side, "Show all of the surfaces, from this side of the brain")
      ->transform(one_of(sides))
      ->option_text("left|right|front|back|above|below");
  add_targets(command, options->targets);
  add_activity(command, options->activity, "--time",
               "Its moment that is shown, ms; by default the first, of spikes alone the busiest");
  add_size(command, options->size);
  command.add_option("-o,--out", options->out, "The picture, a PNG file")->required();
  auto* gaze = command
                   .add_option("--gaze", options->gaze,
                               "Where one looks, as shares of width and height: detail falls off around it "
                               "(docs/scene/gaze.md)")
                   ->expected(2)
                   ->type_name("X Y");
  must_be_within(*gaze, 0., 1.);
  command.add_flag("--outline", options->outline,
                   "Draw the outline of the column or the elements, and their layers");
  add_marks(command, options->marks);
  add_renderer(command, options->drawer);
  return [options, &console] {
    if (extension_of(options->out).starts_with(".jp") &&
        options->look.background == scene::Background::transparent)
      throw Error(fmt::format("{}: JPEG pictures are never transparent; give a name that ends in .png",
                              options->out.string()));
    must_take(options->out, png_picture);
    const auto [width, height] = parse_size(options->size);
    SurfaceOptions named = options->surfaces;
    const float aspect = float(width) / float(height);
    const std::filesystem::path& first = options->forest.front();
    const bool alone = options->forest.size() == 1 && is_surface(first);
    const char* of_neurons = options->skin                    ? "--skin"
                             : options->outline               ? "--outline"
                             : !options->targets.only.empty() ? "--only"
                             : !options->targets.hide.empty() ? "--hide"
                                                              : nullptr;
    if (alone && of_neurons)
      throw Error(
          fmt::format("{} is of neurons, and {} is a surface; name a forest file, and that by --surface",
                      of_neurons, first.string()));
    if (alone) named.files.insert(named.files.begin(), first);
    scene::Surfaces surfaces = read_surfaces(named, console);
    const scene::Forest forest = alone ? empty_forest() : open_forest(options->forest, aspect);
    Artist artist(forest, options->drawer, read_node_sets(forest, options->targets.node_sets, console));
    warn_of_slow(artist, options->drawer, console);
    const auto outline = options->outline ? scene::outline(forest) : std::vector<frame::Overlay>();
    if (options->outline && outline.empty())
      console.warn("the forest is neither a column nor planted in elements, so it has no outline");
    scene::View view =
        default_view(artist.targets(), options->targets, surfaces, options->side, aspect, outline);
    if (!options->view.empty()) {
      const frame::Camera from = view.camera;
      view = read_view(options->view, forest.circuit().up, &view);
      if (options->side && (view.camera.eye != from.eye || view.camera.target != from.target))
        throw Error("--from and the view both say where the eye is; leave one of them out");
    }
    options->look.put_on(view);
    add_appearances(options->targets, view.targets);
    nlohmann::ordered_json of_surfaces;  // null where there are none
    if (!surfaces.empty()) of_surfaces["triangles"] = surfaces.triangles();
    if (surfaces.has_values()) {
      of_surfaces["range"] = surfaces.shown_range();
      of_surfaces["colour_map"] = surfaces.map->name;
    }
    if (!options->gaze.empty()) view.detail.gaze = Vec2(options->gaze[0], options->gaze[1]);
    warn_of_empty(artist.targets(), view.targets, console);
    artist.show(std::move(surfaces));
    if (options->skin) artist.give_skin();
    if (auto synapses = open_synapses(options->synapses, first, forest)) artist.show(std::move(*synapses));
    if (options->synapses.colour) view.synapses = *options->synapses.colour;
    play(artist, options->activity, view, console);
    view.samples = artist.still_samples(view);
    Drawn drawn =
        artist.draw(view, width, height, {.outline = options->outline, .progress = &console.progress()});
    if (drawn.image.covered == 0.) console.warn(nothing_shown(artist, drawn));
    scene::Arrangement places;
    if (const std::string missing = artist.explain(view, options->marks, drawn.image, places);
        !missing.empty())
      console.warn(missing);
    io::write_png(options->out, width, height, drawn.image.pixels);
    nlohmann::ordered_json activity;
    if (artist.playback())
      activity = {{"neurons", drawn.activity.neurons},
                  {"values", drawn.activity.values},
                  {"flashes", drawn.activity.flashes},
                  {"touched", artist.playback()->activity().touched()},
                  {"milliseconds", drawn.activity.gather + drawn.activity.paint}};
    console.print({{"file", options->out.string()},
                   {"activity", activity},
                   {"surfaces", of_surfaces},
                   {"skin_triangles", artist.skins().triangles},
                   {"view", nlohmann::ordered_json::parse(scene::to_json(view))},
                   {"neurons", drawn.neurons},
                   {"segments", drawn.segments},
                   {"synapses", drawn.synapses},
                   {"covered", drawn.image.covered},
                   {"milliseconds", {{"cull", drawn.cull}, {"draw", drawn.draw}, {"resolve", drawn.resolve}}},
                   {"renderer", artist.renderer()}});
    console.table({"picture", "neurons in sight", "segments drawn", "pixels covered", "seconds"},
                  {{options->out.string(), fmt::format("{}", drawn.neurons),
                    fmt::format("{}", drawn.segments), fmt::format("{:.1f} %", 100. * drawn.image.covered),
                    fmt::format("{:.2f}", (drawn.cull + drawn.draw + drawn.resolve) / 1000.)}});
  };
}

std::function<void()> movie(CLI::App& command, Console& console) {
  struct Options {
    std::vector<std::filesystem::path> forest;
    std::filesystem::path out;
    std::vector<std::string> views;
    std::string path, scanpath;
    std::string size = "1280x720";
    FilmPlan plan;
    TargetOptions targets;
    SurfaceOptions surfaces;
    bool skin = false;
    SynapseOptions synapses;
    Drawer drawer = Drawer::automatic;
    ActivityOptions activity;
    std::optional<double> rate;
    bool growth = false;
  };
  const auto options = std::make_shared<Options>();
  command
      .add_option("forest", options->forest,
                  "Forest file, or traced neurons: files or folders of them, side by side")
      ->required();
  add_look(command, options->plan.look);
  command.add_option("--view", options->views,
                     "Key views, two or more, as JSON files or texts; by default a walk into the forest, or "
                     "around traced neurons. With "
                     "--activity one is enough: the eye stands still");
  add_activity(command, options->activity, "--from",
               "Its moment at the first picture, ms; by default the first");
  must_be_within(
      *command.add_option("--rate", options->rate,
                          "Milliseconds of activity a second of film; by default all of it is shown"),
      1e-6, 1e9);
  add_targets(command, options->targets);
  add_surfaces(command, options->surfaces);
  command.add_flag("--skin", options->skin,
                   "Neurons near the eye have a smooth skin and spines (takes seconds)");
  add_synapses(command, options->synapses);
  command
      .add_option("--path", options->path,
                  "Key views from a file, one on each line, as the studio records them")
      ->excludes("--view");
  command.add_option(
      "--scanpath", options->scanpath,
      "A recorded gaze, a CSV file of time (ms), x, y: detail falls off around it (docs/scene/gaze.md)");
  add_size(command, options->size, true);
  must_be_within(
      *command.add_option("--seconds", options->plan.seconds, "Length of the film")->capture_default_str(),
      .04, 3600.);
  command.add_option("--fps", options->plan.frames_per_second, "Pictures a second")
      ->check(CLI::Range(1, 120))
      ->capture_default_str();
  command
      .add_option("--samples", options->plan.samples,
                  "Subframes a picture: more is smoother and slower; by default 8, where something is seen "
                  "through 32")
      ->check(CLI::Range(1, 256));
  command.add_flag("--outline", options->plan.outline,
                   "Draw the outline of the column or the elements, and their layers");
  command.add_option("--pictures", options->plan.pictures, "Also write every picture into this folder");
  options->plan.marks.legend = true;
  add_marks(command, options->plan.marks);
  add_renderer(command, options->drawer);
  command.add_option("-o,--out", options->out, "The film, an MP4 file")->required();
  auto* growth = command.add_flag("--growth", options->growth,
                                  "How neurons grew: the folders are what 'grow --time-lapse' wrote");
  for (const char* other : {"--view", "--path", "--activity", "--scanpath", "--surface", "--skin",
                            "--synapses", "--synapse-file", "--outline", "--node-sets"})
    growth->excludes(other);
  return [options, &console] {
    must_take(options->out, mp4_film);
    must_have_ground(options->plan.look.background.value_or(scene::Background::dark));
    FilmPlan plan = options->plan;
    const auto tell_of = [&](const FilmFigures& figures) {
      if (figures.covered == 0.)
        console.warn(
            "the film shows nothing: no neuron that is visible lies in its views; give others by --view");
      if (!figures.missing.empty()) console.warn(figures.missing);
      console.print({{"file", options->out.string()},
                     {"pictures", figures.pictures},
                     {"frames_per_second", figures.pictures / figures.seconds},
                     {"covered", figures.covered},
                     {"codec", figures.codec},
                     {"renderer", figures.renderer}});
      console.table({"film", "pictures", "pictures/s", "pixels covered", "codec"},
                    {{options->out.string(), fmt::format("{}", figures.pictures),
                      fmt::format("{:.1f}", figures.pictures / figures.seconds),
                      fmt::format("{:.1f} %", 100. * figures.covered), figures.codec}});
    };
    std::tie(plan.width, plan.height) = parse_size(options->size);
    add_appearances(options->targets, plan.targets);
    if (options->growth)
      return tell_of(film_growth(options->forest, plan, options->drawer, options->out, console.progress()));
    const float aspect = float(plan.width) / float(plan.height);
    const scene::Forest forest = open_forest(options->forest, aspect);
    const scene::View whole = scene::overview(forest, aspect);
    std::vector<scene::View> views;
    for (const std::string& view : options->views)
      views.push_back(read_view(view, forest.circuit().up, &whole));
    if (!options->path.empty()) views = read_views(options->path, forest.circuit().up, &whole);
    if (!options->scanpath.empty())
      plan.gaze = scene::parse_scanpath(MappedFile(options->scanpath).text(), options->scanpath);
    const bool playing = !options->activity.file.empty();
    if (options->rate && !playing) throw Error("--rate plays an activity file; name it with --activity");
    if (views.size() == 1 && !playing)
      throw Error("a film needs two views or more, or none for a walk into the forest; give another --view");
    Artist artist(forest, options->drawer, read_node_sets(forest, options->targets.node_sets, console));
    warn_of_slow(artist, options->drawer, console);
    warn_of_empty(artist.targets(), plan.targets, console);
    artist.show(read_surfaces(options->surfaces, console));
    if (options->skin) artist.give_skin();
    if (auto synapses = open_synapses(options->synapses, options->forest.front(), forest))
      artist.show(std::move(*synapses));
    plan.synapses = options->synapses.colour;
    std::optional<scene::View> look;
    if (playing) {
      look = views.empty() ? whole : views.front();
      const bool told = options->activity.time || (look->activity && look->activity->time);
      play(artist, options->activity, *look, console);
      if (!told) look->activity->time = artist.playback()->begin();  // all of it
      plan.from = *look->activity->time;
      const double left = artist.playback()->end() - plan.from;
      plan.rate = options->rate.value_or(left / plan.seconds);
      if (const double still = plan.seconds - left / plan.rate; still > .05 * plan.seconds)
        console.warn(
            fmt::format("the simulation ends {:.1f} s before the film does, which shows its last moment "
                        "until then; give a "
                        "lower --rate or fewer --seconds",
                        still));
    }
    const scene::CameraPath path =
        views.empty() ? scene::walk(forest, states_of(artist.targets(), options->targets), aspect)
                      : scene::CameraPath(std::move(views));
    tell_of(film(artist, path, plan, options->out, console.progress(), look ? look->activity : std::nullopt));
  };
}

}  // namespace forest::cli
