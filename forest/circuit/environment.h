// SPDX-License-Identifier: Apache-2.0
// Environments of growth (cortex/environment.h) from files that people write, and from circuits: layers, somata and
// attractors, in TOML with the words of recipes; docs/lsystem/environment.md describes the keys.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>

#include "forest/circuit/circuit.h"
#include "forest/cortex/environment.h"

namespace forest::circuit {

/// Reads an environment; a recipe is one too, with its layers alone. Throws InputError (file, line, remedy): not TOML, an
/// unknown or missing key, a number out of range, nothing in it.
cortex::Environment parse_environment(std::string_view text, const std::string& file);
cortex::Environment read_environment(const std::filesystem::path& path);

/// Layers and somata of a circuit.
/// @param soma_radii  of each of circuit.morphologies, µm
cortex::Environment environment(const Circuit& circuit, std::span<const float> soma_radii);

}  // namespace forest::circuit
