// SPDX-License-Identifier: Apache-2.0
// The studio as a person uses it: the program itself on a display (Xvfb under ctest), driven by real mouse and keyboard
// events (xdotool), and asked what it did by its own --report.
#include <array>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <map>
#include <poll.h>
#include <set>
#include <unistd.h>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <sys/wait.h>

#include "forest/core/file.h"
#include "forest/core/random.h"
#include "forest/io/png.h"
#include "forest/render/opengl/context.h"
#include "forest/render/opengl/opengl_renderer.h"
#include "forest/reports/trace.h"
#include "forest/scene/pick.h"
#include "forest/scene/playback.h"
#include "forest/scene/synapses.h"
#include "forest/scene/view.h"

#include "tests/sample_activity.h"
#include "tests/sample_forest.h"

namespace forest::studio {
namespace {

using Json = nlohmann::json;
constexpr int patience = 120'000;  // milliseconds before a program that says nothing is given up

const std::filesystem::path folder = STUDIO_TEST_FOLDER;

std::filesystem::path sample_file() {
  static const std::filesystem::path path = [] {
    std::filesystem::create_directories(folder);
    write_file(folder / "sample.forest",
               scene::pack(testing::sample_circuit(120), testing::sample_neurons()));
    return folder / "sample.forest";
  }();
  return path;
}
const scene::Forest& sample() {
  static const scene::Forest forest = scene::Forest::open(sample_file());
  return forest;
}

// A made-up simulation of its neurons: 300 steps of 0.5 ms.
std::filesystem::path sample_activity() {
  static const std::filesystem::path path = [] {
    const auto circuit = testing::sample_circuit(120);
    const auto neurons = testing::sample_neurons();
    const auto report = reports::synthetic_report(circuit, neurons,
                                                  {.compartments = 150, .steps = 300, .step = .5, .seed = 2});
    write_file(folder / "sample.activity", testing::packed_activity(report, circuit, neurons));
    return folder / "sample.activity";
  }();
  sample_file();
  return path;
}

// Made-up synapses on its neurons.
std::filesystem::path sample_synapses() {
  static const std::filesystem::path path = [] {
    const auto made =
        circuit::made_up_synapses(testing::sample_circuit(120), testing::sample_neurons(), "p", 60, 2);
    write_file(folder / "contacts.synapses", scene::Synapses::make(sample(), std::span(&made, 1)));
    return folder / "contacts.synapses";
  }();
  return path;
}

// A running studio.
class Studio {
 public:
  explicit Studio(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), STUDIO_PROGRAM);
    int out[2], error[2];
    if (pipe(out) || pipe(error)) throw std::runtime_error("no pipe");
    pid_ = fork();
    if (pid_ == 0) {
      dup2(out[1], 1), dup2(error[1], 2);
      for (const int end : {out[0], out[1], error[0], error[1]}) close(end);
      std::vector<char*> words;
      for (auto& a : arguments) words.push_back(a.data());
      words.push_back(nullptr);
      execv(words[0], words.data());
      _exit(127);
    }
    close(out[1]), close(error[1]);
    out_ = out[0], error_ = error[0];
  }
  ~Studio() {
    if (pid_ > 0) kill(pid_, SIGKILL), waitpid(pid_, nullptr, 0);
    close(out_), close(error_);
  }
  Studio(const Studio&) = delete;
  Studio& operator=(const Studio&) = delete;

  /// The next report of that event; those before it are passed over.
  Json wait_for(const std::string& event) {
    for (;;) {
      const Json line = Json::parse(next_line());
      if (line.at("event") == event) return line;
    }
  }
  void send(int signal) { kill(pid_, signal); }
  /// What it said in the end, and its exit status.
  std::pair<std::string, int> end() {
    std::string said;
    std::array<char, 4096> part;
    for (ssize_t n; (n = read(error_, part.data(), part.size())) > 0;)
      said.append(part.data(), std::size_t(n));
    int status = 0;
    waitpid(std::exchange(pid_, -1), &status, 0);
    return {said, WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status)};
  }

 private:
  std::string next_line() {
    for (;;) {
      if (const auto at = heard_.find('\n'); at != std::string::npos) {
        const std::string line = heard_.substr(0, at);
        heard_.erase(0, at + 1);
        return line;
      }
      pollfd ready{out_, POLLIN, 0};
      if (poll(&ready, 1, patience) <= 0) throw std::runtime_error("the studio says nothing any more");
      std::array<char, 4096> part;
      const ssize_t n = read(out_, part.data(), part.size());
      if (n <= 0) throw std::runtime_error("the studio has ended: " + end().first);
      heard_.append(part.data(), std::size_t(n));
    }
  }

  pid_t pid_ = -1;
  int out_ = -1, error_ = -1;
  std::string heard_;
};

void xdotool(const std::string& what) {
  ASSERT_EQ(std::system(("xdotool " + what).c_str()), 0) << "xdotool " << what;
}

// A studio on the sample from a near view, with a hand on its mouse.
class Window : public ::testing::Test {
 protected:
  virtual std::vector<std::string> more() const { return {}; }  // arguments
  virtual float nearness() const { return .45f; }  // of the eye: share of the distance from which all is seen

