// SPDX-License-Identifier: Apache-2.0
// brainforest-studio: a window on a forest file.
#include <QApplication>
#include <QOffscreenSurface>
#include <QOpenGLContext>
#include <QSurfaceFormat>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string_view>

#include <CLI/CLI.hpp>

#include "forest/core/error.h"
#include "forest/core/signals.h"
#include "forest/core/standard_error.h"

#include "apps/choice.h"
#include "apps/drawer.h"
#include "apps/forest_files.h"
#include "apps/node_set_files.h"
#include "apps/studio/report.h"
#include "apps/studio/theme.h"
#include "apps/studio/window.h"
#include "apps/surface_files.h"
#include "apps/view_text.h"

namespace forest::studio {
namespace {

struct Options {
  std::filesystem::path forest, activity, synapses, screenshot;
  std::vector<std::filesystem::path> surfaces, overlays;
  std::string view, size;
  std::vector<std::filesystem::path> node_sets;
  bool report = false;
  Drawer drawer = Drawer::automatic;
};

void say(const std::string& sentence) { std::fprintf(stderr, "brainforest-studio: %s\n", sentence.c_str()); }
int fail(const std::string& sentence) {
  say(sentence);
  return 1;
}

// Qt ends the program when there is no display; a person deserves a sentence.
void on_qt_message(QtMsgType type, const QMessageLogContext&, const QString& text) {
  if (type == QtFatalMsg)
    std::_Exit(
        fail("there is no display that a window could open on; use 'brainforest render' for pictures without "
             "one"));
  if (type == QtCriticalMsg) std::fprintf(stderr, "%s\n", qPrintable(text));
}

// Of any version: what a window is put together with. Qt ends in a crash where there is none.
bool offers_opengl() {
  if (QGuiApplication::platformName() == "offscreen")
    return false;  // it offers some, and then fails to show it
  QOffscreenSurface surface;
  surface.create();
  QOpenGLContext context;
  return context.create() && context.makeCurrent(&surface);
}

// A picture replaces an older one, and nothing else.
void must_be_picture(const std::filesystem::path& place) {
  constexpr std::string_view mark = "\x89PNG\r\n";
  std::error_code none;
  if (!std::filesystem::is_regular_file(place, none) || std::filesystem::file_size(place, none) == 0) return;
  std::string first(mark.size(), 0);
  std::ifstream(place, std::ios::binary).read(first.data(), std::streamsize(first.size()));
  if (first != mark)
    throw Error(place.string() +
                " is there and is no PNG picture, so nothing was written; choose another name");
}

QSize size_of(const std::string& text) {
  int width = 0, height = 0;
  char rest = 0;
  if (std::sscanf(text.c_str(), "%dx%d%c", &width, &height, &rest) != 2 || width < 320 || height < 240 ||
      width > 16384 || height > 16384)
    throw Error("the size '" + text + "' is not understood; give it in pixels as 1280x800, at least 320x240");
  return {width, height};
}

// Those that were named, or that lie beside the forest; what lies there and is of another forest is told, not shown.
std::optional<scene::Synapses> synapses_of(const Options& options, const scene::Forest& forest) {
  if (!options.synapses.empty()) return scene::Synapses::open(options.synapses, forest);
  const auto beside = scene::Synapses::beside(options.forest);
  std::error_code unseen;  // in a folder that may not be looked into nothing lies beside
  if (forest.instances().empty() || !std::filesystem::exists(beside, unseen)) return std::nullopt;
  try {
    return scene::Synapses::open(beside, forest);
  } catch (const InputError& error) {
    say(std::string("the synapses are not shown: ") + error.what());
    return std::nullopt;
  }
}

int run(const Options& options, int& argc, char** argv) {
  std::vector<std::filesystem::path> surface_files = options.surfaces;
  const bool alone = is_surface(options.forest);
  if (alone) surface_files.insert(surface_files.begin(), options.forest);
  const scene::Forest forest =
      alone ? scene::Forest::from_bytes(scene::pack(circuit::Circuit{}, {})) : open_forest(options.forest);
  scene::Surfaces surfaces;
  add_surfaces(surfaces, {surface_files, options.overlays});
  const QSize size = options.size.empty() ? QSize() : size_of(options.size);
  // About what panels and bars leave of the window, narrow rather than wide.
  const QSize about = size.isValid() ? size : QSize(1280, 800);
  scene::View view =
      scene::overview(forest, float(std::max(200, about.width() - 340)) / float(about.height() - 40));
  view.camera.near = .5f;
  if (alone) view.camera = surfaces.camera(surfaces.outside(), 1.6f), view.fog = 0.f;
  bool skin = false;
  if (!options.view.empty()) {
    view = read_view(options.view, forest.circuit().up, &view);
    skin = asks_for_skin(
        [&](const scene::View& unless) { return read_view(options.view, forest.circuit().up, &unless); });
  }
  std::optional<scene::Playback> playback;
  if (!options.activity.empty()) playback.emplace(scene::Playback::open(forest, options.activity));
  std::optional<scene::Synapses> synapses = synapses_of(options, forest);
  circuit::NodeSets sets =
      read_node_sets(forest, options.node_sets, [](const std::string& sentence) { say(sentence); });

  QSurfaceFormat format;
  format.setVersion(4, 5);
  format.setProfile(QSurfaceFormat::CoreProfile);
  format.setSwapInterval(1);
  format.setOption(QSurfaceFormat::ResetNotification);  // a card that is reset is told, and ends nothing
  QSurfaceFormat::setDefaultFormat(format);
  must_be_picture(options.screenshot);
  qInstallMessageHandler(on_qt_message);
  QApplication application(argc, argv);
  application.setOrganizationName("Brain Forest");
  application.setApplicationName("Studio");
  if (!offers_opengl())
    return fail(
        "this display offers no OpenGL, by which the window shows even what the processor draws; install "
        "libgl1-mesa-dri or "
        "a driver of the graphics card, or use 'brainforest render' for pictures without one");
  apply_theme(application);

  Window window(forest, view, QString::fromStdString(options.forest.filename().string()), std::move(sets),
                options.drawer);
  if (size.isValid()) window.resize((QSizeF(size) / window.devicePixelRatioF()).toSize());
  if (options.report) report(window);
  if (skin) {
    Settings settings = window.viewport().settings();
    settings.skin = true;
    window.viewport().change(settings);
  }
  if (!surfaces.empty()) window.viewport().show(surfaces);
  if (synapses) window.viewport().show(std::move(*synapses));
  if (playback) window.viewport().play(std::move(*playback));
  int status = 0;
  const auto end = [&](int code) { application.exit(status = code); };
  QObject::connect(
      &window.viewport(), &Viewport::failed, &application,
      [&](const QString& sentence) { end(fail(sentence.toStdString())); }, Qt::QueuedConnection);
  if (!options.screenshot.empty())
    QObject::connect(
        &window.viewport(), &Viewport::settled, &application,
        [&] {
          try {
            write_image(options.screenshot, window.grab().toImage());
            end(0);
          } catch (const std::exception& error) {
            end(fail(error.what()));
          }
        },
        Qt::QueuedConnection);
  window.show();
  window.activateWindow();
  const int code = application.exec();
  return status ? status : code;
}

}  // namespace
}  // namespace forest::studio

