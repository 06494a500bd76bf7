// SPDX-License-Identifier: Apache-2.0
// Node sets as SONATA's JSON: {"name": {"attribute": value, …}, "compound": ["name", …]}, see docs/scene/targets.md.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "forest/circuit/node_sets.h"

namespace forest::io {

/// Throws InputError (file, line where the JSON breaks off) for what is no set of node sets; what a set names is looked up
/// when it is used.
circuit::NodeSets parse_node_sets(std::string_view json, const std::string& name);
circuit::NodeSets read_node_sets(const std::filesystem::path& file);

/// Those that a circuit came with into a forest file.
circuit::NodeSets node_sets_of(const circuit::NodeNames& nodes);

/// A rule as it stands behind a name: {"layer": "L5"} or ["name", …].
circuit::NodeSet parse_node_set(std::string_view json, const std::string& name);

/// One set a line, in their order.
std::string to_json(const circuit::NodeSets& sets);

}  // namespace forest::io