  void SetUp() override {
    if (!std::getenv("DISPLAY")) GTEST_SKIP() << "there is no display; ctest runs this under xvfb-run";
    scene::View view = scene::overview(sample());
    view.camera.near = .5f;
    view.camera.eye = view.camera.target + nearness() * (view.camera.eye - view.camera.target);
    view.samples = 4;
    write_file(folder / "near.json", scene::to_json(view));
    setenv("XDG_CONFIG_HOME", (folder / "settings").c_str(), 1);
    std::filesystem::remove_all(folder / "settings");
    std::vector<std::string> arguments{sample_file(), "--view",   folder / "near.json",
                                       "--size",      "1280x800", "--report"};
    for (const std::string& word : more()) arguments.push_back(word);
    studio_ = std::make_unique<Studio>(arguments);
    finish();
    xdotool("search --sync --onlyvisible --name 'Brain Forest' windowfocus");
    settle();
  }

  // Waits until the picture is finished and remembers what is seen.
  void finish() {
    const Json report = studio_->wait_for("settled");
    view_ = scene::parse_view(report.at("view").dump());
    picture_ = report.at("picture");
    activity_ = report.at("activity");
    synapses_ = report.at("synapses");
    skin_ = report.at("skin_triangles");
    cut_off_ = report.at("cut_off");
  }
  // The same after everything that the hand did so far: events are worked off in order, and Escape (which leaves
  // nothing selected) is answered at once. What was finished before, between two moves of a slow mouse, is passed over.
  void settle() {
    key("Escape");
    studio_->wait_for("selected");
    finish();
  }
  frame::Viewport viewport() const {
    return {picture_.at("width").get<float>(), picture_.at("height").get<float>()};
  }
  std::string place(const Vec2& pixel) const {  // on the screen
    return fmt::format("{} {}", int(pixel.x()) + picture_.at("x").get<int>(),
                       int(pixel.y()) + picture_.at("y").get<int>());
  }
  void point(const Vec2& pixel) { xdotool("mousemove " + place(pixel)); }
  Json click(const Vec2& pixel) {
    xdotool("mousemove " + place(pixel) + " click 1");
    return studio_->wait_for("selected").at("facts");
  }
  void drag(int button, const Vec2& from, const Vec2& to, const std::string& with = "") {
    const Vec2 half = .5f * (from + to);
    xdotool(fmt::format("{} mousemove {} mousedown {} mousemove {} mousemove {} mouseup {} {}",
                        with.empty() ? "" : "keydown " + with, place(from), button, place(half), place(to),
                        button, with.empty() ? "" : "keyup " + with));
    settle();
  }
  void key(const std::string& key) { xdotool("key " + key); }
  // The picture alone, as Ctrl+S saves it.
  io::Picture saved(const std::string& name) {
    const std::filesystem::path path = folder / name;
    std::filesystem::remove(path);
    key("ctrl+s");
    xdotool("search --sync --onlyvisible --name 'Save picture' windowfocus");
    xdotool(fmt::format("key ctrl+a type --delay 5 '{}'", path.string()));
    key("Return");
    wait_for_file(path, "Save picture");
    finish();
    xdotool("search --sync --onlyvisible --name 'Brain Forest' windowfocus");
    return io::read_png(path);
  }

