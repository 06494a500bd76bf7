// SPDX-License-Identifier: Apache-2.0
// A service like NeuroMorpho.Org: records by name or query, and the standardised SWC file of a record.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "forest/core/progress.h"
#include "forest/fetch/address.h"
#include "forest/fetch/cache.h"
#include "forest/fetch/record.h"

namespace forest::fetch {

struct Selection {
  std::vector<Record> records;  // distinct, in the service's order
  std::size_t total = 0;        // that match, as the service says
  std::string error;  // why the pages end before the limit though there are more; empty when they do not
};

struct Swc {
  std::string address, bytes;
  std::string hash;     // of the bytes: hash_hex, core/hash.h
  bool cached = false;  // nothing of it came over the network now
};

class Service {
 public:
  Service(Addresses addresses, Cache& cache, std::size_t max_bytes = 200u << 20);

  const Addresses& addresses() const { return addresses_; }

  /// @param name  or number, NMO_123. Throws Error when there is none, or when the answer is of another neuron.
  Record record(const std::string& name);

  /// The first `limit` records of a query (conditions(), address.h). Ends at the service's last page, at an empty page, and
  /// at a page that brings nothing new, whatever the service says of its pages. Throws Error when not even the first comes.
  Selection select(const std::string& query, std::size_t limit, Progress& progress = Progress::none());

  /// Throws Error when it cannot be had, or is a web page; then, as when `accept` throws, it is not kept.
  Swc swc(const Record& record, const Cache::Accept& accept);

 private:
  Addresses addresses_;
  Cache& cache_;
  std::size_t max_bytes_;
};

/// Whether bytes that were to be a cell are a web page: an error told with status 200, or the login of a network.
bool is_web_page(std::string_view bytes);

}  // namespace forest::fetch