int main(int argc, char** argv) {
  using namespace forest::studio;
  forest::keep_standard_streams();
  forest::say_signals("brainforest-studio");
  Options options;
  CLI::App app{"A window on a forest: orbit, fly, and ask any branch what it is.", "brainforest-studio"};
  app.add_option("FOREST", options.forest,
                 "A forest file, made by 'brainforest pack', or the surface of a cortex")
      ->required();
  app.add_option("--view", options.view, "Begin with this view: a JSON file, or the text that Ctrl+C copies");
  app.add_option("--node-sets", options.node_sets,
                 "SONATA node sets, JSON files: names that targets may use besides the forest's own");
  app.add_option("--activity", options.activity,
                 "A simulation to play on the branches: an activity file, made by 'brainforest activity'");
  app.add_option(
      "--synapses", options.synapses,
      "Synapses, made by 'brainforest pack'; by default those of column.synapses beside column.forest");
  app.add_option("--surface", options.surfaces,
                 "Surface of a cortex to show, too: GIFTI, FreeSurfer's lh.pial, PLY, STL or OBJ")
      ->allow_extra_args(false);
  app.add_option("--overlay", options.overlays, "Values or areas that colour the surfaces, in their order")
      ->allow_extra_args(false);
  app.add_option("--size", options.size, "Size of the window in pixels of the screen, for example 1280x800");
  forest::add_renderer(app, options.drawer);
  app.add_option("--screenshot", options.screenshot, "Write a PNG of the window once it is drawn, and end")
      ->check([](const std::string& name) {
        return name.ends_with(".png")
                   ? std::string()
                   : "'" + name + "' is no picture that can be written; end its name in .png";
      });
  app.add_flag("--report", options.report, "Print selections and views as lines of JSON on standard output");
  app.set_version_flag("--version", FOREST_VERSION);
  app.footer(
      "Example:\n  brainforest-studio column.forest --view inside.json\nF1 in the window lists keys and "
      "mouse.");
  app.failure_message([](const CLI::App*, const CLI::Error& error) {
    return forest::sentence_of(error) + "\nRun with --help for more information.\n";
  });
  forest::refuse_empty(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  try {
    return run(options, argc, argv);
  } catch (const std::bad_alloc&) {
    return fail("there is not enough memory for this forest");
  } catch (const std::exception& error) {
    return fail(error.what());
  }
}
