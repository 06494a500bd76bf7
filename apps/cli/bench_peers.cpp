// SPDX-License-Identifier: Apache-2.0
// brainforest bench peers: the same segments, cameras and window drawn by VTK (bench/peers/vtk_column.py) and by ourselves,
// each in a process of its own; and how far the pictures are like the reference. How it is measured: docs/scene/seam.md.
#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <ctime>
#include <fcntl.h>
#include <map>
#include <memory>
#include <numeric>
#include <optional>
#include <spawn.h>
#include <unistd.h>

#include <CLI/App.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <sys/wait.h>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/core/half.h"
#include "forest/frame/similarity.h"
#include "forest/frame/soften.h"
#include "forest/io/png.h"
#include "forest/render/reference/reference_renderer.h"
#include "forest/scene/whole.h"

#include "apps/cli/artist.h"
#include "apps/cli/bench.h"
#include "apps/cli/clock.h"
#include "apps/cli/console.h"
#include "apps/cli/grown_column.h"
#include "apps/cli/options.h"

extern char** environ;

namespace forest::cli {
namespace {

using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

constexpr std::uint32_t dolly_pictures = 250;  // ten seconds
constexpr std::uint32_t settling = 15;         // pictures in which the budget finds its error

struct Options {
  std::uint32_t neurons = 1000, frames = 6, samples = 16;
  std::optional<std::uint32_t> quick_samples;
  double budget = scene::Budget::usual;
  std::uint64_t seed = 1;
  std::string size = "1280x720", python = "/usr/bin/python3";
  std::vector<std::string> modes{"lines", "impostors", "tubes"};
  fs::path out, draw;  // draw: the folder that a process of ours draws from
};

struct Figures {
  double frame_seconds = 0., core_seconds = 0., first_picture_seconds = 0., agreement = 0.,
         agreement_min = 1.;
  std::uint64_t peak_bytes = 0;
  std::string renderer;
};

/// A folder of its own under the system's, gone afterwards; or the one that is wished, which stays.
class Folder {
 public:
  explicit Folder(const fs::path& wish) : path_(wish), passing_(wish.empty()) {
    if (!passing_) {
      fs::create_directories(path_);
      return;
    }
    std::string name = (fs::temp_directory_path() / "brainforest-peers-XXXXXX").string();
    if (!::mkdtemp(name.data()))
      throw Error(
          fmt::format("no folder can be made in {}; name one by --out", fs::temp_directory_path().string()));
    path_ = name;
  }
  ~Folder() {
    std::error_code ignored;
    if (passing_) fs::remove_all(path_, ignored);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
  bool passing_;
};

/// Runs a program and returns what it printed as JSON. Throws Error with the last line of what it complained of.
Json run_process(std::vector<std::string> words, const fs::path& folder) {
  const std::string printed = (folder / "printed.txt").string(), said = (folder / "said.txt").string();
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  for (const auto& [file, descriptor] : {std::pair(&printed, 1), std::pair(&said, 2)})
    posix_spawn_file_actions_addopen(&actions, descriptor, file->c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
  pid_t child = 0;
  const int failure = ::posix_spawnp(&child, arguments[0], &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (failure) throw Error(fmt::format("{} cannot be started ({})", words[0], std::strerror(failure)));
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) {
    std::string complaint(MappedFile(said).text());
    while (!complaint.empty() && complaint.back() == '\n') complaint.pop_back();
    complaint = complaint.substr(complaint.rfind('\n') + 1);
    throw Error(
        !complaint.empty() ? complaint
        : WIFSIGNALED(status)
            ? fmt::format("{} was ended by signal {}; there may be too little memory, try fewer --neurons",
                          words[0], WTERMSIG(status))
            : fmt::format("{} failed without a word", words[0]));
  }
  return Json::parse(MappedFile(printed).text());
}

scene::View view_at(const scene::Dolly& dolly, std::uint32_t picture, std::uint32_t samples) {
  scene::View view = dolly.at(float(picture) / float(dolly_pictures - 1));
  view.samples = samples;
  view.fog = view.halo = 0.f;  // VTK has neither
  return view;
}

std::vector<std::uint32_t> measured_pictures(std::uint32_t count) {
  std::vector<std::uint32_t> pictures;
  for (std::uint32_t i = 0; i < count; ++i)
    pictures.push_back(count > 1 ? (dolly_pictures - 1) * i / (count - 1) : 0);
  return pictures;
}

/// A neuron's original segments as polylines, each as long as only one segment goes on in the same kind.
struct Polylines {
  std::vector<float> points;                 // x, y, z, radius
  std::vector<std::uint32_t> strips, kinds;  // points and section kind of each
};

Polylines polylines_of(const scene::Forest& forest, const scene::Neuron& neuron) {
  auto segments = forest.segments().subspan(neuron.first_segment, neuron.original_count);
  if (neuron.soma_radius > 0.f) segments = segments.subspan(1);
  using Place = std::array<float, 3>;
  std::map<Place, std::vector<std::uint32_t>> begins;
  for (std::uint32_t i = 0; i < segments.size(); ++i)
    begins[{segments[i].ax, segments[i].ay, segments[i].az}].push_back(i);
  const auto next = [&](const frame::Segment& s) -> std::optional<std::uint32_t> {
    const auto found = begins.find({s.bx, s.by, s.bz});
    if (found == begins.end() || found->second.size() != 1) return {};
    const std::uint32_t i = found->second[0];
    return (segments[i].meta & 7u) == (s.meta & 7u) ? std::optional(i) : std::nullopt;
  };
  std::vector<bool> follows(segments.size());
  for (const frame::Segment& s : segments)
    if (const auto i = next(s)) follows[*i] = true;
  Polylines result;
  for (std::uint32_t head = 0; head < segments.size(); ++head) {
    if (follows[head]) continue;
    const frame::Segment& first = segments[head];
    result.points.insert(result.points.end(), {first.ax, first.ay, first.az, from_half(first.radii)});
    std::uint32_t count = 1;
    for (std::optional<std::uint32_t> i = head; i; i = next(segments[*i]), ++count) {
      const frame::Segment& s = segments[*i];
      result.points.insert(result.points.end(), {s.bx, s.by, s.bz, from_half(s.radii >> 16)});
    }
    result.strips.push_back(count);
    result.kinds.push_back(first.meta & 7u);
  }
  return result;
}

/// What bench/peers/vtk_column.py reads.
void write_column(const scene::Forest& forest, const Options& options, const fs::path& folder) {
  const auto list = [](const Vec3& v) { return Json{v.x(), v.y(), v.z()}; };
  const auto srgb = [&](const Vec3& light) { return list(scene::screen_of(light)); };
  const auto [width, height] = parse_size(options.size);
  const scene::Dolly dolly(forest);
  const scene::View first = view_at(dolly, 0, 1);
  const scene::Colouring colouring = scene::colour(forest, first.colour_by, first.background);
  const frame::Frame frame = scene::compose(forest, first, colouring, {}, width, height);
  Json json{{"size", {width, height}},
            {"background", {srgb(frame.style.background_top), srgb(frame.style.background_bottom)}},
            {"light", list(frame::light_direction())}};
  for (const Vec3& colour : colouring.palette) json["palette"].push_back(srgb(colour));
  std::uint64_t segments = 0;
  std::vector<std::uint64_t> segments_of;
  for (const scene::Neuron& neuron : forest.neurons()) {
    const Polylines lines = polylines_of(forest, neuron);
    json["neurons"].push_back({{"points", lines.points},
                               {"strips", lines.strips},
                               {"kinds", lines.kinds},
                               {"soma", neuron.soma_radius}});
    segments_of.push_back(lines.points.size() / 4 - lines.strips.size() + (neuron.soma_radius > 0.f));
  }
  for (std::size_t i = 0; i < forest.instances().size(); ++i) {
    const frame::Instance& at = forest.instances()[i];
    json["instances"].push_back(
        {at.morphology, at.x, at.y, at.z, at.qx, at.qy, at.qz, at.qw, colouring.states[i].colour_class});
    segments += segments_of[at.morphology];
  }
  if (segments != forest.segment_total())
    throw Error(
        fmt::format("{} of {} segments became polylines; this is an error of the program, please report it",
                    segments, forest.segment_total()));
  for (const std::uint32_t picture : measured_pictures(options.frames)) {
    const frame::Camera camera = view_at(dolly, picture, 1).camera;
    json["cameras"].push_back({{"eye", list(camera.eye)},
                               {"target", list(camera.target)},
                               {"up", list(camera.up)},
                               {"field_of_view", camera.field_of_view},
                               {"near", camera.near}});
  }
  write_file(folder / "column.json", json.dump());
}

/// Walks the dolly up to each camera that VTK draws, as the studio would, and prints what these pictures have taken.
void draw_ours(const Options& options) {
  const auto begin = Clock::now();
  Artist artist(scene::Forest::open(options.draw / "column.forest"));
  const scene::Dolly dolly(artist.forest());
  const auto [width, height] = parse_size(options.size);
  scene::Budget budget(options.budget);
  const std::vector<std::uint32_t> measured = measured_pictures(options.frames);
  Json frames = Json::array(), cores = Json::array();
  double first = 0.;
  frame::Image image;
  for (std::uint32_t picture = 0; picture <= measured.back(); ++picture) {
    if (*std::ranges::lower_bound(measured, picture) > picture + settling) continue;
    const auto start = Clock::now();
    const std::clock_t core = std::clock();
    scene::View view = scene::within(view_at(dolly, picture, 1), budget);
    view.samples = options.quick_samples.value_or(view.samples);
    const Drawn drawn = artist.draw(view, width, height);
    frame::soften(drawn.image, options.quick_samples ? 0.f : budget.softness(), image);
    const double seconds = seconds_since(start);
    const double core_seconds = double(std::clock() - core) / CLOCKS_PER_SEC;
    budget.took(1000. * seconds, drawn.segments);
    if (picture == 0) first = seconds_since(begin);
    for (std::size_t i = 0; i < measured.size(); ++i) {
      if (measured[i] != picture) continue;
      frames.push_back(seconds), cores.push_back(core_seconds);
      io::write_png(options.draw / fmt::format("ours-{}.png", i), width, height, image.pixels);
    }
  }
  fmt::print("{}\n", Json{{"frame_seconds", frames},
                          {"core_seconds", cores},
                          {"first_picture_seconds", first},
                          {"peak_bytes", peak_bytes()},
                          {"renderer", artist.renderer()}}
                         .dump());
}

Figures figures_of(const Json& json, const std::string& mode, const fs::path& folder,
                   const std::vector<frame::Image>& reference) {
  const auto mean = [](const Json& list) {
    double sum = 0.;
    for (const Json& value : list) sum += value.get<double>();
    return sum / double(std::max<std::size_t>(1, list.size()));
  };
  Figures figures{.frame_seconds = mean(json.at("frame_seconds")),
                  .core_seconds = mean(json.at("core_seconds")),
                  .first_picture_seconds = json.at("first_picture_seconds").get<double>(),
                  .peak_bytes = json.at("peak_bytes").get<std::uint64_t>(),
                  .renderer = json.at("renderer").get<std::string>()};
  for (std::size_t i = 0; i < reference.size(); ++i) {
    io::Picture picture = io::read_png(folder / fmt::format("{}-{}.png", mode, i));
    const frame::Image image{picture.width, picture.height, std::move(picture.pixels)};
    const double alike = frame::similarity(image, reference[i]);
    figures.agreement += alike / double(reference.size());
    figures.agreement_min = std::min(figures.agreement_min, alike);
    const std::vector<float> light = frame::luminance(image);
    if (const auto [low, high] = std::ranges::minmax(light); high - low < 64.f)
      throw Error(fmt::format("{} drew an empty picture ({}-{}.png, by {}): nothing was measured", mode, mode,
                              i, figures.renderer));
  }
  return figures;
}

std::vector<frame::Image> reference_pictures(const scene::Forest& forest, const Options& options,
                                             const fs::path& folder, Console& console) {
  const auto [width, height] = parse_size(options.size);
  const frame::Viewport viewport{float(width), float(height)};
  const scene::Dolly dolly(forest);
  render::ReferenceRenderer renderer;
  renderer.load(forest.geometry());
  std::vector<frame::Image> pictures;
  console.progress().begin("reference", options.frames);
  for (const std::uint32_t picture : measured_pictures(options.frames)) {
    const scene::View view = view_at(dolly, picture, options.samples);
    const scene::Colouring colouring = scene::colour(forest, view.colour_by, view.background);
    renderer.draw(
        scene::compose(forest, view, colouring, scene::whole(forest, view.camera, viewport), width, height));
    pictures.push_back(renderer.read());
    io::write_png(folder / fmt::format("reference-{}.png", pictures.size() - 1), width, height,
                  pictures.back().pixels);
    console.progress().advance();
  }
  console.progress().end();
  return pictures;
}

void run(const Options& options, Console& console) {
  if (!options.draw.empty()) return draw_ours(options);
  const fs::path script = fs::path(FOREST_SOURCE_DIR) / "bench" / "peers" / "vtk_column.py";
  if (!fs::exists(script))
    throw Error(fmt::format("{} is missing; build and run from the source tree", script.string()));

  const Folder folder(options.out);
  const std::vector<std::byte> bytes = packed_column(options.neurons, options.seed, console);
  write_file(folder.path() / "column.forest", bytes);
  std::optional<scene::Forest> forest = scene::Forest::from_bytes(bytes, "column");
  write_column(*forest, options, folder.path());

  // VTK first: where it is missing, nobody waits for the rest.
  std::map<std::string, Json> printed;
  console.progress().begin("drawing", options.modes.size() + 1);
  for (const std::string& mode : options.modes) {
    printed[mode] =
        run_process({options.python, script.string(), folder.path().string(), mode}, folder.path());
    console.progress().advance();
  }
  std::vector<std::string> words{fs::read_symlink("/proc/self/exe").string(),
                                 "bench",
                                 "peers",
                                 "--draw",
                                 folder.path().string(),
                                 "--frames",
                                 std::to_string(options.frames),
                                 "--size",
                                 options.size,
                                 "--budget",
                                 fmt::format("{}", options.budget),
                                 "--threads",
                                 std::to_string(console.threads)};
  if (options.quick_samples)
    words.insert(words.end(), {"--quick-samples", std::to_string(*options.quick_samples)});
  printed["ours"] = run_process(words, folder.path());
  console.progress().end();

  const std::vector<frame::Image> reference = reference_pictures(*forest, options, folder.path(), console);
  std::vector<std::string> names{"ours"};
  names.insert(names.end(), options.modes.begin(), options.modes.end());
  Json modes, ratio;
  std::vector<std::vector<std::string>> rows;
  Figures ours;
  for (const std::string& name : names) {
    const Figures f = figures_of(printed[name], name, folder.path(), reference);
    if (name == "ours") ours = f;
    modes[name] = {{"frame_seconds", f.frame_seconds},
                   {"core_seconds", f.core_seconds},
                   {"peak_bytes", f.peak_bytes},
                   {"agreement", f.agreement},
                   {"agreement_min", f.agreement_min},
                   {"first_picture_seconds", f.first_picture_seconds},
                   {"renderer", f.renderer}};
    const double frame = f.frame_seconds / ours.frame_seconds, core = f.core_seconds / ours.core_seconds,
                 memory = double(f.peak_bytes) / double(ours.peak_bytes);
    if (name != "ours") ratio[name] = {{"frame", frame}, {"core", core}, {"memory", memory}};
    rows.push_back({name == "ours" ? name : "VTK " + name, fmt::format("{:.0f}", 1000. * f.frame_seconds),
                    fmt::format("{:.1f}", frame), fmt::format("{:.0f}", 1000. * f.core_seconds),
                    fmt::format("{:.1f}", core), fmt::format("{:.0f}", double(f.peak_bytes) / 1e6),
                    fmt::format("{:.1f}", memory), fmt::format("{:.1f}", f.first_picture_seconds),
                    fmt::format("{:.3f}", f.agreement), fmt::format("{:.3f}", f.agreement_min)});
  }
  console.print({{"modes", modes},
                 {"ratio", ratio},
                 {"neurons", forest->instances().size()},
                 {"segments", forest->segment_total()},
                 {"size", options.size},
                 {"frames", options.frames},
                 {"samples", options.samples},
                 {"vtk", printed[names.back()].value("version", "")}});
  console.say(fmt::format("{} neurons, {} segments, {}, {} cameras of a dolly; ours and VTK {} on {}",
                          forest->instances().size(), forest->segment_total(), options.size, options.frames,
                          printed[names.back()].value("version", ""), ours.renderer));
  console.table(
      {"", "ms a frame", "÷ ours", "core ms", "÷ ours", "peak MB", "÷ ours", "first s", "agreement", "least"},
      rows);
}

}  // namespace

std::function<void()> bench_peers(CLI::App& command, Console& console) {
  const auto options = std::make_shared<Options>();
  add_planted(command, options->neurons);
  add_whole(command, "--frames", options->frames, "Cameras of the dolly that are measured", 1, 250);
  add_whole(command, "--samples", options->samples, "Samples a pixel of the reference", 1, 1024);
  must_be_whole(*command.add_option("--quick-samples", options->quick_samples,
                                    "Samples a pixel of ours, instead of what the budget says"),
                1, 1024);
  add_budget(command, options->budget);
  command
      .add_option("--modes", options->modes, "What VTK draws: lines, impostors, tubes; separated by commas")
      ->delimiter(',')
      ->check(CLI::IsMember({"lines", "impostors", "tubes"}))
      ->capture_default_str();
  command.add_option("--python", options->python, "The Python that has VTK (python3-vtk9)")
      ->capture_default_str();
  command.add_option("--out", options->out, "A folder that keeps the pictures and what VTK is given");
  command.add_option("--draw", options->draw)->group("");
  add_size(command, options->size);
  add_seed(command, options->seed, "Of the neurons and their places");
  return [options, &console] { run(*options, console); };
}

}  // namespace forest::cli
