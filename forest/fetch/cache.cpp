// SPDX-License-Identifier: Apache-2.0
#include "forest/fetch/cache.h"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <fcntl.h>
#include <span>
#include <thread>
#include <unistd.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <sys/file.h>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/core/hash.h"
#include "forest/core/json.h"

namespace forest::fetch {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

std::span<const std::byte> bytes_of(std::string_view text) { return std::as_bytes(std::span(text)); }

/// The first line of a file of the cache and what follows it.
struct Kept {
  std::string address, etag, modified, hash;
  std::uint64_t length = 0;
  std::string bytes;
};

std::string first_line(const std::string& address, const std::string& etag, const std::string& modified,
                       const std::string* bytes = nullptr) {
  Json line{{"address", address}, {"etag", etag}, {"modified", modified}};
  if (bytes) line.update({{"length", bytes->size()}, {"hash", hash_hex(bytes_of(*bytes))}});
  return line.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
}

/// Nothing when there is no such file or it is not of this address.
std::optional<Kept> read(const fs::path& path, const std::string& address) {
  try {
    const MappedFile file(path);
    const std::string_view text = file.text();
    const std::size_t end = text.find('\n');
    if (end == std::string_view::npos) return std::nullopt;
    const auto line = parse_json<Json>(text.substr(0, end), path.string(), "");
    Kept kept{.address = line.at("address"),
              .etag = line.at("etag"),
              .modified = line.at("modified"),
              .hash = line.value("hash", ""),
              .length = line.value("length", std::uint64_t(0)),
              .bytes = std::string(text.substr(end + 1))};
    return kept.address == address ? std::optional(std::move(kept)) : std::nullopt;
  } catch (const InputError&) {
  } catch (const Json::exception&) {
  }
  return std::nullopt;
}

std::optional<Kept> read_entry(const fs::path& path, const std::string& address) {
  std::optional<Kept> kept = read(path, address);
  if (kept && (kept->bytes.size() != kept->length || hash_hex(bytes_of(kept->bytes)) != kept->hash))
    kept.reset();
  return kept;
}

double age(const fs::path& path) {
  std::error_code error;
  const auto time = fs::last_write_time(path, error);
  return error ? HUGE_VAL
               : std::abs(std::chrono::duration<double>(fs::file_time_type::clock::now() - time).count());
}

/// A download on its way into its part.
class Part {
 public:
  Part(const fs::path& place, const std::string& address, std::size_t max_bytes)
      : file_(place), address_(address), max_bytes_(max_bytes) {
    // Only what can be compared byte by byte can be continued (RFC 9110, section 13.1.5): not a weak ETag.
    if (const auto kept = read(file_.path(), address)) {
      validator_ = !kept->etag.empty() ? kept->etag : kept->modified;
      size_ = kept->bytes.size();
      if (validator_.empty() || validator_.starts_with("W/")) size_ = 0;
    }
  }

  ~Part() {
    if (file_.size() == 0) forget();
  }
  Part(const Part&) = delete;
  Part& operator=(const Part&) = delete;

  std::uint64_t size() const { return size_; }
  const std::string& validator() const { return validator_; }

  /// False when it is another part than the one that was asked for; then all begins again.
  bool take(const Head& head, std::span<const std::byte> bytes) {
    if (!begun_ && !(begun_ = begin(head))) return false;
    if (size_ + bytes.size() > max_bytes_) refuse();
    file_.write(bytes);  // at once, so that it is there when the program is killed
    size_ += bytes.size();
    return true;
  }
  bool misled() const { return misled_; }

  /// The bytes so far, which leave the disk when `forget` is called.
  std::string bytes() const {
    const auto kept = read(file_.path(), address_);
    return kept ? kept->bytes : "";
  }
  void forget() { file_.discard(); }

 private:
  bool begin(const Head& head) {
    if (head.size && *head.size > max_bytes_) refuse();
    misled_ = head.status == 206 && (size_ == 0 || head.begin != size_);
    if (misled_) {
      forget();
      return false;
    }
    if (head.status == 206) return true;
    size_ = 0;
    file_.cut(0);
    file_.write(bytes_of(first_line(address_, head.etag, head.modified)));
    return true;
  }
  [[noreturn]] void refuse() {
    forget();
    throw LimitError(
        fmt::format("{}: is larger than {} bytes; raise --max-size if it is right", address_, max_bytes_));
  }

