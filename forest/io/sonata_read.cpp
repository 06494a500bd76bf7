// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <unordered_map>
#include <unordered_set>

#include <fmt/format.h>

#include "forest/core/distinct.h"
#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/core/json.h"
#include "forest/core/parallel.h"
#include "forest/io/hdf5.h"
#include "forest/io/sonata.h"
#include "forest/io/sonata_config.h"
#include "forest/io/sonata_nodes.h"
#include "forest/morphology/transform.h"

namespace forest::io {
namespace {

namespace fs = std::filesystem;
using circuit::CellType;
using circuit::Circuit;
using circuit::Instance;

/// Collects the populations of a configuration into one circuit.
class Assembler {
 public:
  explicit Assembler(const SonataConfig& config)
      : config_(config), ours_(SonataConfig::find(config.json(), sonata_our_key)) {
    circuit_.name = fs::absolute(config.file()).parent_path().filename().string();
    if (!ours_) return;
    circuit_.name = config.text(*ours_, "name");
    circuit_.radius = float(config.number(*ours_, "radius"));
    const Json* layers = SonataConfig::find(*ours_, "layers");
    if (!layers || !layers->is_array()) config.refuse("\"layers\" must be a list");
    for (const Json& layer : *layers)
      circuit_.layers.push_back({config.text(layer, "name"), float(config.number(layer, "bottom")),
                                 float(config.number(layer, "top"))});
    if (const Json* up = SonataConfig::find(*ours_, "up")) circuit_.up = vector_of(*up, "\"up\"");
    if (const auto outline = config.path(*ours_, "outline")) read_outline(*outline);
  }

  /// One entry of networks.nodes: a nodes file with one or more populations.
  void add_nodes(const Json& entry) {
    const auto nodes_file = config_.path(entry, "nodes_file");
    if (!nodes_file) config_.refuse("an entry of \"nodes\" has no \"nodes_file\"; add it");
    const hdf5::File file(*nodes_file);
    if (const auto magic = file.attribute("/", "magic"); !magic.empty() && magic[0] != sonata_magic)
      file.refuse(fmt::format("has the magic number {}, but files of SONATA have {}; name another file",
                              magic[0], sonata_magic));

    std::optional<Table> types;
    const auto types_file = config_.path(entry, "node_types_file");
    if (types_file && types_file->has_filename())
      types = parse_table(MappedFile(*types_file).text(), types_file->string());

    const Json* populations = SonataConfig::find(entry, "populations");
    if (populations && !populations->is_object())
      config_.refuse("\"populations\" must have one entry a population, by name");
    const auto add = [&](const std::string& name, const Json& description) {
      const Json* type = SonataConfig::find(description, "type");
      if (type && *type != "biophysical" && *type != "astrocyte") {
        warn("not-biophysical",
             fmt::format("population {} is {}, without shapes; it was left out", name, type->dump()));
        nodes_.shapeless.push_back(name);
        return;
      }
      add_population(NodePopulation(file, name, types ? &*types : nullptr, types_file.value_or("").string()),
                     name, description);
    };
    if (populations)
      for (const auto& [name, description] : populations->items()) add(name, description);
    else
      for (const std::string& name : file.members("/nodes")) add(name, Json::object());
  }

  SonataOutline finish() {
    if (circuit_.instances.empty() && !ours_)
      config_.refuse(
          "no neuron of the circuit has a shape and a place, so there is nothing to plant; name a circuit "
          "with morphologies");
    if (!ours_) bound_layers();
    if (!all_in_elements_) circuit_.in_elements.clear();
    place_not_centred();
    try {
      circuit::check(circuit_);
    } catch (const Error& error) {
      config_.refuse(error.what());
    }
    auto known = attributes();
    return {std::move(circuit_), std::move(files_), std::move(warnings_), std::move(nodes_),
            std::move(known)};
  }

 private:
  static constexpr std::uint32_t unknown = Categories::none;

