// SPDX-License-Identifier: Apache-2.0
// brainforest bench seam: a dolly from outside the column to one soma, drawn as the product draws it and by the reference
// renderer. Does anything pop, how alike are they, does a branch come apart?
#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/error.h"
#include "forest/frame/similarity.h"
#include "forest/io/png.h"
#include "forest/render/reference/reference_renderer.h"
#include "forest/scene/connection.h"
#include "forest/scene/whole.h"

#include "apps/cli/artist.h"
#include "apps/cli/bench.h"
#include "apps/cli/console.h"
#include "apps/cli/grown_column.h"
#include "apps/cli/options.h"

namespace forest::cli {
namespace {

struct Options {
  std::uint32_t neurons = 1000, frames = 0, samples = 16, quick_samples = 1, rate = 25;
  double seconds = 10., budget = 85.;
  std::optional<float> error;
  std::uint64_t seed = 1;
  std::string size = "640x360";
  std::filesystem::path out;
};

/// What one moment of the dolly looks like.
struct Moment {
  frame::Image quick, reference;
  double similarity = 0.;
  scene::Connections connections;
  float error = 0.f;  // pixels accepted
};

/// The change from a picture to the next, quick and in the reference, and where.
struct Step {
  std::uint32_t from = 0;
  double quick = 0., reference = 0.;
  double ratio() const { return quick / std::max(reference, 1e-9); }
};

class Dolly {
 public:
  Dolly(const Options& options, scene::Forest forest)
      : options_(options),
        size_(parse_size(options.size)),
        artist_(std::move(forest)),
        path_(scene::dolly(artist_.forest())),
        connectedness_(artist_.forest()),
        budget_(options.budget),
        pictures_(std::max(2u, std::uint32_t(std::lround(options.seconds * options.rate)))) {
    reference_.load(artist_.forest().geometry());
  }

  std::uint32_t pictures() const { return pictures_; }

  Moment draw(std::uint32_t picture) {
    const auto [width, height] = size_;
    const frame::Viewport viewport{float(width), float(height)};
    scene::View view = path_.at(float(picture) / float(pictures_ - 1));
    Moment moment;
    moment.error = options_.error.value_or(budget_.error());
    view.detail.error = moment.error;
    view.samples = options_.quick_samples;
    Drawn drawn = artist_.draw(view, width, height);
    budget_.took(drawn.cull + drawn.draw + drawn.resolve);
    if (drawn.image.covered < .005)
      throw Error(fmt::format("picture {} covers {:.2f} % of its pixels: nothing was compared", picture,
                              100. * drawn.image.covered));
    moment.quick = std::move(drawn.image);
    moment.connections = connectedness_(
        scene::choose(artist_.forest(), scene::Eye(view.camera, viewport, scene::detail_for(view, width, height)),
                      viewport),
        view.camera, viewport, view.samples);

    view.samples = options_.samples;
    const scene::Cut all = scene::whole(artist_.forest(), view.camera, viewport);
    const scene::Colouring colouring = scene::colour(artist_.forest(), view.colour_by, view.background);
    const frame::Timing timing =
        reference_.draw(scene::compose(artist_.forest(), view, colouring, all, width, height));
    reference_seconds_ += timing.draw / 1000.;
    moment.reference = reference_.read();
    moment.similarity = frame::similarity(moment.quick, moment.reference);
    return moment;
  }

  double reference_seconds() const { return reference_seconds_; }
  std::string renderer() const { return artist_.renderer(); }
  const scene::Forest& forest() const { return artist_.forest(); }

 private:
  const Options& options_;
  std::pair<std::uint32_t, std::uint32_t> size_;
  Artist artist_;
  render::ReferenceRenderer reference_;
  scene::CameraPath path_;
  scene::Connectedness connectedness_;
  scene::Budget budget_;
  std::uint32_t pictures_;
  double reference_seconds_ = 0.;
};

/// The pictures that are drawn: all, or `count` in pairs of neighbours, spread evenly.
std::vector<std::uint32_t> chosen_pictures(std::uint32_t all, std::uint32_t count) {
  std::vector<std::uint32_t> chosen;
  if (count == 0 || count >= all) {
    for (std::uint32_t i = 0; i < all; ++i) chosen.push_back(i);
    return chosen;
  }
  const std::uint32_t pairs = std::max(1u, count / 2);
  for (std::uint32_t p = 0; p < pairs; ++p) {
    const auto first = pairs > 1 ? std::uint32_t(std::uint64_t(all - 2) * p / (pairs - 1)) : (all - 2) / 2;
    for (const std::uint32_t i : {first, first + 1})
      if (chosen.empty() || i > chosen.back()) chosen.push_back(i);
  }
  return chosen;
}

void keep(const std::filesystem::path& folder, const std::string& name, const frame::Image& image) {
  if (!folder.empty()) io::write_png(folder / (name + ".png"), image.width, image.height, image.pixels);
}

void run(const Options& options, Console& console) {
  if (!options.out.empty()) std::filesystem::create_directories(options.out);
  Dolly dolly(options, grown_column(options.neurons, options.seed, console));
  const std::vector<std::uint32_t> chosen = chosen_pictures(dolly.pictures(), options.frames);

  Step largest_quick, largest_reference, worst;  // worst: by the ratio of one step alone
  std::uint32_t least_alike = 0;
  double similarity_min = INFINITY, similarity_sum = 0.;
  std::uint64_t disconnected = 0, most_disconnected = 0;
  nlohmann::ordered_json every = nlohmann::ordered_json::array();
  std::optional<Moment> before;
  console.progress().begin("drawing", chosen.size());
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    const std::uint32_t picture = chosen[i];
    Moment now = dolly.draw(picture);
    similarity_sum += now.similarity;
    disconnected += now.connections.disconnected;
    most_disconnected = std::max(most_disconnected, now.connections.disconnected);
    nlohmann::ordered_json row{{"picture", picture},
                               {"similarity", now.similarity},
                               {"disconnected", now.connections.disconnected},
                               {"error_pixels", now.error}};
    if (now.similarity < similarity_min) {
      similarity_min = now.similarity, least_alike = picture;
      keep(options.out, "least_alike_quick", now.quick);
      keep(options.out, "least_alike_reference", now.reference);
    }
    if (before && chosen[i - 1] + 1 == picture) {
      const Step step{chosen[i - 1], frame::change(before->quick, now.quick),
                      frame::change(before->reference, now.reference)};
      row["change"] = step.quick, row["change_reference"] = step.reference;
      if (step.quick > largest_quick.quick) {
        largest_quick = step;
        for (const auto& [name, moment] : {std::pair("before", &*before), std::pair("after", &now)}) {
          keep(options.out, fmt::format("largest_change_quick_{}", name), moment->quick);
          keep(options.out, fmt::format("largest_change_reference_{}", name), moment->reference);
        }
      }
      if (step.reference > largest_reference.reference) largest_reference = step;
      if (step.ratio() > worst.ratio()) worst = step;
    }
    every.push_back(std::move(row));
    before = std::move(now);
    console.progress().advance();
  }
  console.progress().end();

