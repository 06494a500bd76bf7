// SPDX-License-Identifier: Apache-2.0
#include "forest/io/neuroml.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/io/neuroml_document.h"
#include "forest/io/neuroml_groups.h"
#include "forest/io/neuroml_names.h"
#include "forest/io/neuroml_sections.h"
#include "forest/io/neuroml_segments.h"
#include "forest/io/plain_text.h"
#include "forest/io/words.h"

namespace forest::io {
namespace {

using namespace neuroml;

constexpr std::string_view keep_the_file = "keep the file beside what is made of it";

constexpr std::array<Oddity, static_cast<std::size_t>(NeuromlOddity::count)> table{{
    {"several-cells", false, "only the first is read here; import the file to have all"},
    {"several-documents", false, "the first one is read", "split the file"},
    {"morphology-elsewhere", true, "left out; read that file for its shape", "give the file that holds it"},
    {"include", false, "included files are not opened; name them as well",
     "give the included files as well, where they hold cells"},
    {"not-kept", false, "left out: shapes are read, not what they do", keep_the_file, true},
    {"groups-not-kept", false, "used as far as they say kinds and sections, else left out", keep_the_file,
     true},
    {"duplicate-id", true, "children hang on the first segment of that number",
     "give each segment a number of its own"},
    {"missing-parent", true, "read as a root", "give it the parent it was traced from"},
    {"child-first", false, "the order of segments does not matter"},
    {"several-roots", true, "kept as a tree of its own, attached to no soma point",
     "give it a parent if it belongs to the cell"},
    {"missing-proximal", true, "read as a neurite that begins with a single point",
     "give it a proximal point or a parent"},
    {"unknown-number", true, "read as that of the point before", "look it up in the tracing"},
    {"diameter", true, "read as that of the point before", "measure it where thickness matters"},
    {"zero-diameter", true, "kept as 0", "give the measured one"},
    {"fraction", true, "read as the nearest of 0 and 1"},
    {"gap", true, "the point it hangs on is put in front"},
    {"several-somata", true, "joined to the first point of the soma", "split the cell if it is several"},
    {"soma-inside-neurite", true, "read as a neurite of undefined kind"},
    {"group", true, "the reference is skipped"},
    {"names-not-kept", false, "left out: a section has a number and no name", keep_the_file, true},
}};

void read_notes(const xml_node& owner, MorphologyBuilder& builder) {
  for (const xml_node& node : owner.children())
    if (local(node) == "notes")
      if (const std::string_view text = trimmed(node.text().get(), xml_blanks); !text.empty())
        builder.annotate("notes", std::string(text));
}

void read_properties(const xml_node& owner, MorphologyBuilder& builder, std::vector<Spine>& spines) {
  for (const xml_node& node : owner.children()) {
    if (local(node) != "property") continue;
    const std::string_view tag = attribute(node, "tag"), value = attribute(node, "value");
    if (tag == marker_tag) continue;
    if (tag == encoded_tag) {
      const std::size_t blank = value.find(' ');
      builder.annotate(percent_decoded(value.substr(0, blank)),
                       blank == value.npos ? "" : percent_decoded(value.substr(blank + 1)));
    } else if (tag == spine_tag) {
      std::array<float, 8> n{};
      std::size_t count = 0;
      for (std::string_view rest = value; !rest.empty() && count < n.size(); ++count) {
        const std::size_t blank = std::min(rest.find(' '), rest.size());
        if (!parse(rest.substr(0, blank), n[count]) || !std::isfinite(n[count])) break;
        rest.remove_prefix(std::min(blank + 1, rest.size()));
      }
      if (count != n.size() || n[0] < 0.f || n[0] > 1e7f || n[7] < 0.f ||
          n[7] > float(SpineShape::branched)) {
        builder.annotate(std::string(tag), std::string(value));
        continue;
      }
      spines.push_back({SectionId(std::size_t(n[0])), n[1], Vec3(n[2], n[3], n[4]), n[5], n[6],
                        static_cast<SpineShape>(n[7])});
    } else {
      builder.annotate(std::string(tag), std::string(value));
    }
  }
}

bool has_marker(const xml_node& cell) {
  for (const xml_node& node : cell.children())
    if (local(node) == "property" && attribute(node, "tag") == marker_tag &&
        attribute(node, "value") == marker_value)
      return true;
  return false;
}

/// A cell with its morphology, which may stand elsewhere in the file, or a morphology alone.
struct Place {
  xml_node cell, morphology;
};

ReadResult read_cell(const Document& document, const Place& place, Oddities& oddities) {
  try {
    MorphologyBuilder builder;
    std::vector<Spine> spines;
    const bool ours = has_marker(place.cell);
    read_notes(document.root(), builder);  // what is said of the file is said of each of its cells
    for (const xml_node& owner : {place.cell, place.morphology})
      if (owner) {
        read_notes(owner, builder);
        read_properties(owner, builder, spines);
        for (const xml_node& node : owner.children()) {
          const std::string_view kind = local(node);
          if (node.type() == pugi::node_element && kind != "notes" && kind != "property" &&
              kind != "morphology" && kind != "segment" && kind != "segmentGroup")
            oddities.add(NeuromlOddity::not_kept, document.line(node),
                         [&] { return fmt::format("there is <{}>", kind.substr(0, 40)); });
        }
      }
    if (place.morphology) {
      Segments segments = read_segments(place.morphology, document, oddities, ours);
      read_groups(place.morphology, segments);
      add_sections(segments, builder);
    }
    for (const Spine& s : spines) builder.add_spine(s);
    Morphology morphology = builder.build();
    return {std::move(morphology), oddities.take()};
  } catch (const InputError&) {
    throw;
  } catch (const Error& error) {
    throw InputError(document.name(), document.line(place.morphology), error.what());
  }
}

/// What of the file can be read as neurons; tells what cannot.
std::vector<Place> find_cells(const Document& document, Oddities& oddities) {
  std::map<std::string_view, xml_node> loose;
  std::map<std::string_view, bool> used;
  std::vector<Place> places;
  for (xml_node next = document.root().next_sibling(); next; next = next.next_sibling())
    if (next.type() == pugi::node_element)
      oddities.add(NeuromlOddity::several_documents, document.line(next),
                   "another document follows the first");
  for (const xml_node& node : document.root().children())
    if (local(node) == "morphology") loose.emplace(attribute(node, "id"), node);
  for (const xml_node& node : document.root().children()) {
    const std::string_view kind = local(node);
    if (kind == "cell" || kind == "cell2CaPools") {
      xml_node morphology;
      for (const xml_node& part : node.children())
        if (local(part) == "morphology") morphology = part;
      const std::string_view reference = attribute(node, "morphology");
      if (const auto found = loose.find(reference);
          !morphology && !reference.empty() && found != loose.end()) {
        morphology = found->second;
        used[reference] = true;
      }
      if (morphology || has_marker(node))
        places.push_back({node, morphology});
      else
        oddities.add(NeuromlOddity::elsewhere, document.line(node), [&] {
          return fmt::format("the morphology of cell {} is not in this file",
                             attribute(node, "id").substr(0, 40));
        });
    } else if (kind == "include") {
      oddities.add(NeuromlOddity::include, document.line(node),
                   [&] { return fmt::format("{} is included", attribute(node, "href").substr(0, 80)); });
    } else if (node.type() == pugi::node_element && kind != "morphology" && kind != "notes") {
      oddities.add(NeuromlOddity::not_kept, document.line(node),
                   [&] { return fmt::format("there is <{}>", kind.substr(0, 40)); });
    }
  }
  for (const xml_node& node : document.root().children())
    if (local(node) == "morphology" && !used.contains(attribute(node, "id"))) places.push_back({{}, node});
  if (places.empty())
    throw NotANeuron(document.name(), 0,
                     oddities.has(NeuromlOddity::elsewhere)
                         ? "holds cells whose morphology is in another file; read that one"
                         : "holds no cell with a morphology; give a file that does");
  return places;
}

}  // namespace

std::span<const Oddity> neuroml_oddities() { return table; }

bool recognises_neuroml(std::string_view bytes) { return first_element(bytes) == "neuroml"; }

ReadResult read_neuroml(std::string_view bytes, const std::string& name) {
  const Document document(bytes, name);
  Oddities oddities(table);
  const std::vector<Place> places = find_cells(document, oddities);
  if (places.size() > 1)
    oddities.add(NeuromlOddity::several_cells, 0,
                 [&] { return fmt::format("there are {} cells", places.size()); });
  return read_cell(document, places[0], oddities);
}

std::vector<Cell> read_all_neuroml(std::string_view bytes, const std::string& name) {
  const Document document(bytes, name);
  Oddities first(table);
  const std::vector<Place> places = find_cells(document, first);
  std::vector<Cell> cells;
  for (const Place& place : places) {
    Oddities others(table);
    const std::string_view id = attribute(place.cell ? place.cell : place.morphology, "id");
    cells.push_back({std::string(id), read_cell(document, place, cells.empty() ? first : others)});
  }
  return cells;
}

}  // namespace forest::io
