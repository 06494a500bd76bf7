// SPDX-License-Identifier: Apache-2.0
// What is thrown. Every error is one sentence that says what is wrong, where, and what to do about it.
#pragma once

#include <cstddef>
#include <stdexcept>
#include <string>
#include <string_view>

namespace forest {

/// The base of all errors that a person can do something about. Our own bugs are assertions instead.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A file (or text) that cannot be read. what(): "cell.swc:12: the radius is not a number; give it in µm".
class InputError : public Error {
 public:
  /// @param line 1-based; 0 when the whole file is meant.
  InputError(std::string file, std::size_t line, const std::string& sentence);

  const std::string& file() const { return file_; }
  std::size_t line() const { return line_; }
  const std::string& sentence() const { return sentence_; }  // without the place

 private:
  std::string file_;
  std::size_t line_;
  std::string sentence_;
};

/// What a parser of JSON found no way on from: "view.json:2: is no JSON from column 11 on; correct what stands there or before".
/// @param byte  1-based, where it stopped
InputError no_json(std::string_view text, std::size_t byte, const std::string& source,
                   std::string_view remedy);

/// A stated limit was reached (runaway growth, a file too large for its format).
class LimitError : public Error {
 public:
  using Error::Error;
};

}  // namespace forest