  Vec3 vector_of(const Json& json, const std::string& what) const {
    Vec3 v;
    for (std::size_t i = 0; i < 3; ++i) {
      if (!json.is_array() || json.size() != 3 || !json[i].is_number())
        config_.refuse(what + " must be three numbers; plant the circuit again");
      v[Eigen::Index(i)] = json[i].get<float>();
    }
    return v;
  }

  void read_outline(const fs::path& file) {
    const auto lines = parse_json<Json>(MappedFile(file).text(), file.string(), "plant the circuit again");
    if (!lines.is_array()) throw InputError(file.string(), 0, "is no list of lines; plant the circuit again");
    for (const Json& line : lines) {
      auto& points = circuit_.outline.emplace_back();
      for (const Json& p : line) points.push_back(vector_of(p, "a point of the \"outline\""));
    }
  }

  void warn(std::string_view code, std::string sentence) {
    warnings_.push_back({0, code, std::move(sentence)});
  }

  void add_population(const NodePopulation& nodes, const std::string& name, const Json& description) {
    const Categories shape = nodes.texts("morphology"), layer = nodes.texts("layer");
    const std::vector<std::size_t> shaped = with_shape(nodes, shape, name);
    const auto folders = folders_of(description);
    std::vector<std::uint32_t> shape_index(shape.values.size(), unknown),
        layer_index(layer.values.size(), unknown);
    if (ours_)  // what no neuron uses is kept, and the order
      for (std::size_t i = 0; i < shape.values.size(); ++i)
        shape_index[i] = morphology(shape.values[i], name, folders);
    const Json* kind = SonataConfig::find(description, "type");
    const auto types = types_of(nodes, name, shaped, kind && *kind == "astrocyte");
    const auto ids = nodes.ids();
    const auto population = std::uint32_t(nodes_.populations.size());
    nodes_.populations.push_back(name);
    nodes_.ends.push_back(ids.empty() ? 0 : std::ranges::max(ids) + 1);
    if (shaped.empty()) return;

    const auto positions = positions_of(nodes, name);
    const auto orientations = orientations_of(nodes);
    const auto recentre = nodes.reals("recenter", 1.f);
    note_attributes(nodes, shaped);
    const auto seats = ours_ ? seats_of(nodes) : std::nullopt;  // others may mean other things by these names
    if (!seats) all_in_elements_ = false;
    const auto cached = [](std::uint32_t& index, auto&& make) {
      return index == unknown ? index = make() : index;
    };
    for (const std::size_t i : shaped) {
      const std::uint32_t s = shape.index[i], l = layer.index[i];
      nodes_.of_instance.push_back({population, ids[i]});
      if (seats) circuit_.in_elements.push_back((*seats)[i]);
      if (recentre && (*recentre)[i] == 0.f) not_centred_.push_back(std::uint32_t(circuit_.instances.size()));
      circuit_.instances.push_back(
          {.position = positions[i],
           .orientation = orientations[i],
           .morphology = cached(shape_index[s], [&] { return morphology(shape.values[s], name, folders); }),
           .type = types[i],
           .layer = l == unknown ? this->layer("tissue")
                                 : cached(layer_index[l], [&] { return this->layer(layer.values[l]); })});
    }
  }

