// SPDX-License-Identifier: Apache-2.0
#include "forest/fetch/http.h"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <exception>
#include <string_view>
#include <thread>

#include <curl/curl.h>
#include <fmt/format.h>

#include "forest/core/error.h"

namespace forest::fetch {
namespace {

using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

constexpr long max_redirects = 5;
constexpr long trickle = 50;       // bytes a second; a connection as slow as that is none
constexpr long max_seconds = 600;  // one request; what has come by then is continued by the next

/// As libcurl wants it: once, before there is a second thread.
void initialise() {
  static const CURLcode done = curl_global_init(CURL_GLOBAL_DEFAULT);
  if (done != CURLE_OK) throw Error("libcurl cannot be started; check the installation");
}

std::string header(CURL* curl, const char* name) {
  curl_header* found = nullptr;
  return curl_easy_header(curl, name, 0, CURLH_HEADER, -1, &found) == CURLHE_OK ? found->value : "";
}

/// "bytes 100-199/1000" (RFC 9110, section 14.4) into begin and size, where it says them.
void read_range(std::string_view text, Head& head) {
  constexpr std::string_view unit = "bytes ";
  if (!text.starts_with(unit)) return;
  const auto number = [](std::string_view digits) -> std::optional<std::uint64_t> {
    std::uint64_t value = 0;
    const auto [rest, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    return error == std::errc() && rest != digits.data() ? std::optional(value) : std::nullopt;
  };
  head.begin = number(text.substr(unit.size()));
  if (const std::size_t slash = text.find('/'); slash != std::string_view::npos)
    head.size = number(text.substr(slash + 1));
}

Head head_of(CURL* curl) {
  Head head;
  long status = 0;
  curl_easy_getinfo(curl, CURLINFO_RESPONSE_CODE, &status);
  head.status = int(status);
  head.etag = header(curl, "ETag");
  head.modified = header(curl, "Last-Modified");
  curl_off_t seconds = 0, length = -1;
  curl_easy_getinfo(curl, CURLINFO_RETRY_AFTER, &seconds);
  head.retry_after = double(std::max<curl_off_t>(seconds, 0));
  curl_easy_getinfo(curl, CURLINFO_CONTENT_LENGTH_DOWNLOAD_T, &length);
  if (status == 206)
    read_range(header(curl, "Content-Range"), head);
  else if (length >= 0)
    head.size = std::uint64_t(length);
  return head;
}

struct Transfer {
  CURL* curl;
  const Sink& sink;
  std::optional<Head> head = {};
  bool refused = false;  // a status whose body nobody wants
  std::exception_ptr thrown = {};
};

std::size_t receive(char* bytes, std::size_t, std::size_t count, void* user) {
  Transfer& transfer = *static_cast<Transfer*>(user);
  try {
    if (!transfer.head) transfer.head = head_of(transfer.curl);
    if (transfer.head->status != 200 && transfer.head->status != 206) {
      transfer.refused = true;
      return CURL_WRITEFUNC_ERROR;
    }
    const bool more = transfer.sink(*transfer.head, std::as_bytes(std::span(bytes, count)));
    return more ? count : CURL_WRITEFUNC_ERROR;
  } catch (...) {  // must not pass through C
    transfer.thrown = std::current_exception();
    return CURL_WRITEFUNC_ERROR;
  }
}

bool is_any(CURLcode code, std::initializer_list<CURLcode> of) {
  return std::ranges::find(of, code) != of.end();
}

}  // namespace

struct Http::Impl {
  Manners manners;
  CURL* curl = nullptr;
  Clock::time_point next = Clock::now();  // no request before

  template <class Value>
  void set(CURLoption option, Value value) {
    if (curl_easy_setopt(curl, option, value) != CURLE_OK)
      throw Error(fmt::format("libcurl refuses its option {}; check the installation", int(option)));
  }

