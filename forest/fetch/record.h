// SPDX-License-Identifier: Apache-2.0
// What a service like NeuroMorpho.Org says of a neuron, out of its JSON. All of it comes from a stranger: any bytes give
// records or InputError, and no name in them is trusted (Addresses::swc refuses those that are no names).
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace forest::fetch {

struct Record {
  std::uint64_t id = 0;  // the service's; 0 when it gives none
  std::string name, archive;
  std::string species, region, layer, type;  // empty: not said; of lists the entries joined by ", "
  /// All that is said, in the service's order ("reference_doi", "10.1016/…"); of lists the entries joined by ", ".
  std::vector<std::pair<std::string, std::string>> facts;
  std::string json;  // as it came, on one line
};

struct Page {
  std::vector<Record> records;
  std::size_t pages = 0, total = 0;  // as the service counts; 0 when it does not say
};

/// @param source  the address, for the sentence. Throws InputError when there is no JSON object with a neuron's name.
Record parse_record(std::string_view json, const std::string& source);

/// HAL: `_embedded.neuronResources` and `page`. A page without records is an empty one. Throws InputError.
Page parse_page(std::string_view json, const std::string& source);

}  // namespace forest::fetch
