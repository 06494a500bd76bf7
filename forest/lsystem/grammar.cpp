// SPDX-License-Identifier: Apache-2.0
#include "forest/lsystem/grammar.h"

#include <algorithm>
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
#include "forest/lsystem/expressions.h"
#include "forest/lsystem/turtle.h"

namespace forest::lsystem {
namespace {

constexpr std::string_view symbol_marks = "+-&^\\/|$[]!';,.{}~%@?\"`";  // besides letters and digits
constexpr std::size_t most_parameters = 64;                             // of one module
constexpr double most_candidates = 64;                                  // of one neuron

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

bool draws_as_f(std::string_view symbol) { return symbol.starts_with("F_"); }

class Parser {
 public:
  Parser(std::string_view text, const std::string& file)
      : clean_(without_comments(text, Cursor(text, file))), text_(clean_, file) {
    grammar_.file = file;
    grammar_.name = std::filesystem::path(file).stem().string();
    grammar_.text = text;
    for (const TurtleSymbol& s : turtle_symbols()) {
      by_name_.emplace(s.symbol, Symbol(grammar_.symbols.size()));
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
    for (const std::string& name : grammar_.symbols) by_name_.emplace(name, Symbol(by_name_.size()));
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
    Compiler compiler(text_, meanings_, written_out_);
    std::vector<Shape> shapes;
    Program values;
    successor(compiler, shapes, values);
    if (text_.more()) text_.fail("this is no module");
    if (compiler.draws()) text_.fail("a word has constant parameters; leave the draws to the grammar");
    Word word;
    std::vector<double> stack(stack_depth(values));
    Random none(0);
    run(values, nullptr, {}, grammar_.lookups, none, stack.data());
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
    Compiler compiler(text_, meanings_, written_out_);
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
    Compiler compiler(text_, meanings_, written_out_);
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
    Compiler compiler(text_, meanings_, written_out_);
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
    Compiler compiler(text_, meanings_, written_out_);
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
    Compiler compiler(text_, meanings_, written_out_);
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
      if (by_name_.contains(name)) text_.fail_at(place, fmt::format("module {} is there already", name));
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
    Compiler compiler(text_, meanings_, written_out_);
    successor(compiler, grammar_.axiom, grammar_.axiom_values);
    note(grammar_.axiom_values, compiler);
    if (grammar_.axiom.empty()) text_.fail("the axiom is empty; give at least one module");
  }

  void production(const std::string& id, std::size_t place) {
    if (!ids_.insert(id).second)
      text_.fail_at(place, fmt::format("there is a production {} already; give each its own name", id));
    Production p;
    p.id = id, p.line = text_.line();
    Compiler compiler(text_, meanings_, written_out_);
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
    compiler.hide_bindings();
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
        const auto count =
            int(compiler.arguments(values, {grammar_.symbols[s.symbol], arity.names, arity.defaults}).size());
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
  void check_count(Symbol symbol, int count, std::size_t place) {
    const Arity& a = arities_[symbol];
    if (count >= a.least && count <= a.most) return;
    const std::string wanted =
        a.least == a.most ? fmt::format("{}", a.least) : fmt::format("{} to {}", a.least, a.most);
    const std::string_view behind = text_.rest();
    const bool word = count == 0 && !behind.empty() && is_letter(behind[0]);
    text_.fail_at(place,
                  fmt::format("module {} has {} parameter{}, {} given{}", grammar_.symbols[symbol], wanted,
                              wanted == "1" ? "" : "s", count,
                              word ? "; a name of more letters must be declared above (module …)" : ""));
  }

  Symbol add_symbol(const std::string& name, Arity arity) {
    if (closed_) text_.fail(fmt::format("the grammar has no module {}", name));
    if (grammar_.symbols.size() >= 4096)
      text_.fail("there are more than 4096 modules; use parameters to tell them apart");
    by_name_.emplace(name, Symbol(grammar_.symbols.size()));
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
    if (text_.at() < noted_) return;
    const std::string_view rest = text_.rest(), word(rest.begin(), std::ranges::find_if_not(rest, is_letter));
    if (word.size() < least) return;
    noted_ = text_.at() + word.size();
    for (std::size_t i = 0; i < word.size(); ++i)
      if (longest_name(word.substr(i)).size() > 1) return;
    words_.push_back({std::string(word), text_.line()});
  }
  void doubt_steps() {
    if (grammar_.steps == 0)
      grammar_.doubts.push_back(
          fmt::format("{}:{}: no production is used, since it is not said how many steps to derive; write "
                      "it, for example steps: 10",
                      grammar_.file, grammar_.productions[0].line));
  }

  // Of such, those with letters that nothing rewrites and the turtle does not draw.
  void doubt_words() {
    for (const auto& [word, line] : words_) {
      std::string idle;
      for (const char letter : word) {
        const auto found = by_name_.find(std::string_view(&letter, 1));
        if (found == by_name_.end() || found->second < turtle_symbols().size() ||
            !grammar_.productions_of[found->second].empty() || in_context_[found->second] ||
            idle.find(letter) != idle.npos)
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

  // The longest name of a module that a text begins with; empty when there is none. What begins as the text does and is no longer
  // stands before it in the order of names, and what the text and the name right before it have in common is all that could be it.
  std::string_view longest_name(std::string_view text) const {
    for (;;) {
      const auto after = by_name_.upper_bound(text);
      if (after == by_name_.begin()) return {};
      const std::string_view name = std::prev(after)->first;
      if (text.starts_with(name)) return name;
      text = text.substr(0, std::size_t(std::ranges::mismatch(text, name).in1 - text.begin()));
    }
  }

  // The longest declared name that stands here, else one letter (with _ and one more: a_r), digit or mark.
  Symbol symbol() {
    const std::string_view rest = text_.rest();
    const std::string_view known = longest_name(rest);
    std::size_t own = 0;
    if (!rest.empty() && is_letter(rest[0]))
      own = rest.size() > 2 && rest[1] == '_' && (is_letter(rest[2]) || is_digit(rest[2])) ? 3 : 1;
    else if (!rest.empty() && (is_digit(rest[0]) || symbol_marks.find(rest[0]) != std::string_view::npos))
      own = 1;
    if (own == 0 && known.empty())
      text_.fail(rest.empty()            ? "a module is missing here"
                 : rest[0] == '#'        ? "this character is no module; a comment begins with # and a blank"
                 : rest.starts_with("→") ? "this arrow is no module; write ->"
                 : rest[0] == '='        ? "this character is no module; a successor follows ->"
                                         : "this character is no module");
    if (own == 1 && rest.size() > 1 && rest[0] == '?' && is_letter(rest[1]) && known.empty())
      text_.fail(fmt::format("?{} is no question; there are {}", rest[1], questions()));
    if (own > known.size()) {
      std::string name(rest.substr(0, own));
      Arity arity = draws_as_f(name) ? arities_[std::size_t(Action::draw)] : Arity();
      const Symbol added = add_symbol(name, std::move(arity));
      text_.skip(own);
      return added;
    }
    text_.skip(known.size());
    return by_name_.find(known)->second;
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
      grammar_.drawn_as.push_back(draws_as_f(grammar_.symbols[i]) ? Symbol(Action::draw) : Symbol(i));
    const auto question = [&](const Shape& s) {
      return s.symbol < turtle_symbols().size() && is_question(turtle_symbols()[s.symbol].action);
    };
    in_context_.assign(grammar_.symbols.size(), false);
    for (const Production& p : grammar_.productions)
      for (const auto* side : {&p.left, &p.right})
        for (const Shape& s : *side) in_context_[s.symbol] = true;
    for (const Total& t : grammar_.totals) in_context_[t.module.symbol] = true;
    doubt_steps();
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
  std::map<std::string, Symbol, std::less<>> by_name_;
  std::set<std::string> ids_;  // of productions
  std::vector<Symbol> ignored_;
  std::vector<Program> cells_;
  Meanings meanings_;
  std::size_t written_out_ = 0;  // of functions
  std::map<std::string, std::uint32_t, std::less<>> declarations_;
  std::string declared_;  // by the statement that is read, and whether that is a distribution
  bool draws_ = false;
  bool closed_ = false;                                     // no new symbols
  std::vector<std::pair<std::string, std::size_t>> words_;  // of letters one after the other, and their lines
  std::size_t noted_ = 0;                                   // where the last of them ends
  std::vector<bool> in_context_;  // by symbol: some production or total looks for it
};

}  // namespace

Grammar parse(std::string_view text, const std::string& file) {
  must_be_plain(text, file);
  return Parser(text, file).grammar();
}

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
