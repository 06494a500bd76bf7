// SPDX-License-Identifier: Apache-2.0
#include "forest/core/json.h"

#include <unordered_set>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/error.h"

namespace forest {
namespace {

using nlohmann::json;

// Hears of each part of the text as it is read, and keeps nothing but the objects that are open.
class Watch final : public nlohmann::json_sax<json> {
 public:
  Watch(std::string_view text, const std::string& source, std::string_view remedy, const JsonLimits& limits)
      : text_(text), source_(source), remedy_(remedy), limits_(limits) {}

  bool null() override { return true; }
  bool boolean(bool) override { return true; }
  bool number_integer(number_integer_t) override { return true; }
  bool number_unsigned(number_unsigned_t) override { return true; }
  bool number_float(number_float_t, const string_t&) override { return true; }
  bool string(string_t&) override { return true; }
  bool binary(binary_t&) override { return true; }

  bool start_object(std::size_t) override { return open(); }
  bool end_object() override { return close(); }
  bool start_array(std::size_t) override { return open(); }
  bool end_array() override { return close(); }

  bool key(string_t& name) override {
    Object& object = open_.back();
    if (++object.members > limits_.most_members)
      refuse(fmt::format("has an object of more than {} members", limits_.most_members));
    if (limits_.keys_once && !object.keys.insert(name).second)
      throw InputError(source_, 0, fmt::format("has '{}' twice; take one out", name));
    return true;
  }

  bool parse_error(std::size_t byte, const std::string&, const json::exception& error) override {
    const InputError broken = no_json(text_, byte, source_, remedy_);
    if (dynamic_cast<const json::parse_error*>(&error)) throw broken;
    refuse("holds a number too large to be computed with", broken.line());
  }

 private:
  struct Object {
    std::size_t members = 0;
    std::unordered_set<std::string> keys;
  };

  [[noreturn]] void refuse(const std::string& what, std::size_t line = 0) const {
    throw InputError(source_, line, fmt::format("{}; {}", what, remedy_));
  }
  bool open() {
    if (open_.size() == limits_.deepest)
      refuse(fmt::format("is nested too deep, more than {} brackets within one another", limits_.deepest));
    open_.emplace_back();
    return true;
  }
  bool close() {
    open_.pop_back();
    return true;
  }

  std::string_view text_;
  const std::string& source_;
  std::string_view remedy_;
  const JsonLimits& limits_;
  std::vector<Object> open_;  // lists too
};

}  // namespace

void check_json(std::string_view text, const std::string& source, std::string_view remedy,
                const JsonLimits& limits) {
  Watch watch(text, source, remedy, limits);
  json::sax_parse(text, &watch);
}

}  // namespace forest
