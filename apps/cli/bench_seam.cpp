// SPDX-License-Identifier: Apache-2.0
// brainforest bench seam: a dolly from outside the column to one soma, drawn as the product draws it and by the reference
// renderer. Does anything pop, how alike are they, does a branch come apart? How it is measured: docs/scene/seam.md.
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>

#include <CLI/App.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/error.h"
#include "forest/frame/similarity.h"
#include "forest/frame/soften.h"
#include "forest/io/png.h"
#include "forest/render/reference/reference_renderer.h"
#include "forest/scene/connection.h"
#include "forest/scene/whole.h"

#include "apps/cli/artist.h"
#include "apps/cli/bench.h"
#include "apps/cli/clock.h"
#include "apps/cli/console.h"
#include "apps/cli/grown_column.h"
#include "apps/cli/options.h"

namespace forest::cli {
namespace {

using Json = nlohmann::ordered_json;

struct Options {
  std::uint32_t neurons = 1000, frames = 20, samples = 16, rate = 25;
  double seconds = 10.;
  double budget = scene::Budget::usual;
  std::optional<float> error, thinnest, softness, pixel;
  std::optional<std::uint32_t> quick_samples;
  std::uint64_t seed = 1;
  std::string size = "640x360";
  bool causes = false;
  Drawer drawer = Drawer::automatic;
  std::filesystem::path out;
};

/// Ways of drawing that are compared with the reference. From each to the next one source of difference is taken away, so
/// that what remains tells whose fault a difference is.
enum Way : std::size_t { product, more_samples, every_segment, way_count };
constexpr std::array<const char*, way_count> way_names{"product", "more_samples", "every_segment"};
constexpr std::array<const char*, way_count> way_meanings{
    "the product", "the same detail, as many samples as the reference", "every segment, as many samples"};

/// What one moment of the dolly looks like.
struct Moment {
  std::uint32_t picture = 0;
  std::array<frame::Image, way_count> drawn;  // only the product's, unless causes are asked for
  frame::Image reference;
  std::array<double, way_count> similarity{};
};

/// The product's state at one moment.
struct Quick {
  frame::Image image;
  scene::Connections drawn;
  float error = 0.f;  // pixels accepted
  float pixel = 1.f;  // as wide as one that was drawn
  std::uint32_t samples = 1;
  double milliseconds = 0.;
};

class Walk {
 public:
  Walk(const Options& options, scene::Forest forest)
      : options_(options),
        size_(parse_size(options.size)),
        viewport_{float(size_.first), float(size_.second)},
        artist_(std::move(forest), options.drawer),
        exact_(make_renderer(options.drawer)),
        dolly_(artist_.forest()),
        connectedness_(artist_.forest()),
        budget_(options.budget),
        pictures_(std::max(2u, std::uint32_t(std::lround(options.seconds * options.rate)))) {
    exact_->load(artist_.forest().geometry());
    reference_.load(artist_.forest().geometry());
  }

  std::uint32_t pictures() const { return pictures_; }

  /// Stands still until the budget knows what the first picture costs.
  void settle() {
    constexpr double long_enough = 3000.;  // milliseconds, for a budget takes its time to go up a step
    for (double stood = 0.; stood < long_enough; stood += budget_.milliseconds()) draw_quick(0);
  }
  /// To be called for every picture in turn: the budget learns from each.
  Quick draw_quick(std::uint32_t picture) {
    Quick quick;
    quick.error = options_.error.value_or(budget_.error());
    quick.pixel = options_.pixel.value_or(options_.error ? 1.f : budget_.pixel());
    quick.samples = options_.quick_samples.value_or(options_.error ? 16u : budget_.samples());
    const scene::View view =
        view_at(picture, quick.error, quick.samples,
                options_.thinnest.value_or(options_.error ? 0.f : budget_.thinnest()), quick.pixel);
    Drawn drawn = artist_.draw(view, size_.first, size_.second);
    const auto softening = Clock::now();
    const bool budgeted = !options_.error && !options_.quick_samples;
    frame::soften(drawn.image, options_.softness.value_or(budgeted ? budget_.softness() : 0.f), quick.image);
    quick.milliseconds = drawn.cull + drawn.draw + drawn.resolve + milliseconds_since(softening);
    budget_.took(quick.milliseconds, drawn.segments);
    if (drawn.image.covered < .005)
      throw Error(fmt::format("picture {} covers {:.2f} % of its pixels: nothing was compared", picture,
                              100. * drawn.image.covered));
    quick.drawn = connectedness_(cut(view), view.camera, viewport_);
    return quick;
  }