  void wait_for_turn() {
    std::this_thread::sleep_until(next);
    next = Clock::now() + std::chrono::duration_cast<Clock::duration>(Seconds(1. / manners.rate));
  }
};

Http::Http(Manners manners) : impl_(std::make_unique<Impl>()) {
  initialise();
  impl_->manners = std::move(manners);
  impl_->curl = curl_easy_init();
  if (!impl_->curl) throw Error("libcurl cannot be started; check the installation");
}

Http::~Http() {
  if (impl_) curl_easy_cleanup(impl_->curl);
}

Http::Http(Http&&) noexcept = default;

Answer Http::get(const Request& request, const Sink& sink) {
  Impl& http = *impl_;
  http.wait_for_turn();
  curl_easy_reset(http.curl);  // keeps the connection
  Transfer transfer{.curl = http.curl, .sink = sink};
  const bool secure = request.address.starts_with("https:");
  http.set(CURLOPT_URL, request.address.c_str());
  http.set(CURLOPT_PROTOCOLS_STR, "http,https");
  http.set(CURLOPT_REDIR_PROTOCOLS_STR, secure ? "https" : "http,https");
  http.set(CURLOPT_FOLLOWLOCATION, 1L);
  http.set(CURLOPT_MAXREDIRS, max_redirects);
  http.set(CURLOPT_USERAGENT, http.manners.program.c_str());
  http.set(CURLOPT_NOSIGNAL, 1L);
  http.set(CURLOPT_CONNECTTIMEOUT_MS, long(1e3 * http.manners.timeout));
  http.set(CURLOPT_LOW_SPEED_LIMIT, trickle);
  http.set(CURLOPT_LOW_SPEED_TIME, std::max(1L, long(http.manners.timeout)));
  http.set(CURLOPT_TIMEOUT, max_seconds);
  // NeuroMorpho.Org has offered a Diffie-Hellman key too short for Debian's OpenSSL; without that exchange its others are
  // taken. A libcurl with another TLS library has its own words for it, and is left alone.
  (void)curl_easy_setopt(http.curl, CURLOPT_SSL_CIPHER_LIST, "DEFAULT:!kDHE");
  const std::string certificates = http.manners.certificates.string();
  if (!certificates.empty()) http.set(CURLOPT_CAINFO, certificates.c_str());
  char words[CURL_ERROR_SIZE] = "";
  http.set(CURLOPT_ERRORBUFFER, static_cast<char*>(words));
  http.set(CURLOPT_WRITEFUNCTION, &receive);
  http.set(CURLOPT_WRITEDATA, static_cast<void*>(&transfer));

  curl_slist* lines = nullptr;
  const auto line = [&](const char* name, const std::string& value) {
    if (!value.empty()) lines = curl_slist_append(lines, fmt::format("{}: {}", name, value).c_str());
  };
  const std::string range = fmt::format("{}-", request.from);
  if (request.from) {
    http.set(CURLOPT_RANGE, range.c_str());
    line("If-Range", request.if_range);
  }
  line("If-None-Match", request.etag);
  line("If-Modified-Since", request.modified);
  if (lines) http.set(CURLOPT_HTTPHEADER, lines);
  const CURLcode code = curl_easy_perform(http.curl);
  curl_slist_free_all(lines);
  if (transfer.thrown) std::rethrow_exception(transfer.thrown);

  Answer answer;
  answer.head = transfer.head ? *transfer.head : head_of(http.curl);
  answer.whole = code == CURLE_OK;
  if (answer.whole && !transfer.head && (answer.head.status == 200 || answer.head.status == 206))
    answer.whole = sink(answer.head, {});
  if (answer.whole || transfer.refused) return answer;
  answer.trouble = words[0] ? words : curl_easy_strerror(code);
  const bool distrusted = is_any(code, {CURLE_SSL_CACERT_BADFILE, CURLE_PEER_FAILED_VERIFICATION,
                                        CURLE_SSL_CERTPROBLEM, CURLE_SSL_ISSUER_ERROR});
  answer.hopeless = distrusted || is_any(code, {CURLE_UNSUPPORTED_PROTOCOL, CURLE_URL_MALFORMAT,
                                                CURLE_TOO_MANY_REDIRECTS, CURLE_WEIRD_SERVER_REPLY});
  answer.reached = !distrusted && !is_any(code, {CURLE_COULDNT_CONNECT, CURLE_COULDNT_RESOLVE_HOST,
                                                 CURLE_COULDNT_RESOLVE_PROXY, CURLE_SSL_CONNECT_ERROR});
  return answer;
}

}  // namespace forest::fetch
