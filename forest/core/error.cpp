// SPDX-License-Identifier: Apache-2.0
#include "forest/core/error.h"

namespace forest {
namespace {

std::string place(const std::string& file, std::size_t line) {
  std::string text = file.empty() ? "input" : file;
  if (line) text += ":" + std::to_string(line);
  return text;
}

}  // namespace

InputError::InputError(std::string file, std::size_t line, const std::string& sentence)
    : Error(place(file, line) + ": " + sentence), file_(std::move(file)), line_(line), sentence_(sentence) {}

}  // namespace forest
