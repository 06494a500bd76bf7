// SPDX-License-Identifier: Apache-2.0
// Expressions of a grammar, compiled as they are read. Private to this room; grammar.h says what is made of it.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "forest/lsystem/cursor.h"
#include "forest/lsystem/program.h"

namespace forest::lsystem {

// What a name in an expression stands for.
struct Meaning {
  enum { constant, cell, total, table, sample, function } kind = constant;
  double value = 0.;                         // of a constant
  std::int32_t index = 0;                    // of a cell value, a total, a table or a sample
  std::vector<std::string> outcomes = {};    // of a sample
  std::vector<std::string> parameters = {};  // their names
  Program body = {};                         // of a function: finds its arguments in the first slots
  std::int32_t slots = 0;
  bool draws = false, sums = false;
};
using Meanings = std::map<std::string, Meaning, std::less<>>;

// How a module, function or sample is called.
struct Signature {
  std::string_view name;
  std::span<const std::string> parameters = {};
  std::span<const double> defaults = {};  // of the last of them
};

// Compiles expressions at a cursor; knows the slots of the production (or function) it works for.
class Compiler {
 public:
  /// @param written_out  instructions and arguments of functions in the whole text, which it adds to
  Compiler(Cursor& text, const Meanings& meanings, std::size_t& written_out)
      : text_(text), meanings_(meanings), written_out_(written_out) {}

  void add_slot(const std::string& name);
  std::int32_t slots() const { return slots_; }
  bool draws() const { return draws_; }
  bool sums() const { return sums_; }
  /// Of a parameter or binding; -1 when there is none of that name.
  std::int32_t slot_of(const std::string& name) const;

  void expression(Program& out) {
    if (depth_ == 0) inlined_ = 0;
    binary(out, 0);
  }

  /// Arguments and the parenthesis behind them: in order, then by name, `reach = 5`, with the default of what is left out
  /// before the last.
  /// @return where each of them begins
  std::vector<std::size_t> arguments(Program& out, const Signature& of);

  /// `name = expression` as a store.
  void binding(Program& out);
  /// From here on bindings may not be named.
  void hide_bindings() { hidden_ = true; }

 private:
  void binary(Program& out, int least);
  void unary(Program& out);
  void operand(Program& out);
  void primary(Program& out);
  void named(Program& out);

  // The name before a single =, else nothing.
  std::string argument_name();

  // An expression whose place in a program is not yet known.
  Program apart();
  void call(Program& out, const std::string& name, std::size_t place);

  // Of a sample: `forks.part(row)`, or by its name alone its number, which Trace wants.
  void outcome(Program& out, const std::string& name, const Meaning& sample);

  // if(condition, then, otherwise): only one of the two is evaluated.
  void choose(Program& out);

  // Adds an instruction; when its operands are constants, their result instead. No jump may lead into what is
  // folded.
  void emit(Program& out, const Instruction& instruction, int operands);

  Cursor& text_;
  const Meanings& meanings_;
  std::size_t& written_out_;
  std::vector<std::string> names_;  // of slots; those of inlined functions have none
  std::int32_t slots_ = 0;
  std::size_t barrier_ = 0;
  std::int32_t first_binding_ = -1;  // its slot
  std::size_t inlined_ = 0;          // instructions of functions, in the expression that is read
  int depth_ = 0;
  bool draws_ = false, sums_ = false, hidden_ = false;
};

}  // namespace forest::lsystem
