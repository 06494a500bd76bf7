// SPDX-License-Identifier: Apache-2.0
// Writing of neurons as NeuroML: neuroml.h.
#include <algorithm>
#include <limits>
#include <map>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "forest/io/keeps.h"
#include "forest/io/neuroml.h"
#include "forest/io/neuroml_names.h"
#include "forest/io/numbers.h"
#include "forest/io/plain_text.h"
#include "forest/io/soma_place.h"
#include "forest/io/words.h"

namespace forest::io {
namespace {

using namespace neuroml;

/// Bytes that XML cannot hold as percent signs and two digits.
std::string encoded(std::string_view text) {
  std::string result;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte <= ' ' || byte >= 127 || c == '%')
      result += fmt::format("%{:02x}", byte);
    else
      result += c;
  }
  return result;
}

/// Whether this is UTF-8 that XML 1.0 can hold and a reader gives back as it is.
bool plain(std::string_view text) {
  for (std::size_t i = 0; i < text.size();) {
    const auto byte = static_cast<unsigned char>(text[i]);
    if (byte < 128) {
      if (byte < ' ' || byte == 127) return false;
      ++i;
      continue;
    }
    const std::size_t size = byte >= 0xf0 ? 4 : byte >= 0xe0 ? 3 : 2;
    if (byte < 0xc2 || byte > 0xf4 || i + size > text.size()) return false;
    std::uint32_t code = byte & (0x7fu >> size);
    for (std::size_t k = 1; k < size; ++k) {
      const auto next = static_cast<unsigned char>(text[i + k]);
      if ((next & 0xc0) != 0x80) return false;
      code = code << 6 | (next & 0x3f);
    }
    const bool overlong = (size == 3 && code < 0x800) || (size == 4 && code < 0x10000);
    if (overlong || (code >= 0xd800 && code < 0xe000) || code > 0x10ffff || code == 0xfffe || code == 0xffff)
      return false;
    i += size;
  }
  return true;
}

std::string escaped(std::string_view text) {
  std::string result;
  for (const char c : text) switch (c) {
      case '&':
        result += "&amp;";
        break;
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '"':
        result += "&quot;";
        break;
      default:
        result += c;
    }
  return result;
}

class Writer {
 public:
  explicit Writer(const Morphology& m) : m_(m), soma_place_(m) {}

