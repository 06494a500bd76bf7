// SPDX-License-Identifier: Apache-2.0
// The protocol (statistics/protocol.h) on cells: what `judge` and models share.
#pragma once

#include <array>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "forest/statistics/protocol.h"

#include "apps/cli/samples.h"

namespace forest::cli {

struct Judged {
  std::array<statistics::FeatureTable, 3> tables;  // training, held-out, grown
  statistics::Judgement judgement;
};

/// With the controls that need no model: training cells stretched by 1.2 along z, and with their angles jittered by 10°.
/// @param parametric  cells of a parametric model, the control 'burke'; null when there are none
/// @param kind        sections to measure, as for the verb measure
/// @param slices      a regular expression that finds the slice in the name of a traced cell; empty when each has its own
Judged judge_samples(const Sample& train, const Sample& held_out, const Sample& grown,
                     const Sample* parametric, const std::string& kind,
                     const statistics::ProtocolOptions& options, Console& console,
                     const std::string& slices = {});

nlohmann::ordered_json json_of(const statistics::Judgement& judgement, std::uint64_t seed);
void tell_judgement(const statistics::Judgement& judgement, Console& console);
std::string report_of(const Judged& judged, const std::string& title);  // HTML

}  // namespace forest::cli