  Moment compare(std::uint32_t picture, Quick& quick) {
    const scene::View view = view_at(picture, quick.error, options_.samples, 0.f, 1.f);
    const scene::Cut all = scene::whole(artist_.forest(), view.camera, viewport_);
    const scene::Colouring colouring = scene::colour(artist_.forest(), view.colour_by, view.background);
    const frame::Frame frame =
        scene::compose(artist_.forest(), view, colouring, all, size_.first, size_.second);
    Moment moment{.picture = picture, .drawn = {}, .reference = {}};
    reference_seconds_ += reference_.draw(frame).draw / 1000.;
    moment.reference = reference_.read();
    moment.drawn[product] = std::move(quick.image);
    if (options_.causes) {
      moment.drawn[more_samples] = artist_.draw(view, size_.first, size_.second).image;
      exact_->draw(frame);
      moment.drawn[every_segment] = exact_->read();
    }
    for (std::size_t w = 0; w < ways(); ++w)
      moment.similarity[w] = frame::similarity(moment.drawn[w], moment.reference);
    return moment;
  }

  std::size_t ways() const { return options_.causes ? std::size_t(way_count) : 1; }
  double reference_seconds() const { return reference_seconds_; }  // of all pictures compared
  std::string renderer() const { return artist_.renderer(); }
  const scene::Forest& forest() const { return artist_.forest(); }

 private:
  scene::View view_at(std::uint32_t picture, float error, std::uint32_t samples, float thinnest,
                      float pixel) const {
    scene::View view = dolly_.at(float(picture) / float(pictures_ - 1));
    view.detail.error = error, view.detail.thinnest = thinnest, view.detail.pixel = pixel;
    view.samples = samples;
    return view;
  }
  scene::Cut cut(const scene::View& view) const {
    const scene::Detail detail = scene::detail_for(view, size_.first, size_.second);
    return scene::choose(artist_.forest(), scene::Eye(view.camera, viewport_, detail));
  }

  const Options& options_;
  std::pair<std::uint32_t, std::uint32_t> size_;
  frame::Viewport viewport_;
  Artist artist_;
  std::unique_ptr<render::Renderer> exact_;  // draws every segment, where causes are asked for
  render::ReferenceRenderer reference_;
  scene::Dolly dolly_;
  scene::Connectedness connectedness_;
  scene::Budget budget_;
  std::uint32_t pictures_;
  double reference_seconds_ = 0.;
};

/// The pictures that are compared: all, or `count` in pairs of neighbours, spread evenly.
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

/// The largest of a row of figures, and the picture where it was.
struct Extreme {
  double value = -INFINITY;
  std::uint32_t picture = 0;
  bool offer(double v, std::uint32_t at) {
    if (v <= value) return false;
    value = v, picture = at;
    return true;
  }
  Json json(double sign = 1.) const { return {{"picture", picture}, {"value", sign * value}}; }
};

/// What is said of one way of drawing, or of the reference.
struct Summary {
  Extreme change, step_ratio, difference;  // difference: 1 - similarity
  double similarity_sum = 0.;
};

/// Rows of pictures of one size, in one picture.
frame::Image sheet(const std::vector<std::vector<const frame::Image*>>& rows) {
  const frame::Image& first = *rows[0][0];
  frame::Image image{
      std::uint32_t(rows[0].size()) * first.width, std::uint32_t(rows.size()) * first.height, {}};
  image.pixels.reserve(std::size_t(4) * image.width * image.height);
  for (const auto& row : rows)
    for (std::size_t y = 0; y < first.height; ++y)
      for (const frame::Image* one : row) {
        const auto from = one->pixels.begin() + std::ptrdiff_t(y * 4 * one->width);
        image.pixels.insert(image.pixels.end(), from, from + std::ptrdiff_t(4 * one->width));
      }
  return image;
}

/// How much brighter (from middle grey up) or darker the first is.
frame::Image difference(const frame::Image& a, const frame::Image& b) {
  const std::vector<float> la = frame::luminance(a), lb = frame::luminance(b);
  frame::Image image{a.width, a.height, {}};
  for (std::size_t i = 0; i < la.size(); ++i) {
    const auto grey = std::uint8_t(std::clamp(128.f + la[i] - lb[i], 0.f, 255.f));
    image.pixels.insert(image.pixels.end(), {grey, grey, grey, 255});
  }
  return image;
}

class Keeper {
 public:
  Keeper(const Options& options, std::size_t ways) : folder_(options.out), ways_(ways) {
    if (!folder_.empty()) std::filesystem::create_directories(folder_);
  }
  /// The ways, the reference, and how the product differs from it, side by side; a row a moment.
  void keep(const char* name, const std::vector<const Moment*>& moments) const {
    if (folder_.empty()) return;
    std::vector<frame::Image> differences;
    for (const Moment* m : moments) differences.push_back(difference(m->drawn[product], m->reference));
    std::vector<std::vector<const frame::Image*>> rows;
    for (std::size_t i = 0; i < moments.size(); ++i) {
      rows.emplace_back();
      for (std::size_t w = 0; w < ways_; ++w) rows.back().push_back(&moments[i]->drawn[w]);
      rows.back().insert(rows.back().end(), {&moments[i]->reference, &differences[i]});
    }
    const frame::Image all = sheet(rows);
    io::write_png(folder_ / (std::string(name) + ".png"), all.width, all.height, all.pixels);
  }

