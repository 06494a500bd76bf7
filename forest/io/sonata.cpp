// SPDX-License-Identifier: Apache-2.0
// Writing; sonata_read.cpp reads.
#include "forest/io/sonata.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/core/json.h"
#include "forest/core/parallel.h"
#include "forest/io/hdf5.h"
#include "forest/io/new_folder.h"
#include "forest/io/node_types.h"
#include "forest/io/sonata_config.h"
#include "forest/io/sonata_edges.h"
#include "forest/morphology/transform.h"

namespace forest::io {
namespace {

namespace fs = std::filesystem;
using circuit::Circuit;
using circuit::Instance;

}  // namespace

void must_take_sonata(const fs::path& folder) {
  const auto refuse = [&](const std::string& why) {
    throw Error(fmt::format("{}: {}, so it is not replaced; choose another folder or remove it",
                            folder.string(), why));
  };
  if (!fs::exists(folder)) return;
  if (!fs::is_directory(folder)) refuse("is there and is no folder");
  if (fs::is_empty(folder)) return;
  const auto ours = [&] {
    try {
      const fs::path config = folder / sonata_config_name;
      const auto json = parse_json<Json>(MappedFile(config).text(), config.string(), "");
      return SonataConfig::find(json, sonata_our_key) != nullptr;
    } catch (const InputError&) {
      return false;
    }
  };
  if (!ours()) refuse("holds something other than a circuit of Brain Forest");

  constexpr std::array parts{sonata_config_name,      sonata_nodes_name,      sonata_types_name,
                             sonata_edges_name,       sonata_edge_types_name, sonata_outline_name,
                             sonata_morphologies_name};
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    const fs::path name = entry.path().lexically_relative(folder);
    const bool morphology = name.parent_path() == sonata_morphologies_name && name.extension() == ".swc";
    if (!morphology && std::ranges::find(parts, name) == parts.end())
      refuse(fmt::format("holds {}, which is no part of the circuit", name.string()));
  }
}

