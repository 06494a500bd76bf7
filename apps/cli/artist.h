// SPDX-License-Identifier: Apache-2.0
// Pictures of a forest without a window: what render, movie, demo and bench share.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>

#include "forest/core/progress.h"
#include "forest/scene/arrangement.h"
#include "forest/scene/chooser.h"
#include "forest/scene/path.h"
#include "forest/scene/playback.h"
#include "forest/scene/scanpath.h"
#include "forest/scene/view.h"

#include "apps/cli/drawer.h"
#include "apps/dressing.h"
#include "apps/foveated.h"

namespace forest::cli {

class Console;

/// What one picture took and showed.
struct Drawn {
  double cull = 0., draw = 0., resolve = 0., read = 0.;  // milliseconds
  std::uint64_t segments = 0;                            // chosen
  std::uint64_t reached = 0;          // of them, neither hidden nor beside the picture; 0: unknown
  std::uint32_t neurons = 0;          // in sight and not hidden
  std::uint64_t synapses = 0;         // drawn
  scene::Playback::Figures activity;  // of what was chosen first; zeros when nothing plays
  frame::Image image;                 // as it was wanted
};

/// What a picture is wanted for.
struct Wanted {
  bool outline = false;                    // the column's, too
  Progress* progress = &Progress::none();  // of what takes seconds: skin
  bool pixels = true;  // else they stay where they were drawn, as for a window, if that can be had
};

/// What stands in a picture so that it can be read.
struct Marks {
  bool legend = true;  // what colours of values mean, of the simulation and of surfaces
  bool names = false;  // what colours of neurons mean
  bool cells = true;   // then also the neurons of a gallery
  bool scale = false;  // how long some µm are
};

/// What many would change of a view, and nothing else.
struct Look {
  std::optional<scene::Background> background;
  std::optional<scene::ColourBy> colour_by;

  void put_on(scene::View& view) const {
    if (background) view.background = *background;
    if (colour_by) view.colour_by = *colour_by;
  }
};

class Artist {
 public:
  /// @param sets  names that targets of views may use
  explicit Artist(scene::Forest forest, Drawer drawer = Drawer::automatic, circuit::NodeSets sets = {});

  /// A view with a gaze or with large pixels is drawn in layers (apps/foveated.h), one that is transparent twice (frame/matte.h).
  Drawn draw(const scene::View& view, std::uint32_t width, std::uint32_t height, Wanted wanted = {});
  /// The pixels of the last picture that was not drawn in layers.
  frame::Image read() { return renderer_->read(); }
  /// Whether something may be seen through (Dressing::sees_through).
  bool sees_through(const scene::View& view) const {
    return dressing_.sees_through(view, scene::colour(targets_, view));
  }
  /// How many samples a picture of the view at rest has (Dressing::still_samples).
  std::uint32_t still_samples(const scene::View& view) const {
    return dressing_.still_samples(view, scene::colour(targets_, view));
  }
  /// Draws into a picture how it is to be read. Small pictures stay as they are.
  /// @param places  where the words stand, in a film the same from picture to picture
  /// @return  what was asked for and is not in it, a sentence; or nothing
  std::string explain(const scene::View& view, const Marks& marks, frame::Image& image,
                      scene::Arrangement& places) const;
  /// Has a look at a picture for whose like places are sought. It is drawn on.
  /// @return  whether there is anything to place
  bool look_at(const scene::View& view, const Marks& marks, frame::Image& image,
               scene::Arrangement& places) const;
  /// From now on branches show the simulation, at the time of View::activity.
  void play(scene::Playback playback) { playback_.emplace(std::move(playback)); }
  /// From now on these surfaces are in the pictures, too.
  void show(scene::Surfaces surfaces) { dressing_.surfaces = std::move(surfaces); }
  /// From now on neurons near the eye have skin, unless the view says otherwise.
  bool shows_surfaces() const { return !dressing_.surfaces.empty(); }
  void give_skin() { dressing_.skinned = true; }
  /// From now on these synapses are in the pictures, unless the view says otherwise.
  void show(scene::Synapses synapses) { dressing_.synapses.emplace(std::move(synapses)); }
  const scene::Skin::Figures& skins() const { return dressing_.skins; }
  /// ms that each picture stands for, for pictures that leave out steps.
  void set_window(double milliseconds) { window_ = milliseconds; }
  const scene::Playback* playback() const { return playback_ ? &*playback_ : nullptr; }
  const scene::Forest& forest() const { return forest_; }
  const scene::Targets& targets() const { return targets_; }
  std::string renderer() const { return renderer_->name(); }
  /// Whether pictures can be shown from where they are drawn, on a graphics card.
  bool on_card() const { return !renderer_->image(); }