  /// Whatever else node sets may ask of the nodes; where they stand is known better from the instances.
  void note_attributes(const NodePopulation& nodes, std::span<const std::size_t> shaped) {
    static constexpr std::string_view told[] = {"x",        "y",          "z",      "morphology",
                                                "recenter", "population", "node_id"};
    // What we wrote is known from the circuit itself.
    static constexpr std::string_view of_ours[] = {"layer", "pop_name",   "ei",          "source_population",
                                                   "glia",  "model_type", "node_type_id"};
    for (const std::string& name : nodes.attributes()) {
      const auto is = [&](std::string_view known) { return name == known; };
      if (std::ranges::any_of(told, is) || (ours_ && std::ranges::any_of(of_ours, is)) ||
          name.starts_with("orientation_") || name.starts_with("rotation_angle_"))
        continue;
      Piece piece{circuit_.instances.size(), {}};
      try {
        if (const auto numbers = nodes.numbers(name)) {
          for (const std::size_t i : shaped) piece.of.numbers.push_back((*numbers)[i]);
        } else {
          Categories texts = nodes.texts(name);
          piece.of.words = std::move(texts.values);
          for (const std::size_t i : shaped) piece.of.index.push_back(texts.index[i]);
        }
      } catch (const InputError& error) {
        warn("attribute", fmt::format("{}; node sets cannot ask for {}", error.what(), name));
        continue;
      }
      attributes_[name].push_back(std::move(piece));
    }
  }

  /// Of all populations. Words where any of them has words.
  std::vector<circuit::NodeAttribute> attributes() const {
    std::vector<circuit::NodeAttribute> all;
    const std::size_t count = circuit_.instances.size();
    for (const auto& [name, pieces] : attributes_) {
      circuit::Attribute a;
      const bool words =
          std::ranges::any_of(pieces, [](const Piece& piece) { return !piece.of.words.empty(); });
      std::unordered_map<std::string, std::uint32_t> number_of;
      const auto word = [&](const std::string& text) {
        const auto [place, fresh] = number_of.try_emplace(text, std::uint32_t(a.words.size()));
        if (fresh) a.words.push_back(text);
        return place->second;
      };
      if (words)
        a.index.assign(count, circuit::Attribute::unknown);
      else
        a.numbers.assign(count, std::numeric_limits<double>::quiet_NaN());
      bool any = false;
      for (const Piece& piece : pieces) {
        for (std::size_t i = 0; i < piece.of.index.size(); ++i)
          if (const std::uint32_t entry = piece.of.index[i]; entry != unknown)
            a.index[piece.first + i] = word(piece.of.words[entry]), any = true;
        for (std::size_t i = 0; i < piece.of.numbers.size(); ++i) {
          const double value = piece.of.numbers[i];
          if (std::isnan(value)) continue;
          any = true;
          if (words)
            a.index[piece.first + i] = word(fmt::format("{}", value));
          else
            a.numbers[piece.first + i] = value;
        }
      }
      if (any) all.push_back({name, std::move(a)});
    }
    return all;
  }

  /// The nodes that can be planted; how many cannot, and why, becomes a warning.
  std::vector<std::size_t> with_shape(const NodePopulation& nodes, const Categories& shape,
                                      const std::string& name) {
    const Categories model = nodes.texts("model_type");
    std::vector<std::size_t> shaped;
    std::size_t without_model = 0;
    for (std::size_t i = 0; i < nodes.size(); ++i)
      if (model.index[i] != unknown && model.values[model.index[i]] != "biophysical" &&
          model.values[model.index[i]] != "astrocyte")
        ++without_model;
      else if (shape.index[i] != unknown)
        shaped.push_back(i);
    if (without_model)
      warn("not-biophysical",
           fmt::format("{} neurons of population {} are points or virtual; they were left out", without_model,
                       name));
    if (const std::size_t count = nodes.size() - without_model - shaped.size())
      warn("no-morphology",
           fmt::format("{} neurons of population {} have no morphology; they were left out", count, name));
    return shaped;
  }

  std::vector<Vec3> positions_of(const NodePopulation& nodes, const std::string& name) const {
    std::vector<Vec3> positions(nodes.size());
    for (const auto& [attribute, axis] : {std::pair{"x", 0}, {"y", 1}, {"z", 2}}) {
      const auto values = nodes.reals(attribute, std::numeric_limits<float>::quiet_NaN());
      if (!values)
        config_.refuse(fmt::format("the neurons of population {} have no {}; planted neurons need x, y and z",
                                   name, attribute));
      for (std::size_t i = 0; i < nodes.size(); ++i) positions[i][axis] = (*values)[i];
    }
    return positions;
  }

