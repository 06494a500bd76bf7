// SPDX-License-Identifier: Apache-2.0
// brainforest bench pack: neurons, each a shape of its own, are packed into a file as they come. How many segments a
// second, and in how much memory? The file is opened and compared with the neurons.
#include <atomic>
#include <filesystem>
#include <memory>
#include <unistd.h>

#include <CLI/App.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/error.h"
#include "forest/core/parallel.h"
#include "forest/core/random.h"
#include "forest/lsystem/grow.h"
#include "forest/morphology/transform.h"
#include "forest/scene/forest.h"

#include "apps/cli/bench.h"
#include "apps/cli/clock.h"
#include "apps/cli/console.h"
#include "apps/cli/grammars.h"
#include "apps/cli/options.h"

namespace forest::cli {
namespace {

namespace fs = std::filesystem;
struct Options {
  std::uint32_t neurons = 10000;
  std::uint64_t seed = 1;
  fs::path folder = fs::temp_directory_path();
};

/// As many distinct neurons as are asked for, made in an instant: a hundred grown ones, each time otherwise stretched and
/// sheared.
class Neurons {
 public:
  Neurons(std::uint64_t seed, Progress& progress) : seed_(seed) {
    for (const char* grammar : {"pyramidal", "pyramidal", "pyramidal", "purkinje", "motoneuron"})
      for (const Morphology& m :
           lsystem::grow_population(find_grammar(grammar), 20, seed, progress, shapes_.size()))
        shapes_.push_back(centred(m));
  }

  Morphology operator()(std::size_t index) const {
    const Morphology& shape = shapes_[index % shapes_.size()];
    Random random(seed_, index, 31);
    Mat3 turn = Mat3::Identity();
    for (float& entry : turn.reshaped()) entry += .1f * float(random.normal());
    const float thicker = float(random.uniform(.8, 1.25));
    const auto moved = [&](const Point& p) {
      const Vec3 at = turn * p.position();
      return Point{at.x(), at.y(), at.z(), p.radius * thicker};
    };
    std::vector<Point> points(shape.points().size());
    std::ranges::transform(shape.points(), points.begin(), moved);
    Soma soma = shape.soma();
    std::ranges::transform(soma.points, soma.points.begin(), moved);
    MorphologyBuilder builder;
    builder.set_soma(std::move(soma));
    builder.add_sections(std::move(points), {shape.sections().begin(), shape.sections().end()});
    return builder.build();
  }