 private:
  struct Words {
    std::vector<scene::Block> blocks;
    std::string missing;  // as explain returns it
  };
  Drawn draw_transparent(scene::View view, std::uint32_t width, std::uint32_t height, const Wanted& wanted);
  Words words(const scene::View& view, const Marks& marks, const frame::Viewport& picture) const;
  void name_cells(const scene::View& view, const Marks& marks, frame::Image& image) const;

  scene::Forest forest_;
  scene::Targets targets_;
  scene::Chooser chooser_;
  std::optional<scene::Playback> playback_;
  double window_ = 0.;
  std::unique_ptr<render::Renderer> renderer_;
  Foveated foveated_;
  std::vector<frame::Overlay> outline_;
  Dressing dressing_;
  std::optional<scene::Colouring> colouring_;
  scene::ColourBy coloured_by_ = scene::ColourBy::type;
  scene::Background coloured_for_ = scene::Background::dark;
  std::vector<scene::Appearance> shown_as_;
};

/// Sums over the pictures of a film.
struct FilmFigures {
  std::uint32_t pictures = 0;
  double seconds = 0.;  // drawing and encoding
  double covered = 0.;  // mean share of pixels
  std::string codec, renderer;
  std::string missing;  // what was asked for and is not in its pictures, a sentence; or nothing
};

struct FilmPlan {
  std::uint32_t width = 1280, height = 720;
  std::optional<std::uint32_t> samples;  // of a pixel; none: 8, where something is seen through 32
  int frames_per_second = 25;
  double seconds = 8.;
  std::optional<scene::Scanpath> gaze;  // replayed from its begin; none: that of the views
  std::filesystem::path pictures;       // when not empty: a folder for the single pictures as PNG files
  Marks marks{.legend = false};
  Look look;
  bool outline = false;                          // of the column or the elements
  std::vector<scene::Appearance> targets;        // after those of the path's views
  std::optional<scene::SynapseColour> synapses;  // none: as the path's views say
  double from = 0., rate = 0.;                   // of activity: ms at the first picture, ms a second of film
};

/// Throws Error when it is transparent, as no film is.
void must_have_ground(scene::Background background);

/// Films what a path shows, with activity as it goes on when it is given a look. Throws Error when no picture shows anything of
/// a forest that it should show.
FilmFigures film(Artist& artist, const scene::CameraPath& path, const FilmPlan& plan,
                 const std::filesystem::path& file, Progress& progress,
                 const std::optional<scene::ActivityView>& activity = {});

/// --activity and what belongs to it.
struct ActivityOptions {
  std::filesystem::path file;
  std::optional<double> time;
};
/// @param name  of the option for the time, with its help
void add_activity(CLI::App& command, ActivityOptions& options, const char* name, const char* help);
/// Lets the artist play the file, if one was given; and the view, which may say how, be of a time that the file holds. Throws
/// Error when it is not, or when the activity is of another circuit. Says so when there is nothing to see in it.
void play(Artist& artist, const ActivityOptions& options, scene::View& view, Console& console);

/// --background and --colour-by.
void add_look(CLI::App& command, Look& look, const char* usual_background = "as the view says, or dark",
              const char* usual_colours = "as the view says");
/// --no-legend and --scale.
void add_marks(CLI::App& command, Marks& marks);

/// "1920x1080" to numbers; throws Error.
std::pair<std::uint32_t, std::uint32_t> parse_size(const std::string& text);

}  // namespace forest::cli