  /// The element of each neuron and its place there, where all of them are in one (docs/formats/sonata.md).
  std::optional<std::vector<circuit::InElement>> seats_of(const NodePopulation& nodes) const {
    const auto element = nodes.integers("element");
    if (!element) return std::nullopt;
    std::vector<circuit::InElement> seats(nodes.size());
    for (std::size_t i = 0; i < seats.size(); ++i) {
      if ((*element)[i] < 0 || (*element)[i] > std::int64_t(unknown))
        config_.refuse(fmt::format("neuron {} stands in element {}, which cannot be; get the whole circuit",
                                   i, (*element)[i]));
      seats[i].element = std::uint32_t((*element)[i]);
    }
    for (const auto& [attribute, axis] : {std::pair{"u", 0}, {"v", 1}, {"w", 2}}) {
      const auto values = nodes.reals(attribute, std::numeric_limits<float>::quiet_NaN());
      if (!values) return std::nullopt;
      for (std::size_t i = 0; i < seats.size(); ++i) seats[i].uvw[axis] = (*values)[i];
    }
    if (const auto depths =
            nodes.reals("depth", 0.f))  // circuits that were planted before it was told lack it
      for (std::size_t i = 0; i < seats.size(); ++i) seats[i].depth = (*depths)[i];
    return seats;
  }

  /// A quaternion, or else angles about the fixed axes: first z, then y, then x (SONATA developer guide).
  static std::vector<Quat> orientations_of(const NodePopulation& nodes) {
    std::vector<Quat> orientations(nodes.size(), Quat::Identity());
    const auto w = nodes.reals("orientation_w", 1.f), x = nodes.reals("orientation_x", 0.f),
               y = nodes.reals("orientation_y", 0.f), z = nodes.reals("orientation_z", 0.f);
    if (w && x && y && z) {
      for (std::size_t i = 0; i < nodes.size(); ++i) {
        orientations[i] = Quat((*w)[i], (*x)[i], (*y)[i], (*z)[i]);
        // Ours are of unit length and come back to the bit; others' may be rounded.
        if (const float norm = orientations[i].norm(); std::abs(norm - 1.f) > 1e-4f && norm > 1e-6f)
          orientations[i].normalize();
      }
      return orientations;
    }
    for (const auto& [attribute, axis] : {std::pair{"rotation_angle_zaxis", Vec3::UnitZ()},
                                          {"rotation_angle_yaxis", Vec3::UnitY()},
                                          {"rotation_angle_xaxis", Vec3::UnitX()}})
      if (const auto angles = nodes.reals(attribute, 0.f))
        for (std::size_t i = 0; i < nodes.size(); ++i)
          orientations[i] = Eigen::AngleAxisf((*angles)[i], axis) * orientations[i];
    return orientations;
  }

  /// The type of each node. Programs differ in what they call it.
  std::vector<std::uint32_t> types_of(const NodePopulation& nodes, const std::string& population,
                                      std::span<const std::size_t> shaped, bool astrocytes) {
    Categories names;
    for (const char* attribute : {"pop_name", "mtype", "model_name"}) {
      names = nodes.texts(attribute);
      if (!names.values.empty()) break;
    }
    const Categories ei = nodes.texts("ei"), synapse = nodes.texts("synapse_class"),
                     source = nodes.texts("source_population"), glia = nodes.texts("glia");
    const auto value = [](const Categories& all, std::size_t i,
                          const std::string& otherwise) -> const std::string& {
      return all.index[i] == unknown ? otherwise : all.values[all.index[i]];
    };
    if (ours_)  // types that no neuron has, and the order
      for (const std::size_t row : nodes.type_rows())
        type({.name = nodes.type_cell(row, "pop_name"),
              .population = nodes.type_cell(row, "source_population"),
              .excitatory = nodes.type_cell(row, "ei") != "i",
              .glia = nodes.type_cell(row, "glia") == "1"});

    std::vector<std::uint32_t> result(nodes.size());
    for (const std::size_t i : shaped)
      result[i] = type({.name = value(names, i, population),
                        .population = value(source, i, population),
                        .excitatory = value(ei, i, "e") != "i" && value(synapse, i, "EXC") != "INH",
                        .glia = astrocytes || value(glia, i, "0") == "1"});
    return result;
  }

