// SPDX-License-Identifier: Apache-2.0
// The studio with a person at it: the program itself on a display (Xvfb under ctest), driven by real mouse and keyboard events
// (xdotool), and asked what it did by its own --report.
#pragma once

#include <csignal>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "forest/core/random.h"
#include "forest/io/png.h"
#include "forest/scene/pick.h"
#include "forest/scene/playback.h"
#include "forest/scene/view.h"

namespace forest::studio {

using Json = nlohmann::json;
inline constexpr int patience = 120'000;  // milliseconds before a program that says nothing is given up
inline const std::filesystem::path folder = STUDIO_TEST_FOLDER;

std::filesystem::path sample_file();
const scene::Forest& sample();
/// A made-up simulation of its neurons: 300 steps of 0.5 ms.
std::filesystem::path sample_activity();
/// Made-up synapses on its neurons.
std::filesystem::path sample_synapses();

/// A running studio.
class Studio {
 public:
  explicit Studio(std::vector<std::string> arguments);
  ~Studio();
  Studio(const Studio&) = delete;
  Studio& operator=(const Studio&) = delete;

  /// The next report of that event; those before it are passed over.
  Json wait_for(const std::string& event);
  void send(int signal) { kill(pid_, signal); }
  /// What it said in the end, and its exit status.
  std::pair<std::string, int> end();

 private:
  std::string next_line();

  pid_t pid_ = -1;
  int out_ = -1, error_ = -1;
  std::string heard_;
};

void xdotool(const std::string& what);

/// A studio on the sample from a near view, with a hand on its mouse.
class Window : public ::testing::Test {
 protected:
  virtual std::vector<std::string> more() const { return {}; }  // arguments
  virtual float nearness() const { return .45f; }  // of the eye: share of the distance from which all is seen

  void SetUp() override;

  // Waits until the picture is finished and remembers what is seen.
  void finish();
  // The same after everything that the hand did so far: events are worked off in order, and Escape (which leaves
  // nothing selected) is answered at once. What was finished before, between two moves of a slow mouse, is passed over.
  void settle();
  frame::Viewport viewport() const {
    return {picture_.at("width").get<float>(), picture_.at("height").get<float>()};
  }
  std::string place(const Vec2& pixel) const {  // on the screen
    return fmt::format("{} {}", int(pixel.x()) + picture_.at("x").get<int>(),
                       int(pixel.y()) + picture_.at("y").get<int>());
  }
  void point(const Vec2& pixel) { xdotool("mousemove " + place(pixel)); }
  Json click(const Vec2& pixel);
  void drag(int button, const Vec2& from, const Vec2& to, const std::string& with = "");
  void key(const std::string& key) { xdotool("key " + key); }
  // The picture alone, as Ctrl+S saves it.
  io::Picture saved(const std::string& name);

  // Until the dialog has written it. Where names to choose from popped up below the typed one, they took the first Return.
  void wait_for_file(const std::filesystem::path& path, const std::string& dialog);
  // How many windows of that name are seen.
  static int windows(const std::string& name);
  // Presses a key until there are so many: names to choose from, below the typed one, may take it.
  void press_until(const std::string& pressed, const std::string& name, int count);

  std::unique_ptr<Studio> studio_;
  scene::View view_;
  Json picture_, activity_, cut_off_;
  std::size_t synapses_ = 0, skin_ = 0;
};

struct Target {
  Vec2 pixel;
  std::optional<scene::Pick> pick;
};
/// A pixel that shows a branch (or nothing) so clearly that a few pixels more or less do not matter.
Target clear_target(Random& random, const scene::View& view, const frame::Viewport& viewport, bool something);

/// What the window shows of a view, drawn without one; with a playback, of the view's moment.
io::Picture without_a_window(scene::View view, std::uint32_t width, std::uint32_t height,
                             scene::Playback* playback = nullptr);

/// Share of the pixels that differ visibly.
double difference(const io::Picture& a, const io::Picture& b);

}  // namespace forest::studio
