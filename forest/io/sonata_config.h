// SPDX-License-Identifier: Apache-2.0
// The configuration of a SONATA circuit: JSON with variables ($NETWORK_DIR, …) and paths relative to its own place.
// Internal to the SONATA files of this room.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

namespace forest::io {

using Json = nlohmann::ordered_json;

// The names of our own files; others' are found through their configuration.
inline constexpr const char* sonata_config_name = "circuit_config.json";
inline constexpr const char* sonata_nodes_name = "nodes.h5";
inline constexpr const char* sonata_types_name = "node_types.csv";
inline constexpr const char* sonata_edges_name = "edges.h5";
inline constexpr const char* sonata_edge_types_name = "edge_types.csv";
inline constexpr const char* sonata_outline_name = "outline.json";
inline constexpr const char* sonata_morphologies_name = "morphologies";
inline constexpr const char* sonata_our_key = "brainforest";
inline constexpr std::uint32_t sonata_magic = 0x0A7A;

class SonataConfig {
 public:
  /// @param place  a configuration file, or a folder with circuit_config.json
  /// Throws InputError, as all functions here do, when a value is missing or of another kind.
  explicit SonataConfig(const std::filesystem::path& place);

  const Json& json() const { return json_; }
  const std::filesystem::path& file() const { return file_; }

  /// A member that is there and not null, or null. `object` may be anything.
  static const Json* find(const Json& object, const char* key);
  std::string text(const Json& object, const char* key) const;
  double number(const Json& object, const char* key) const;
  /// With variables replaced and relative to the configuration; none when there is no such member.
  std::optional<std::filesystem::path> path(const Json& object, const char* key) const;

  [[noreturn]] void refuse(const std::string& sentence) const;

 private:
  std::filesystem::path file_;
  Json json_;
  std::vector<std::pair<std::string, std::string>> variables_;
};

}  // namespace forest::io
