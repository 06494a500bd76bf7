// SPDX-License-Identifier: Apache-2.0
// Which neurons of a repository a command line means, how they are read, and how they are shown.
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "forest/repository/repository.h"

namespace CLI {
class Option;
}

namespace forest::cli {

/// To be written into. One that is missing is not made, but told.
repository::Repository open_to_write(const std::string& repo);

/// The neurons called `names` (a name, or the id that `list` shows as "#12", or "12" where none has that name), in that order; all when there are none. Only those
/// of `population` unless that is empty. Throws Error when there is no such neuron or population, or when a name is that
/// of neurons in several populations.
std::vector<repository::NeuronRow> pick_neurons(const repository::Repository& repository,
                                                const std::vector<std::string>& names,
                                                const std::string& population);

/// Neurons on all cores, with their progress: use(i, neuron) for every row, by any thread; neuron() reads it.
using UseNeuron = std::function<void(std::size_t i, const std::function<Morphology()>& neuron)>;
void each_neuron(const std::string& repo, std::span<const repository::NeuronRow> rows, const char* stage,
                 Progress& progress, const UseNeuron& use);

/// What `list` and `show` print of a neuron.
nlohmann::ordered_json json_of(const repository::NeuronRow& row);
std::string source_of(const repository::NeuronRow& row);  // "cell7.swc", "purkinje, seed 1, index 7"

std::string micrometres(double value);  // with one decimal

/// An option's value must be a name (repository/names.h), or the usage is wrong.
void must_be_name(CLI::Option& option);

}  // namespace forest::cli
