// SPDX-License-Identifier: Apache-2.0
// What the parametric models of this room have in common: how they measure, how they write what they draw, and how they
// are corrected until cells have as many tips as the traced ones.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "forest/fitting/parametric_options.h"
#include "forest/morphology/morphology.h"
#include "forest/statistics/arbors.h"

namespace forest::fitting {

struct Form {  // of a kind in the notation
  SectionKind kind;
  std::string_view suffix, module;
};
std::span<const Form> forms();

double first_diameter(const statistics::Arbors& arbors, const statistics::Branch& b);
/// Angles to draw with, one independent of the other. Traced ones are not: turns undo one another, and daughters keep to the
/// directions of their ends. So what is seen is scaled until what is drawn is as straight and as wide.
struct Angles {
  std::vector<double> turns;    // between one piece of `step` µm of a section and the next
  std::vector<double> spreads;  // between two daughters
};
Angles angles_of(std::span<const Morphology> cells, SectionKind kind, double step);

/// How many branches run side by side at most, at the same path distance: what grows at once, where all grow alike.
std::size_t abreast(const statistics::Arbors& arbors);

/// A declaration that draws such values, by the family that fits them best, and none beyond them.
std::string drawn_as(const std::string& name, const std::vector<double>& values,
                     std::vector<std::string> families);
/// The same without a family, of a parameter d, in bins of at least 40 values.
std::string drawn_by_diameter(const std::string& name, const std::vector<double>& values,
                              const std::vector<double>& diameters);
/// A cell's value that is one of these counts, as often as it is among them.
std::string counted_as(const std::string& name, std::vector<std::size_t> counts);
std::string title_of(const std::string& name);  // without what would end the line

/// How the branches of a kind begin.
struct Stems {
  std::vector<std::size_t> counts;  // of each cell
  std::vector<double> diameters;    // µm
  std::vector<double> elevations;   // degrees between their first 20 µm and the direction of the pia
};
Stems stems_of(std::span<const Morphology> cells, SectionKind kind);
/// Declarations and productions that put stems around a soma, each beginning with the module `first` of diameter d.
std::string text_of(const Stems& stems, const Form& form, std::string_view first);

struct Cells {                 // what all kinds of a population share
  std::vector<double> somata;  // diameters, µm; ten where no cell has one
  double step = 1.;            // µm between points: a sixth of a middle section
};
/// Throws Error when there is no section of these kinds.
Cells cells_of(std::span<const Morphology> cells, statistics::KindSet kinds, const std::string& name);

/// What a grammar needs of one kind.
struct Part {
  const Form& form;
  const Stems& stems;
  std::size_t most_abreast;  // branches, in any cell
  double steps;              // of growth, those of the stems aside
  std::string text;          // its declarations and productions
};
/// The grammar of a population: the comment and the title it begins with, what is shared, its parts, and the axiom, which needs the
/// modules and cells above it and so stands last.
/// @param piece  what the shared step is
std::string assembled(const std::string& comment, const std::string& title, const std::string& piece,
                      const Cells& shared, std::span<const Part> parts);

/// One kind whose number of tips is to be `tips`: `more` multiplies what makes it fork.
struct Correction {
  SectionKind kind;
  double tips = 0., more = 1.;
  double grown = 0.;  // tips of cells that grew with it; 0: none did

  std::string comment() const;
};
/// Grows cells of text() and changes each `more` until they have as many tips, or nearly: the best of all is kept. A rule measured on traced branches is not
/// that of grown ones, whose diameters wander differently, and near the border between dying out and running away a little
/// is much.
void correct(std::span<Correction*> kinds, const std::function<std::string()>& text, int rounds,
             std::uint64_t seed);

/// What every form knows of a kind.
struct KindModel {
  const Form* form = nullptr;
  Stems stems;
  Angles angles;
  double extent = 0.;  // µm, of the farthest point along branches
  std::size_t most_abreast = 0, sections = 0;
  Correction correction;
};

/// The grammar of the kinds that were measured, corrected.
/// @param measured  of one kind; nothing where there is too little of it
/// @param text_of   of all kinds and what they share
template <class Model>
std::string corrected_grammar(std::span<const Morphology> cells, const std::string& name,
                              const ParametricOptions& options,
                              std::optional<Model> (*measured)(std::span<const Morphology>, const Form&,
                                                               double step),
                              std::string (*text_of)(const std::vector<Model>&, const Cells&,
                                                     std::size_t cells, const std::string& name)) {
  const Cells shared = cells_of(cells, options.kinds, name);
  std::vector<Model> kinds;
  for (const Form& form : forms())
    if (options.kinds.contains(form.kind))
      if (auto model = measured(cells, form, shared.step)) kinds.push_back(std::move(*model));
  const auto text = [&] { return text_of(kinds, shared, cells.size(), name); };
  std::vector<Correction*> corrections;
  for (Model& m : kinds) corrections.push_back(&m.correction);
  correct(corrections, text, options.rounds, options.seed);
  for (const Correction* c : corrections)
    if (options.tell && c->grown > 0.) options.tell({c->kind, c->tips, c->grown});
  return text();
}

}  // namespace forest::fitting
