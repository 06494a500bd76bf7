// SPDX-License-Identifier: Apache-2.0
#include "forest/io/sonata_config.h"

#include <algorithm>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/core/json.h"

namespace forest::io {

SonataConfig::SonataConfig(const std::filesystem::path& place)
    : file_(std::filesystem::is_directory(place) ? place / sonata_config_name : place) {
  json_ = parse_json<Json>(MappedFile(file_).text(), file_.string(),
                           "correct it, or name the folder of a SONATA circuit");
  if (!find(json_, "networks"))
    refuse("has no \"networks\"; name the configuration file of a SONATA circuit, or its folder");
  if (const Json* manifest = find(json_, "manifest")) {
    if (!manifest->is_object()) refuse("\"manifest\" must hold variables and their values");
    for (const auto& [name, value] : manifest->items())
      variables_.emplace_back(name, this->text(*manifest, name.c_str()));
  }
  if (std::ranges::none_of(variables_, [](const auto& v) { return v.first == "$BASE_DIR"; }))
    variables_.emplace_back("$BASE_DIR", ".");
  // Long names first: $BASE_DIR must not eat the start of $BASE_DIR_2.
  std::ranges::stable_sort(variables_, std::greater{}, [](const auto& v) { return v.first.size(); });
}

void SonataConfig::refuse(const std::string& sentence) const {
  throw InputError(file_.string(), 0, sentence);
}

const Json* SonataConfig::find(const Json& object, const char* key) {
  if (!object.is_object()) return nullptr;
  const auto found = object.find(key);
  return found == object.end() || found->is_null() ? nullptr : &*found;
}

std::string SonataConfig::text(const Json& object, const char* key) const {
  const Json* value = find(object, key);
  if (!value || !value->is_string()) refuse(fmt::format("\"{}\" must be a text", key));
  return value->get<std::string>();
}

double SonataConfig::number(const Json& object, const char* key) const {
  const Json* value = find(object, key);
  if (!value || !value->is_number()) refuse(fmt::format("\"{}\" must be a number", key));
  return value->get<double>();
}

std::optional<std::filesystem::path> SonataConfig::path(const Json& object, const char* key) const {
  if (!find(object, key)) return std::nullopt;
  std::string value = text(object, key);
  constexpr int deepest = 32;  // a variable may name others, but not itself
  constexpr std::size_t longest = 65536;
  for (int depth = 0; value.find('$') != std::string::npos; ++depth) {
    const std::string before = value;
    for (const auto& [name, replacement] : variables_)
      if (const auto at = value.find(name); at != std::string::npos)
        value.replace(at, name.size(), replacement);
    if (value == before)
      refuse(
          fmt::format("\"{}\" uses a variable that the manifest does not define: {}; define it", key, value));
    if (depth == deepest || value.size() > longest)
      refuse(
          fmt::format("the variables in \"{}\" refer to one another without end; correct the manifest", key));
  }
  return (file_.parent_path() / value).lexically_normal();
}

}  // namespace forest::io
