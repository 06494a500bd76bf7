// SPDX-License-Identifier: Apache-2.0
#include "forest/fetch/service.h"

#include <algorithm>
#include <set>
#include <span>

#include <fmt/format.h>

#include "forest/core/byte_order_mark.h"
#include "forest/core/error.h"
#include "forest/core/hash.h"
#include "forest/core/lower.h"

namespace forest::fetch {
namespace {

constexpr std::size_t page_size = 100;       // the service gives 500 at most
constexpr std::size_t max_json = 32u << 20;  // bytes; a record has some two thousand

bool same_letters(std::string_view a, std::string_view b) { return lower(a) == lower(b); }

}  // namespace

Service::Service(Addresses addresses, Cache& cache, std::size_t max_bytes)
    : addresses_(std::move(addresses)), cache_(cache), max_bytes_(max_bytes) {}

Record Service::record(const std::string& name) {
  const std::string address = addresses_.record(name);
  const bool by_number = address.find("/api/neuron/id/") != std::string::npos;
  Record record;
  cache_.get(address, max_json, [&](std::string_view bytes) {
    record = parse_record(bytes, address);
    const bool meant =
        by_number ? address.ends_with(fmt::format("/{}", record.id)) : same_letters(record.name, name);
    if (!meant)
      throw InputError(address, 0,
                       fmt::format("the answer is of another neuron, '{}'; check the service's address",
                                   encoded(record.name.substr(0, 80))));
  });
  return record;
}

Selection Service::select(const std::string& query, std::size_t limit, Progress& progress) {
  const std::vector<std::string> fields = conditions(query);
  const std::size_t size = std::min(limit, page_size);
  Selection selection;
  std::set<std::string> seen;
  progress.begin("asking", 0);
  for (std::size_t number = 0; selection.records.size() < limit; ++number) {
    const std::string address = addresses_.page(fields, number, size);
    Page page;
    try {
      cache_.get(address, max_json, [&](std::string_view bytes) { page = parse_page(bytes, address); });
    } catch (const Error& error) {
      if (number == 0) throw;
      selection.error = error.what();
      break;
    }
    if (number == 0) selection.total = page.total;
    const std::size_t before = selection.records.size();
    for (Record& record : page.records)
      if (selection.records.size() < limit && seen.insert(record.name).second) {
        selection.records.push_back(std::move(record));
        progress.advance();
      }
    if (selection.records.size() == before || number + 1 >= page.pages) break;
  }
  progress.end();
  return selection;
}

Swc Service::swc(const Record& record, const Cache::Accept& accept) {
  Swc swc{.address = addresses_.swc(record.archive, record.name), .bytes = {}, .hash = {}};
  auto entry = cache_.get(swc.address, max_bytes_, [&](std::string_view bytes) {
    if (is_web_page(bytes))
      throw InputError(swc.address, 0,
                       "is a web page and no SWC file; check the name and the service's address");
    accept(bytes);
  });
  swc.hash = hash_hex(std::as_bytes(std::span(entry.bytes)));
  swc.bytes = std::move(entry.bytes);
  swc.cached = entry.cached;
  return swc;
}

bool is_web_page(std::string_view bytes) {
  bytes = without_byte_order_mark(bytes);
  const std::size_t first = bytes.find_first_not_of(" \t\r\n");
  return first != std::string_view::npos && bytes[first] == '<';
}

}  // namespace forest::fetch
