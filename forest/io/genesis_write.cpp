// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "forest/core/lower.h"
#include "forest/core/number.h"
#include "forest/io/genesis.h"
#include "forest/io/genesis_names.h"
#include "forest/io/own_file.h"
#include "forest/io/soma_place.h"
#include "forest/io/swc_rows.h"
#include "forest/morphology/measure.h"

namespace forest::io {
namespace {

// First found, first served.
struct Word {
  std::string_view part;
  SectionKind kind;
  bool begins = false;  // the name begins with it
};
constexpr std::array<Word, 19> foreign_words{{
    {"apic", SectionKind::apical},     {"apdend", SectionKind::apical},   {"tuft", SectionKind::apical},
    {"axon", SectionKind::axon},       {"hillock", SectionKind::axon},    {"iseg", SectionKind::axon},
    {"init_seg", SectionKind::axon},   {"initial", SectionKind::axon},    {"ais", SectionKind::axon, true},
    {"myelin", SectionKind::axon},     {"ranvier", SectionKind::axon},    {"telodend", SectionKind::axon},
    {"basal", SectionKind::basal},     {"basilar", SectionKind::basal},   {"dend", SectionKind::basal},
    {"den", SectionKind::basal, true}, {"bas", SectionKind::basal, true}, {"prox", SectionKind::basal, true},
    {"glia", SectionKind::glia},
}};

constexpr std::array<std::pair<std::string_view, SectionKind>, 6> own_words{{
    {"axon", SectionKind::axon},
    {"dend", SectionKind::basal},
    {"apical", SectionKind::apical},
    {"neurite", SectionKind::undefined},
    {"unspecified", SectionKind::unspecified},
    {"glia", SectionKind::glia},
}};

template <class Number>
void add_number(std::string& text, Number value) {
  std::array<char, 40> digits;
  text += ' ';
  text.append(digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr);
}

class Writer {
 public:
  explicit Writer(const Morphology& m) : m_(m), soma_place_(m) {}

  std::string write() {
    text_ = own_line(genesis_marker, m_) + '\n';
    for (const auto& [key, value] : m_.annotations())
      text_ += fmt::format("{}{} {}\n", genesis_note, escaped_note(key, true), escaped_note(value, false));
    text_ += "*cartesian\n*absolute\n*asymmetric\n*double_endpoint\n";
    soma();
    std::vector<std::string> last(m_.sections().size());  // names of compartments
    for (std::size_t s = 0; s < m_.sections().size(); ++s) {
      const Section& section = m_.sections()[s];
      const auto points = m_.points(SectionId(s));
      std::string parent = "none";
      std::int32_t place = -1;
      if (section.parent.valid())
        parent = last[section.parent.value()];
      else if (place = soma_place_(SectionId(s)); place >= 0)
        parent = soma_names_[std::size_t(place)];
      if (m_.soma().kind != SomaKind::cylinders) place = -1;
      for (std::size_t i = 1; i < points.size(); ++i) {
        last[s] = name_of_compartment(section, s, i);
        compartment(last[s], parent, points[i - 1], points[i], i == 1 ? place : -1);
        parent = last[s];
      }
    }
    return std::move(text_);
  }

 private:
  void soma() {
    const Soma& soma = m_.soma();
    if (soma.kind == SomaKind::sphere) {
      soma_names_ = {"soma"};
      text_ += "*spherical\n";
      compartment("soma", "none", soma.points[0], soma.points[0], -1);
      text_ += "*cylindrical\n";
    } else if (soma.kind == SomaKind::cylinders) {
      soma_names_.assign(soma.points.size(),
                         "soma");  // the compartment that ends there; the first point begins one
      for (std::size_t i = 1; i < soma.points.size(); ++i) {
        const auto from = std::size_t(soma.parents[i]);
        if (i > 1) soma_names_[i] = fmt::format("soma_{}", i);
        compartment(soma_names_[i], i == 1 ? "none" : soma_names_[from], soma.points[from], soma.points[i],
                    std::int32_t(from));
      }
    }
  }