  std::uint32_t type(const CellType& wanted) {
    auto& types = circuit_.types;
    if (last_type_ < types.size() && types[last_type_] == wanted) return last_type_;
    CellType renamed = wanted;  // two populations may use one name for different things
    for (int copy = 1;; ++copy) {
      const auto found = std::ranges::find(types, renamed.name, &CellType::name);
      if (found == types.end())
        types.push_back(renamed);
      else if (!(*found == renamed)) {
        renamed.name = fmt::format("{} ({}{})", wanted.name, wanted.population,
                                   copy > 1 ? fmt::format(" {}", copy) : "");
        continue;
      }
      return last_type_ =
                 std::uint32_t(std::ranges::find(types, renamed.name, &CellType::name) - types.begin());
    }
  }

  std::uint32_t layer(const std::string& name) {
    auto& layers = circuit_.layers;
    const auto found = std::ranges::find(layers, name, &circuit::Layer::name);
    if (found != layers.end()) return std::uint32_t(found - layers.begin());
    if (ours_)
      config_.refuse(fmt::format("neurons stand in layer {}, which \"layers\" does not list; add it", name));
    layers.push_back({.name = name});
    return std::uint32_t(layers.size() - 1);
  }

  /// In the order of their names, as high as the somata in them reach.
  void bound_layers() {
    auto& layers = circuit_.layers;
    std::vector<std::string> names;
    for (auto& layer : layers) {
      names.push_back(layer.name);
      layer.bottom = std::numeric_limits<float>::infinity(), layer.top = -layer.bottom;
    }
    for (const Instance& instance : circuit_.instances) {
      auto& layer = layers[instance.layer];
      layer.bottom = std::min(layer.bottom, instance.position.y()),
      layer.top = std::max(layer.top, instance.position.y());
    }
    std::ranges::sort(layers, {}, &circuit::Layer::name);
    std::vector<std::uint32_t> place;
    for (const std::string& name : names) place.push_back(layer(name));
    for (Instance& instance : circuit_.instances) instance.layer = place[instance.layer];
  }

  /// Where to look for morphologies: the population's folder or that of all, then folders of other formats.
  std::vector<fs::path> folders_of(const Json& description) const {
    std::vector<fs::path> folders;
    static const Json nothing = Json::object();
    const Json* components = SonataConfig::find(config_.json(), "components");
    for (const Json* place : {&description, components ? components : &nothing}) {
      if (const auto folder = config_.path(*place, "morphologies_dir")) folders.push_back(*folder);
      if (const Json* others = SonataConfig::find(*place, "alternate_morphologies");
          others && others->is_object())
        for (const auto& [kind, unused] : others->items())
          if (const auto folder = config_.path(*others, kind.c_str())) folders.push_back(*folder);
    }
    return folders;
  }

  /// The number of a morphology, known by its file.
  std::uint32_t morphology(const std::string& name, const std::string& population,
                           std::span<const fs::path> folders) {
    const fs::path file = file_of(name, folders);
    const auto [place, fresh] = morphology_of_file_.try_emplace(file.string(), std::uint32_t(files_.size()));
    if (fresh) {
      circuit_.morphologies.push_back(names_.insert(name).second ? name : population + ":" + name);
      files_.push_back(file);
    }
    return place->second;
  }

