// SPDX-License-Identifier: Apache-2.0
// The protocol (statistics/protocol.h) on cells: what `judge` and models share.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "forest/lsystem/grammar.h"
#include "forest/statistics/protocol.h"

#include "apps/cli/samples.h"
#include "apps/cli/silhouettes.h"

namespace forest::cli {

struct Judged {
  statistics::FeatureTable train, held_out;
  std::vector<statistics::FeatureTable> grown;  // populations
  statistics::Judgement judgement;
};

/// With controls of their own: training cells stretched by 1.2 along z, and with their angles jittered by 10°.
/// @param grown       populations, one or more
/// @param parametric  cells of a parametric model, the control 'burke'
/// @param kind        sections to measure, as for the verb measure
/// @param slices      a regular expression that finds the slice in the name of a traced cell; empty when each has its own
Judged judge_samples(const Sample& train, const Sample& held_out, std::span<const Sample> grown,
                     const Sample& parametric, const std::string& kind,
                     const statistics::ProtocolOptions& options, Console& console,
                     const std::string& slices = {});

/// Neurons that the grammar grows, called NAME-SEED-NUMBER.
Sample grown_from(const lsystem::Grammar& grammar, const std::string& name, std::size_t count,
                  std::uint64_t seed, Console& console);

/// Of these neurons, the most branches in a row from one traced neuron, where the model tells.
std::optional<std::size_t> longest_run_of(const lsystem::Grammar& grammar, std::size_t count,
                                          std::uint64_t seed);

/// Few cells: each is left out in turn (statistics/leave_one_out.h).
struct LeftOutTrial {
  Sample traced;
  const lsystem::Grammar* model = nullptr;  // that saw none of them, or says so …
  std::size_t fitted_to = 0;                // … of how many it says that it did
  const Sample* grown =
      nullptr;  // … or what such a one grew; with neither, one is fitted to the others each time
  std::string kind = "dendrite", slices = {};
  std::size_t count = 99;  // neurons to grow for each
  std::size_t repeats = 50;
  std::uint64_t seed = 0;
  std::filesystem::path features = {}, report = {};
  bool force = false;
};
void judge_leaving_out(const LeftOutTrial& trial, Console& console);

/// @param seeds  of the populations
nlohmann::ordered_json json_of(const statistics::Judgement& judgement, std::span<const std::uint64_t> seeds);
void tell_judgement(const statistics::Judgement& judgement, Console& console);
std::string report_of(const Judged& judged, const Riddle& riddle, const std::string& title);  // HTML

}  // namespace forest::cli
