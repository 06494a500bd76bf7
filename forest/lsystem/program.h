// SPDX-License-Identifier: Apache-2.0
// Expressions of a grammar, compiled to instructions in postfix order for a small stack machine. A program
// leaves its results on the stack in the order in which they were written; jumps are relative, so that
// programs can be spliced.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "forest/core/random.h"
#include "forest/lsystem/sample.h"

namespace forest::lsystem {

enum class Op : std::uint8_t {
  // clang-format off
  constant, slot, cell, cell_at, store, jump, jump_if_zero, table, row, outcome,
  add, subtract, multiply, divide, power, modulo, negate,
  less, less_equal, greater, greater_equal, equal, not_equal, logical_and, logical_or, logical_not,
  sin, cos, tan, asin, acos, atan, atan2, exp, log, sqrt, abs, floor, ceil, round, sign, min, max,
  uniform, normal, truncnormal, lognormal, gamma, exponential, weibull, vonmises, poisson, chance, dealt,
  // clang-format on
};

struct Instruction {
  Op op = Op::constant;
  std::int32_t index = 0;  // of a slot, a cell value, a table or a sample; instructions to skip, of a jump
  double value = 0.;       // of a constant; of a row: how many conditions it takes; of an outcome: its column
};

using Program = std::vector<Instruction>;

/// A total by a parameter has one value for each of the whole numbers below this.
inline constexpr int total_keys = 64;

/// A function that expressions may call.
struct Function {
  std::string_view name;
  int parameters;
  Op op;
  bool draws;  // its value is random
  std::string_view meaning;
};
std::span<const Function> functions();

/// What programs look up.
struct Lookups {
  std::vector<Table> tables;
  std::vector<Sample> samples;
};

/// How far results and operands of a program stand above the stack at most.
std::size_t stack_depth(const Program& program);

/// Runs a program.
/// @param slots  the parameters and bindings it names; stores write there
/// @param cell   the values drawn once a neuron
/// @param stack  room for stack_depth(program) numbers; results begin at stack[0]
/// @return one past the last result
double* run(std::span<const Instruction> program, double* slots, std::span<const double> cell,
            const Lookups& lookups, Random& random, double* stack);

}  // namespace forest::lsystem
