// SPDX-License-Identifier: Apache-2.0
#include "forest/lsystem/grammar.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <map>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "forest/core/byte_order_mark.h"
#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/lsystem/cursor.h"
#include "forest/lsystem/turtle.h"

namespace forest::lsystem {
namespace {

constexpr std::string_view symbol_marks = "+-&^\\/|$[]!';,.{}~%@?\"`";  // besides letters and digits
constexpr int deepest = 100;                                            // nested parentheses
constexpr std::size_t most_parameters = 64;                             // of one module
constexpr double most_candidates = 64;                                  // of one neuron

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

// Compiles expressions at a cursor; knows the slots of the production (or function) it works for.
class Compiler {
 public:
  Compiler(Cursor& text, const Meanings& meanings) : text_(text), meanings_(meanings) {}

  void add_slot(const std::string& name) {
    if (std::ranges::find(names_, name) != names_.end())
      text_.fail(fmt::format("'{}' has a meaning already; choose another name", name));
    names_.resize(std::size_t(slots_));
    names_.push_back(name);
    ++slots_;
  }
  std::int32_t slots() const { return slots_; }
  bool draws() const { return draws_; }
  bool sums() const { return sums_; }
  /// Of a parameter or binding; -1 when there is none of that name.
  std::int32_t slot_of(const std::string& name) const {
    const auto found = std::ranges::find(names_, name);
    return found == names_.end() ? -1 : std::int32_t(found - names_.begin());
  }

  void expression(Program& out) { binary(out, 0); }

  /// Arguments and the parenthesis behind them: in order, then by name, `reach = 5`, with the default of what is left out
  /// before the last.
  /// @return how many there are
  int arguments(Program& out, const Signature& of) {
    if (text_.takes(")")) return 0;
    std::size_t count = 0;
    std::map<std::size_t, Program> named;
    do {
      const std::size_t place = (text_.more(), text_.at());
      const std::string name = argument_name();
      if (name.empty()) {
        if (!named.empty())
          text_.fail_at(place, "an argument in order stands before those by name; move it there");
        expression(out);
        ++count;
        continue;
      }
      const auto parameter = std::size_t(std::ranges::find(of.parameters, name) - of.parameters.begin());
      if (parameter == of.parameters.size())
        text_.fail_at(
            place, of.parameters.empty()
                       ? fmt::format("{} has no parameters with names; give its arguments in order", of.name)
                       : fmt::format("{} has no parameter '{}'; it has {}", of.name, name,
                                     fmt::join(of.parameters, ", ")));
      if (parameter < count || named.contains(parameter))
        text_.fail_at(place, fmt::format("the parameter '{}' of {} is given twice", name, of.name));
      named[parameter] = apart();
    } while (text_.takes(","));
    text_.expect(")", "after the arguments");
    const std::size_t needed = of.parameters.size() - of.defaults.size();
    for (; !named.empty(); ++count) {
      if (const auto given = named.extract(count)) {
        out.insert(out.end(), given.mapped().begin(), given.mapped().end());
        barrier_ = out.size();
      } else if (count >= needed) {
        out.push_back({Op::constant, 0, of.defaults[count - needed]});
      } else {
        text_.fail(fmt::format("the parameter '{}' of {} is missing", of.parameters[count], of.name));
      }
    }
    return int(count);
  }

  /// `name = expression` as a store.
  void binding(Program& out) {
    const std::string name = text_.name("of a value to be used in the successor");
    text_.expect("=", "between a name and its value");
    expression(out);
    out.push_back({Op::store, slots_, 0.});
    add_slot(name);
  }

