// SPDX-License-Identifier: Apache-2.0
// brainforest-studio: a window on a forest file.
#include <QApplication>
#include <QSurfaceFormat>
#include <QTimer>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>

#include <CLI/CLI.hpp>

#include "forest/core/error.h"
#include "forest/io/node_sets.h"

#include "apps/studio/report.h"
#include "apps/studio/theme.h"
#include "apps/studio/window.h"
#include "apps/view_text.h"

namespace forest::studio {
namespace {

struct Options {
  std::filesystem::path forest, activity, screenshot;
  std::string view, size;
  std::vector<std::filesystem::path> node_sets;
  bool report = false;
};

int fail(const std::string& sentence) {
  std::fprintf(stderr, "brainforest-studio: %s\n", sentence.c_str());
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

QSize size_of(const std::string& text) {
  int width = 0, height = 0;
  char rest = 0;
  if (std::sscanf(text.c_str(), "%dx%d%c", &width, &height, &rest) != 2 || width < 320 || height < 240 ||
      width > 16384 || height > 16384)
    throw Error("the size '" + text + "' is not understood; give it in pixels as 1280x800, at least 320x240");
  return {width, height};
}

int run(const Options& options, int& argc, char** argv) {
  const scene::Forest forest = scene::Forest::open(options.forest);
  scene::View view = scene::overview(forest);
  view.camera.near = .5f;
  if (!options.view.empty()) view = read_view(options.view);
  std::optional<scene::Playback> playback;
  if (!options.activity.empty()) playback.emplace(scene::Playback::open(forest, options.activity));
  const QSize size = options.size.empty() ? QSize() : size_of(options.size);

  QSurfaceFormat format;
  format.setVersion(4, 5);
  format.setProfile(QSurfaceFormat::CoreProfile);
  format.setSwapInterval(1);
  format.setOption(QSurfaceFormat::ResetNotification);  // a card that is reset is told, and ends nothing
  QSurfaceFormat::setDefaultFormat(format);
  qInstallMessageHandler(on_qt_message);
  QApplication application(argc, argv);
  application.setOrganizationName("Brain Forest");
  application.setApplicationName("Studio");
  apply_theme(application);

  circuit::NodeSets sets = io::node_sets_of(forest.nodes());
  for (const auto& file : options.node_sets) {
    circuit::NodeSets more = io::read_node_sets(file);
    for (circuit::NodeSet& set : more.sets) sets.put(std::move(set));
    sets.source = options.node_sets.size() == 1 ? more.source : "the node sets";
  }
  Window window(forest, view, QString::fromStdString(options.forest.filename().string()), std::move(sets));
  if (size.isValid()) window.resize(size);
  if (options.report) report(window);
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
  QTimer::singleShot(0, &application, [&] {
    if (!window.viewport().isValid())
      end(
          fail("this display offers no OpenGL 4.5; install a newer graphics driver, or set "
               "LIBGL_ALWAYS_SOFTWARE=1 to draw on the processor"));
  });
  const int code = application.exec();
  return status ? status : code;
}

}  // namespace
}  // namespace forest::studio

int main(int argc, char** argv) {
  using namespace forest::studio;
  Options options;
  CLI::App app{"A window on a forest: orbit, fly, and ask any branch what it is.", "brainforest-studio"};
  app.add_option("FOREST", options.forest, "A forest file, made by 'brainforest pack'")->required();
  app.add_option("--view", options.view, "Begin with this view: a JSON file, or the text that Ctrl+C copies");
  app.add_option("--node-sets", options.node_sets,
                 "SONATA node sets, JSON files: names that targets may use besides the forest's own");
  app.add_option("--activity", options.activity,
                 "A simulation to play on the branches: an activity file, made by 'brainforest activity'");
  app.add_option("--size", options.size, "Size of the window in pixels, for example 1280x800");
  app.add_option("--screenshot", options.screenshot, "Write a PNG of the window once it is drawn, and end");
  app.add_flag("--report", options.report, "Print selections and views as lines of JSON on standard output");
  app.set_version_flag("--version", FOREST_VERSION);
  app.footer(
      "Example:\n  brainforest-studio column.forest --view inside.json\nF1 in the window lists keys and "
      "mouse.");
  app.failure_message(CLI::FailureMessage::simple);
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