  std::string write() {
    text_ = R"(<?xml version="1.0" encoding="UTF-8"?>
<neuroml xmlns="http://www.neuroml.org/schema/neuroml2" xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance"
    xsi:schemaLocation="http://www.neuroml.org/schema/neuroml2 https://raw.github.com/NeuroML/NeuroML2/development/Schemas/NeuroML2/NeuroML_v2beta5.xsd"
    id="neuron">
  <cell id="cell">
)";
    properties();
    if (m_.soma().kind != SomaKind::none || !m_.sections().empty()) {
      text_ += "    <morphology id=\"morphology\">\n";
      soma();
      for (std::size_t i = 0; i < m_.sections().size(); ++i) section(i);
      groups();
      text_ += "    </morphology>\n";
    }
    text_ += "  </cell>\n</neuroml>\n";
    return std::move(text_);
  }

 private:
  void property(std::string_view tag, std::string_view value) {
    text_ += fmt::format("    <property tag=\"{}\" value=\"{}\"/>\n", escaped(tag), escaped(value));
  }

  void properties() {
    std::optional<std::size_t> notes;
    for (std::size_t i = 0; i < m_.annotations().size() && !notes; ++i)
      if (const auto& [key, value] = m_.annotations()[i];
          key == "notes" && plain(value) && trimmed(value, xml_blanks) == value && !value.empty()) {
        text_ += "    <notes>" + escaped(value) + "</notes>\n";
        notes = i;
      }
    property(marker_tag, marker_value);
    for (std::size_t i = 0; i < m_.annotations().size(); ++i) {
      const auto& [key, value] = m_.annotations()[i];
      if (i == notes) continue;
      const bool ours = key.starts_with(marker_tag);
      if (plain(key) && plain(value) && !ours && !key.empty())
        property(key, value);
      else
        property(encoded_tag, encoded(key) + ' ' + encoded(value));
    }
    for (const Spine& s : m_.spines()) {
      std::string numbers = fmt::format("{}", s.section.value());
      for (const float number :
           {s.position, s.head.x(), s.head.y(), s.head.z(), s.head_diameter, s.neck_diameter, float(s.shape)})
        numbers += ' ', append_shortest(numbers, number);
      property(spine_tag, numbers);
    }
  }

  void point(std::string_view name, const Point& p) {
    text_ += "        <";
    text_ += name;
    for (const auto& [key, number] :
         {std::pair{" x=\"", p.x},
          {"\" y=\"", p.y},
          {"\" z=\"", p.z},
          {"\" diameter=\"", std::min(2.f * p.radius, std::numeric_limits<float>::max())}})
      text_ += key, append_shortest(text_, number);
    text_ += "\"/>\n";
  }

  struct Joint {
    std::int64_t segment = -1;
    bool at_begin = false;
  };

  std::int64_t segment(std::string_view name, const Joint& parent, const Point* proximal,
                       const Point& distal) {
    text_ += fmt::format("      <segment id=\"{}\" name=\"{}\">\n", count_, name);
    if (parent.segment >= 0)
      text_ += fmt::format("        <parent segment=\"{}\"{}/>\n", parent.segment,
                           parent.at_begin ? " fractionAlong=\"0\"" : "");
    if (proximal) point("proximal", *proximal);
    point("distal", distal);
    text_ += "      </segment>\n";
    return count_++;
  }

  void soma() {
    const Soma& soma = m_.soma();
    if (soma.kind == SomaKind::sphere) {
      joints_.push_back({segment(sphere_name, {}, &soma.points[0], soma.points[0]), false});
    } else if (soma.kind == SomaKind::cylinders) {
      // A point is the end of the segment from its parent; the first one the beginning of the first segment.
      joints_.resize(soma.points.size());
      for (std::size_t i = 1; i < soma.points.size(); ++i) {
        const std::size_t parent = std::size_t(soma.parents[i]);
        const Joint joint = joints_[parent];
        joints_[i] = {segment("soma_cylinder", joint,
                              i == 1 || joint.at_begin ? &soma.points[parent] : nullptr, soma.points[i]),
                      false};
        if (i == 1) joints_[0] = {joints_[1].segment, true};
      }
    }
    soma_segments_ = count_;
  }

  void section(std::size_t i) {
    const Section& s = m_.sections()[i];
    const auto points = m_.points(SectionId(i));
    Joint joint;
    if (s.parent.valid())
      joint = {last_[s.parent.value()], false};
    else if (const std::int32_t place = soma_place_(SectionId(i)); place >= 0)
      joint = joints_[std::size_t(place)];
    first_.push_back(count_);
    if (points.size() == 1) {
      // A lone point; on the soma it is told from a segment of no length by its name.
      last_.push_back(segment(stump_name, joint, &points[0], points[0]));
      return;
    }
    for (std::size_t k = 1; k < points.size(); ++k) {
      const std::int64_t id =
          segment(fmt::format("section_{}", i), joint, k == 1 ? &points[0] : nullptr, points[k]);
      joint = {id, false};
    }
    last_.push_back(joint.segment);
  }

  void groups() {
    const auto open = [&](const std::string& id, std::string_view lex) {
      text_ += "      <segmentGroup id=\"" + id + '"';
      if (!lex.empty()) text_ += fmt::format(" neuroLexId=\"{}\"", lex);
      text_ += ">\n";
    };
    for (std::size_t i = 0; i < first_.size(); ++i) {
      open(fmt::format("section_{}", i), section_lex);
      for (std::int64_t id = first_[i]; id <= last_[i]; ++id)
        text_ += fmt::format("        <member segment=\"{}\"/>\n", id);
      text_ += "      </segmentGroup>\n";
    }
    if (soma_segments_) {
      open("soma_group", "sao1044911821");
      for (std::int64_t id = 0; id < soma_segments_; ++id)
        text_ += fmt::format("        <member segment=\"{}\"/>\n", id);
      text_ += "      </segmentGroup>\n";
    }
    std::map<std::pair<std::string, std::string_view>, std::vector<std::size_t>> kinds;
    for (std::size_t i = 0; i < first_.size(); ++i) {
      const Section& s = m_.sections()[i];
      const auto add = [&](std::string id, std::string_view lex = {}) {
        kinds[{std::move(id), lex}].push_back(i);
      };
      if (s.kind == SectionKind::axon) add("axon_group", "sao1770195789");
      if (s.kind == SectionKind::basal || s.kind == SectionKind::apical)
        add("dendrite_group", "sao1211023249");
      if (s.kind == SectionKind::basal) add("basal_dendrite", "sao1079900774");
      if (s.kind == SectionKind::apical) add("apical_dendrite", "sao273773228");
      const bool usual = s.tag == std::int32_t(s.kind);
      const bool worded = s.kind == SectionKind::axon || s.kind == SectionKind::basal ||
                          s.kind == SectionKind::apical || s.kind == SectionKind::undefined;
      if (!usual || !worded)
        add(fmt::format("{}_{}{}_group", name_of(s.kind), s.tag < 0 ? "m" : "",
                        std::abs(std::int64_t(s.tag))));
    }
    for (const auto& [group, members] : kinds) {
      open(group.first, group.second);
      for (const std::size_t i : members)
        text_ += fmt::format("        <include segmentGroup=\"section_{}\"/>\n", i);
      text_ += "      </segmentGroup>\n";
    }
  }

  const Morphology& m_;
  SomaPlaces soma_place_;
  std::string text_;
  std::int64_t count_ = 0, soma_segments_ = 0;
  std::vector<Joint> joints_;               // of soma points
  std::vector<std::int64_t> first_, last_;  // segments of sections
};

}  // namespace

std::string write_neuroml(const Morphology& morphology) {
  const Morphology left = as_kept(morphology, neuroml_keeps);
  return Writer(left).write();
}

}  // namespace forest::io
