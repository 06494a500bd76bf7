// SPDX-License-Identifier: Apache-2.0
// A made-up simulation of the sample forest, for tests of what plays it.
#pragma once

#include <filesystem>
#include <string>
#include <unistd.h>
#include <utility>
#include <vector>

#include "forest/core/file.h"
#include "forest/reports/activity.h"
#include "forest/reports/synthetic.h"

namespace forest::testing {

/// The report and spikes as an activity file's bytes.
inline std::vector<std::byte> packed_activity(const reports::Report& report, const circuit::Circuit& circuit,
                                              const std::vector<Morphology>& neurons,
                                              const std::vector<reports::Spikes>& spikes = {},
                                              const reports::PackOptions& options = {}) {
  std::string name = (std::filesystem::temp_directory_path() / "forest-sample.XXXXXX").string();
  ::close(::mkstemp(name.data()));
  reports::pack(report, circuit, neurons, reports::nodes_of(circuit), spikes, name, options);
  const MappedFile file(name);
  std::vector<std::byte> bytes(file.bytes().begin(), file.bytes().end());
  std::filesystem::remove(name);
  return bytes;
}

}  // namespace forest::testing