 private:
  std::filesystem::path folder_;
  std::size_t ways_;
};

void run(const Options& options, Console& console) {
  Walk walk(options, grown_column(options.neurons, options.seed, console));
  const Keeper keeper(options, walk.ways());
  const std::vector<std::uint32_t> chosen = chosen_pictures(walk.pictures(), options.frames);

  std::array<Summary, way_count> summary;
  Summary reference;
  std::uint64_t disconnected = 0, runs = 0;
  Extreme most_disconnected;
  Json every = Json::array();
  std::optional<Moment> before;
  walk.settle();
  console.progress().begin("walking", walk.pictures());
  for (std::uint32_t picture = 0; picture < walk.pictures(); ++picture, console.progress().advance()) {
    Quick quick = walk.draw_quick(picture);
    disconnected += quick.drawn.disconnected;
    runs += quick.drawn.runs;
    most_disconnected.offer(double(quick.drawn.disconnected), picture);
    if (!std::ranges::binary_search(chosen, picture)) continue;

    Moment now = walk.compare(picture, quick);
    Json row{{"picture", picture},
             {"error_pixels", quick.error},
             {"quick_samples", quick.samples},
             {"pixel", quick.pixel},
             {"disconnected", quick.drawn.disconnected}};
    if (!options.error) row["milliseconds"] = quick.milliseconds;
    const bool step = before && before->picture + 1 == picture;
    const double should = step ? frame::change(before->reference, now.reference) : 0.;
    if (step) row["change_reference"] = should, reference.change.offer(should, before->picture);
    for (std::size_t w = 0; w < walk.ways(); ++w) {
      Summary& s = summary[w];
      s.similarity_sum += now.similarity[w];
      Json figures{{"similarity", now.similarity[w]}};
      if (s.difference.offer(1. - now.similarity[w], picture) && w == product)
        keeper.keep("least_alike", {&now});
      if (step) {
        const double change = frame::change(before->drawn[w], now.drawn[w]);
        figures["change"] = change;
        if (s.change.offer(change, before->picture) && w == product)
          keeper.keep("largest_change", {&*before, &now});
        if (s.step_ratio.offer(change / std::max(should, .01), before->picture) && w == product)
          keeper.keep("largest_step_ratio", {&*before, &now});
      }
      if (w == product)
        row.update(figures);
      else
        row[way_names[w]] = figures;
    }
    every.push_back(std::move(row));
    before = std::move(now);
  }
  console.progress().end();

  const auto ratio = [&](std::size_t w) { return summary[w].change.value / reference.change.value; };
  const auto mean = [&](std::size_t w) { return summary[w].similarity_sum / double(chosen.size()); };
  const auto json_of = [&](std::size_t w) {
    const Summary& s = summary[w];
    return Json{{"change_ratio", ratio(w)},          {"similarity_min", 1. - s.difference.value},
                {"similarity_mean", mean(w)},        {"least_alike", s.difference.picture},
                {"largest_change", s.change.json()}, {"step_ratio", s.step_ratio.json()}};
  };
  Json json{{"change_ratio", ratio(product)},
            {"similarity_min", 1. - summary[product].difference.value},
            {"disconnected", disconnected}};
  json.update(json_of(product));
  json.update({{"largest_change_reference", reference.change.json()},
               {"most_disconnected", most_disconnected.json()},
               {"runs", runs}});
  for (std::size_t w = 1; w < walk.ways(); ++w) json["causes"][way_names[w]] = json_of(w);
  json.update({{"neurons", walk.forest().instances().size()},
               {"segments", walk.forest().segment_total()},
               {"size", options.size},
               {"pictures", walk.pictures()},
               {"compared", chosen.size()},
               {"samples", options.samples},
               {"reference_seconds", walk.reference_seconds() / double(chosen.size())},
               {"renderer", walk.renderer()},
               {"every", std::move(every)}});
  console.print(json);

  console.say(fmt::format("{} neurons, {} segments, {}, {} of {} pictures of {} s compared, {}",
                          walk.forest().instances().size(), walk.forest().segment_total(), options.size,
                          chosen.size(), walk.pictures(), options.seconds, walk.renderer()));
  std::vector<std::vector<std::string>> rows;
  for (std::size_t w = 0; w < walk.ways(); ++w) {
    const Summary& s = summary[w];
    rows.push_back({way_meanings[w], fmt::format("{:.2f}", ratio(w)), fmt::format("{}", s.change.picture),
                    fmt::format("{:.2f}", s.step_ratio.value), fmt::format("{}", s.step_ratio.picture),
                    fmt::format("{:.3f}", 1. - s.difference.value), fmt::format("{}", s.difference.picture),
                    fmt::format("{:.3f}", mean(w))});
  }
  constexpr double most_change = 1.1, least_similarity = .95;
  rows.push_back({"to reach", fmt::format("{:.2f}", most_change), "", "", "",
                  fmt::format("{:.3f}", least_similarity), "", ""});
  console.table({"", "change ÷ reference's", "at", "of one step", "at", "least similarity", "at", "mean"},
                rows);
  console.say(fmt::format("disconnected branches: {} in {} pictures (at most {:.0f}, in picture {})",
                          disconnected, walk.pictures(), most_disconnected.value, most_disconnected.picture));
  if (ratio(product) > most_change || 1. - summary[product].difference.value < least_similarity ||
      disconnected)
    console.say("missed: what is to be reached is not");
  console.say(fmt::format("the reference took {:.2f} s a picture of {} samples",
                          walk.reference_seconds() / double(chosen.size()), options.samples));
}

}  // namespace

std::function<void()> bench_seam(CLI::App& command, Console& console) {
  const auto options = std::make_shared<Options>();
  add_planted(command, options->neurons);
  add_whole(command, "--frames", options->frames,
            "Pictures compared with the reference, in pairs of neighbours spread over the dolly; 0: all", 0,
            100'000);
  add_whole(command, "--samples", options->samples, "Samples a pixel of the reference", 1, 1024);
  must_be_whole(*command.add_option("--quick-samples", options->quick_samples,
                                    "Samples a pixel of the product, instead of what the budget says"),
                1, 1024);
  add_whole(command, "--rate", options->rate, "Pictures a second", 1, 1000);
  const auto within = [&](CLI::Option* option, double low, double high) {
    must_be_within(*option, low, high);
  };
  within(command.add_option("--seconds", options->seconds, "How long the dolly takes")->capture_default_str(),
         .1, 3600.);
  add_budget(command, options->budget);
  within(command.add_option("--error", options->error,
                            "Pixels of acceptable error, and 16 samples, instead of what the budget says"),
         .05, 100.);
  within(command.add_option("--thinnest", options->thinnest,
                            "Pixels that the thinnest lines measure, instead of what the budget says"),
         0., 64.);
  within(command.add_option("--pixel", options->pixel,
                            "Pixels of the picture as wide as one drawn, instead of what the budget says"),
         1., 8.);
  within(command.add_option("--softness", options->softness,
                            "Share that neighbouring pixels give, instead of what the budget says"),
         0., .25);
  command.add_flag(
      "--causes", options->causes,
      "Compare, too, what the product would draw with more samples, and without levels of detail");
  command.add_option("--out", options->out, "A folder for the worst pictures, beside the reference");
  add_renderer(command, options->drawer);
  add_size(command, options->size);
  add_seed(command, options->seed, "Of the neurons and their places");
  return [options, &console] { run(*options, console); };
}

}  // namespace forest::cli
