// SPDX-License-Identifier: Apache-2.0
#include "forest/lsystem/expressions.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <utility>

#include <fmt/format.h>

#include "forest/core/random.h"

namespace forest::lsystem {
namespace {

constexpr int deepest = 100;                         // nested parentheses
constexpr std::size_t most_inlined = 100'000;        // instructions of functions in one expression
constexpr std::size_t most_written_out = 2'000'000;  // with arguments, in a grammar

struct Binary {
  std::string_view token;
  Op op;
  int level;  // the higher the tighter
};
// Longer tokens before their beginnings. & and | are the book's, && and || C's.
constexpr std::array binaries{
    Binary{"||", Op::logical_or, 1},  Binary{"|", Op::logical_or, 1},
    Binary{"&&", Op::logical_and, 2}, Binary{"&", Op::logical_and, 2},
    Binary{"==", Op::equal, 3},       Binary{"!=", Op::not_equal, 3},
    Binary{"<=", Op::less_equal, 4},  Binary{">=", Op::greater_equal, 4},
    Binary{"<", Op::less, 4},         Binary{">", Op::greater, 4},
    Binary{"+", Op::add, 5},          Binary{"-", Op::subtract, 5},
    Binary{"*", Op::multiply, 6},     Binary{"/", Op::divide, 6},
    Binary{"%", Op::modulo, 6},       Binary{"^", Op::power, 8},
};
constexpr int unary_level = 7;
const Lookups nothing;

// Takes arguments that are a number or a name out of a program that ends with all of them: whoever is called may say these itself.
// Of each argument what it is, or a store when it is to be worked out and kept.
Program without_plain(Program& out, const std::vector<std::size_t>& begins) {
  Program plain;
  if (begins.empty()) return plain;
  const Program all(out.begin() + std::ptrdiff_t(begins[0]), out.end());
  out.resize(begins[0]);
  for (std::size_t k = 0; k < begins.size(); ++k) {
    const auto first = all.begin() + std::ptrdiff_t(begins[k] - begins[0]);
    const auto last =
        k + 1 < begins.size() ? all.begin() + std::ptrdiff_t(begins[k + 1] - begins[0]) : all.end();
    const Op op = first->op;
    if (last - first == 1 && (op == Op::constant || op == Op::slot || op == Op::cell)) {
      plain.push_back(*first);
    } else {
      plain.push_back({Op::store, 0, 0.});
      out.insert(out.end(), first, last);
    }
  }
  return plain;
}

}  // namespace

void Compiler::add_slot(const std::string& name) {
  if (std::ranges::find(names_, name) != names_.end())
    text_.fail(fmt::format("'{}' has a meaning already; choose another name", name));
  names_.resize(std::size_t(slots_));
  names_.push_back(name);
  ++slots_;
}

std::int32_t Compiler::slot_of(const std::string& name) const {
  const auto found = std::ranges::find(names_, name);
  return found == names_.end() ? -1 : std::int32_t(found - names_.begin());
}

std::vector<std::size_t> Compiler::arguments(Program& out, const Signature& of) {
  if (text_.takes(")")) return {};
  std::vector<std::size_t> begins;
  std::map<std::size_t, Program> named;
  do {
    const std::size_t place = (text_.more(), text_.at());
    const std::string name = argument_name();
    if (name.empty()) {
      if (!named.empty())
        text_.fail_at(place, "an argument in order stands before those by name; move it there");
      begins.push_back(out.size());
      expression(out);
      continue;
    }
    const auto parameter = std::size_t(std::ranges::find(of.parameters, name) - of.parameters.begin());
    if (parameter == of.parameters.size())
      text_.fail_at(place,
                    of.parameters.empty()
                        ? fmt::format("{} has no parameters with names; give its arguments in order", of.name)
                        : fmt::format("{} has no parameter '{}'; it has {}", of.name, name,
                                      fmt::join(of.parameters, ", ")));
    if (parameter < begins.size() || named.contains(parameter))
      text_.fail_at(place, fmt::format("the parameter '{}' of {} is given twice", name, of.name));
    named[parameter] = apart();
  } while (text_.takes(","));
  text_.expect(")", "after the arguments");
  const std::size_t needed = of.parameters.size() - of.defaults.size();
  while (!named.empty()) {
    const std::size_t count = begins.size();
    begins.push_back(out.size());
    if (const auto given = named.extract(count)) {
      out.insert(out.end(), given.mapped().begin(), given.mapped().end());
      barrier_ = out.size();
    } else if (count >= needed) {
      out.push_back({Op::constant, 0, of.defaults[count - needed]});
    } else {
      text_.fail(fmt::format("the parameter '{}' of {} is missing", of.parameters[count], of.name));
    }
  }
  return begins;
}

void Compiler::binding(Program& out) {
  const std::string name = text_.name("of a value to be used in the successor");
  text_.expect("=", "between a name and its value");
  expression(out);
  out.push_back({Op::store, slots_, 0.});
  if (first_binding_ < 0) first_binding_ = slots_;
  add_slot(name);
}

void Compiler::binary(Program& out, int least) {
  if (++depth_ > deepest) text_.fail("the expression is nested too deeply; use bindings for its parts");
  unary(out);
  for (;;) {
    if (!text_.more() || text_.sees("->")) break;
    if (text_.sees("=") && !text_.sees("==")) text_.fail("write == to compare");
    const auto row = std::ranges::find_if(binaries, [&](const Binary& b) { return text_.sees(b.token); });
    if (row == binaries.end() || row->level < least) break;
    text_.takes(row->token);
    binary(out, row->op == Op::power ? row->level : row->level + 1);  // 2^3^2 = 2^9
    emit(out, {row->op, 0, 0.}, 2);
  }
  --depth_;
}

void Compiler::unary(Program& out) {
  if (text_.sees("-") && !text_.sees("->")) {
    text_.takes("-");
    operand(out);
    emit(out, {Op::negate, 0, 0.}, 1);
  } else if (text_.sees("!") && !text_.sees("!=")) {
    text_.takes("!");
    operand(out);
    emit(out, {Op::logical_not, 0, 0.}, 1);
  } else if (text_.takes("+")) {
    operand(out);
  } else {
    primary(out);
  }
}

void Compiler::operand(Program& out) { binary(out, unary_level); }

void Compiler::primary(Program& out) {
  const char c = text_.peek();
  if (text_.takes("(")) {
    expression(out);
    text_.expect(")", "to close the parenthesis");
  } else if (is_digit(c) || c == '.') {
    out.push_back({Op::constant, 0, text_.number()});
  } else if (is_letter(c) || c == '_') {
    named(out);
  } else {
    text_.fail("a number, a name or a parenthesis is missing here");
  }
}

void Compiler::named(Program& out) {
  const std::size_t place = text_.at();
  const std::string name = text_.name("in an expression");
  if (text_.takes("(")) return call(out, name, place);
  const auto found = meanings_.find(name);
  const bool sample = found != meanings_.end() && found->second.kind == Meaning::sample;
  if (const std::int32_t slot = slot_of(name); slot >= 0 && !(sample && text_.sees("."))) {
    if (hidden_ && first_binding_ >= 0 && slot >= first_binding_)
      text_.fail_at(place,
                    fmt::format("'{}' is a binding, which is worked out when the production was chosen; "
                                "write its probability by parameters",
                                name));
    return out.push_back({Op::slot, slot, 0.});
  }
  if (sample) return outcome(out, name, found->second);
  if (found == meanings_.end())
    text_.fail_at(
        place,
        fmt::format("'{}' is not known here; make it a parameter or a binding, or #define it above", name));
  const Meaning& m = found->second;
  if (m.kind == Meaning::constant) return out.push_back({Op::constant, 0, m.value});
  sums_ |= m.kind == Meaning::total;
  if (m.kind == Meaning::cell || (m.kind == Meaning::total && m.parameters.empty()))
    return out.push_back({Op::cell, m.index, 0.});
  text_.fail_at(place, fmt::format("'{}' wants its arguments; write {}(…)", name, name));
}

std::string Compiler::argument_name() {
  const std::string_view rest = text_.rest();
  const auto length = std::size_t(std::ranges::find_if_not(rest, is_name) - rest.begin());
  if (!length || is_digit(rest[0])) return {};
  std::string_view after = rest.substr(length);
  after.remove_prefix(
      std::min(after.size(), std::size_t(std::ranges::find_if_not(after, is_space) - after.begin())));
  if (!after.starts_with('=') || after.starts_with("==")) return {};
  std::string name = text_.name("of an argument");
  text_.takes("=");
  return name;
}

Program Compiler::apart() {
  Program out;
  const std::size_t barrier = std::exchange(barrier_, 0);
  expression(out);
  barrier_ = barrier;
  return out;
}

void Compiler::call(Program& out, const std::string& name, std::size_t place) {
  const auto close = [&](const std::vector<std::size_t>& taken, std::size_t wanted) {
    if (taken.size() != wanted)
      text_.fail_at(place, fmt::format("{} takes {} argument{}, {} given", name, wanted,
                                       wanted == 1 ? "" : "s", taken.size()));
  };
  if (name == "if") return choose(out);
  const auto found = meanings_.find(name);
  if (found != meanings_.end() && found->second.kind == Meaning::function) {
    const Meaning& f = found->second;
    inlined_ += f.body.size();
    if (inlined_ > most_inlined)
      text_.fail_at(place,
                    fmt::format("with all that {} and other functions call the expression has more than "
                                "{} instructions; keep parts of it in bindings or parameters",
                                name, most_inlined));
    written_out_ += f.body.size() + std::size_t(f.slots);
    if (written_out_ > most_written_out)
      text_.fail_at(place,
                    fmt::format("with all that {} and other functions call the grammar has more than {} "
                                "instructions and arguments; call fewer functions within functions",
                                name, most_written_out));
    const std::int32_t base = slots_;
    slots_ += f.slots;
    const std::vector<std::size_t> begins = arguments(out, {name, f.parameters});
    close(begins, f.parameters.size());
    const Program plain = without_plain(out, begins);
    for (auto i = std::int32_t(plain.size()); i-- > 0;)
      if (plain[std::size_t(i)].op == Op::store) out.push_back({Op::store, base + i, 0.});
    for (Instruction i : f.body) {
      if (i.op == Op::slot && std::size_t(i.index) < plain.size() &&
          plain[std::size_t(i.index)].op != Op::store)
        i = plain[std::size_t(i.index)];
      else if (i.op == Op::slot || i.op == Op::store)
        i.index += base;
      out.push_back(i);
    }
    barrier_ = out.size();
    draws_ |= f.draws, sums_ |= f.sums;
  } else if (found != meanings_.end() && found->second.kind == Meaning::total) {
    const auto& parameters = found->second.parameters;
    close(arguments(out, {name, parameters}), parameters.size());
    out.push_back({parameters.empty() ? Op::cell : Op::cell_at, found->second.index, 0.});
    barrier_ = out.size();
    sums_ = true;
  } else if (found != meanings_.end() && found->second.kind == Meaning::table) {
    close(arguments(out, {name}), 1);
    out.push_back({Op::table, found->second.index, 0.});
    barrier_ = out.size();
  } else if (found != meanings_.end() && found->second.kind == Meaning::sample) {
    const auto& parameters = found->second.parameters;
    close(arguments(out, {name, parameters}), parameters.size());
    out.push_back({Op::row, found->second.index, double(parameters.size())});
    barrier_ = out.size();
    draws_ = true;
  } else {
    const auto row = std::ranges::find(functions(), name, &Function::name);
    if (row == functions().end())
      text_.fail_at(
          place, fmt::format("there is no function '{}'; declare it as function, distribution or table above",
                             name));
    close(arguments(out, {name}), std::size_t(row->parameters));
    draws_ |= row->draws;
    emit(out, {row->op, 0, 0.}, row->draws ? 0 : row->parameters);
  }
}

void Compiler::outcome(Program& out, const std::string& name, const Meaning& sample) {
  if (!text_.takes(".")) return out.push_back({Op::constant, 0, double(sample.index)});
  const std::size_t place = text_.at();
  const std::string column = text_.name("of an outcome");
  const auto found = std::ranges::find(sample.outcomes, column);
  if (found == sample.outcomes.end())
    text_.fail_at(place, fmt::format("sample {} has no outcome '{}'; it has {}", name, column,
                                     fmt::join(sample.outcomes, ", ")));
  text_.expect("(", "before the row of an outcome");
  expression(out);
  text_.expect(")", "after the row of an outcome");
  out.push_back({Op::outcome, sample.index, double(found - sample.outcomes.begin())});
  barrier_ = out.size();
}

void Compiler::choose(Program& out) {
  expression(out);
  const std::size_t test = out.size();
  out.push_back({Op::jump_if_zero, 0, 0.});
  barrier_ = out.size();
  text_.expect(",", "after the condition of if(condition, then, otherwise)");
  expression(out);
  const std::size_t skip = out.size();
  out.push_back({Op::jump, 0, 0.});
  out[test].index = std::int32_t(skip - test);
  barrier_ = out.size();
  text_.expect(",", "before the last part of if(condition, then, otherwise)");
  expression(out);
  text_.expect(")", "after the arguments");
  out[skip].index = std::int32_t(out.size() - skip - 1);
  barrier_ = out.size();
}

void Compiler::emit(Program& out, const Instruction& instruction, int operands) {
  out.push_back(instruction);
  const auto count = std::size_t(operands);
  if (operands == 0 || out.size() < barrier_ + count + 1) return;
  const auto first = out.end() - operands - 1;
  if (!std::all_of(first, out.end() - 1, [](const Instruction& i) { return i.op == Op::constant; })) return;
  Random none(0);
  double stack[8] = {};
  run({first, out.end()}, nullptr, {}, nothing, none, stack);
  out.erase(first, out.end());
  out.push_back({Op::constant, 0, stack[0]});
}

}  // namespace forest::lsystem