 private:
  std::uint64_t seed_;
  std::vector<Morphology> shapes_;
};

circuit::Circuit planted(const Options& options) {
  circuit::Circuit c{.name = "made-up",
                     .layers = {{"tissue", 0.f, 2000.f}},
                     .types = {{"made-up", "made-up"}},
                     .morphologies = {},
                     .instances = {},
                     .radius = 1000.f};
  Random random(options.seed, 0, 32);
  for (std::uint32_t i = 0; i < options.neurons; ++i) {
    c.morphologies.push_back(fmt::format("neuron-{}", i));
    const double out = c.radius * std::sqrt(random.uniform()), turn = random.uniform(0., 2. * pi);
    c.instances.push_back({.position = {float(out * std::cos(turn)), float(random.uniform(0., 2000.)),
                                        float(out * std::sin(turn))},
                           .morphology = i});
  }
  return c;
}

/// Whether the original segments of a neuron in the file are those of its sections, point for point.
void compare(const scene::Forest& forest, std::size_t number, const Morphology& m) {
  const scene::Neuron& n = forest.neurons()[number];
  const auto segments = forest.segments().subspan(n.first_segment, n.original_count);
  const auto sections = forest.section_of_segment().subspan(n.first_original, n.original_count);
  const Vec3 origin = centre(m);
  std::vector<std::uint32_t> next(m.sections().size());  // point of each section
  const auto same = [&](const Point& p, float x, float y, float z) {
    return (p.position() - origin - Vec3(x, y, z)).norm() < 1e-3f;
  };
  bool good = n.section_count == m.sections().size();
  for (std::size_t i = 0; good && i < segments.size(); ++i) {
    if (sections[i] == scene::soma_section) continue;
    const auto points = m.points(SectionId(sections[i]));
    const std::uint32_t at = next[sections[i]]++;
    const frame::Segment& s = segments[i];
    good = at + 1 < points.size() && same(points[at], s.ax, s.ay, s.az) &&
           same(points[at + 1], s.bx, s.by, s.bz);
  }
  for (std::size_t s = 0; good && s < next.size(); ++s) good = next[s] + 1 == m.points(SectionId(s)).size();
  if (!good) throw Error(fmt::format("neuron {} of the file is not the one that was packed", number));
}

void run(const Options& options, Console& console) {
  const Neurons neurons(options.seed, console.progress());
  const circuit::Circuit circuit = planted(options);
  const fs::path path = options.folder / fmt::format("brainforest-pack-{}.forest", ::getpid());
  std::atomic<std::uint64_t> given = 0, making = 0;  // segments; nanoseconds of all threads together
  const auto source = [&](std::size_t index) {
    const auto begin = Clock::now();
    Morphology m = neurons(index);
    given += m.segment_count();
    making += std::uint64_t(1e9 * seconds_since(begin));
    return m;
  };
  auto start = Clock::now();
  const scene::PackFigures packed = scene::pack(circuit, source, path, console.progress());
  const double seconds = seconds_since(start);
  const std::uint64_t peak = peak_bytes();  // from here on the file's own pages would count
  start = Clock::now();
  const scene::Forest forest = scene::Forest::open(path);
  const double opening = seconds_since(start);
  fs::remove(path);  // it stays for as long as it is open

  std::atomic<std::uint64_t> found = 0;
  parallel_ranges(forest.section_of_segment().size(), 1 << 16, [&](std::size_t begin, std::size_t end) {
    const auto part = forest.section_of_segment().subspan(begin, end - begin);
    found += part.size() - std::size_t(std::ranges::count(part, scene::soma_section));
  });
  if (found != given || forest.neurons().size() != options.neurons || forest.bytes() != packed.bytes ||
      forest.section_of_segment().size() != packed.segments)
    throw Error(fmt::format("{} segments of {} neurons were packed and {} of {} are in the file",
                            given.load(), options.neurons, found.load(), forest.neurons().size()));
  Random random(options.seed, 1, 32);
  for (int i = 0; i < 200; ++i) {
    const std::uint32_t any = random.below(options.neurons);
    compare(forest, any, neurons(any));
  }

  const double rate = double(packed.segments) / seconds;
  console.print({{"segments_per_second", rate},
                 {"segments", packed.segments},
                 {"neurons", options.neurons},
                 {"seconds", seconds},
                 {"making_core_seconds", double(making) / 1e9},
                 {"bytes", packed.bytes},
                 {"peak_bytes", peak},
                 {"open_seconds", opening}});
  console.table(
      {"neurons", "segments", "segments/s", "seconds", "of which core-seconds of making up", "MB of the file",
       "peak MB", "opened in"},
      {{fmt::format("{}", options.neurons), fmt::format("{}", packed.segments), fmt::format("{:.0f}", rate),
        fmt::format("{:.2f}", seconds), fmt::format("{:.2f}", double(making) / 1e9),
        fmt::format("{:.0f}", double(packed.bytes) / 1e6), fmt::format("{:.0f}", double(peak) / 1e6),
        fmt::format("{:.2f} s", opening)}});
}

}  // namespace

std::function<void()> bench_pack(CLI::App& command, Console& console) {
  const auto options = std::make_shared<Options>();
  add_whole(command, "--neurons", options->neurons,
            "Distinct neurons, each planted once; 10,000 take some 2 GB of disk", 1, 10'000'000);
  command.add_option("--folder", options->folder, "Where the file is made, and removed")
      ->capture_default_str();
  add_seed(command, options->seed, "Of the neurons and their places");
  return [options, &console] { run(*options, console); };
}

}  // namespace forest::cli