namespace {

void check_file_name(const std::string& name) {
  const bool good =
      !name.empty() && name.size() <= 250 && name[0] != '.' && name != "NULL" && name != "NONE" &&
      name != "None" &&
      std::ranges::none_of(name, [](char c) { return c == '/' || (c >= 0 && c < ' ') || c == 0x7f; });
  if (!good)
    throw Error(
        fmt::format("\"{}\" cannot be the file name of a morphology; give it a name without slashes, of at "
                    "most 250 bytes",
                    name));
}

std::string config_of(const Circuit& circuit, std::span<const circuit::Projection> projections) {
  const std::string base = "$BASE_DIR/";
  const Json population = {{"type", "biophysical"}, {"morphologies_dir", base + sonata_morphologies_name}};
  Json nodes;
  nodes["nodes_file"] = base + sonata_nodes_name;
  nodes["node_types_file"] = base + sonata_types_name;
  nodes["populations"][sonata_population(circuit)] = population;

  Json config;
  config["version"] = 2.4;
  config["manifest"]["$BASE_DIR"] = ".";
  config["components"]["morphologies_dir"] = base + sonata_morphologies_name;
  config["networks"]["nodes"] = Json::array({nodes});
  config["networks"]["edges"] = Json::array();
  if (!projections.empty()) {
    Json edges;
    edges["edges_file"] = base + sonata_edges_name;
    edges["edge_types_file"] = base + sonata_edge_types_name;
    for (const auto& projection : projections) edges["populations"][projection.name] = {{"type", "chemical"}};
    config["networks"]["edges"].push_back(edges);
  }
  Json& ours = config[sonata_our_key];
  ours["name"] = circuit.name;
  ours["radius"] = circuit.radius;
  ours["layers"] = Json::array();
  for (const auto& layer : circuit.layers)
    ours["layers"].push_back(Json{{"name", layer.name}, {"bottom", layer.bottom}, {"top", layer.top}});
  if (circuit.up != Circuit().up) ours["up"] = {circuit.up.x(), circuit.up.y(), circuit.up.z()};
  if (!circuit.outline.empty()) ours["outline"] = base + sonata_outline_name;
  return config.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

// A line of text for each line.
std::string outline_of(const Circuit& circuit) {
  std::string text;
  for (const auto& line : circuit.outline) {
    std::string points;
    for (const Vec3& p : line)
      points += fmt::format("{}[{},{},{}]", points.empty() ? "" : ",", p.x(), p.y(), p.z());
    text += fmt::format("{}[{}]", text.empty() ? "[" : ",\n ", points);
  }
  return text + "]\n";
}

std::string types_of(const Circuit& circuit) {
  Table table;
  table.columns = {"node_type_id", "population", "model_type",       "model_template",
                   "pop_name",     "ei",         "source_population"};
  const bool glia = std::ranges::any_of(circuit.types, &circuit::CellType::glia);
  if (glia) table.columns.emplace_back("glia");
  for (std::size_t i = 0; i < circuit.types.size(); ++i) {
    const circuit::CellType& type = circuit.types[i];
    table.rows.push_back({std::to_string(i), sonata_population(circuit), "biophysical", "NULL", type.name,
                          type.glia         ? "NULL"
                          : type.excitatory ? "e"
                                            : "i",
                          type.population});
    if (glia) table.rows.back().emplace_back(type.glia ? "1" : "0");
  }
  return format_table(table);
}

std::string edge_types_of(std::span<const circuit::Projection> projections) {
  Table table;
  table.columns = {"edge_type_id", "population", "model_template"};
  for (const auto& projection : projections) table.rows.push_back({"0", projection.name, "NULL"});
  return format_table(table);
}

/// The angle about y, from -π to π, when that is all a rotation does.
std::optional<float> angle_about_y(const Quat& q) {
  if (std::abs(q.x()) > 1e-6f || std::abs(q.z()) > 1e-6f) return std::nullopt;
  return float(std::remainder(2. * std::atan2(double(q.y()), double(q.w())), 2. * std::numbers::pi));
}

void write_nodes(const fs::path& path, const fs::path& named, const Circuit& circuit) {
  const auto& instances = circuit.instances;
  const std::string base = "/nodes/" + sonata_population(circuit), group = base + "/0";
  hdf5::NewFile file(path, named);
  file.attribute("/", "version", std::array<std::uint32_t, 2>{0, 1});
  file.attribute("/", "magic", sonata_magic);
  file.group(group + "/@library");

  // One array: its values are what `of` gives for each neuron and its number.
  const auto column = [&]<class Of>(const std::string& name, Of of) {
    std::vector<std::invoke_result_t<Of, const Instance&, std::size_t>> values;
    values.reserve(instances.size());
    for (std::size_t i = 0; i < instances.size(); ++i) values.push_back(of(instances[i], i));
    file.write(name, std::span(std::as_const(values)));
  };
  column(base + "/node_id", [](const Instance&, std::size_t i) { return std::uint64_t(i); });
  column(base + "/node_type_id", [](const Instance& n, std::size_t) { return std::uint64_t(n.type); });
  column(base + "/node_group_id", [](const Instance&, std::size_t) { return std::uint32_t(0); });
  column(base + "/node_group_index", [](const Instance&, std::size_t i) { return std::uint64_t(i); });
  for (const auto& [name, axis] : {std::pair{"/x", 0}, {"/y", 1}, {"/z", 2}})
    column(group + name, [axis = axis](const Instance& n, std::size_t) { return n.position[axis]; });
  for (const auto& [name, part] :
       {std::pair{"/orientation_x", 0}, {"/orientation_y", 1}, {"/orientation_z", 2}, {"/orientation_w", 3}})
    column(group + name,
           [part = part](const Instance& n, std::size_t) { return n.orientation.coeffs()[part]; });
  // The same rotation for readers that know angles only, or nothing for any neuron.
  if (std::ranges::all_of(instances,
                          [](const Instance& n) { return angle_about_y(n.orientation).has_value(); }))
    column(group + "/rotation_angle_yaxis",
           [](const Instance& n, std::size_t) { return *angle_about_y(n.orientation); });
  column(group + "/morphology", [](const Instance& n, std::size_t) { return n.morphology; });
  column(group + "/layer", [](const Instance& n, std::size_t) { return n.layer; });

  if (const auto& seats = circuit.in_elements; !seats.empty()) {
    column(group + "/element", [&](const Instance&, std::size_t i) { return seats[i].element; });
    for (const auto& [name, axis] : {std::pair{"/u", 0}, {"/v", 1}, {"/w", 2}})
      column(group + name, [&, axis = axis](const Instance&, std::size_t i) { return seats[i].uvw[axis]; });
    column(group + "/depth", [&](const Instance&, std::size_t i) { return seats[i].depth; });
  }

  std::vector<std::string> layers;
  for (const auto& layer : circuit.layers) layers.push_back(layer.name);
  file.write(group + "/@library/morphology", std::span(circuit.morphologies));
  file.write(group + "/@library/layer", std::span(std::as_const(layers)));
  file.close();
}

}  // namespace

// It is a path in HDF5 and a key in reports: letters, digits, - and _ are safe everywhere.
std::string sonata_population(const Circuit& circuit) {
  std::string safe = circuit.name.empty() ? "neurons" : circuit.name;
  for (char& c : safe)
    if (!((c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-')) c = '_';
  return safe;
}

void write_sonata(const fs::path& folder, const Circuit& circuit, std::span<const Morphology> morphologies,
                  Progress& progress, std::span<const circuit::Projection> projections) {
  circuit::check(circuit);
  if (morphologies.size() != circuit.morphologies.size())
    throw Error(fmt::format("a circuit of {} morphologies was given {} of them; give one for each name",
                            circuit.morphologies.size(), morphologies.size()));
  for (const std::string& name : circuit.morphologies) check_file_name(name);
  must_take_sonata(folder);

  NewFolder files(folder);
  fs::create_directory(files.path() / sonata_morphologies_name);
  const Format& swc = *find_format("swc");
  progress.begin("writing", morphologies.size());
  parallel_for(morphologies.size(), 1, [&](std::size_t i) {
    files.write(fs::path(sonata_morphologies_name) / (circuit.morphologies[i] + ".swc"),
                swc.write(centred(morphologies[i])));
    progress.advance();
  });
  progress.end();
  write_nodes(files.path() / sonata_nodes_name, folder / sonata_nodes_name, circuit);
  files.write(sonata_types_name, types_of(circuit));
  if (!projections.empty()) {
    write_edges(files.path() / sonata_edges_name, folder / sonata_edges_name, projections);
    files.write(sonata_edge_types_name, edge_types_of(projections));
  }
  if (!circuit.outline.empty()) files.write(sonata_outline_name, outline_of(circuit));
  files.write(sonata_config_name, config_of(circuit, projections));
  files.commit();
}

}  // namespace forest::io
