// SPDX-License-Identifier: Apache-2.0
#include "apps/cli/growth_film.h"

#include <algorithm>
#include <charconv>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/io/format.h"
#include "forest/scene/arrangement.h"
#include "forest/scene/gallery.h"

#include "apps/cli/reel.h"
#include "apps/forest_files.h"

namespace forest::cli {
namespace {

constexpr std::string_view mark = "-step";
constexpr float grown = .85f;  // of the film: the rest shows what they became

using Step = std::uint32_t;
// Of each neuron by its name, its files by their steps; the last one is what it became.
using Growth = std::map<std::string, std::map<Step, std::filesystem::path>>;

constexpr Step ended = 0xffff'ffff;

Growth growth_in(std::span<const std::filesystem::path> folders) {
  Growth all;
  for (const std::filesystem::path& folder : folders) {
    std::error_code none;
    if (!std::filesystem::is_directory(folder, none))
      throw InputError(folder.string(), 0,
                       "is no folder; give one that 'grow --time-lapse' wrote neurons into");
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
      if (!holds_cells(entry.path())) continue;
      const std::string stem = entry.path().stem().string();
      const std::size_t at = stem.rfind(mark);
      Step step = ended;
      const char* const end = stem.data() + stem.size();
      const bool is_step =
          at != stem.npos && std::from_chars(stem.data() + at + mark.size(), end, step).ptr == end;
      all[(folder / (is_step ? stem.substr(0, at) : stem)).string()][is_step ? step : ended] = entry.path();
    }
  }
  std::erase_if(all, [](const auto& neuron) { return neuron.second.size() < 2; });  // not seen to grow
  if (all.empty())
    throw InputError(
        folders.front().string(), 0,
        "holds no neuron as it grew, NAME-step000010.swc and so on; write some by 'brainforest grow "
        "--time-lapse 10 --out FOLDER'");
  return all;
}

Morphology read(const std::filesystem::path& file) {
  const MappedFile bytes(file);
  const io::CellReader cells = io::read_each(io::format_of(file, bytes.text()), bytes.text(), file.string());
  if (cells.count != 1)
    throw InputError(file.string(), 0,
                     fmt::format("holds {} neurons; each that grows has a file", cells.count));
  return cells.read(0).read.morphology;
}

// As they all were at a step: each as it was last written by then, or first.
std::vector<Morphology> at_step(const Growth& growth, Step step) {
  std::vector<Morphology> neurons;
  for (const auto& [name, files] : growth) {
    const auto after = files.upper_bound(step);
    neurons.push_back(read((after == files.begin() ? after : std::prev(after))->second));
  }
  return neurons;
}

scene::Block block_of(Step step, const frame::Viewport& picture, scene::Background background) {
  constexpr float padding = 1.1f, margin = 1.6f;  // heights of a letter
  const scene::Lettering letters = scene::letters_in(picture, background);
  const float h = letters.height;
  const std::string text = fmt::format("step {}", step);
  return {scene::Block::step,
          scene::Spot::bottom_right,
          letters.width(text) + 2.f * h * padding,
          h * (1.f + 2.f * padding),
          h * margin,
          [=](frame::Image& image, float left, float top) {
            letters.write(image, text, left + h * padding, top + h * (1.f + padding));
          }};
}

}  // namespace

FilmFigures film_growth(std::span<const std::filesystem::path> folders, const FilmPlan& plan, Drawer drawer,
                        const std::filesystem::path& out, Progress& progress) {
  const Growth growth = growth_in(folders);
  std::vector<std::string> names;
  std::vector<Step> steps;
  for (const auto& [name, files] : growth) {
    names.push_back(std::filesystem::path(name).filename().string());
    for (const auto& [step, file] : files)
      if (step != ended) steps.push_back(step);
  }
  std::ranges::sort(steps);
  steps.erase(std::ranges::unique(steps).begin(), steps.end());
  for (std::size_t i = 1; i < names.size(); ++i)
    if (std::ranges::count(names, names[i]) > 1) names[i] += fmt::format(" ({})", i + 1);

  const float aspect = float(plan.width) / float(plan.height);
  const std::vector<Morphology> whole = at_step(growth, ended);
  const std::vector<Vec3> somata = scene::places_in_gallery(whole, aspect);
  const scene::Forest forest = scene::hung(whole, names, somata);
  scene::View view = scene::overview(forest, aspect);
  plan.look.put_on(view);
  must_have_ground(view.background);
  view.targets = plan.targets;
  view.samples = plan.samples.value_or(16);

  Marks marks = plan.marks;
  marks.cells = false;
  Reel reel(plan, out, progress);
  frame::Image image;
  std::size_t drawn = steps.size() + 1;
  std::string renderer;
  const frame::Viewport picture{float(plan.width), float(plan.height)};
  const scene::Paper paper = scene::paper_of(view.background);
  scene::Arrangement places;  // beside what they became
  std::string missing;
  const auto draw = [&](const scene::Forest& grown, const auto& explain) {
    Artist artist(grown, drawer);
    renderer = artist.renderer();
    image = artist.draw(view, plan.width, plan.height).image;
    if (marks.names) scene::paint_names(image, forest, view);  // where they stay
    explain(artist);
  };
  const auto say = [&](Artist& artist) { missing = artist.explain(view, marks, image, places); };
  draw(forest, [&](Artist& artist) { artist.look_at(view, marks, image, places); });
  const scene::Block last_step = block_of(steps.back(), picture, view.background);
  places.look_at(image, paper, {&last_step, 1});
  for (int i = 0; i < reel.count(); ++i) {
    const float time = float(i) / std::max(1.f, grown * float(reel.count()));
    const std::size_t now = std::min(std::size_t(time * float(steps.size())), steps.size() - 1);
    const bool last = time >= 1.f;
    const std::size_t wanted = last ? steps.size() : now;
    if (drawn != wanted) {
      draw(last ? forest : scene::hung(at_step(growth, steps[now]), names, somata), say);
      const scene::Block step = block_of(steps[now], picture, view.background);
      places.paint(image, paper, {&step, 1});
      drawn = wanted;
    }
    reel.add(image);
  }
  FilmFigures figures = reel.finish();
  figures.renderer = std::move(renderer);
  figures.missing = std::move(missing);
  return figures;
}

}  // namespace forest::cli
