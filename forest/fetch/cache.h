// SPDX-License-Identifier: Apache-2.0
// Answers of a service kept in a folder, so that nothing is asked for twice and nothing that has come is lost.
//
//   <hash of the address>        one line of JSON (address, length, hash, ETag, date), then the bytes
//   <hash of the address>.part   one line of JSON (address, ETag, date), then the bytes that have come so far
//
// An entry gets its name when it is whole and accepted; one whose length or hash is wrong counts as none. A part is
// continued from its end, also by a later run, as long as the service says that it still has the same thing. Several programs
// may use a folder: they ask one after the other.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "forest/fetch/http.h"

namespace forest::fetch {

struct Patience {
  unsigned retries = 4;           // after the first attempt
  double first_wait = .5;         // s; doubled after each attempt, up to a minute
  double longest_request = 120.;  // s that a server may ask to wait (Retry-After)
};

struct CacheOptions {
  std::filesystem::path folder;  // made when there is none
  bool offline = false;          // entries of any age, and nothing else
  bool refresh = false;          // ask again for what is there
  double max_age =
      7. * 86400.;  // s; older entries are asked for again, and sent again only if they have changed
  Patience patience = {};
  std::function<void(const std::string& sentence)> tell = {};  // of waits longer than a second or two
};

/// $XDG_CACHE_HOME/brainforest, or ~/.cache/brainforest. Throws Error when there is neither.
std::filesystem::path default_cache();

class Cache {
 public:
  Cache(CacheOptions options, Manners manners);

  struct Entry {
    std::string bytes;
    bool cached = false;  // nothing of it came over the network now
  };

  /// Throws when the bytes are not what was asked for; they are not kept then.
  using Accept = std::function<void(std::string_view bytes)>;

  /// What is at the address. Throws Error that says why it cannot be had: an InputError about the address, a LimitError for more
  /// than `max_bytes`, or whatever `accept` throws. When there is no server, later calls say so without asking again.
  Entry get(const std::string& address, std::size_t max_bytes, const Accept& accept);

 private:
  Entry download(const std::string& address, const std::filesystem::path& place, std::size_t max_bytes,
                 const Accept& accept);
  void wait(double seconds, const std::string& why) const;

  CacheOptions options_;
  Http http_;
  std::string closed_;  // why the service is not asked any more
};

}  // namespace forest::fetch