  PartFile file_;
  const std::string& address_;
  std::size_t max_bytes_;
  std::string validator_;
  std::uint64_t size_ = 0;
  bool begun_ = false, misled_ = false;
};

/// Others who use the folder wait while this exists.
class Lock {
 public:
  explicit Lock(const fs::path& folder) {
    std::error_code error;
    fs::create_directories(folder, error);
    if (!error) file_ = ::open((folder / "lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
    if (file_ < 0)
      throw Error(
          fmt::format("{}: is no folder that can be written; name another with --cache", folder.string()));
    while (::flock(file_, LOCK_EX) != 0 && errno == EINTR) {
    }
  }
  ~Lock() { ::close(file_); }
  Lock(const Lock&) = delete;
  Lock& operator=(const Lock&) = delete;

 private:
  int file_ = -1;
};

bool may_pass(int status) {  // worth asking again
  constexpr int passing[] = {408, 416, 425, 429, 500, 502, 503, 504};
  return std::ranges::find(passing, status) != std::end(passing);
}

/// Why an answer is no success, after all attempts.
std::string sentence(const Answer& answer, std::uint64_t come, unsigned attempts) {
  const std::string tries = attempts > 1 ? fmt::format(" after {} attempts", attempts) : "";
  const int status = answer.head.status;
  if (!answer.reached)
    return fmt::format("no answer from the service{} ({}); check the address and the network", tries,
                       answer.trouble);
  if (status == 404 || status == 410)
    return fmt::format("the service does not have it (status {}); check the name", status);
  if (may_pass(status))
    return fmt::format("the service cannot answer now (status {}){}; try again later", status, tries);
  if (answer.hopeless) return fmt::format("cannot be had ({}); check the service's address", answer.trouble);
  if (answer.trouble.empty())
    return fmt::format("the service refuses it (status {}); check the address", status);
  return fmt::format("broke off{} with {} bytes there ({}); the same command continues where it can", tries,
                     come, answer.trouble);
}

}  // namespace

fs::path default_cache() {
  const auto folder = [](const char* name) {
    const char* value = std::getenv(name);
    return fs::path(value && *value == '/' ? value : "");
  };
  if (const fs::path cache = folder("XDG_CACHE_HOME"); !cache.empty()) return cache / "brainforest";
  if (const fs::path home = folder("HOME"); !home.empty()) return home / ".cache" / "brainforest";
  throw Error("there is no folder for what is fetched, as HOME is not set; name one with --cache");
}

Cache::Cache(CacheOptions options, Manners manners)
    : options_(std::move(options)), http_(std::move(manners)) {}

Cache::Entry Cache::get(const std::string& address, std::size_t max_bytes, const Accept& accept) {
  const fs::path place = options_.folder / hash_hex(bytes_of(address));
  std::optional<Lock> lock;
  if (!options_.offline) lock.emplace(options_.folder);
  auto kept = read_entry(place, address);
  if (kept && (options_.offline || (!options_.refresh && age(place) < options_.max_age))) {
    try {
      accept(kept->bytes);
      return {std::move(kept->bytes), true};
    } catch (const Error&) {  // what another version accepted
      if (options_.offline) throw;
      std::error_code none;
      fs::remove(place, none);
    }
  }
  if (options_.offline) throw InputError(address, 0, "is not in the cache; fetch it once without --offline");
  if (!closed_.empty()) throw InputError(address, 0, closed_);
  return download(address, place, max_bytes, accept);
}

Cache::Entry Cache::download(const std::string& address, const fs::path& place, std::size_t max_bytes,
                             const Accept& accept) {
  const auto kept = read_entry(place, address);
  const Patience& patience = options_.patience;
  for (unsigned attempt = 1;; ++attempt) {
    Part part(place, address, max_bytes);
    Request request{.address = address, .from = part.size()};
    if (request.from)
      request.if_range = part.validator();
    else if (kept)
      request.etag = kept->etag, request.modified = kept->modified;
    Head got;
    Answer answer = http_.get(request, [&](const Head& head, std::span<const std::byte> bytes) {
      got = head;
      return part.take(head, bytes);
    });
    if (part.misled()) answer.trouble = "the server sends another part than the one it was asked for";
    const int status = answer.head.status;
    if (answer.whole && status == 304 && kept) {
      accept(kept->bytes);
      std::error_code none;
      fs::last_write_time(place, fs::file_time_type::clock::now(), none);
      part.forget();
      return {kept->bytes, false};
    }
    if (answer.whole && (status == 200 || status == 206) && (!got.size || *got.size == part.size())) {
      std::string bytes = part.bytes();
      part.forget();
      accept(bytes);
      NewFile file(place);
      file.write(bytes_of(first_line(address, got.etag, got.modified, &bytes)));
      file.write(bytes_of(bytes));
      file.commit();
      return {std::move(bytes), false};
    }
    if (status == 416) part.forget();  // what is there is no beginning of what the service has
    const bool again =
        !answer.hopeless && (may_pass(status) || status == 0 || status == 200 || status == 206);
    const std::string why = sentence(answer, part.size(), attempt);
    const double asked = answer.head.retry_after;
    if (asked > patience.longest_request)
      closed_ = fmt::format(
          "the service asks to be left alone for {:.0f} seconds (status {}); try again then", asked, status);
    else if (!answer.reached && (answer.hopeless || attempt > patience.retries))
      closed_ = why;
    if (!closed_.empty()) throw InputError(address, 0, closed_);
    if (!again || attempt > patience.retries) throw InputError(address, 0, why);
    wait(std::max(asked, std::min(60., patience.first_wait * std::exp2(attempt - 1.))), why);
  }
}

void Cache::wait(double seconds, const std::string& why) const {
  if (seconds > 1.5 && options_.tell) options_.tell(fmt::format("waiting {:.0f} seconds: {}", seconds, why));
  std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
}

}  // namespace forest::fetch
