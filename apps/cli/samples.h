// SPDX-License-Identifier: Apache-2.0
// Populations on the command line: folders and files of neurons, or populations of a repository, to be compared.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "forest/morphology/morphology.h"
#include "forest/statistics/features.h"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace forest::cli {

class Console;

struct Sample {
  std::string name;                // of the folder, the file or the population
  std::vector<std::string> cells;  // names, of files without folder and extension
  std::vector<std::string>
      types;  // that were given: in a repository, or the folder of each file; may be empty
  std::vector<Morphology> neurons;
};

/// @param words  files or folders; populations when there is a repository ("" for all of its neurons)
/// Throws Error when one cannot be read, has a point farther away than any neuron reaches, or there is none.
Sample read_sample(const std::vector<std::string>& words, const std::string& repo, Console& console);

/// Throws Error when a file that is to be written is a neuron among those that words, files or folders, say are read.
void must_not_be_cells(const std::vector<std::filesystem::path>& written,
                       const std::vector<std::string>& words);

/// Throws Error when no neuron has a section of the kind, a word of --kind.
void must_have_sections(const Sample& sample, const std::string& kind);

/// Says when a neuron is in a sample more than once.
void warn_of_copies(const Sample& sample, Console& console);

/// Warns of cells that are in both samples, by their points: how two samples differ is then said of less than it seems.
void warn_of_shared(const Sample& one, const Sample& other, Console& console);

/// Features of the cells, on all cores.
statistics::FeatureTable measured(const Sample& sample, std::span<const statistics::Group> groups,
                                  Console& console);

/// A table for other programs: a row a cell, its group first. What depends on diameters has " [diameters]" behind its name.
std::string features_csv(std::span<const statistics::FeatureTable> tables,
                         std::span<const std::string> groups);

/// Names the slice of each cell: what the regular expression finds in its name, or the cell itself where it finds nothing.
/// Throws Error when it finds nothing in any, or the same in all of a table.
/// Says how many it finds nothing in.
void set_slices(std::span<statistics::FeatureTable* const> tables, const std::string& expression,
                Console& console);

/// --slices, a regular expression.
CLI::Option* add_slices(CLI::App& command, std::string& expression);

/// An option's value must be a word for kinds of sections.
void must_be_kind(CLI::Option& option);

/// --kind, as the verb measure has it.
void add_kind(CLI::App& command, std::string& kind);

/// --report, and its writing.
void add_report(CLI::App& command, std::filesystem::path& report);

}  // namespace forest::cli
