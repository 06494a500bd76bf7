// SPDX-License-Identifier: Apache-2.0
#include "forest/circuit/toml_node.h"

#include <exception>
#include <sstream>

namespace forest::circuit {
namespace {

// toml11 draws its message over several lines with a picture of the source; the first line holds the reason.
std::string reason(const std::exception& error) {
  std::string text = error.what();
  text.erase(std::min(text.find('\n'), text.size()));
  for (const std::string_view prefix : {"[error] ", "toml::"})
    if (text.starts_with(prefix)) text.erase(0, prefix.size());
  if (const auto colon = text.find(": "); colon != std::string::npos && text.find(' ') > colon)
    text.erase(0, colon + 2);
  return text.empty() ? "it cannot be parsed" : text;
}

// The parser recurses; text that opens brackets without end would exhaust the stack.
void refuse_deep_nesting(std::string_view text, const std::string& file) {
  constexpr int deepest = 64;
  int depth = 0;
  std::size_t line = 1;
  for (const char c : text) {
    if (c == '\n') ++line;
    if (c == '[' || c == '{') ++depth;
    if (c == ']' || c == '}') depth = std::max(0, depth - 1);
    if (depth > deepest) throw InputError(file, line, "brackets are nested too deeply; close them");
  }
}

}  // namespace

toml::value parse_toml(std::string_view text, const std::string& file) {
  refuse_deep_nesting(text, file);
  try {
    std::istringstream stream{std::string(text)};
    return toml::parse(stream, file);
  } catch (const toml::exception& error) {
    throw InputError(file, error.location().line(), "this is not TOML: " + reason(error) + "; correct it");
  } catch (const std::exception& error) {
    throw InputError(file, 0, "this is not TOML: " + reason(error) + "; correct it");
  }
}

}  // namespace forest::circuit
