// SPDX-License-Identifier: Apache-2.0
// One request at a time over HTTP (libcurl), with manners: never faster than agreed, the program says who it is, and a
// server can neither lead it away from http and https, nor hold it for ever.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>

namespace forest::fetch {

struct Manners {
  double rate = 2.;      // requests a second at most, repeated ones included
  double timeout = 30.;  // s without a connection, or without more than a trickle, until it is given up
  std::string program = "brainforest";      // User-Agent
  std::filesystem::path certificates = {};  // whom to trust instead of the system's list, PEM
};

struct Request {
  std::string address;
  std::uint64_t from = 0;     // bytes that are there already
  std::string if_range = {};  // with `from`: only if this (ETag or date) still holds, else the whole
  std::string etag = {};      // only if it is another now, else status 304
  std::string modified = {};  // the same by date
};

/// What is known before the body.
struct Head {
  int status = 0;                      // 0: no answer
  std::string etag, modified;          // validators, empty when not given
  std::optional<std::uint64_t> begin;  // of a part (206): its first byte
  std::optional<std::uint64_t> size;   // of the whole, when it is said
  double retry_after = 0.;             // s the server asks to wait
};

struct Answer {
  Head head;
  bool whole = false;     // all that was announced has come
  bool reached = true;    // there is a server, and it is the one that was meant
  bool hopeless = false;  // asking again would not help: a forbidden address, a wrong certificate
  std::string trouble;    // a few words; empty when whole
};

/// Pieces of a body with status 200 or 206, at least one (perhaps empty). False, or an exception, ends the transfer.
using Sink = std::function<bool(const Head& head, std::span<const std::byte> bytes)>;

class Http {
 public:
  explicit Http(Manners manners);
  ~Http();
  Http(Http&&) noexcept;

  /// Follows at most five redirections, to http and https only, and from https to https only. Throws what `sink` throws.
  Answer get(const Request& request, const Sink& sink);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace forest::fetch