  const double ratio = largest_quick.quick / std::max(largest_reference.reference, 1e-9);
  const double mean_similarity = similarity_sum / double(chosen.size());
  console.print({{"change_ratio", ratio},
                 {"similarity_min", similarity_min},
                 {"disconnected", disconnected},
                 {"similarity_mean", mean_similarity},
                 {"step_ratio_max", worst.ratio()},
                 {"least_alike", least_alike},
                 {"largest_change", {{"picture", largest_quick.from}, {"change", largest_quick.quick}}},
                 {"largest_change_reference",
                  {{"picture", largest_reference.from}, {"change", largest_reference.reference}}},
                 {"neurons", dolly.forest().instances().size()},
                 {"segments", dolly.forest().segment_total()},
                 {"size", options.size},
                 {"pictures", chosen.size()},
                 {"samples", options.samples},
                 {"quick_samples", options.quick_samples},
                 {"reference_seconds", dolly.reference_seconds() / double(chosen.size())},
                 {"renderer", dolly.renderer()},
                 {"every", std::move(every)}});
  console.say(fmt::format("{} neurons, {} segments, {}, {} of {} pictures of {} s, {}",
                          dolly.forest().instances().size(), dolly.forest().segment_total(), options.size,
                          chosen.size(), dolly.pictures(), options.seconds, dolly.renderer()));
  console.table({"", "figure", "aim", "where"},
                {{"largest change ÷ the reference's", fmt::format("{:.2f}", ratio), "≤ 1.1",
                  fmt::format("picture {}", largest_quick.from)},
                 {"the same of one step", fmt::format("{:.2f}", worst.ratio()), "",
                  fmt::format("picture {}", worst.from)},
                 {"least similarity", fmt::format("{:.3f}", similarity_min), "≥ 0.95",
                  fmt::format("picture {}", least_alike)},
                 {"mean similarity", fmt::format("{:.3f}", mean_similarity), "", ""},
                 {"disconnected branches", fmt::format("{}", disconnected), "0",
                  fmt::format("at most {} in a picture", most_disconnected)}});
  console.say(fmt::format("the reference took {:.2f} s a picture of {} samples",
                          dolly.reference_seconds() / double(chosen.size()), options.samples));
}

}  // namespace

std::function<void()> bench_seam(CLI::App& command, Console& console) {
  const auto options = std::make_shared<Options>();
  const auto whole = [&](const char* name, std::uint32_t& value, const char* help, std::uint64_t low,
                         std::uint64_t high) {
    must_be_whole(*command.add_option(name, value, help)->capture_default_str(), low, high);
  };
  whole("--neurons", options->neurons, "Neurons planted, at the density of the recipe column-10000", 10, 10'000'000);
  whole("--frames", options->frames, "Pictures compared, in pairs of neighbours spread over the dolly; 0: all", 0,
        100'000);
  whole("--samples", options->samples, "Samples a pixel of the reference", 1, 1024);
  whole("--quick-samples", options->quick_samples, "Pictures averaged by the renderer that is judged", 1, 1024);
  whole("--rate", options->rate, "Pictures a second", 1, 1000);
  command.add_option("--seconds", options->seconds, "How long the dolly takes")
      ->check(CLI::Range(.1, 3600.))
      ->capture_default_str();
  command
      .add_option("--budget", options->budget, "Milliseconds a picture may take before less detail is chosen")
      ->check(CLI::Range(1., 10000.))
      ->capture_default_str();
  command.add_option("--error", options->error, "Pixels of acceptable error, instead of what the budget says")
      ->check(CLI::Range(.05, 100.));
  command.add_option("--out", options->out, "A folder for the worst pictures");
  add_size(command, options->size);
  add_seed(command, options->seed, "Of the neurons and their places");
  return [options, &console] { run(*options, console); };
}

}  // namespace forest::cli
