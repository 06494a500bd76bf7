// SPDX-License-Identifier: Apache-2.0
// Parametric, stochastic, context-sensitive, bracketed L-systems in the notation of Prusinkiewicz &
// Lindenmayer, The Algorithmic Beauty of Plants (1990), with draws from named distributions.
// docs/lsystem/notation.md teaches it.
//
//   distribution ratio = truncnormal(0.83, 0.21, 0.2, 1.8)
//   axiom:  Soma(20) A(1, 4)
//   branch: A(l, d) : d > 0.5 { r = ratio() } -> F(l, d) [+(30) A(l, d*r)] -(30) A(l, d*(1 - r)) : 0.3
//   extend: A(l, d) -> F(l, d) A(l, 0.99*d) : 0.7
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "forest/lsystem/program.h"
#include "forest/statistics/few_features.h"

namespace forest::lsystem {

using Symbol = std::uint16_t;  // index in Grammar::symbols

/// A module of a word: a symbol and `count` numbers from Word::parameters[first].
struct Module {
  Symbol symbol = 0;
  std::uint16_t count = 0;
  std::uint32_t first = 0;
};

/// A string of modules.
struct Word {
  std::vector<Module> modules;
  std::vector<double> parameters;

  std::span<const double> of(const Module& m) const {
    return std::span(parameters).subspan(m.first, m.count);
  }
};

/// What stands in a predecessor, a context or a successor: a symbol and how many parameters it has.
struct Shape {
  Symbol symbol = 0;
  std::uint16_t count = 0;
};

struct Production {
  std::string id;
  std::size_t line = 0;
  Shape predecessor;
  std::vector<Shape> left, right;  // contexts, in the order of the text; `right` may hold brackets
  Program condition;               // empty: always
  Program bindings;                // stores
  Program weight;                  // its probability; empty: what the others leave to 1
  std::vector<Shape> successor;
  Program values;  // of all parameters of the successor, in order
};

/// A sum over the modules of the word, worked out before each step. Its values lie among those drawn once a neuron.
struct Total {
  Shape module;
  std::size_t line = 0;
  Program value;          // finds the module's parameters in slots 0 to count - 1
  std::int32_t key = -1;  // the parameter by which there are total_keys sums; -1: there is one
  std::size_t place = 0;  // of the first
};

/// What a neuron is liked for: its score is the sum of these, and of its candidates it is drawn by it (grow.h).
struct Taste {
  std::string feature;  // "basal contraction sd", in Grammar::tasted at the same place
  std::size_t line = 0;
  Program value;  // finds the feature in slot 0
};

/// A statement that gives a name to a value, a function, a distribution, a table or a sample.
struct Declaration {
  std::string name;
  std::size_t begin = 0, end = 0;   // in Grammar::text
  std::vector<std::uint32_t> uses;  // declarations above, which it needs
  bool draws = false;               // a distribution or a sample
};

/// An L-system, compiled. A plain value; not changed after parse().
struct Grammar {
  std::string file, name, title;        // name: the file's, without folder and extension
  std::string text;                     // as it was parsed
  std::vector<std::string> symbols;     // the turtle's own first (turtle.h), then those of the text
  std::vector<Production> productions;  // those of one predecessor keep their order
  std::vector<std::vector<std::uint32_t>> productions_of;  // by symbol
  std::vector<bool> ignored;                               // by symbol: not seen by contexts
  std::vector<Symbol> drawn_as;  // by symbol: the turtle's that it stands for; F_l and its like are F
  Lookups lookups;
  std::vector<Total> totals;
  std::vector<Taste> tastes;
  statistics::FewFeatures tasted;
  std::uint32_t candidates = 1;           // grown for each neuron, of which one is drawn by the tastes
  std::vector<Declaration> declarations;  // in the order of the text
  Program cell;                           // one store a value that is drawn once a neuron
  std::size_t cell_line = 0;              // of the first of them
  std::size_t cell_values = 0;
  std::vector<Shape> axiom;
  std::size_t axiom_line = 0;
  Program axiom_values;
  std::size_t slots = 0, stack = 0;  // what the largest program needs
  bool context = false;              // some production looks at its neighbours
  bool queries = false;              // … or asks where the turtle is

  std::vector<std::string>
      doubts;  // sentences, with file and line, about what is read otherwise than it looks

  int steps = 0;                  // of derivation, when nothing else is said
  std::size_t limit = 1'000'000;  // modules a word may have
  double angle = 90., step = 1.;  // of turtle symbols without a parameter: degrees, µm
};

/// Throws InputError with line and column when the text is no grammar.
/// @param file  named in errors
Grammar parse(std::string_view text, const std::string& file);
Grammar parse_file(const std::filesystem::path& path);

/// A declaration as a text that stands alone: before it all that it needs, a line each.
std::string text_of(const Declaration& declaration, const Grammar& grammar);

/// Reads a word of the grammar's symbols with constant parameters, "B(2)A(4,4)". Throws InputError.
Word parse_word(std::string_view text, const Grammar& grammar);

/// "B(2)A(4,4)": read back by parse_word with every number the same.
std::string to_string(const Word& word, const Grammar& grammar);

}  // namespace forest::lsystem
