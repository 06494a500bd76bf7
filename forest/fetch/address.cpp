// SPDX-License-Identifier: Apache-2.0
#include "forest/fetch/address.h"

#include <algorithm>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/lower.h"

namespace forest::fetch {
namespace {

constexpr std::size_t max_piece = 255;  // bytes; a file name is no longer

bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }

/// The text if it can stand between two slashes, whoever decodes it, however often.
std::string_view piece(std::string_view text, std::string_view what) {
  const bool strange = std::ranges::any_of(text, [](char c) {
    return static_cast<unsigned char>(c) < 0x20 || c == 0x7f || c == '/' || c == '\\' || c == '%';
  });
  if (text.empty() || text == "." || text == ".." || text.size() > max_piece || strange)
    throw Error(
        fmt::format("{} '{}' is no single piece of an address (a slash, a percent sign, dots alone, or its "
                    "length); use a name as the service lists it",
                    what, encoded(text.substr(0, 80))));
  return text;
}

std::string_view trimmed(std::string_view text) {
  while (text.starts_with(' ')) text.remove_prefix(1);
  while (text.ends_with(' ')) text.remove_suffix(1);
  return text;
}

bool is_condition(std::string_view text) {
  const std::size_t colon = text.find(':');
  if (colon == 0 || colon == std::string_view::npos || colon + 1 == text.size() || text.ends_with(" AND"))
    return false;
  return std::ranges::all_of(text.substr(0, colon),
                             [](char c) { return is_letter(c) || is_digit(c) || c == '_'; }) &&
         std::ranges::count(text, '"') % 2 == 0;
}

}  // namespace

std::string encoded(std::string_view text) {
  std::string out;
  for (const char c : text)
    if (is_letter(c) || is_digit(c) || std::string_view("-._~").find(c) != std::string_view::npos)
      out += c;
    else
      out += fmt::format("%{:02X}", static_cast<unsigned char>(c));
  return out;
}

std::vector<std::string> conditions(std::string_view query) {
  constexpr std::string_view both = " AND ";
  std::vector<std::string> found;
  bool quoted = false;
  std::size_t begin = 0;
  for (std::size_t i = 0; i <= query.size(); ++i) {
    if (i < query.size() && query[i] == '"') quoted = !quoted;
    if (i < query.size() && (quoted || !query.substr(i).starts_with(both))) continue;
    const std::string_view part = trimmed(query.substr(begin, i - begin));
    if (!is_condition(part))
      throw Error(
          fmt::format("'{}' is no condition; write field:value, several joined by AND, for example "
                      "species:rat AND cell_type:\"principal cell\"",
                      part.substr(0, 80)));
    found.emplace_back(part);
    begin = i + both.size();
  }
  return found;
}

Addresses::Addresses(std::string_view base) : base_(base) {
  while (base_.ends_with('/')) base_.pop_back();
  const std::size_t scheme = base_.starts_with("https://") ? 8 : base_.starts_with("http://") ? 7 : 0;
  const bool strange = std::ranges::any_of(base_, [](char c) {
    return c <= ' ' || c > '~' || std::string_view("@?#\\\"<>").find(c) != std::string_view::npos;
  });
  if (base_.find('@') != std::string::npos)  // which may hold a password: not to be shown
    throw Error("the address of the service must be without user and password; write https://host");
  if (!scheme || base_.size() <= scheme || base_[scheme] == '/' || base_[scheme] == ':' || strange)
    throw Error(fmt::format(
        "'{}' is no address of a service; write https://host or http://host:port, without a query",
        encoded(base.substr(0, 80))));
}

std::string Addresses::record(std::string_view name) const {
  constexpr std::string_view mark = "NMO_";
  const std::string_view number = name.substr(std::min(mark.size(), name.size()));
  if (name.starts_with(mark) && !number.empty() && number.size() <= 18 &&
      std::ranges::all_of(number, is_digit))
    return fmt::format("{}/api/neuron/id/{}", base_, std::stoull(std::string(number)));
  return fmt::format("{}/api/neuron/name/{}", base_, encoded(piece(name, "the name")));
}

std::string Addresses::page(const std::vector<std::string>& conditions, std::size_t number,
                            std::size_t size) const {
  std::string address = base_ + "/api/neuron/select?";
  for (std::size_t i = 0; i < conditions.size(); ++i)
    address += (i == 0 ? "q=" : "fq=") + encoded(conditions[i]) + "&";
  return address + fmt::format("page={}&size={}", number, size);
}

std::string Addresses::swc(std::string_view archive, std::string_view name) const {
  const std::string folder = lower(piece(archive, "the archive"));
  return fmt::format("{}/dableFiles/{}/CNG%20version/{}.CNG.swc", base_, encoded(folder),
                     encoded(piece(name, "the name")));
}

}  // namespace forest::fetch