  void compartment(std::string_view name, std::string_view parent, const Point& from, const Point& to,
                   std::int32_t place) {
    const bool same = from.radius == to.radius;
    if (!same || place > 0 || (place == 0 && parent != "none")) {
      text_ += genesis_ends.substr(0, genesis_ends.size() - 1);
      add_number(text_, from.radius), add_number(text_, to.radius);
      if (place >= 0) add_number(text_, place);
      text_ += '\n';
    }
    text_ += name, text_ += ' ', text_ += parent;
    for (const float x : {from.x, from.y, from.z, to.x, to.y, to.z}) add_number(text_, x);
    if (same && 2.f * to.radius <= std::numeric_limits<float>::max())
      add_number(text_, 2.f * to.radius);
    else
      add_number(text_, genesis_diameter(from, to));
    text_ += '\n';
  }

  const Morphology& m_;
  SomaPlaces soma_place_;
  std::string text_;
  std::vector<std::string> soma_names_;
};

}  // namespace

GenesisName genesis_name(std::string_view name) {
  const std::string text = lower(name);
  GenesisName found;
  if (text.starts_with("soma")) {
    found.soma = found.known = true;
    return found;
  }
  for (const Word& word : foreign_words)
    if (word.begins ? text.starts_with(word.part) : text.find(word.part) != text.npos) {
      found.kind = word.kind;
      found.tag = std::int32_t(word.kind);
      found.known = true;
      return found;
    }
  return found;
}

std::string name_of_compartment(const Section& section, std::size_t number, std::size_t compartment) {
  const auto word = std::ranges::find(own_words, section.kind, &decltype(own_words)::value_type::second);
  const std::int32_t type = swc_type(section);
  const std::string kind = word != own_words.end() ? std::string(word->first)
                           : type < 0              ? fmt::format("customm{}", -std::int64_t(type))
                                                   : fmt::format("custom{}", type);
  return fmt::format("{}_{}_{}", kind, number, compartment);
}

GenesisName own_genesis_name(std::string_view name) {
  GenesisName found;
  const std::string_view kind = name.substr(0, name.find('_'));
  if (kind == "soma") {
    found.soma = found.known = true;
    return found;
  }
  const std::size_t number = std::min(name.size(), kind.size() + 1),
                    end = std::min(name.find('_', number), name.size());
  const auto section = number_of<std::uint32_t>(name.substr(number, end - number));
  if (!section) return genesis_name(name);
  found.section = *section;
  const bool below = kind.starts_with("customm");
  if (const auto word = std::ranges::find(own_words, kind, &decltype(own_words)::value_type::first);
      word != own_words.end()) {
    found.kind = word->second;
    found.tag = std::int32_t(word->second);
    found.known = true;
  } else if (const auto type = kind.starts_with("custom")
                                   ? number_of<std::int32_t>(kind.substr(below ? 7 : 6))
                                   : std::nullopt;
             type && *type >= 0) {
    found.kind = SectionKind::custom;
    found.tag = below ? -*type : *type;
    found.known = true;
  } else {
    return genesis_name(name);
  }
  return found;
}

double genesis_diameter(const Point& from, const Point& to) {
  const double length = segment_length(from, to);
  if (length == 0. || from.radius == to.radius) return double(from.radius) + to.radius;
  return segment_area(from, to) / (std::numbers::pi * length);
}

std::string escaped_note(std::string_view text, bool blanks) {
  std::string result;
  for (const char c : text)
    if (static_cast<unsigned char>(c) < ' ' || c == '%' || (blanks && c == ' '))
      result += fmt::format("%{:02x}", static_cast<unsigned char>(c));
    else
      result += c;
  return result;
}

std::string write_genesis(const Morphology& morphology) {
  return Writer(as_kept(morphology, genesis_keeps)).write();
}

}  // namespace forest::io
