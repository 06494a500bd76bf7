// SPDX-License-Identifier: Apache-2.0
#include "tests/studio/driven_studio.h"

#include <array>
#include <csignal>
#include <cstdlib>
#include <poll.h>
#include <unistd.h>

#include <fmt/format.h>
#include <sys/wait.h>

#include "forest/core/file.h"
#include "forest/render/opengl/context.h"
#include "forest/render/opengl/opengl_renderer.h"
#include "forest/scene/synapses.h"

#include "tests/sample_activity.h"
#include "tests/sample_forest.h"

namespace forest::studio {

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

std::filesystem::path sample_synapses() {
  static const std::filesystem::path path = [] {
    const auto made =
        circuit::made_up_synapses(testing::sample_circuit(120), testing::sample_neurons(), "p", 60, 2);
    write_file(folder / "contacts.synapses", scene::Synapses::make(sample(), std::span(&made, 1)));
    return folder / "contacts.synapses";
  }();
  return path;
}

Studio::Studio(std::vector<std::string> arguments) {
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

Studio::~Studio() {
  if (pid_ > 0) kill(pid_, SIGKILL), waitpid(pid_, nullptr, 0);
  close(out_), close(error_);
}

Json Studio::wait_for(const std::string& event) {
  for (;;) {
    const Json line = Json::parse(next_line());
    if (line.at("event") == event) return line;
  }
}

std::pair<std::string, int> Studio::end() {
  std::string said;
  std::array<char, 4096> part;
  for (ssize_t n; (n = read(error_, part.data(), part.size())) > 0;) said.append(part.data(), std::size_t(n));
  int status = 0;
  waitpid(std::exchange(pid_, -1), &status, 0);
  return {said, WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status)};
}

std::string Studio::next_line() {
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

void xdotool(const std::string& what) {
  ASSERT_EQ(std::system(("xdotool " + what).c_str()), 0) << "xdotool " << what;
}

void Window::SetUp() {
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

void Window::finish() {
  const Json report = studio_->wait_for("settled");
  view_ = scene::parse_view(report.at("view").dump());
  picture_ = report.at("picture");
  activity_ = report.at("activity");
  synapses_ = report.at("synapses");
  skin_ = report.at("skin_triangles");
  cut_off_ = report.at("cut_off");
}

void Window::settle() {
  key("Escape");
  studio_->wait_for("selected");
  finish();
}

Json Window::click(const Vec2& pixel) {
  xdotool("mousemove " + place(pixel) + " click 1");
  return studio_->wait_for("selected").at("facts");
}

void Window::drag(int button, const Vec2& from, const Vec2& to, const std::string& with) {
  const Vec2 half = .5f * (from + to);
  xdotool(fmt::format("{} mousemove {} mousedown {} mousemove {} mousemove {} mouseup {} {}",
                      with.empty() ? "" : "keydown " + with, place(from), button, place(half), place(to),
                      button, with.empty() ? "" : "keyup " + with));
  settle();
}

io::Picture Window::saved(const std::string& name) {
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

void Window::wait_for_file(const std::filesystem::path& path, const std::string& dialog) {
  for (int i = 1; i < patience / 50 && !std::filesystem::exists(path); ++i) {
    usleep(50'000);
    if (i % 60 == 0 && windows(dialog) == 1) key("Return");
  }
}

int Window::windows(const std::string& name) {
  const auto list = folder / "seen_windows";
  // Fails where there is none.
  [[maybe_unused]] const int found =
      std::system(fmt::format("xdotool search --onlyvisible --name '{}' >{}", name, list.string()).c_str());
  const MappedFile lines(list);
  return int(std::ranges::count(lines.text(), '\n'));
}

void Window::press_until(const std::string& pressed, const std::string& name, int count) {
  for (int i = 0; i < 600 && windows(name) != count; ++i) {
    if (i % 60 == 0) key(pressed);
    usleep(50'000);
  }
  ASSERT_EQ(windows(name), count) << name;
}

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

io::Picture without_a_window(scene::View view, std::uint32_t width, std::uint32_t height,
                             scene::Playback* playback) {
  const render::OffscreenContext context;
  render::OpenGLRenderer renderer;
  renderer.load(sample().geometry());
  view.samples = 16;
  const frame::Viewport pixels{float(width), float(height)};
  const scene::Colouring colouring = scene::colour(sample(), view.colour_by, view.background);
  const scene::Eye eye(view.camera, pixels, scene::detail_for(view, width, height));
  scene::Cut cut = scene::choose(sample(), eye);
  if (playback) playback->colour(cut, eye, view.activity.value());
  renderer.draw(scene::compose(sample(), view, colouring, cut, width, height));
  return {width, height, renderer.read().pixels};
}

double difference(const io::Picture& a, const io::Picture& b) {
  std::size_t differing = 0;
  for (std::size_t i = 0; i < a.pixels.size(); i += 4) {
    int most = 0;
    for (std::size_t c = 0; c < 3; ++c) most = std::max(most, std::abs(a.pixels[i + c] - b.pixels[i + c]));
    differing += most > 12;
  }
  return double(differing) / double(a.pixels.size() / 4);
}

}  // namespace forest::studio
