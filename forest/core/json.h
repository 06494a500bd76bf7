// SPDX-License-Identifier: Apache-2.0
// JSON that others wrote, looked at before anything is made of it: the library that reads it copies and writes brackets within
// brackets by calling itself, which ends a program that was given enough of them, and looks through all members of an ordered
// object for each new one.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace forest {

struct JsonLimits {
  std::size_t deepest = 32;         // brackets within one another
  std::size_t most_members = 4096;  // of one object
  bool keys_once = false;           // within an object; otherwise the last of them counts
};

/// Throws InputError for a text that is no JSON ("view.json:2: is no JSON from column 11 on; …"), holds a number beyond all that
/// can be computed with, or goes beyond the limits.
/// @param remedy  what to do about it
void check_json(std::string_view text, const std::string& source, std::string_view remedy,
                const JsonLimits& limits = {});

/// What the text says. `Json` is one of nlohmann's types, whose header this one does not bring.
template <class Json>
Json parse_json(std::string_view text, const std::string& source, std::string_view remedy,
                const JsonLimits& limits = {}) {
  check_json(text, source, remedy, limits);
  return Json::parse(text);
}

}  // namespace forest