 private:
  void binary(Program& out, int least) {
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

  void unary(Program& out) {
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
  void operand(Program& out) { binary(out, unary_level); }

  void primary(Program& out) {
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

  void named(Program& out) {
    const std::size_t place = text_.at();
    const std::string name = text_.name("in an expression");
    if (text_.takes("(")) return call(out, name, place);
    if (const auto sample = meanings_.find(name);
        sample != meanings_.end() && sample->second.kind == Meaning::sample)
      return outcome(out, name, sample->second);
    for (std::size_t i = 0; i < names_.size(); ++i)
      if (names_[i] == name) return out.push_back({Op::slot, std::int32_t(i), 0.});
    const auto found = meanings_.find(name);
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

  // The name before a single =, else nothing.
  std::string argument_name() {
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

  // An expression whose place in a program is not yet known.
  Program apart() {
    Program out;
    const std::size_t barrier = std::exchange(barrier_, 0);
    expression(out);
    barrier_ = barrier;
    return out;
  }

  void call(Program& out, const std::string& name, std::size_t place) {
    const auto close = [&](int taken, std::size_t count) {
      const int wanted = int(count);
      if (taken != wanted)
        text_.fail_at(place, fmt::format("{} takes {} argument{}, {} given", name, wanted,
                                         wanted == 1 ? "" : "s", taken));
    };
    if (name == "if") return choose(out);
    const auto found = meanings_.find(name);
    if (found != meanings_.end() && found->second.kind == Meaning::function) {
      const Meaning& f = found->second;
      const std::int32_t base = slots_;
      slots_ += f.slots;
      close(arguments(out, {name, f.parameters}), f.parameters.size());
      for (auto i = std::int32_t(f.parameters.size()); i-- > 0;) out.push_back({Op::store, base + i, 0.});
      for (Instruction i : f.body) {
        if (i.op == Op::slot || i.op == Op::store) i.index += base;
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
            place,
            fmt::format("there is no function '{}'; declare it as function, distribution or table above",
                        name));
      close(arguments(out, {name}), std::size_t(row->parameters));
      draws_ |= row->draws;
      emit(out, {row->op, 0, 0.}, row->draws ? 0 : row->parameters);
    }
  }

  // Of a sample: `forks.part(row)`, or by its name alone its number, which Trace wants.
  void outcome(Program& out, const std::string& name, const Meaning& sample) {
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

  // if(condition, then, otherwise): only one of the two is evaluated.
  void choose(Program& out) {
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

  // Adds an instruction; when its operands are constants, their result instead. No jump may lead into what is
  // folded.
  void emit(Program& out, const Instruction& instruction, int operands) {
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

  Cursor& text_;
  const Meanings& meanings_;
  std::vector<std::string> names_;  // of slots; those of inlined functions have none
  std::int32_t slots_ = 0;
  std::size_t barrier_ = 0;
  int depth_ = 0;
  bool draws_ = false, sums_ = false;
};

// Comments become blanks, so that every place keeps its line and column.
std::string without_comments(std::string_view text, const Cursor& place) {
  std::string out(text);
  const auto blank = [&](std::size_t i) {
    if (out[i] != '\n') out[i] = ' ';
  };
  for (std::size_t i = 0; i < out.size(); ++i) {
    if (out[i] == '#' &&
        (i + 1 == out.size() || is_space(out[i + 1]) || out[i + 1] == '#' || out[i + 1] == '!')) {
      while (i < out.size() && out[i] != '\n') blank(i++);
    } else if (out[i] == '/' && i + 1 < out.size() && out[i + 1] == '*') {
      const std::size_t close = out.find("*/", i + 2);
      if (close == std::string::npos) place.fail_at(i, "the comment is not closed; write */ where it ends");
      while (i < close + 2) blank(i++);
      --i;
    }
  }
  return out;
}

class Parser {
 public:
  Parser(std::string_view text, const std::string& file)
      : clean_(without_comments(text, Cursor(text, file))), text_(clean_, file) {
    grammar_.file = file;
    grammar_.name = std::filesystem::path(file).stem().string();
    grammar_.text = text;
    for (const TurtleSymbol& s : turtle_symbols()) {
      grammar_.symbols.emplace_back(s.symbol);
      arities_.push_back({s.least, s.most, names_in(s.parameters), s.defaults});
    }
    for (const auto& [name, number] :
         {std::pair{"pi", 3.141592653589793}, {"axon", 2.}, {"basal", 3.}, {"apical", 4.}, {"glia", 7.}})
      meanings_[name] = {.kind = Meaning::constant, .value = number};
  }
  // Continues with the symbols of a grammar that exists, to read a word.
  Parser(std::string_view text, const Grammar& grammar)
      : clean_(text), text_(clean_, grammar.file), grammar_(grammar) {
    arities_.resize(grammar_.symbols.size());
    closed_ = true;
  }

  Grammar grammar() {
    for (std::size_t begin = 0; begin < clean_.size();) {
      // A statement goes on over lines that begin with a blank.
      std::size_t end = clean_.find('\n', begin);
      while (end != std::string::npos && end + 1 < clean_.size() && is_space(clean_[end + 1]))
        end = clean_.find('\n', end + 1);
      if (end == std::string::npos) end = clean_.size();
      text_.enter(begin, end);
      if (text_.more()) statement();
      if (!declared_.empty()) keep_declaration(begin, end);
      begin = end + 1;
    }
    text_.enter(clean_.size(), clean_.size());
    if (grammar_.axiom.empty()) text_.fail("the grammar has no axiom; write one, for example axiom: A(1)");
    if (grammar_.productions.empty())
      text_.fail("the grammar has no production; write one, for example grow: A -> F(1) A");
    finish();
    return std::move(grammar_);
  }

  Word word() {
    Compiler compiler(text_, meanings_);
    std::vector<Shape> shapes;
    Program values;
    successor(compiler, shapes, values);
    if (text_.more()) text_.fail("this is no module");
    if (compiler.draws()) text_.fail("a word has constant parameters; leave the draws to the grammar");
    Word word;
    std::vector<double> stack(stack_depth(values));
    Random none(0);
    run(values, nullptr, {}, nothing, none, stack.data());
    for (const Shape& s : shapes) {
      const auto first = std::uint32_t(word.parameters.size());
      word.modules.push_back({s.symbol, s.count, first});
      word.parameters.insert(word.parameters.end(), stack.data() + first, stack.data() + first + s.count);
    }
    return word;
  }

 private:
  struct Arity {
    int least = 0, most = int(most_parameters);
    std::vector<std::string> names = {};    // of the parameters, when they have some
    std::span<const double> defaults = {};  // of the last of them
  };

  // "x, y" as two.
  static std::vector<std::string> names_in(std::string_view list) {
    std::vector<std::string> names;
    for (std::size_t at = 0, stop; at < list.size(); at = stop + 2) {
      stop = std::min(list.find(", ", at), list.size());
      names.emplace_back(list.substr(at, stop - at));
    }
    return names;
  }

  /// What it uses is found by its names; a parameter of the same name makes it one too many, which does no harm.
  void keep_declaration(std::size_t begin, std::size_t end) {
    end = clean_.find_last_not_of(" \t\r\n", end - 1) + 1;
    const std::size_t line = std::min(clean_.find('\n', end), clean_.size());  // with a comment behind it
    if (grammar_.text.substr(end, line - end).find("/*") == std::string::npos) end = line;
    Declaration declaration{std::exchange(declared_, {}), begin, end, {}, std::exchange(draws_, false)};
    for (std::size_t at = begin, stop; at < end; at = std::max(stop, at + 1)) {
      for (stop = at; stop < end && is_name(clean_[stop]);) ++stop;
      const auto used = declarations_.find(std::string_view(clean_).substr(at, stop - at));
      if (used != declarations_.end()) declaration.uses.push_back(used->second);
    }
    declarations_.emplace(declaration.name, std::uint32_t(grammar_.declarations.size()));
    grammar_.declarations.push_back(std::move(declaration));
  }

  void statement() {
    struct Row {
      std::string_view word;
      void (Parser::*read)();
    };
    static constexpr Row declarations[] = {
        {"#define", &Parser::define},    {"#ignore", &Parser::ignore},
        {"module", &Parser::modules},    {"cell", &Parser::cell_value},
        {"function", &Parser::function}, {"distribution", &Parser::distribution},
        {"table", &Parser::table},       {"sample", &Parser::sample},
        {"total", &Parser::total},       {"taste", &Parser::taste},
    };
    static constexpr Row settings[] = {
        {"axiom", &Parser::axiom},           {"title", &Parser::title}, {"steps", &Parser::steps},
        {"limit", &Parser::limit},           {"angle", &Parser::angle}, {"step", &Parser::step},
        {"candidates", &Parser::candidates},
    };
    const std::size_t place = text_.at();
    const std::string first =
        text_.takes("#") ? "#" + text_.name("after #") : text_.name("that begins a statement");
    if (text_.takes(":") && first[0] != '#') {
      for (const Row& row : settings)
        if (row.word == first) return (this->*row.read)(), finished();
      return production(first, place), finished();
    }
    for (const Row& row : declarations)
      if (row.word == first) return (this->*row.read)(), finished();
    text_.fail_at(place, fmt::format("a statement cannot begin with '{}'; {}", first,
                                     first[0] == '#' ? "a comment begins with # and a blank"
                                                     : "productions begin with a name and a colon"));
  }
  void finished() {
    if (text_.more())
      text_.fail("the statement should end here; begin the next one at the left margin of a new line");
  }

  void title() {
    const std::string_view all = text_.rest();
    grammar_.title = all.substr(0, all.find_last_not_of(" \t\r\n") + 1);
    text_.skip(all.size());
  }
  double positive(std::string_view what, double most, bool whole) {
    const std::size_t place = (text_.more(), text_.at());
    const double value = constant();
    if (!(value > 0. && value <= most) || (whole && value != std::floor(value)))
      text_.fail_at(place, fmt::format("{} must be {}number from above 0 to {}", what,
                                       whole ? "a whole " : "a ", most));
    return value;
  }
  void steps() { grammar_.steps = int(positive("the number of steps", 1e6, true)); }
  void limit() { grammar_.limit = std::size_t(positive("the limit", 1e8, true)); }
  void angle() { grammar_.angle = positive("the angle", 360., false); }
  void step() { grammar_.step = positive("the step", 1e6, false); }

  void candidates() {
    grammar_.candidates = std::uint32_t(positive("the number of candidates", most_candidates, true));
  }

  double constant() {
    Compiler compiler(text_, meanings_);
    Program program;
    const std::size_t place = text_.at();
    compiler.expression(program);
    if (program.size() != 1 || program[0].op != Op::constant)
      text_.fail_at(
          place,
          "this must be a constant; for what is drawn write a distribution, or cell for once a neuron");
    if (!std::isfinite(program[0].value)) text_.fail_at(place, "the constant is not a finite number");
    return program[0].value;
  }

  std::string new_name(std::string_view purpose) {
    const std::size_t place = (text_.more(), text_.at());
    std::string name = text_.name(purpose);
    if (meanings_.contains(name) || name == "if" ||
        std::ranges::find(functions(), name, &Function::name) != functions().end())
      text_.fail_at(place, fmt::format("'{}' has a meaning already; choose another name", name));
    return declared_ = name;
  }

  void define() {
    const std::string name = new_name("of the constant");
    meanings_[name] = {.kind = Meaning::constant, .value = constant()};
  }

  void cell_value() {
    const std::string name = new_name("of the value that is drawn once a neuron");
    text_.expect("=", "between a name and its value");
    Compiler compiler(text_, meanings_);
    Program program;
    compiler.expression(program);
    if (compiler.sums())
      text_.fail("a cell's values are drawn before there is a word; use totals in productions");
    note(program, compiler);
    if (cells_.empty()) grammar_.cell_line = text_.line();
    const auto index = std::int32_t(grammar_.cell_values++);
    program.push_back({Op::store, index, 0.});
    cells_.push_back(std::move(program));
    meanings_[name] = {.kind = Meaning::cell, .index = index};
  }

  void distribution() { callable(draws_ = true); }
  void function() { callable(false); }
  void callable(bool may_draw) {
    const std::size_t place = text_.at();
    const std::string name = new_name("of the function");
    Compiler compiler(text_, meanings_);
    Meaning meaning{.kind = Meaning::function};
    if (text_.takes("(") && !text_.takes(")")) {
      do compiler.add_slot(meaning.parameters.emplace_back(text_.name("of a parameter")));
      while (text_.takes(","));
      text_.expect(")", "after the parameters");
    }
    text_.expect("=", "between a function and its expression");
    compiler.expression(meaning.body);
    meaning.slots = compiler.slots();
    meaning.draws = compiler.draws(), meaning.sums = compiler.sums();
    if (meaning.draws && !may_draw)
      text_.fail_at(place, fmt::format("a function may not draw; write distribution {} instead", name));
    if (!meaning.draws && may_draw)
      text_.fail_at(place, fmt::format("the distribution does not draw; write function {} instead", name));
    meanings_[name] = std::move(meaning);
  }

  void table() {
    const std::string name = new_name("of the table");
    Table table{.name = name, .edges = {}, .values = {}};
    text_.expect("=", "before the rows of a table");
    do {
      const std::size_t place = (text_.more(), text_.at());
      table.edges.push_back(text_.signed_number());
      text_.expect(":", "between the upper edge of a bin and its value");
      table.values.push_back(text_.signed_number());
      if (table.edges.size() > 1 && !(table.edges.back() > *(table.edges.end() - 2)))
        text_.fail_at(place, "the upper edges of the bins must increase");
    } while (text_.takes(","));
    meanings_[name] = {.kind = Meaning::table, .index = std::int32_t(grammar_.lookups.tables.size())};
    grammar_.lookups.tables.push_back(std::move(table));
  }

  // sample forks(kind =, cell !=, tips ~ 0.3 -> part) = 3 1 1.4 -> 0.25 | 0 1 0 1.2: 0.5 3.1 0 1.1, …; …
  void sample() {
    const std::string name = new_name("of the sample");
    Sample sample;
    sample.name = name;
    text_.expect("(", "before the conditions of a sample");
    while (!text_.sees("->") && !text_.sees(")")) {
      Sample::Condition c{text_.name("of a condition"), Sample::Match::like, 1.};
      const std::size_t place = (text_.more(), text_.at());
      if (text_.takes("!="))
        c.match = Sample::Match::another;
      else if (text_.takes("="))
        c.match = Sample::Match::same;
      else {
        text_.expect("~", "between a condition and the width of its kernel (or = or != after it)");
        const std::string_view rest = text_.rest();
        const auto table = std::ranges::find_if(grammar_.lookups.tables, [&](const Table& t) {
          return rest.starts_with(t.name) && !is_name(rest[t.name.size()]);
        });
        if (table != grammar_.lookups.tables.end()) {  // `path ~ path_width(kind)`
          text_.takes(table->name);
          text_.expect("(", "after the table of widths");
          const std::size_t at = (text_.more(), text_.at());
          const std::string by = text_.name("of the condition that the width depends on");
          const auto found = std::ranges::find(sample.conditions, by, &Sample::Condition::name);
          if (found == sample.conditions.end() || found->match != Sample::Match::same)
            text_.fail_at(at, fmt::format("'{}' is no condition before this one that must be the same", by));
          text_.expect(")", "after the condition that the width depends on");
          c.widths = *table, c.by = std::size_t(found - sample.conditions.begin());
        } else {
          c.width = constant();
        }
        const auto good = [](double width) { return width > 0.; };
        if (!good(c.width) || !std::ranges::all_of(c.widths.values, good))
          text_.fail_at(place, "the width of a kernel must be above 0");
      }
      sample.conditions.push_back(std::move(c));
      if (!text_.takes(",")) break;
    }
    if (text_.takes("->")) do
        sample.outcomes.push_back(text_.name("of an outcome"));
      while (text_.takes(","));
    text_.expect(")", "after the conditions and outcomes of a sample");
    text_.expect("=", "before the rows of a sample");
    std::vector<double> given(sample.conditions.size()), found(sample.outcomes.size());
    do {
      if (!text_.more()) break;
      for (double& value : given) value = text_.signed_number();
      if (!given.empty() && !found.empty())
        text_.expect("->", "between the conditions and the outcomes of a row");
      for (double& value : found) value = text_.signed_number();
      std::vector<Trace> branches;
      while (text_.takes("|")) branches.push_back(trace());
      sample.add(given, found, std::move(branches));
    } while (text_.takes(";"));
    if (!sample.rows()) text_.fail("the sample has no row");
    sample.finish();
    Meaning meaning{.kind = Meaning::sample,
                    .index = std::int32_t(grammar_.lookups.samples.size()),
                    .outcomes = sample.outcomes};
    for (const Sample::Condition& c : sample.conditions) meaning.parameters.push_back(c.name);
    meanings_[name] = std::move(meaning);
    draws_ = true;
    grammar_.lookups.samples.push_back(std::move(sample));
  }

  // Heading and diameter before it, perhaps also the last step before it, then places with their diameters:
  // `0 1 0 1.2: 0.5 3.1 0 1.1, 2 6.4 0.8 0.9` or `0 1 0 1.2, 0.6 0.8 0: …`.
  Trace trace() {
    const auto place = [&] {
      const auto x = float(text_.signed_number()), y = float(text_.signed_number());
      return Vec3(x, y, float(text_.signed_number()));
    };
    Trace trace;
    trace.heading = place().stableNormalized();
    trace.diameter = float(text_.number());
    if (text_.takes(",")) trace.last_step = place().stableNormalized();
    text_.expect(":", "between what a branch begins with and its places");
    do {
      const Vec3 at = place();
      trace.stops.push_back({at, float(text_.number())});
    } while (text_.takes(","));
    return trace;
  }

  // total share(tree) = Tip(tree, order) : 2^(-S * order)
  void total() {
    const std::string name = new_name("of the total");
    std::string key;
    if (text_.takes("(")) {
      key = text_.name("of the parameter that it is summed by");
      text_.expect(")", "after the parameter");
    }
    text_.expect("=", "between a total and the module that it is of");
    Compiler compiler(text_, meanings_);
    const std::size_t place = (text_.more(), text_.at());
    const std::vector<Shape> module = context(compiler);
    if (module.size() != 1 || is(module[0], Action::push) || is(module[0], Action::pop))
      text_.fail_at(place, "a total is of one module; write total NAME = MODULE(parameters) : expression");
    Total total{.module = module[0],
                .line = text_.line(),
                .value = {},
                .key = key.empty() ? -1 : compiler.slot_of(key),
                .place = grammar_.cell_values};
    if (!key.empty() && total.key < 0)
      text_.fail_at(place, fmt::format("the module has no parameter {}", key));
    text_.expect(":", "before what is summed");
    compiler.expression(total.value);
    if (compiler.draws() || compiler.sums())
      text_.fail_at(place, "a total neither draws nor uses totals; sum what the module's parameters say");
    note(total.value, compiler);
    Meaning meaning{.kind = Meaning::total, .index = std::int32_t(total.place)};
    if (!key.empty()) meaning.parameters = {key};
    meanings_[name] = std::move(meaning);
    grammar_.cell_values += key.empty() ? 1 : std::size_t(total_keys);
    grammar_.totals.push_back(std::move(total));
  }

  // taste basal contraction sd(x) = -0.5 * ((x - 0.05) / 0.01)^2
  void taste() {
    const std::size_t place = (text_.more(), text_.at());
    Taste taste{.feature = {}, .line = text_.line(), .value = {}};
    do
      taste.feature +=
          (taste.feature.empty() ? "" : " ") + text_.name("of a feature that neurons are liked for");
    while (!text_.sees("("));
    try {
      grammar_.tasted.add(taste.feature);
    } catch (const Error& error) {
      text_.fail_at(place, error.what());
    }
    text_.expect("(", "after a feature");
    Compiler compiler(text_, meanings_);
    compiler.add_slot(text_.name("of the value of the feature"));
    text_.expect(")", "after the value of the feature");
    text_.expect("=", "between a feature and how well its value is liked");
    compiler.expression(taste.value);
    if (compiler.draws() || compiler.sums())
      text_.fail_at(place,
                    "a taste neither draws nor uses totals; say how well the feature's value is liked");
    note(taste.value, compiler);
    grammar_.tastes.push_back(std::move(taste));
  }

  void modules() {
    do {
      const std::size_t place = (text_.more(), text_.at());
      const std::string name = text_.name("of a module");
      if (std::ranges::find(grammar_.symbols, name) != grammar_.symbols.end())
        text_.fail_at(place, fmt::format("module {} is there already", name));
      Arity arity{0, 0};
      if (text_.takes("(") && !text_.takes(")")) {
        do arity.names.push_back(text_.name("of a parameter"));
        while (text_.takes(","));
        text_.expect(")", "after the parameters");
      }
      arity.least = arity.most = int(arity.names.size());
      add_symbol(name, std::move(arity));
    } while (text_.takes(","));
  }

  void ignore() {
    text_.takes(":");
    while (text_.more()) ignored_.push_back(symbol());
  }

  void axiom() {
    if (!grammar_.axiom.empty()) text_.fail("there is an axiom already; a grammar has one");
    grammar_.axiom_line = text_.line();
    Compiler compiler(text_, meanings_);
    successor(compiler, grammar_.axiom, grammar_.axiom_values);
    note(grammar_.axiom_values, compiler);
    if (grammar_.axiom.empty()) text_.fail("the axiom is empty; give at least one module");
  }

  void production(const std::string& id, std::size_t place) {
    if (std::ranges::find(grammar_.productions, id, &Production::id) != grammar_.productions.end())
      text_.fail_at(place, fmt::format("there is a production {} already; give each its own name", id));
    Production p;
    p.id = id, p.line = text_.line();
    Compiler compiler(text_, meanings_);
    std::vector<Shape> middle = context(compiler);
    if (text_.takes("<")) {
      p.left = std::move(middle);
      middle = context(compiler);
    }
    if (middle.size() != 1)
      text_.fail_at(place,
                    "the predecessor must be one module; its neighbours are written left < module > right");
    p.predecessor = middle[0];
    if (text_.takes(">")) p.right = context(compiler);
    const auto bracketed = [&](const Shape& s) { return is(s, Action::push) || is(s, Action::pop); };
    if (bracketed(p.predecessor) || std::ranges::any_of(p.left, bracketed))
      text_.fail_at(place, "a bracket can neither be rewritten nor stand in a left context");
    check_brackets(p.right);
    grammar_.context |= !p.left.empty() || !p.right.empty();

    if (text_.takes(":") && !text_.takes("*") && !text_.sees("{") && !text_.sees("->"))
      compiler.expression(p.condition);
    if (text_.takes("{")) {
      if (!text_.takes("}")) {
        do compiler.binding(p.bindings);
        while (text_.takes(","));
        text_.expect("}", "after the bindings");
      }
    }
    text_.expect("->", "before the successor");
    successor(compiler, p.successor, p.values);
    if (text_.takes(":")) compiler.expression(p.weight);
    for (const Program* program : {&p.condition, &p.bindings, &p.values, &p.weight}) note(*program, compiler);
    grammar_.productions.push_back(std::move(p));
  }

  // Modules with formal parameters: "A(x, y)". A lone * stands for none.
  std::vector<Shape> context(Compiler& compiler) {
    std::vector<Shape> shapes;
    if (text_.takes("*")) return shapes;
    while (text_.more() && !text_.sees("<") && !text_.sees(">") && !text_.sees(":") && !text_.sees("->") &&
           !text_.sees("{")) {
      const std::size_t place = text_.at();
      Shape s{symbol(), 0};
      if (text_.takes("(") && !text_.takes(")")) {
        do compiler.add_slot(text_.name("of a parameter")), ++s.count;
        while (text_.takes(","));
        text_.expect(")", "after the parameters");
      }
      check_count(s.symbol, s.count, place);
      shapes.push_back(s);
    }
    return shapes;
  }

  // Modules with expressions for parameters: "A(x*2, 1)", up to a colon or the end.
  void successor(Compiler& compiler, std::vector<Shape>& shapes, Program& values) {
    if (text_.takes("ε") || text_.takes("*")) return;
    while (text_.more() && !text_.sees(":")) {
      const std::size_t place = text_.at();
      note_word();
      Shape s{symbol(), 0};
      if (text_.takes("(")) {
        const Arity& arity = arities_[s.symbol];
        const int count =
            compiler.arguments(values, {grammar_.symbols[s.symbol], arity.names, arity.defaults});
        check_count(s.symbol, count, place);
        s.count = std::uint16_t(count);
      } else {
        check_count(s.symbol, 0, place);
      }
      shapes.push_back(s);
    }
    check_brackets(shapes);
  }

  bool is(const Shape& s, Action action) const {
    return s.symbol < turtle_symbols().size() && turtle_symbols()[s.symbol].action == action;
  }
  void check_brackets(const std::vector<Shape>& shapes) const {
    int open = 0;
    for (const Shape& s : shapes) {
      open += int(is(s, Action::push)) - int(is(s, Action::pop));
      if (open < 0) break;
    }
    if (open)
      text_.fail(open > 0 ? "a [ is not closed; write ] where the branch ends"
                          : "a ] closes nothing; write [ where the branch begins");
  }
  void check_count(Symbol symbol, int count, std::size_t place) const {
    const Arity& a = arities_[symbol];
    if (count >= a.least && count <= a.most) return;
    const std::string wanted =
        a.least == a.most ? fmt::format("{}", a.least) : fmt::format("{} to {}", a.least, a.most);
    text_.fail_at(place, fmt::format("module {} has {} parameter{}, {} given", grammar_.symbols[symbol],
                                     wanted, wanted == "1" ? "" : "s", count));
  }

  Symbol add_symbol(const std::string& name, Arity arity) {
    if (closed_) text_.fail(fmt::format("the grammar has no module {}", name));
    if (grammar_.symbols.size() >= 4096)
      text_.fail("there are more than 4096 modules; use parameters to tell them apart");
    grammar_.symbols.push_back(name);
    arities_.push_back(std::move(arity));
    return Symbol(grammar_.symbols.size() - 1);
  }

  static std::string questions() {
    std::vector<std::string_view> names;
    for (const TurtleSymbol& s : turtle_symbols())
      if (is_question(s.action)) names.push_back(s.symbol);
    return fmt::format("{}", fmt::join(names, ", "));
  }

  // What looks like the name of one module and is read as a module for each of its letters.
  void note_word() {
    constexpr std::size_t least = 3;
    const std::string_view rest = text_.rest();
    const auto length = std::size_t(std::ranges::find_if_not(rest, is_letter) - rest.begin());
    if (length < least || (noted_ && text_.at() < noted_)) return;
    noted_ = text_.at() + length;
    for (const std::string& name : grammar_.symbols)
      if (name.size() > 1 && rest.substr(0, length).find(name) != std::string_view::npos) return;
    words_.push_back({std::string(rest.substr(0, length)), text_.line()});
  }
  // Of such, those with letters that nothing rewrites and the turtle does not draw.
  void doubt_words() {
    for (const auto& [word, line] : words_) {
      std::string idle;
      for (const char letter : word) {
        const auto symbol = std::size_t(std::ranges::find(grammar_.symbols, std::string(1, letter)) -
                                        grammar_.symbols.begin());
        if (symbol < turtle_symbols().size() || symbol == grammar_.symbols.size() ||
            !grammar_.productions_of[symbol].empty() || in_context_[symbol] || idle.find(letter) != idle.npos)
          continue;
        idle += idle.empty() ? "" : ", ", idle += letter;
      }
      if (!idle.empty())
        grammar_.doubts.push_back(
            fmt::format("{}:{}: '{}' is read as {} modules of one letter, and nothing is done with {}; "
                        "declare it, module {}(…), if it is one",
                        grammar_.file, line, word, word.size(), idle, word));
    }
  }

  // Questions that a context asks with as many parameters as no word has them.
  void doubt_questions() {
    std::set<std::pair<Symbol, std::uint16_t>> written;
    const auto write = [&](const std::vector<Shape>& word) {
      for (const Shape& s : word) written.emplace(s.symbol, s.count);
    };
    write(grammar_.axiom);
    for (const Production& p : grammar_.productions) write(p.successor);
    for (const Production& p : grammar_.productions)
      for (const auto* side : {&p.left, &p.right})
        for (const Shape& s : *side)
          if (s.symbol < turtle_symbols().size() && is_question(turtle_symbols()[s.symbol].action) &&
              !written.contains({s.symbol, s.count}))
            grammar_.doubts.push_back(fmt::format(
                "{}:{}: production {} asks {} with {} parameters, and no word has it so, so that it never "
                "fits; write as many of them in both",
                grammar_.file, p.line, p.id, grammar_.symbols[s.symbol], s.count));
  }

  // The longest declared name that stands here, else one letter (with _ and one more: a_r), digit or mark.
  Symbol symbol() {
    const std::string_view rest = text_.rest();
    std::size_t best = grammar_.symbols.size(), length = 0;
    for (std::size_t i = 0; i < grammar_.symbols.size(); ++i)
      if (const std::string& name = grammar_.symbols[i]; name.size() > length && rest.starts_with(name))
        best = i, length = name.size();
    std::size_t own = 0;
    if (!rest.empty() && is_letter(rest[0]))
      own = rest.size() > 2 && rest[1] == '_' && (is_letter(rest[2]) || is_digit(rest[2])) ? 3 : 1;
    else if (!rest.empty() && (is_digit(rest[0]) || symbol_marks.find(rest[0]) != std::string_view::npos))
      own = 1;
    if (own == 0 && length == 0)
      text_.fail(rest.empty()            ? "a module is missing here"
                 : rest[0] == '#'        ? "this character is no module; a comment begins with # and a blank"
                 : rest.starts_with("→") ? "this arrow is no module; write ->"
                 : rest[0] == '='        ? "this character is no module; a successor follows ->"
                                         : "this character is no module");
    if (own == 1 && rest.size() > 1 && rest[0] == '?' && is_letter(rest[1]) && length == 0)
      text_.fail(fmt::format("?{} is no question; there are {}", rest[1], questions()));
    if (own > length) {
      best = add_symbol(std::string(rest.substr(0, own)), {});
      length = own;
    }
    text_.skip(length);
    return Symbol(best);
  }

  void note(const Program& program, const Compiler& compiler) {
    grammar_.stack = std::max(grammar_.stack, stack_depth(program));
    grammar_.slots = std::max(grammar_.slots, std::size_t(compiler.slots()));
  }

  void finish() {
    if (!grammar_.tastes.empty() && grammar_.candidates < 2)
      text_.fail(
          "tastes choose among the candidates of a neuron; say how many are grown, for example candidates: "
          "4");
    grammar_.productions_of.resize(grammar_.symbols.size());
    for (std::size_t i = 0; i < grammar_.productions.size(); ++i)
      grammar_.productions_of[grammar_.productions[i].predecessor.symbol].push_back(std::uint32_t(i));
    grammar_.ignored.assign(grammar_.symbols.size(), false);
    for (const Symbol s : ignored_) grammar_.ignored[s] = true;
    for (std::size_t i = 0; i < grammar_.symbols.size(); ++i)
      grammar_.drawn_as.push_back(grammar_.symbols[i].starts_with("F_") ? Symbol(Action::draw) : Symbol(i));
    const auto question = [&](const Shape& s) {
      return s.symbol < turtle_symbols().size() && is_question(turtle_symbols()[s.symbol].action);
    };
    in_context_.assign(grammar_.symbols.size(), false);
    for (const Production& p : grammar_.productions)
      for (const auto* side : {&p.left, &p.right})
        for (const Shape& s : *side) in_context_[s.symbol] = true;
    for (const Total& t : grammar_.totals) in_context_[t.module.symbol] = true;
    doubt_words();
    doubt_questions();
    for (const Production& p : grammar_.productions)
      grammar_.queries |= std::ranges::any_of(p.left, question) || std::ranges::any_of(p.right, question);
    // Cell values live in slots 0 to n - 1 while they are drawn; what their functions need lies above.
    const auto shift = std::int32_t(grammar_.cell_values);
    for (Program& program : cells_) {
      for (std::size_t i = 0; i + 1 < program.size(); ++i) {
        if (program[i].op == Op::slot || program[i].op == Op::store) program[i].index += shift;
        if (program[i].op == Op::cell) program[i].op = Op::slot;
      }
      grammar_.cell.insert(grammar_.cell.end(), program.begin(), program.end());
    }
    grammar_.slots += grammar_.cell_values;
  }

  std::string clean_;
  Cursor text_;
  Grammar grammar_;
  std::vector<Arity> arities_;  // by symbol
  std::vector<Symbol> ignored_;
  std::vector<Program> cells_;
  Meanings meanings_;
  std::map<std::string, std::uint32_t, std::less<>> declarations_;
  std::string declared_;  // by the statement that is read, and whether that is a distribution
  bool draws_ = false;
  bool closed_ = false;                                     // no new symbols
  std::vector<std::pair<std::string, std::size_t>> words_;  // of letters one after the other, and their lines
  std::size_t noted_ = 0;                                   // where the last of them ends
  std::vector<bool> in_context_;  // by symbol: some production or total looks for it
};

}  // namespace

Grammar parse(std::string_view text, const std::string& file) { return Parser(text, file).grammar(); }

Grammar parse_file(const std::filesystem::path& path) {
  const MappedFile file(path);
  return parse(without_byte_order_mark(file.text()), path.string());
}

std::string text_of(const Declaration& declaration, const Grammar& grammar) {
  std::vector<const Declaration*> needed{&declaration};
  std::set<std::uint32_t> seen;
  for (std::size_t i = 0; i < needed.size(); ++i)
    for (const std::uint32_t use : needed[i]->uses)
      if (seen.insert(use).second) needed.push_back(&grammar.declarations[use]);
  std::ranges::sort(needed, {}, &Declaration::begin);
  std::string text;
  for (const Declaration* d : needed) {
    text += std::string_view(grammar.text).substr(d->begin, d->end - d->begin);
    text += '\n';
  }
  return text;
}

Word parse_word(std::string_view text, const Grammar& grammar) { return Parser(text, grammar).word(); }

std::string to_string(const Word& word, const Grammar& grammar) {
  std::string out;
  for (const Module& m : word.modules) {
    out += grammar.symbols[m.symbol];
    const auto values = word.of(m);
    if (!values.empty()) out += fmt::format("({})", fmt::join(values, ","));
  }
  return out;
}

}  // namespace forest::lsystem