  fs::path file_of(const std::string& name, std::span<const fs::path> folders) const {
    const fs::path relative(name);
    if (relative.is_absolute() || std::ranges::find(relative, fs::path("..")) != relative.end())
      config_.refuse(fmt::format(
          "the morphology \"{}\" lies outside the circuit's folder of morphologies; correct its name", name));
    for (const fs::path& folder : folders)
      for (const Format& format : formats())
        for (const std::string_view extension : format.extensions) {
          if (!format.read) continue;
          if (fs::is_regular_file(folder / (name + std::string(extension))))
            return folder / (name + std::string(extension));
          if (relative.extension() == extension && fs::is_regular_file(folder / relative))
            return folder / relative;
        }
    config_.refuse(fmt::format(
        "the morphology {} is not in {}; put {}.swc there", name,
        folders.empty() ? "any folder, as \"morphologies_dir\" is missing" : folders[0].string(), name));
  }

  void place_not_centred() {
    std::vector<std::uint32_t> asked;  // morphologies
    for (const std::uint32_t i : not_centred_) asked.push_back(circuit_.instances[i].morphology);
    asked = distinct(std::move(asked));
    std::vector<Vec3> centres(files_.size());
    parallel_for(asked.size(), 1,
                 [&](std::size_t i) { centres[asked[i]] = centre(io::read(files_[asked[i]]).morphology); });
    for (const std::uint32_t i : not_centred_) {
      Instance& instance = circuit_.instances[i];
      instance.position += instance.orientation * centres[instance.morphology];
    }
  }

  const SonataConfig& config_;
  const Json* ours_;
  Circuit circuit_;
  std::vector<Warning> warnings_;
  reports::Nodes nodes_;
  std::vector<fs::path> files_;  // by morphology
  struct Piece {                 // of an attribute: instances of one population, from `first` on
    std::size_t first;
    circuit::Attribute of;
  };
  std::map<std::string, std::vector<Piece>> attributes_;
  std::unordered_map<std::string, std::uint32_t> morphology_of_file_;
  std::unordered_set<std::string> names_;   // of morphologies
  std::vector<std::uint32_t> not_centred_;  // instances whose morphology stays where its file has it
  std::uint32_t last_type_ = 0;
  bool all_in_elements_ = true;
};

}  // namespace

ReadResult SonataOutline::morphology(std::size_t index) const {
  ReadResult read = io::read(files[index]);
  read.morphology = centred(read.morphology);
  for (Warning& warning : read.warnings)
    warning.sentence = fmt::format("{}:{}: {}", files[index].string(), warning.line, warning.sentence);
  return read;
}

SonataOutline outline_sonata(const fs::path& place) {
  const SonataConfig config(place);
  Assembler assembler(config);
  const Json* nodes = SonataConfig::find(*SonataConfig::find(config.json(), "networks"), "nodes");
  if (!nodes || !nodes->is_array())
    config.refuse("\"networks\" has no list of \"nodes\"; add the file of the neurons");
  for (const Json& entry : *nodes) assembler.add_nodes(entry);
  SonataOutline outline = assembler.finish();
  try {
    outline.node_sets = config.path(config.json(), "node_sets_file").value_or("");
  } catch (const InputError& error) {  // the neurons are there all the same
    outline.warnings.push_back(
        {0, "node-sets", fmt::format("{}; the circuit has no node sets", error.what())});
  }
  return outline;
}

SonataCircuit read_sonata(const fs::path& place, Progress& progress) {
  SonataOutline outline = outline_sonata(place);
  const std::size_t count = outline.files.size();
  std::vector<ReadResult> read(count);
  progress.begin("reading", count);
  parallel_for(count, 1, [&](std::size_t i) {
    read[i] = outline.morphology(i);
    progress.advance();
  });
  progress.end();
  SonataCircuit result{std::move(outline.circuit), {}, std::move(outline.warnings), std::move(outline.nodes)};
  for (ReadResult& one : read) {
    result.morphologies.push_back(std::move(one.morphology));
    std::ranges::move(one.warnings, std::back_inserter(result.warnings));
  }
  return result;
}

}  // namespace forest::io
