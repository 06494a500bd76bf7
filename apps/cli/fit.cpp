// SPDX-License-Identifier: Apache-2.0
// brainforest fit: from traced neurons to a model that grows more of them.
#include <cmath>
#include <filesystem>
#include <memory>
#include <string_view>

#include <CLI/App.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/error.h"
#include "forest/fitting/calibration.h"
#include "forest/lsystem/grammar.h"
#include "forest/morphology/validate.h"
#include "forest/repository/names.h"
#include "forest/statistics/dealing.h"
#include "forest/statistics/flattening.h"

#include "apps/cli/console.h"
#include "apps/cli/files.h"
#include "apps/cli/grammars.h"
#include "apps/cli/neurons.h"
#include "apps/cli/options.h"
#include "apps/cli/parametric_model.h"
#include "apps/cli/samples.h"
#include "apps/cli/verb.h"

namespace forest::cli {
namespace {

struct Options {
  std::vector<std::string> files, kinds{"dendrite"};
  std::string repo, population, model, slices, form;  // form: of a parametric model; empty: resampled
  std::filesystem::path out;
  fitting::Resampling resampling;
  fitting::Calibration calibration;
  bool force = false, calibrate = false;
};

std::vector<std::uint32_t> slices_of(const Sample& sample, const std::string& expression, Console& console) {
  statistics::FeatureTable names;
  names.cells = sample.cells;
  if (!expression.empty()) set_slices(std::array{&names}, expression, console);
  return statistics::numbered(names.slices);
}

// What is so far from all else that a model of it would grow it again: a slip of a tracer or of a file.
void look_for_slips(const Sample& sample, statistics::KindSet kinds, Console& console) {
  std::size_t with = 0;
  std::string first;
  for (std::size_t i = 0; i < sample.neurons.size(); ++i) {
    const Morphology& neuron = sample.neurons[i];
    const auto findings = validate(neuron);
    const auto slip = std::ranges::find_if(findings, [&](const Finding& f) {
      return f.code == "jump" && f.section.valid() && kinds.contains(neuron.section(f.section).kind);
    });
    if (slip == findings.end()) continue;
    if (!with++) first = fmt::format("{}: {}", repository::escaped(sample.cells[i]), slip->sentence);
  }
  if (with)
    console.warn(fmt::format(
        "{} of {} {} what may be a slip, which will be grown again, first {}; 'brainforest check' "
        "tells all",
        with, counted(sample.neurons.size(), "neuron"), with == 1 ? "has" : "have", first));
}

/// Whether chance is in what is fitted.
bool draws(const Options& options) { return !options.form.empty() || options.calibrate; }

/// By what the model was fitted, how, and to which neurons: comments that the text begins with.
std::string provenance(const Options& options, const Sample& sample) {
  std::string how = fmt::format("--kind {}", fmt::join(options.kinds, " "));
  if (!options.form.empty()) {
    how += fmt::format(" --form {}", options.form);
  } else {
    how += fmt::format(" --style {:g}", options.resampling.style);
    if (options.resampling.smoothing) how += fmt::format(" --smoothing {:g}", *options.resampling.smoothing);
    if (options.calibrate) how += fmt::format(" --calibrate --candidates {}", options.calibration.candidates);
    if (!options.slices.empty()) how += fmt::format(" --slices '{}'", repository::escaped(options.slices));
  }
  if (draws(options)) how += fmt::format(" --seed {}", options.calibration.seed);
  std::string text =
      fmt::format("# Fitted by brainforest {} to {} of {}: fit {}\n", FOREST_VERSION,
                  counted(sample.cells.size(), "neuron"), repository::escaped(sample.name), how);
  constexpr std::size_t width = 120;
  std::string line = "# They are";
  for (std::size_t i = 0; i < sample.cells.size(); ++i) {
    const std::string cell = ' ' + listed(sample.cells[i]) + (i + 1 < sample.cells.size() ? "," : "");
    if (line.size() + cell.size() > width) text += std::exchange(line, "#") + '\n';
    line += cell;
  }
  text += line + '\n';
  if (const auto [ratio, error] = statistics::flattening(sample.neurons); std::isfinite(error))
    text += fmt::format(
        "# They go {:.2f} (± {:.2f}) times as far along x as along z, as those that grow do: 'plant "
        "--slice-correction' makes up for it.\n",
        ratio, error);
  return text;
}

// Those with a section of these kinds that goes anywhere; the others cannot be fitted to.
Sample with_branches(Sample sample, statistics::KindSet kinds, Console& console) {
  Sample kept{.name = sample.name, .cells = {}, .types = {}, .neurons = {}};
  for (std::size_t i = 0; i < sample.neurons.size(); ++i) {
    const Morphology& m = sample.neurons[i];
    const auto goes = [&](const Section& s) {
      const auto points = m.points().subspan(s.first_point, s.point_count);
      return kinds.contains(s.kind) && std::ranges::any_of(points, [&](const Point& p) {
               return p.position() != points[0].position();
             });
    };
    if (std::ranges::none_of(m.sections(), goes)) continue;
    kept.cells.push_back(sample.cells[i]), kept.neurons.push_back(m);
    if (i < sample.types.size()) kept.types.push_back(sample.types[i]);
  }
  if (kept.neurons.empty())
    throw Error(fmt::format(
        "no section of {} goes anywhere, all points of each are at one place; give traced neurons",
        repository::escaped(sample.name)));
  if (const std::size_t without = sample.neurons.size() - kept.neurons.size())
    console.warn(fmt::format("{} of {} {} no section of these kinds that goes anywhere and {} left out",
                             without, counted(sample.neurons.size(), "neuron"), without == 1 ? "has" : "have",
                             without == 1 ? "is" : "are"));
  return kept;
}

void run(const Options& options, Console& console) {
  must_take_files({options.out}, options.force);
  must_not_be_cells({options.out}, options.files);
  if (std::error_code none; !options.model.empty() && std::filesystem::exists(options.repo, none))
    repository::Repository::open(options.repo, repository::Access::write);  // told before hours of work
  const bool files = !options.files.empty();
  Sample sample = read_sample(files ? options.files : std::vector{options.population},
                              files ? "" : options.repo, console);
  for (const std::string& word : options.kinds) must_have_sections(sample, word);
  fitting::Resampling resampling = options.resampling;
  resampling.kinds = {};
  for (const std::string& word : options.kinds)
    resampling.kinds = resampling.kinds | statistics::kind_set(word);
  sample = with_branches(std::move(sample), resampling.kinds, console);
  const std::vector<Morphology>& neurons = sample.neurons;
  const std::string& of = sample.name;
  warn_of_copies(sample, console);
  look_for_slips(sample, resampling.kinds, console);
  fitting::Calibration calibration = options.calibration;
  if (!options.calibrate) calibration.candidates = 1;
  if (options.calibrate && neurons.size() < calibration.least)
    console.warn(fmt::format("--calibrate learns nothing of fewer than {} neurons, so there is no taste",
                             calibration.least));
  const std::string title = fmt::format("neurons like those of {}", of);
  fitting::Calibrated fitted;
  if (!options.form.empty()) {
    fitted.text =
        parametric_grammar(options.form, neurons, title, resampling.kinds, calibration.seed, console);
  } else {
    try {
      fitted = fitting::calibrated_grammar(neurons, slices_of(sample, options.slices, console), title,
                                           resampling, calibration, console.progress());
    } catch (const Error& error) {
      if (!std::string_view(error.what()).starts_with(title)) throw;
      throw Error(
          fmt::format("{} cannot be resampled, since what grows of them fails; mend what "
                      "'brainforest check' tells of them, or leave such neurons out ({})",
                      repository::escaped(of), repository::escaped(error.what())));
    }
  }
  const std::string text = provenance(options, sample) + fitted.text;
  const std::string name = options.model.empty() ? options.out.stem().string() : options.model;
  const lsystem::Grammar grammar =
      lsystem::parse(text, name);  // finds our own mistakes before anybody else does
  if (!options.out.empty()) write_unless_there(options.out, text, options.force);
  int version = 0;
  if (!options.model.empty()) {
    auto repository = repository::Repository::open(options.repo, repository::Access::write);
    version = repository
                  .add_model({options.model, text, options.population,
                              fmt::format("fitted to {} neurons of {}", neurons.size(), of),
                              distributions_of(grammar)})
                  .first;
  }
  std::vector<std::vector<std::string>> rows;
  nlohmann::ordered_json samples;
  for (const lsystem::Sample& s : grammar.lookups.samples) {
    rows.push_back({s.name, fmt::format("{}", s.rows())});
    samples[s.name] = s.rows();
  }
  if (!rows.empty()) console.table({"branches are drawn from", "rows"}, rows);
  if (fitted.gap_before > 0.)
    console.say(
        fmt::format("calibrated in {} rounds: mean square gap to thirds held back {:.3f}, {:.3f} before",
                    fitted.rounds, fitted.gap_after, fitted.gap_before));
  if (!options.out.empty())
    console.say(fmt::format("written to {}", repository::escaped(options.out.string())));
  if (version)
    console.say(fmt::format("stored in {} as {}, version {}", repository::escaped(options.repo),
                            repository::escaped(options.model), version));
  console.print({{"model", name},
                 {"version", version},
                 {"neurons", neurons.size()},
                 {"samples", samples},
                 {"calibration",
                  {{"rounds", fitted.rounds},
                   {"candidates", grammar.candidates},
                   {"tastes", grammar.tastes.size()},
                   {"gap_before", fitted.gap_before},
                   {"gap_after", fitted.gap_after}}}});
}

}  // namespace

std::function<void()> fit(CLI::App& command, Console& console) {
  const auto options = std::make_shared<Options>();
  CLI::Option_group* from = command.add_option_group("from", "what is fitted");
  from->add_option("files", options->files, "Files or folders of traced neurons");
  CLI::Option* population = from->add_option(
      "--population", options->population,
      "A population of the repository; beside files, that which the model is said to describe");
  from->require_option(1, 2);
  CLI::Option* repo = command.add_option("--repo", options->repo, "The repository");
  must_be_name(*population->needs(repo));
  CLI::Option_group* into = command.add_option_group("into", "where the model goes");
  CLI::Option* model = into->add_option("--model", options->model, "Its name in the repository");
  must_be_name(*model->needs(repo));
  into->add_option("-o,--out", options->out, "A file for the grammar");
  into->require_option(1, 2);
  must_be_kind(*command
                    .add_option("--kind", options->kinds,
                                "Kinds of sections to model: dendrite, axon, basal, apical, glia, all")
                    ->capture_default_str());
  CLI::Option* form =
      command
          .add_option(
              "--form", options->form,
              "A published form instead, which forgets all but the diameter: burke (chances to fork by µm) "
              "or hillman (a threshold)")
          ->check(CLI::IsMember(parametric_forms));
  CLI::Option* style =
      command
          .add_option("--style", options->resampling.style,
                      "How far the style of the neurons that are drawn from may be from a neuron's own, in "
                      "standard deviations")
          ->capture_default_str();
  must_be_within(*style->excludes(form), .01, 100.);
  CLI::Option* smoothing =
      command.add_option("--smoothing", options->resampling.smoothing,
                         "How far a neuron's style may be from that of the traced one whose stems "
                         "it has; 0: not at all. Without it 0, or with fewer than 25 neurons 10 over "
                         "their number, at most 1.2");
  must_be_within(*smoothing->excludes(form), 0., 100.);
  CLI::Option* calibrate =
      command
          .add_flag("--calibrate", options->calibrate,
                    "Learn a taste: of some candidates of each neuron one is drawn, by weights from a "
                    "discriminator of traced and grown ones")
          ->excludes(form);
  command
      .add_option("--candidates", options->calibration.candidates,
                  "How many candidates are grown for each neuron then")
      ->check(CLI::Range(2, 64))
      ->needs(calibrate)
      ->capture_default_str();
  add_slices(command, options->slices)->needs(calibrate);
  add_seed(command, options->calibration.seed,
           "The same seed fits the same model, where chance is in it: with --form and --calibrate");
  add_force(command, options->force);
  command.parse_complete_callback([options, &command] {
    if (command.count("--seed") && !draws(*options))
      throw CLI::ValidationError(
          "--seed is of --form and --calibrate; nothing is drawn without one of these");
    if (!options->files.empty() && !options->population.empty() && options->model.empty())
      throw CLI::ValidationError(
          "--population beside files is of the --model that is stored; give that, too");
  });
  return [options, &console] { run(*options, console); };
}

}  // namespace forest::cli
