// SPDX-License-Identifier: Apache-2.0
#include "forest/fetch/record.h"

#include <algorithm>
#include <cctype>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/error.h"
#include "forest/core/json.h"
#include "forest/core/lower.h"

namespace forest::fetch {
namespace {

using Json = nlohmann::ordered_json;

Json parse(std::string_view text, const std::string& source) {
  return parse_json<Json>(text, source, "check the service's address, or try again when it is well");
}

const Json* find(const Json& object, const char* key) {
  const auto found = object.is_object() ? object.find(key) : object.end();
  return object.is_object() && found != object.end() ? &*found : nullptr;
}

/// The entries of a list of texts, or of the one text.
std::vector<std::string> entries(const Json* value) {
  std::vector<std::string> texts;
  const auto add = [&](const Json& entry) {
    if (entry.is_null()) return;
    std::string text = entry.is_string() ? entry.get<std::string>() : entry.dump();
    if (!text.empty()) texts.push_back(std::move(text));
  };
  if (value && value->is_array())
    std::ranges::for_each(*value, add);
  else if (value)
    add(*value);
  return texts;
}

std::string joined(const std::vector<std::string>& texts) {
  return fmt::format("{}", fmt::join(texts, ", "));
}

bool is_layer(const std::string& region) {
  constexpr std::string_view word = "layer";
  return region.size() > word.size() && lower(region.substr(0, word.size())) == word;
}

std::size_t count_of(const Json* value) {
  return value && value->is_number_unsigned() ? value->get<std::size_t>() : 0;
}

/// Without a name it is no neuron: nothing is returned in `name`.
Record record_of(const Json& json) {
  Record record;
  const auto text = [&](const char* key) {
    const Json* value = find(json, key);
    return value && value->is_string() ? value->get<std::string>() : std::string();
  };
  record.id = count_of(find(json, "neuron_id"));
  record.name = text("neuron_name");
  record.archive = text("archive");
  record.species = joined(entries(find(json, "species")));
  record.type = joined(entries(find(json, "cell_type")));
  // The layer is one of the regions: ["neocortex", "prefrontal", "layer 3"].
  std::vector<std::string> regions, layers;
  for (std::string& entry : entries(find(json, "brain_region")))
    (is_layer(entry) ? layers : regions).push_back(std::move(entry));
  record.region = joined(regions);
  record.layer = joined(layers);
  for (const auto& [key, value] : json.items())
    if (std::string said = joined(entries(&value)); key != "_links" && !said.empty())
      record.facts.emplace_back(key, std::move(said));
  record.json = json.dump();
  return record;
}

}  // namespace

Record parse_record(std::string_view text, const std::string& source) {
  const Json json = parse(text, source);
  if (!json.is_object())
    throw InputError(source, 0, "the answer holds no neuron; check the service's address");
  Record record = record_of(json);
  if (record.name.empty())
    throw InputError(source, 0, "the answer holds no neuron; check the name and the service's address");
  return record;
}

Page parse_page(std::string_view text, const std::string& source) {
  const Json json = parse(text, source);
  const Json* embedded = find(json, "_embedded");
  const Json* list = embedded ? find(*embedded, "neuronResources") : nullptr;
  const Json* counts = find(json, "page");
  if (!json.is_object() || (!list && !counts) || (list && !list->is_array()))
    throw InputError(source, 0, "the answer is no page of neurons; check the service's address");
  Page page;
  if (counts) {
    page.pages = count_of(find(*counts, "totalPages"));
    page.total = count_of(find(*counts, "totalElements"));
  }
  if (list)
    for (const Json& entry : *list)
      if (entry.is_object()) page.records.push_back(record_of(entry));
  return page;
}

}  // namespace forest::fetch