  // Until the dialog has written it. Where names to choose from popped up below the typed one, they took the first Return.
  void wait_for_file(const std::filesystem::path& path, const std::string& dialog) {
    for (int i = 1; i < patience / 50 && !std::filesystem::exists(path); ++i) {
      usleep(50'000);
      if (i % 60 == 0 && windows(dialog) == 1) key("Return");
    }
  }
  // How many windows of that name are seen.
  static int windows(const std::string& name) {
    const auto list = folder / "seen_windows";
    // Fails where there is none.
    [[maybe_unused]] const int found =
        std::system(fmt::format("xdotool search --onlyvisible --name '{}' >{}", name, list.string()).c_str());
    const MappedFile lines(list);
    return int(std::ranges::count(lines.text(), '\n'));
  }
  // Presses a key until there are so many: names to choose from, below the typed one, may take it.
  void press_until(const std::string& pressed, const std::string& name, int count) {
    for (int i = 0; i < 600 && windows(name) != count; ++i) {
      if (i % 60 == 0) key(pressed);
      usleep(50'000);
    }
    ASSERT_EQ(windows(name), count) << name;
  }

  std::unique_ptr<Studio> studio_;
  scene::View view_;
  Json picture_, activity_, cut_off_;
  std::size_t synapses_ = 0, skin_ = 0;
};

class Contacts : public Window {
 protected:
  std::vector<std::string> more() const override { return {"--synapses", sample_synapses()}; }
};

class Near : public Window {
 protected:
  float nearness() const override { return .06f; }
};

// Drawn by OpenGL, of which the driver can be made to say that the card was reset.
class OnACard : public Window {
 protected:
  std::vector<std::string> more() const override { return {"--renderer", "opengl"}; }
  void SetUp() override {
    setenv("LD_PRELOAD", STUDIO_LOST_CARD, 1);
    Window::SetUp();
    unsetenv("LD_PRELOAD");
  }
  // Resets it, and moves; what the studio says of it.
  Json reset() {
    studio_->send(SIGUSR1);
    key("Left");
    const Json said = studio_->wait_for("recovered");
    finish();
    xdotool("search --sync --onlyvisible --name 'Brain Forest' windowfocus");
    return said;
  }
};

class Playing : public Window {
 protected:
  std::vector<std::string> more() const override { return {"--activity", sample_activity()}; }
  double time() const { return activity_.at("time").get<double>(); }
};

// What was written whole is damaged later, by a disk or on its way: the header is right, values are not.
class PlayingDamaged : public Window {
 protected:
  std::vector<std::string> more() const override {
    std::string bytes = std::string(MappedFile(sample_activity()).text());
    for (std::size_t i = bytes.size() / 3; i < bytes.size() / 2; ++i) bytes[i] = char(~bytes[i]);
    write_file(folder / "damaged.activity", bytes);
    return {"--activity", folder / "damaged.activity"};
  }
};

struct Target {
  Vec2 pixel;
  std::optional<scene::Pick> pick;
};
// A pixel that shows a branch (or nothing) so clearly that a few pixels more or less do not matter.
Target clear_target(Random& random, const scene::View& view, const frame::Viewport& viewport,
                    bool something) {
  for (;;) {
    const Vec2 pixel(float(20 + random.below(std::uint32_t(viewport.width) - 40)),
                     float(20 + random.below(std::uint32_t(viewport.height) - 40)));
    const std::vector<Vec2> middle{pixel + Vec2(.5f, .5f)};
    const auto exact = scene::plain_picks(sample(), view.camera, viewport, middle, 0.f)[0],
               rough = scene::plain_picks(sample(), view.camera, viewport, middle, 5.f)[0];
    if (!something && !rough) return {pixel, {}};
    if (something && exact && rough && exact->instance == rough->instance && exact->section == rough->section)
      return {pixel, exact};
  }
}

double difference(const io::Picture& a, const io::Picture& b) {  // share of pixels that differ visibly
  std::size_t differing = 0;
  for (std::size_t i = 0; i < a.pixels.size(); i += 4) {
    int most = 0;
    for (std::size_t c = 0; c < 3; ++c) most = std::max(most, std::abs(a.pixels[i + c] - b.pixels[i + c]));
    differing += most > 12;
  }
  return double(differing) / double(a.pixels.size() / 4);
}

TEST_F(Window, ClickSelectsWhatBruteForceFinds) {
  Random random(11);
  for (int i = 0; i < 6; ++i) {
    const Target target = clear_target(random, view_, viewport(), true);
    const Json facts = click(target.pixel);
    ASSERT_FALSE(facts.is_null());
    EXPECT_EQ(facts.at("neuron"), target.pick->instance);
    const bool soma = target.pick->section == scene::soma_section;
    EXPECT_EQ(facts.at("section"), soma ? Json("soma") : Json(target.pick->section));
  }
  EXPECT_TRUE(click(clear_target(random, view_, viewport(), false).pixel).is_null());
}

TEST_F(Window, SelectionIsLitInThePictureAndEscapePutsItOut) {
  Random random(12);
  const Target target = clear_target(random, view_, viewport(), true);
  const io::Picture before = saved("before.png");
  click(target.pixel);
  finish();
  const io::Picture lit = saved("lit.png");
  const auto at = [&](const io::Picture& p) {
    const std::size_t i = 4 * (std::size_t(target.pixel.y()) * p.width + std::size_t(target.pixel.x()));
    return std::array<int, 3>{p.pixels[i], p.pixels[i + 1], p.pixels[i + 2]};
  };
  EXPECT_NE(at(before), at(lit));
  EXPECT_GT(at(lit)[0], at(lit)[2]);  // the picked section is red
  EXPECT_GT(difference(before, lit), .02);
  key("Escape");
  EXPECT_TRUE(studio_->wait_for("selected").at("facts").is_null());
  finish();
  EXPECT_EQ(saved("after.png").pixels, before.pixels);
}

TEST_F(Window, DragOrbitsAboutTheTarget) {
  const io::Picture before = saved("orbit_before.png");
  const scene::View old = view_;
  drag(1, {300, 300}, {420, 260});
  EXPECT_EQ(view_.camera.target, old.camera.target);
  const float distance = (old.camera.eye - old.camera.target).norm();
  EXPECT_NEAR((view_.camera.eye - view_.camera.target).norm(), distance, 1e-3f * distance);
  EXPECT_GT((view_.camera.eye - old.camera.eye).norm(), .2f * distance);
  EXPECT_GT(difference(before, saved("orbit_after.png")), .1);
}

TEST_F(Window, SavedPictureIsThatOfTheViewDrawnWithoutAWindow) {
  drag(1, {300, 300}, {380, 330});
  key("o");  // no outline
  settle();
  const io::Picture seen = saved("window.png");
  const render::OffscreenContext context;
  render::OpenGLRenderer renderer;
  renderer.load(sample().geometry());
  scene::View view = view_;
  view.samples = 16;
  const auto width = seen.width, height = seen.height;
  const frame::Viewport pixels{float(width), float(height)};
  const scene::Colouring colouring = scene::colour(sample(), view.colour_by, view.background);
  const scene::Cut cut = scene::choose(
      sample(), scene::Eye(view.camera, pixels, scene::detail_for(view, width, height)), pixels);
  renderer.draw(scene::compose(sample(), view, colouring, cut, width, height));
  EXPECT_LT(difference(seen, {width, height, renderer.read().pixels}), .001);
}

TEST_F(Window, WheelComesNearerToWhatIsUnderTheMouse) {
  const scene::View old = view_;
  point({200, 200});
  xdotool("click 4");
  settle();
  const float before = (old.camera.eye - old.camera.target).norm(),
              after = (view_.camera.eye - view_.camera.target).norm();
  EXPECT_LT(after, .95f * before);
  const auto at_target_depth = [&](const frame::Camera& camera) -> Vec3 {
    const Ray ray = ray_through(camera, viewport(), {200, 200});
    const Vec3 forward = (camera.target - camera.eye).normalized();
    return camera.eye + ray.direction * ((camera.target - camera.eye).norm() / ray.direction.dot(forward));
  };
  EXPECT_LT((at_target_depth(old.camera) - at_target_depth(view_.camera)).norm(), 1.f);
}

TEST_F(Window, RightDragAndShiftDragMoveAcross) {
  for (const auto& [button, with] : {std::pair(3, ""), std::pair(1, "shift")}) {
    const scene::View old = view_;
    drag(button, {300, 300}, {360, 300}, with);
    const Vec3 moved = project(view_.camera, viewport(), old.camera.target);
    EXPECT_NEAR(moved.x(), .5f * viewport().width + 60.f, 1.f);
    EXPECT_NEAR(moved.y(), .5f * viewport().height, 1.f);
  }
}

TEST_F(Window, KeysFlyAndTurn) {
  point({300, 300});
  const scene::View old = view_;
  const Vec3 forward = (old.camera.target - old.camera.eye).normalized();
  xdotool("keydown w sleep 0.3 keyup w");
  settle();
  EXPECT_GT((view_.camera.eye - old.camera.eye).dot(forward), 5.f);
  const scene::View flown = view_;
  key("e");
  settle();
  EXPECT_GT((view_.camera.eye - flown.camera.eye).dot(flown.camera.axes().col(1)), 1.f);
  const scene::View risen = view_;
  key("Left");
  settle();
  EXPECT_EQ(view_.camera.eye, risen.camera.eye);
  EXPECT_LT((view_.camera.target - risen.camera.target).dot(risen.camera.axes().col(0)), -1.f);
  key("v");  // fly: a drag now turns the eye where it is
  const scene::View turned = view_;
  drag(1, {300, 300}, {340, 300});
  EXPECT_EQ(view_.camera.eye, turned.camera.eye);
  EXPECT_GT((view_.camera.target - turned.camera.target).dot(turned.camera.axes().col(0)), 1.f);
}

TEST_F(Window, CentreGoesToTheSelection) {
  Random random(13);
  const Target target = clear_target(random, view_, viewport(), true);
  click(target.pixel);
  finish();
  key("f");
  finish();
  // All of the subarbor is in sight now, and its middle in the middle.
  for (const std::uint32_t segment : scene::subarbor(sample(), target.pick->instance, target.pick->section)) {
    const Vec3 seen =
        project(view_.camera, viewport(), scene::in_world(sample(), target.pick->instance, segment).a);
    EXPECT_GT(seen.z(), 0.f);
    EXPECT_NEAR(seen.x(), .5f * viewport().width, .55f * viewport().height);
    EXPECT_NEAR(seen.y(), .5f * viewport().height, .55f * viewport().height);
  }
}

TEST_F(Window, ViewIsCopiedAndPasted) {
  key("ctrl+c");
  const scene::View old = view_;
  drag(1, {300, 300}, {420, 260});
  ASSERT_NE(scene::to_json(view_), scene::to_json(old));
  key("ctrl+v");
  settle();
  EXPECT_EQ(scene::to_json(view_), scene::to_json(old));
}

TEST_F(Window, APathOfViewsIsFlownToItsEnd) {
  scene::View end = view_;
  end.camera.eye += Vec3(120, 40, -60);
  end.colour_by = scene::ColourBy::layer;
  const auto path = folder / "path.jsonl";
  write_file(path, scene::to_json(view_) + "\n" + scene::to_json(end) + "\n");
  key("ctrl+shift+k");
  xdotool("search --sync --onlyvisible --name 'Path of views' windowfocus");
  xdotool(fmt::format("key ctrl+a type --delay 5 '{}'", path.string()));
  key("Return");
  for (int i = 0; i < 4 && view_.colour_by != end.colour_by; ++i)
    finish();  // the first may be that of the dialog
  EXPECT_EQ(view_.colour_by, end.colour_by);
  EXPECT_LT((view_.camera.eye - end.camera.eye).norm(), 1.f);
}

TEST_F(Window, ControlsHaveKeys) {
  key("b");
  settle();
  EXPECT_EQ(view_.background, scene::Background::light);
  key("c");
  settle();
  EXPECT_EQ(view_.colour_by, scene::ColourBy::layer);
  key("g");
  settle();
  EXPECT_TRUE(view_.detail.gaze.has_value());
  key("alt+x");
  xdotool("type 123");
  key("Return");
  settle();
  EXPECT_NEAR(view_.camera.eye.x(), 123.f, .1f);
  const io::Picture light = saved("light.png");
  EXPECT_GT(light.pixels[0], 200);
}

TEST_F(Window, TargetsAreShownAndHiddenByKeys) {
  const io::Picture before = saved("targets_before.png");
  // The list begins with the types: the first is hidden by Space on its row, and comes back.
  key("alt+t");
  key("space");
  settle();
  ASSERT_EQ(view_.targets.size(), 1u);
  EXPECT_EQ(view_.targets[0].name, "first");
  EXPECT_EQ(view_.targets[0].visible, false);
  EXPECT_GT(difference(before, saved("targets_hidden.png")), .02);
  key("alt+t");
  key("space");
  settle();
  EXPECT_EQ(view_.targets[0].visible, true);
  EXPECT_LT(difference(before, saved("targets_again.png")), .001);
  // Its opacity, its kind, its colour.
  key("alt+q");
  xdotool("key ctrl+a type 20");
  key("Return");
  settle();
  EXPECT_EQ(view_.targets.back().opacity, .2f);
  const io::Picture clear = saved("targets_clear.png");
  EXPECT_GT(difference(before, clear), .02);
  key("alt+k");
  xdotool("type Somata");
  settle();
  EXPECT_EQ(view_.targets.back().kind, frame::Kind::somata);
  key("alt+c");
  key("Down");
  settle();
  EXPECT_EQ(view_.targets.back().colour, 0xE69F00u);
  EXPECT_GT(difference(clear, saved("targets_somata.png")), .02);
}

TEST_F(Window, AnExpressionBecomesATarget) {
  key("alt+n");
  xdotool("type --delay 5 'first and not upper'");
  key("Return");
  settle();
  ASSERT_EQ(view_.targets.size(), 1u);
  EXPECT_EQ(view_.targets[0].name, "first and not upper");
  EXPECT_EQ(view_.targets[0].visible, true);
  // It is chosen, so that what is said next is meant of it.
  key("alt+c");
  key("Down");
  settle();
  ASSERT_EQ(view_.targets.size(), 1u);
  EXPECT_EQ(view_.targets[0].colour, 0xE69F00u);
  key("alt+n");
  xdotool("type --delay 5 'nobody of this name'");
  key("Return");
  settle();
  EXPECT_EQ(view_.targets.size(), 1u);  // the panel says why
}

TEST_F(Window, WhatIsHiddenCannotBePicked) {
  key("alt+t");
  key("End");  // all
  key("space");
  settle();
  ASSERT_EQ(view_.targets.size(), 1u);
  EXPECT_EQ(view_.targets[0].name, "all");
  Random random(14);
  const Target target = clear_target(random, view_, viewport(), true);
  EXPECT_TRUE(click(target.pixel).is_null());
}

TEST_F(Window, GazeFollowsTheMouse) {
  key("m");
  settle();
  point({100, 250});
  settle();
  ASSERT_TRUE(view_.detail.gaze);
  EXPECT_NEAR(view_.detail.gaze->x() * viewport().width, 100.f, 1.f);
  EXPECT_NEAR(view_.detail.gaze->y() * viewport().height, 250.f, 1.f);
}

TEST_F(Window, WhatSavingWouldReplaceIsAskedOfUnderItsTrueName) {
  const auto path = folder / "asked.png";
  write_file(path, "a person's own");
  key("ctrl+s");
  xdotool("search --sync --onlyvisible --name 'Save picture' windowfocus");
  xdotool(fmt::format("key ctrl+a type --delay 5 '{}'", (folder / "asked").string()));
  press_until("Return", "Save picture", 2);  // the question has the title of the dialog
  EXPECT_EQ(MappedFile(path).text(), "a person's own");
  press_until("Return", "Save picture", 1);  // no, unless one says yes; then the dialog is there again
  EXPECT_EQ(MappedFile(path).text(), "a person's own");
  EXPECT_FALSE(std::filesystem::exists(folder / "asked"));
}

TEST_F(Window, NoFieldOfThePanelsIsCutOff) { EXPECT_EQ(cut_off_, Json::array()); }

TEST_F(Window, KeysAndMouseAreExplainedOnTheScreen) {
  key("F1");
  const auto list = folder / "keys.txt";
  xdotool("search --sync --onlyvisible --name 'Keys and mouse' getwindowgeometry --shell >" + list.string());
  int x = -1, y = -1, width = 0, height = 0;
  const std::string said(MappedFile(list).text());
  ASSERT_EQ(std::sscanf(said.c_str(), "WINDOW=%*d X=%d Y=%d WIDTH=%d HEIGHT=%d", &x, &y, &width, &height), 4)
      << said;
  EXPECT_GE(x, 0);
  EXPECT_GE(y, 0);
  EXPECT_GT(height, 300);
  EXPECT_LE(x + width, 1280);
  EXPECT_LE(y + height, 800);  // the button at its lower end can be clicked
  // Every command has its name beside its key.
  std::map<std::string, std::string> names;
  const Json explained = studio_->wait_for("explained");
  for (const Json& row : explained.at("keys")) names.emplace(row.at("key"), row.at("name"));
  EXPECT_EQ(names.at("U"), "Surfaces");
  EXPECT_EQ(names.at("L"), "Legend");
  EXPECT_EQ(names.at("Ctrl+S"), "Save picture");
  EXPECT_EQ(names.at("Ctrl+1"), "Selection");
  EXPECT_EQ(std::ranges::count(names, "", &std::pair<const std::string, std::string>::second), 7)
      << "gestures alone say what they do without a name";
}

TEST_F(OnACard, ThatIsLostTheForestIsLoadedAnewAndThenDrawnByTheProcessor) {
  const Json first = reset();
  EXPECT_NE(first.at("renderer").get<std::string>().find("card was lost"), std::string::npos) << first;
  EXPECT_NE(first.at("why").get<std::string>().find("was reset by its driver"), std::string::npos) << first;
  const io::Picture again = saved("card_again.png");
  // The hand is answered as before, in the window that was made anew.
  const scene::View old = view_;
  key("Home");
  settle();
  key("ctrl+1");
  key("ctrl+1");
  drag(1, {100, 150}, {160, 160});
  EXPECT_NE(view_.camera.eye, old.camera.eye);
  const Json second = reset();
  EXPECT_NE(second.at("why").get<std::string>().find("The processor draws"), std::string::npos) << second;
  EXPECT_NE(second.at("renderer"), first.at("renderer"));
  const io::Picture by_processor = saved("card_processor.png");
  // Both show the forest: neither is black, nor one colour.
  for (const io::Picture& picture : {again, by_processor}) {
    std::set<std::uint8_t> reds;
    for (std::size_t i = 0; i < picture.pixels.size(); i += 4) reds.insert(picture.pixels[i]);
    EXPECT_GT(reds.size(), 40u);
  }
}

TEST_F(Playing, SpacePlaysAndStopsAndStepsGoBothWays) {
  EXPECT_EQ(time(), 0.);
  EXPECT_FALSE(activity_.at("playing").get<bool>());
  const io::Picture first = saved("moment_0.png");
  key("period period period");
  settle();
  EXPECT_NEAR(time(), 1.5, 1e-6);
  EXPECT_NEAR(view_.activity.value().time.value(), 1.5, 1e-6);
  key("comma");
  settle();
  EXPECT_NEAR(time(), 1., 1e-6);
  xdotool("key space sleep 0.8 key space");
  settle();
  EXPECT_FALSE(activity_.at("playing").get<bool>());
  EXPECT_GT(time(), 3.);
  EXPECT_LT(time(), 149.5);
  EXPECT_GT(difference(first, saved("moment_later.png")), .01);
  key("ctrl+Home");
  settle();
  EXPECT_EQ(time(), 0.);
  EXPECT_EQ(saved("moment_again.png").pixels, first.pixels);
}

TEST_F(PlayingDamaged, PutsTheSimulationAwayAndGoesOn) {
  EXPECT_TRUE(activity_.is_null());  // its raster was to be drawn
  key("space period");               // nothing plays
  settle();
  const scene::View before = view_;
  drag(1, {100, 150}, {160, 160});
  EXPECT_NE(view_.camera.eye, before.camera.eye);
  key("ctrl+Home");
}

TEST_F(Playing, AClickShowsTheWholeHistoryOfTheCompartmentAndTracesAreSaved) {
  const scene::Playback playback = scene::Playback::open(sample(), sample_activity());
  Random random(21);
  std::vector<reports::Trace> wanted;
  for (int i = 0; i < 3; ++i) {
    // A place where half a pixel more or less is still the same compartment.
    Target target;
    std::optional<scene::Playback::Compartment> compartment, beside;
    do {
      target = clear_target(random, view_, viewport(), true);
      const std::array middle{Vec2(target.pixel + Vec2(.5f, .5f))};
      const auto rough = scene::plain_picks(sample(), view_.camera, viewport(), middle, .5f)[0];
      compartment = playback.compartment(target.pick->instance, target.pick->segment);
      beside = playback.compartment(rough->instance, rough->segment);
    } while (compartment->index != beside->index);
    const reports::Trace trace = reports::trace(playback.activity(), compartment->row, compartment->index);
    const auto again = std::ranges::find_if(
        wanted, [&](const auto& t) { return t.row == trace.row && t.compartment == trace.compartment; });
    if (again != wanted.end()) wanted.erase(again);
    wanted.push_back(trace);
    xdotool("mousemove " + place(target.pixel) + " click 1");
    const Json clamped = studio_->wait_for("clamped");
    ASSERT_EQ(clamped.at("traces").size(), wanted.size());
    EXPECT_EQ(clamped.at("traces").back(), trace.name());
    // Under the number that the selection has.
    const Json section = studio_->wait_for("selected").at("facts").at("section");
    EXPECT_EQ(section, target.pick->section == scene::soma_section ? Json("soma") : Json(trace.section));
    finish();
  }
  const auto path = folder / "traces.csv";
  std::filesystem::remove(path);
  key("ctrl+t");
  xdotool("search --sync --onlyvisible --name 'Save traces' windowfocus");
  xdotool(fmt::format("key ctrl+a type --delay 5 '{}'", path.string()));
  key("Return");
  wait_for_file(path, "Save traces");
  EXPECT_EQ(MappedFile(path).text(), reports::csv_of(playback.activity().facts(), wanted));
}

TEST_F(Playing, AClickOnARowOfTheRasterSelectsItsNeuron) {
  const scene::Playback playback = scene::Playback::open(sample(), sample_activity());
  const Json raster = activity_.at("raster");
  const auto rows = playback.activity().rows();
  for (const double share : {.1, .5, .93}) {
    const int y = int(share * raster.at("height").get<double>());
    xdotool(fmt::format("mousemove {} {} click 1", raster.at("x").get<int>() + 40,
                        raster.at("y").get<int>() + y));
    studio_->wait_for("clamped");  // the soma's voltage is shown, too
    const Json facts = studio_->wait_for("selected").at("facts");
    const auto row = std::size_t((double(y) + .5) / raster.at("height").get<double>() * double(rows.size()));
    EXPECT_NEAR(facts.at("neuron").get<int>(), int(rows[row].instance), 1);
    EXPECT_EQ(facts.at("section"), "soma");
    finish();
  }
}

TEST_F(Playing, AViewCopiedWithItsMomentGoesBackThere) {
  key("period period");
  settle();
  key("ctrl+c");
  key("ctrl+Home");
  settle();
  EXPECT_EQ(time(), 0.);
  key("ctrl+v");
  settle();
  EXPECT_NEAR(time(), 1., 1e-6);
}

TEST_F(Contacts, AreShownUntilAKeyHidesThem) {
  EXPECT_GT(synapses_, 100u);
  const io::Picture with = saved("synapses.png");
  key("y");
  settle();
  EXPECT_EQ(synapses_, 0u);
  EXPECT_EQ(view_.synapses, scene::SynapseColour::none);
  EXPECT_GT(difference(with, saved("no_synapses.png")), .001);
  key("y");
  key("shift+y");
  settle();
  EXPECT_GT(synapses_, 100u);
  EXPECT_EQ(view_.synapses, scene::SynapseColour::target);
}

TEST_F(Contacts, AClickTellsSourceAndTarget) {
  const auto synapses = scene::Synapses::open(sample_synapses(), sample());
  const scene::Eye eye(view_.camera, viewport(), {});
  const auto choice =
      synapses.choose(eye, scene::colour(sample(), scene::ColourBy::type, scene::Background::dark),
                      scene::SynapseColour::sign);
  int clicked = 0;
  for (std::size_t i = 0; i < choice.balls.size() && clicked < 3; ++i) {
    const Vec3 at = frame::project(view_.camera, viewport(), choice.balls[i].centre);
    const Vec2 pixel(std::floor(at.x()), std::floor(at.y()));
    if (pixel.x() < 250 || pixel.x() > viewport().width - 60 || pixel.y() < 60 ||
        pixel.y() > viewport().height - 120)
      continue;
    const auto found = scene::pick(choice, view_.camera, viewport(), pixel + Vec2(.5f, .5f), 1.5f);
    const auto branch = scene::pick(sample(), view_.camera, viewport(), pixel + Vec2(.5f, .5f), 0.f);
    if (!found || found->synapse != choice.synapses[i] || (branch && branch->distance < found->distance))
      continue;
    const scene::Synapse& synapse = synapses.all()[found->synapse];
    const Json facts = click(pixel);
    ASSERT_TRUE(facts.contains("synapse")) << facts.dump();
    EXPECT_EQ(facts["synapse"]["synapse"], synapse.id);
    EXPECT_EQ(facts["synapse"]["source"], synapse.source);
    EXPECT_EQ(facts["synapse"]["target"], synapse.target);
    EXPECT_EQ(facts["neuron"], synapse.target);
    settle();
    ++clicked;
  }
  EXPECT_GT(clicked, 0);
}

TEST_F(Near, SkinIsMadeWhenAskedForAndWhenATargetIsForcedToHaveOne) {
  EXPECT_EQ(skin_, 0u);
  key("n");
  settle();
  EXPECT_GT(skin_, 100u);
  const std::size_t all = skin_;
  key("n");
  settle();
  EXPECT_EQ(skin_, 0u);
  key("alt+t");
  key("End");  // "all"
  key("alt+k");
  key("End");
  key("Up");  // Skin
  settle();
  ASSERT_FALSE(view_.targets.empty());
  EXPECT_EQ(view_.targets.back().kind, frame::Kind::skin);
  EXPECT_GT(skin_, all / 2);  // of half the width, too, as far as the limit goes
}

TEST(Studio, ShowsASurfaceWithoutAForest) {
  if (!std::getenv("DISPLAY")) GTEST_SKIP() << "there is no display; ctest runs this under xvfb-run";
  // An octahedron of 40 mm, as FreeSurfer writes surfaces.
  std::string bytes =
      "\xff\xff\xfe"
      "made by a test\n\n";
  const auto add = [&](std::uint32_t word) {
    for (int shift = 24; shift >= 0; shift -= 8) bytes += char(word >> shift & 255);
  };
  add(6), add(8);
  for (int i = 0; i < 6; ++i)
    for (int axis = 0; axis < 3; ++axis)
      add(std::bit_cast<std::uint32_t>(axis == i / 2 ? (i % 2 ? -40.f : 40.f) : 0.f));
  for (const std::uint32_t x : {0u, 1u})
    for (const std::uint32_t y : {2u, 3u})
      for (const std::uint32_t z : {4u, 5u})
        add(x), add((x + y + z) % 2 ? y : z), add((x + y + z) % 2 ? z : y);
  write_file(folder / "lh.pial", bytes);
  Studio studio(
      {folder / "lh.pial", "--size", "800x600", "--report", "--screenshot", folder / "surface.png"});
  const Json report = studio.wait_for("settled");
  const scene::View view = scene::parse_view(report.at("view").dump());
  EXPECT_GT((view.camera.eye - view.camera.target).norm(), 40e3f);
  EXPECT_EQ(report.at("segments"), 0);
  EXPECT_EQ(report.at("cut_off"), Json::array());  // of coordinates with six digits
  EXPECT_EQ(studio.end(), std::pair(std::string(), 0));
  const io::Picture seen = io::read_png(folder / "surface.png");
  std::size_t bright = 0;
  for (std::size_t i = 0; i < seen.pixels.size(); i += 4)
    bright += seen.pixels[i] > 110 && seen.pixels[i + 2] > 60;
  EXPECT_GT(bright, 5000u);
  Studio wrong({sample_file(), "--overlay", folder / "lh.pial"});
  EXPECT_NE(wrong.end().first.find("more overlays (1) than surfaces (0)"), std::string::npos);
}

TEST(Studio, RefusesASimulationOfAnotherCircuit) {
  if (!std::getenv("DISPLAY")) GTEST_SKIP() << "there is no display; ctest runs this under xvfb-run";
  sample_activity();
  write_file(folder / "fewer.forest", scene::pack(testing::sample_circuit(100), testing::sample_neurons()));
  const auto [said, status] =
      Studio({folder / "fewer.forest", "--activity", folder / "sample.activity"}).end();
  EXPECT_EQ(status, 1);
  EXPECT_NE(said.find("with 120 neurons and the forest has 100"), std::string::npos) << said;
  EXPECT_EQ(std::ranges::count(said, '\n'), 1) << said;
}

TEST(Studio, TakesAViewAsTextAndSaysWhatIsWrongWithIt) {
  if (!std::getenv("DISPLAY")) GTEST_SKIP() << "there is no display; ctest runs this under xvfb-run";
  const auto path = folder / "text.png";
  std::filesystem::remove(path);
  setenv("XDG_CONFIG_HOME", (folder / "settings").c_str(), 1);
  Studio good({sample_file(), "--view", scene::to_json(scene::overview(sample())), "--screenshot", path});
  EXPECT_EQ(good.end(), std::pair(std::string(), 0));
  EXPECT_TRUE(std::filesystem::exists(path));
  Studio bad({sample_file(), "--view", "{\"eye\": [1, 2, 3],\n oops}"});
  const auto [said, status] = bad.end();
  EXPECT_EQ(status, 1);
  EXPECT_NE(said.find("--view:2: is no JSON from column 2"), std::string::npos) << said;
}

TEST(Studio, WritesAScreenshotOfItsWindow) {
  if (!std::getenv("DISPLAY")) GTEST_SKIP() << "there is no display; ctest runs this under xvfb-run";
  const auto path = folder / "screenshot.png";
  std::filesystem::remove(path);
  setenv("XDG_CONFIG_HOME", (folder / "settings").c_str(), 1);
  Studio studio({sample_file(), "--size", "1000x700", "--screenshot", path});
  EXPECT_EQ(studio.end(), std::pair(std::string(), 0));
  const io::Picture picture = io::read_png(path);
  EXPECT_EQ(picture.width, 1000u);
  EXPECT_EQ(picture.height, 700u);
}

TEST(Studio, SaysWhichNodeSetReplacesWhich) {
  if (!std::getenv("DISPLAY")) GTEST_SKIP() << "there is no display; ctest runs this under xvfb-run";
  sample_file();
  write_file(folder / "one.json", R"({"mine": {"node_id": [1, 2]}})");
  write_file(folder / "two.json", R"({"mine": {"node_id": [3]}})");
  const auto [said, status] = Studio({sample_file(), "--node-sets", folder / "one.json", folder / "two.json",
                                      "--screenshot", folder / "sets.png"})
                                  .end();
  EXPECT_EQ(status, 0);
  EXPECT_NE(said.find("two.json replaces the node set 'mine' of the files before it"), std::string::npos)
      << said;
  EXPECT_EQ(std::ranges::count(said, '\n'), 1) << said;
}

TEST(Studio, OpensAForestWithTheLongestName) {
  if (!std::getenv("DISPLAY")) GTEST_SKIP() << "there is no display; ctest runs this under xvfb-run";
  // That of its synapses would be longer than any file's may be.
  const auto path = folder / (std::string(255 - 7, 'x') + ".forest");
  write_file(path, MappedFile(sample_file()).bytes());
  Studio studio({path, "--screenshot", folder / "long.png"});
  EXPECT_EQ(studio.end(), std::pair(std::string(), 0));
  std::filesystem::remove(path);
}

TEST(Studio, WhatGoesWrongIsOneSentence) {
  std::filesystem::create_directories(folder);
  write_file(folder / "no.forest", "this is no forest");
  write_file(folder / "no.json", "{\"eye\": 3}");
  const std::pair<std::vector<std::string>, int> wrong[] = {
      {{folder / "missing.forest"}, 1},
      {{folder / "no.forest"}, 1},
      {{sample_file(), "--view", folder / "no.json"}, 1},
      {{sample_file(), "--size", "big"}, 1},
      {{}, 2},
      {{sample_file(), "--no-such-option"}, 2},
  };
  for (const auto& [arguments, status] : wrong) {
    const auto [said, ended] = Studio(arguments).end();
    EXPECT_EQ(ended, status) << said;
    EXPECT_FALSE(said.empty());
    if (status == 1) {
      EXPECT_EQ(std::ranges::count(said, '\n'), 1) << said;
    }
  }
}

TEST(Studio, WithoutADisplayItSaysSo) {
  const char* display = std::getenv("DISPLAY");
  const std::string kept = display ? display : "";
  unsetenv("DISPLAY");
  unsetenv("WAYLAND_DISPLAY");
  const auto [said, ended] = Studio({sample_file()}).end();
  if (display) setenv("DISPLAY", kept.c_str(), 1);
  EXPECT_EQ(ended, 1);
  EXPECT_NE(said.find("no display"), std::string::npos) << said;
  EXPECT_EQ(std::ranges::count(said, '\n'), 1) << said;
}

}  // namespace
}  // namespace forest::studio
