// SPDX-License-Identifier: Apache-2.0
#include "forest/io/sonata.h"

#include <array>
#include <cmath>
#include <fstream>
#include <map>
#include <numbers>
#include <sstream>
#include <tuple>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "forest/circuit/plant.h"
#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/io/hdf5.h"
#include "forest/io/sonata_edges.h"
#include "forest/morphology/measure.h"
#include "forest/morphology/transform.h"
#include "forest/reports/layout.h"

#include "tests/real_data.h"
#include "tests/refused.h"

namespace forest::io {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

Morphology neuron(float size) {
  MorphologyBuilder builder;
  builder.set_soma(
      {.kind = SomaKind::sphere, .points = {{3, 4, 5, size}}, .parents = {}, .contour_starts = {}});
  const SectionId stem = builder.add_section({}, SectionKind::apical,
                                             std::vector<Point>{{3, 4 + size, 5, 1.5f}, {3, 40, 5, 1}}, 4, 0);
  builder.add_section(stem, SectionKind::apical, std::vector<Point>{{3, 40, 5, 1}, {20, 60.125f, 5, .5f}});
  builder.add_section(stem, SectionKind::apical, std::vector<Point>{{3, 40, 5, 1}, {-20, 70, 9, .1f}});
  return builder.build();
}

class Sonata : public testing::Test {
 protected:
  Sonata() {
    std::string root = (fs::temp_directory_path() / "forest-sonata.XXXXXX").string();
    root_ = ::mkdtemp(root.data());
    const circuit::Recipe recipe{
        .name = "two layers",
        .radius = 100.f,
        .types = {{"L5 \"tall\" cell", "tall", true}, {"small", "small", false}, {"nobody", "absent", true}},
        .layers = {{"L1", 100.3f, 0., 11, {.25, .75, 0.}},
                   {"empty", 20.f, 0., 0, {1., 0., 0.}},
                   {"L5", 77.7f, 0., 20, {.5, .5, 0.}}},
        .neurons = {},
        .soma_gap = 0.f,
        .rotate = true};
    circuit_ =
        circuit::plant(recipe,
                       std::vector<circuit::Candidate>{
                           {"tall-1", "tall", 5.f}, {"tall 2", "tall", 7.f}, {"small-1", "small", 2.f}},
                       3);
    for (const std::string& name : circuit_.morphologies)
      morphologies_.push_back(neuron(name == "tall-1" ? 5.f : name == "tall 2" ? 7.f : 2.f));
  }
  ~Sonata() override { fs::remove_all(root_); }

  fs::path folder() const { return root_ / "circuit"; }
  void write() const { write_sonata(folder(), circuit_, morphologies_); }
  void replace(const char* file, const std::string& from, const std::string& to) const {
    std::string text(MappedFile(folder() / file).text());
    const auto at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    write_file(folder() / file, text.replace(at, from.size(), to));
  }
  static std::string complaint(const auto& act) {
    try {
      act();
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), testing::Not(HasSubstr("\n")));
      return error.what();
    }
    return "accepted";
  }
  std::string reading() const {
    return complaint([&] { read_sonata(folder()); });
  }
  // Every file of a folder with its bytes.
  static std::map<std::string, std::string> bytes(const fs::path& folder) {
    std::map<std::string, std::string> all;
    for (const auto& entry : fs::recursive_directory_iterator(folder))
      if (entry.is_regular_file())
        all[entry.path().lexically_relative(folder).string()] = MappedFile(entry.path()).text();
    return all;
  }

  fs::path root_;
  circuit::Circuit circuit_;
  std::vector<Morphology> morphologies_;
};

TEST_F(Sonata, ACircuitComesBackEqual) {
  write();
  const SonataCircuit back = read_sonata(folder());
  EXPECT_EQ(back.circuit, circuit_);
  EXPECT_TRUE(back.warnings.empty()) << back.warnings[0].sentence;
  ASSERT_EQ(back.morphologies.size(), morphologies_.size());
  for (std::size_t i = 0; i < morphologies_.size(); ++i)
    EXPECT_EQ(back.morphologies[i], centred(morphologies_[i]));
}

TEST_F(Sonata, SomataKeepTheirPlacesInElements) {
  for (std::size_t i = 0; i < circuit_.instances.size(); ++i)
    circuit_.in_elements.push_back({std::uint32_t(i % 3 ? i : 4'000'000'000u + i),
                                    Vec3(float(i) / 40.f, 1.f, 1.f / float(i + 3)), float(i) * 2.5f});
  write();
  const circuit::Circuit back = read_sonata(folder()).circuit;
  EXPECT_EQ(back.in_elements, circuit_.in_elements);
  EXPECT_EQ(back, circuit_);
  const hdf5::File file(folder() / "nodes.h5");
  EXPECT_EQ(file.integers("/nodes/two_layers/0/element")[3], 4'000'000'003);
  EXPECT_EQ(file.reals("/nodes/two_layers/0/v")[3], 1.f);

  circuit_.in_elements[7].uvw.y() = 1.5f;
  EXPECT_THAT(complaint([&] { write(); }), HasSubstr("neuron 7 stands at (u, v, w)"));
  circuit_.in_elements.pop_back();
  EXPECT_THAT(complaint([&] { write(); }),
              HasSubstr("of 30 neurons in which element they stand, and has 31"));
  circuit_.in_elements.clear();
  write();
  EXPECT_EQ(hdf5::File(folder() / "nodes.h5").kind("/nodes/two_layers/0/u"), hdf5::Kind::none);
}

TEST_F(Sonata, TheOutlineOfElementsAndTheWayUpComeBack) {
  circuit_.radius = 0.f;
  circuit_.up = Vec3(.125f, -.25f, .9375f);
  circuit_.outline = {{{1.1f, 2.f, -3e5f}, {1.25f, 1e-9f, 0.f}}, {{0, 0, 0}, {1, 1, 1}, {2, 3, 4}}};
  write();
  EXPECT_EQ(read_sonata(folder()).circuit, circuit_);
  for (const auto& [file, from, to, what] :
       {std::tuple{"outline.json", "[0,0,0]", "[0,0]", "a point of the \"outline\" must be three numbers"},
        {"outline.json", "[0,0,0]", "\"word\"", "a point of the \"outline\" must be three numbers"},
        {"outline.json", "[[[", "{", "is no JSON"},
        {"circuit_config.json", "0.9375", "\"x\"", "\"up\" must be three numbers"},
        {"circuit_config.json", "outline.json", "other.json", "other.json"}}) {
    write();
    replace(file, from, to);
    EXPECT_THAT(complaint([&] { read_sonata(folder()); }), HasSubstr(what)) << file << ' ' << from;
  }
  circuit_.up = Vec3::Zero();
  EXPECT_THAT(complaint([&] { write(); }), HasSubstr("way up"));
  circuit_.up = Vec3::UnitX(), circuit_.outline[1][2].x() = INFINITY;
  EXPECT_THAT(complaint([&] { write(); }), HasSubstr("not finite"));
}

TEST_F(Sonata, WhatNoNeuronUsesAndTiltedNeuronsComeBackToo) {
  circuit_.morphologies.insert(circuit_.morphologies.begin(), "unused");
  morphologies_.insert(morphologies_.begin(), neuron(1.f));
  for (auto& instance : circuit_.instances) ++instance.morphology;
  circuit_.instances[5].orientation = Quat(.5f, .5f, -.5f, .5f);
  circuit_.radius = 0.f;
  write();
  EXPECT_EQ(read_sonata(folder()).circuit, circuit_);
}

TEST_F(Sonata, AnEmptyCircuitComesBackEqual) {
  circuit_.instances.clear();
  write();
  EXPECT_EQ(read_sonata(folder() / "circuit_config.json").circuit, circuit_);
}

TEST_F(Sonata, TheSameCircuitGivesTheSameBytes) {
  write();
  const auto first = bytes(folder());
  EXPECT_EQ(first.size(), 3 + morphologies_.size());
  EXPECT_TRUE(first.contains("morphologies/tall 2.swc"));
  ::sleep(1);  // a time in a file would show
  write();     // replaces its own
  EXPECT_EQ(bytes(folder()), first);
  EXPECT_EQ(std::distance(fs::directory_iterator(root_), {}), 1) << "something was left behind";
}

TEST_F(Sonata, ALinkToAFolderStaysAndTheFolderIsReplaced) {
  fs::create_directory(root_ / "real");
  fs::create_directory_symlink("real", folder());
  write();
  write();
  EXPECT_TRUE(fs::is_symlink(folder()));
  EXPECT_EQ(read_sonata(root_ / "real").circuit, circuit_);
}

TEST_F(Sonata, AFolderWithAnythingElseIsNotReplaced) {
  const auto writing = [&] { return complaint([&] { write(); }); };
  fs::create_directory(folder());
  write_file(folder() / "thesis.txt", "years of work");
  EXPECT_THAT(writing(), HasSubstr("something other than a circuit"));
  EXPECT_EQ(MappedFile(folder() / "thesis.txt").text(), "years of work");

  fs::remove(folder() / "thesis.txt");
  write();
  write_file(folder() / "thesis.txt", "years of work");
  EXPECT_THAT(writing(), HasSubstr("thesis.txt"));
  fs::remove(folder() / "thesis.txt");
  write_file(folder() / "circuit_config.json", R"({"networks": {"nodes": []}})");
  EXPECT_THAT(writing(), HasSubstr("something other than a circuit"));

  fs::remove_all(folder());
  write_file(folder(), "a file");
  EXPECT_THAT(writing(), HasSubstr("is no folder"));
  EXPECT_EQ(std::distance(fs::directory_iterator(root_), {}), 1) << "something was left behind";
}

TEST_F(Sonata, WhatCannotBeWrittenLeavesTheOldCircuit) {
  write();
  const auto before = bytes(folder());
  circuit_.morphologies[0] = "../evil";
  EXPECT_THAT(complaint([&] { write(); }), HasSubstr("file name"));
  circuit_.morphologies[0] = "tall-1";
  circuit_.instances[0].type = 77;
  EXPECT_THAT(complaint([&] { write(); }), HasSubstr("cell type number 77"));
  circuit_.instances[0].type = 0;
  morphologies_.pop_back();
  EXPECT_THAT(complaint([&] { write(); }), HasSubstr("give one for each name"));
  EXPECT_EQ(bytes(folder()), before);
  EXPECT_THAT(complaint([&] { write_sonata(root_ / "no" / "where", {}, {}); }), HasSubstr("folder above"));
}

TEST_F(Sonata, AnOutlineReadsMorphologiesOneByOne) {
  write();
  const SonataCircuit whole = read_sonata(folder());
  const SonataOutline outline = outline_sonata(folder());
  EXPECT_EQ(outline.circuit, whole.circuit);
  EXPECT_EQ(outline.nodes.of_instance, whole.nodes.of_instance);
  ASSERT_EQ(outline.files.size(), whole.morphologies.size());
  for (std::size_t i = outline.files.size(); i-- > 0;)
    EXPECT_EQ(outline.morphology(i).morphology, whole.morphologies[i]);
  write_file(outline.files[1], "1 1 0 0 0 five -1\n");
  EXPECT_NO_THROW(outline_sonata(folder()));
  EXPECT_THAT(complaint([&] { outline.morphology(1); }),
              HasSubstr(outline.files[1].filename().string() + ":1"));
  EXPECT_EQ(complaint([&] { outline.morphology(1); }), complaint([&] { read_sonata(folder()); }));
}

TEST_F(Sonata, MissingFilesAreNamed) {
  for (const char* name : {"circuit_config.json", "nodes.h5", "node_types.csv", "morphologies/tall-1.swc"}) {
    write();
    fs::remove(folder() / name);
    EXPECT_THAT(reading(), HasSubstr(fs::path(name).stem().string())) << name;
    write_file(folder() / "circuit_config.json", R"({"brainforest": {}})");  // so that it may be replaced
  }
  EXPECT_THAT(complaint([&] { read_sonata(root_ / "nothing"); }), HasSubstr("nothing"));
}

TEST_F(Sonata, CutOffAnywhereItIsAnErrorNeverACrash) {
  for (const char* name : {"nodes.h5", "circuit_config.json"}) {
    write();
    const std::string whole(MappedFile(folder() / name).text());
    const std::size_t step = std::max<std::size_t>(1, whole.size() / 300);
    for (std::size_t length = whole.size() - 2; length < whole.size(); length -= step) {
      fs::resize_file(folder() / name, length);
      EXPECT_THROW(read_sonata(folder()), InputError)
          << name << " cut to " << length << " of " << whole.size();
    }
    write_file(folder() / name, whole);
  }
}

TEST_F(Sonata, ATableOfTypesCutOffIsAnErrorUntilTheUsedTypesAreWhole) {
  write();
  const std::string whole(MappedFile(folder() / "node_types.csv").text());
  const std::size_t used = whole.find(" small\n2 ");  // the last cell may lose letters and still be one
  for (std::size_t length = whole.size() - 1; length > 0; --length) {
    fs::resize_file(folder() / "node_types.csv", length);
    const std::string says = reading();
    if (length <= used) {
      EXPECT_NE(says, "accepted") << "cut to " << length;
    }
  }
}

TEST_F(Sonata, WrongValuesAreNamed) {
  const auto base = std::string("/nodes/two_layers");
  // Writes nodes.h5 anew, with one array replaced.
  const auto spoil = [&](const std::string& array, const auto& values) {
    write();
    std::map<std::string, std::vector<float>> reals;
    std::map<std::string, std::vector<std::uint64_t>> wholes;
    std::map<std::string, std::vector<std::string>> texts;
    {
      const hdf5::File file(folder() / "nodes.h5");
      for (const std::string& group : {base, base + "/0", base + "/0/@library"})
        for (const std::string& name : file.members(group)) {
          const std::string path = group + "/" + name;
          if (path == array) continue;
          if (file.kind(path) == hdf5::Kind::reals) reals[path] = file.reals(path);
          if (file.kind(path) == hdf5::Kind::texts) texts[path] = file.texts(path);
          if (file.kind(path) == hdf5::Kind::integers)
            for (const std::int64_t value : file.integers(path)) wholes[path].push_back(std::uint64_t(value));
        }
    }
    hdf5::NewFile file(folder() / "nodes.h5");
    for (const auto& [path, row] : reals) file.write(path, std::span(row));
    for (const auto& [path, row] : wholes) file.write(path, std::span(row));
    for (const auto& [path, row] : texts) file.write(path, std::span(row));
    if (!values.empty()) file.write(array, std::span(values));
    file.close();
    return reading();
  };
  using Reals = const std::vector<float>;
  using Texts = const std::vector<std::string>;
  using Wholes = const std::vector<std::uint64_t>;
  const std::size_t count = circuit_.instances.size();
  EXPECT_EQ(spoil("/nothing", Reals{1.f}), "accepted");
  EXPECT_THAT(spoil(base + "/node_type_id", Texts{"a"}), HasSubstr("whole numbers are expected"));
  EXPECT_THAT(spoil(base + "/node_type_id", Wholes{}), HasSubstr("no array /nodes/two_layers/node_type_id"));
  EXPECT_THAT(spoil(base + "/node_type_id", Wholes(count, 9)), HasSubstr("of type 9, which has no row"));
  EXPECT_THAT(spoil(base + "/node_group_index", Wholes(count, 99)), HasSubstr("entry 99"));
  EXPECT_THAT(spoil(base + "/node_group_index", Wholes(count, ~0ull)),
              HasSubstr("must be an entry of its group"));
  EXPECT_THAT(spoil(base + "/node_group_index", Wholes{1, 2}), HasSubstr("must be as many"));
  EXPECT_THAT(spoil(base + "/node_group_id", Wholes(count, 5)), HasSubstr("group /nodes/two_layers/5"));
  EXPECT_THAT(spoil(base + "/0/x", Texts(count, "left")), HasSubstr("numbers are expected"));
  EXPECT_THAT(spoil(base + "/0/x", Reals(count - 1, 1.f)), HasSubstr("not complete"));
  EXPECT_THAT(spoil(base + "/0/x", Reals(count, NAN)), HasSubstr("position of neuron 0 is not finite"));
  EXPECT_THAT(spoil(base + "/0/orientation_w", Reals(count, 0.f)),
              testing::AnyOf("accepted", HasSubstr("orientation")));
  EXPECT_THAT(spoil(base + "/0/morphology", Wholes(count, 1000)), HasSubstr("its library has"));
  EXPECT_THAT(spoil(base + "/0/morphology", Reals(count, 0.f)), HasSubstr("texts are expected"));
  EXPECT_THAT(spoil(base + "/0/@library/morphology", Texts{"../../etc/passwd", "a", "b"}),
              HasSubstr("outside"));
  EXPECT_THAT(spoil(base + "/0/@library/layer", Texts{"a", "b", "c"}), HasSubstr("layer a"));
}

TEST_F(Sonata, AWrongConfigurationIsNamed) {
  const auto spoil = [&](const char* from, const char* to) {
    write();
    replace("circuit_config.json", from, to);
    const std::string says = reading();
    write_file(folder() / "circuit_config.json", R"({"brainforest": {}})");
    return says;
  };
  EXPECT_THAT(spoil("\"version\"", "version"), HasSubstr("circuit_config.json:2: is no JSON"));
  const std::string deep = "\"deep\": " + std::string(1000, '[') + std::string(1000, ']') + ", \"version\"";
  EXPECT_THAT(spoil("\"version\"", deep.c_str()), HasSubstr("more than 32 brackets"));
  EXPECT_THAT(spoil("\"networks\"", "\"network\""), HasSubstr("has no \"networks\""));
  EXPECT_THAT(spoil("\".\"", "\"$BASE_DIR\""), HasSubstr("not define"));
  EXPECT_THAT(spoil("\".\"", "\"$BASE_DIR/$BASE_DIR\""), HasSubstr("without end"));
  EXPECT_THAT(spoil("\"$BASE_DIR/nodes.h5\"", "\"$HERE/nodes.h5\""), HasSubstr("manifest does not define"));
  EXPECT_THAT(spoil("\"$BASE_DIR/nodes.h5\"", "5"), HasSubstr("\"nodes_file\" must be a text"));
  EXPECT_THAT(spoil("\"two_layers\"", "\"elsewhere\""), HasSubstr("/nodes/elsewhere"));
  EXPECT_THAT(spoil("\"radius\": 100.0", "\"radius\": \"wide\""), HasSubstr("\"radius\" must be a number"));
  EXPECT_THAT(spoil("\"biophysical\"", "\"virtual\""),
              "accepted");  // and its neurons are left out, with a warning
}

// Each ended the library with a crash.
TEST(Hdf5, AnArrayOfAnotherSizeThanItSaysIsRefused) {
  const fs::path path = fs::temp_directory_path() / ("forest-hdf5-size." + std::to_string(::getpid()));
  const std::vector<std::uint64_t> wholes(9, 0x1234567890abcdef);
  {
    hdf5::NewFile file(path);
    file.write("/a", std::span(wholes));
    file.close();
  }
  const std::string whole(MappedFile(path).text());
  // The message that says how the array lies there: version 3, in one piece, where, how many bytes.
  const std::uint64_t size = 8 * wholes.size();
  const std::string sizes(reinterpret_cast<const char*>(&size), 8);
  std::size_t message = 1;
  do message = whole.find("\3\1", message + 1);
  while (message != whole.npos && whole.substr(message + 10, 8) != sizes);
  ASSERT_NE(message, whole.npos);
  const std::tuple<std::size_t, std::string, const char*> wrong[] = {
      {1, std::string(3, '\0'), "other bytes are there"},        // within the header, no byte
      {2, std::string("\0\0\0\1", 4), "other bytes are there"},  // far beyond the end
      {10, "\x8", "other bytes are there"}};                     // fewer bytes
  for (const auto& [at, bytes, words] : wrong) {
    std::string damaged = whole;
    write_file(path, damaged.replace(message + at, bytes.size(), bytes));
    EXPECT_THAT(forest::refused<InputError>([&] { hdf5::File(path).integers("/a"); }), HasSubstr(words))
        << at;
  }
  fs::remove(path);
}

TEST(Hdf5, ArraysComeBackAndOtherKindsAreRefused) {
  const fs::path path = fs::temp_directory_path() / ("forest-hdf5." + std::to_string(::getpid()));
  const std::vector<float> reals{1.5f, -2.f};
  const std::vector<std::uint64_t> wholes{3, 4, 5};
  const std::vector<std::string> texts{"", "pyramidal", "Ω"};
  {
    hdf5::NewFile file(path);
    file.write("/a/b/reals", std::span(reals));
    file.write("/a/wholes", std::span(wholes));
    file.write("/a/texts", std::span(texts));
    file.write("/a/none", std::span(texts).first(0));
    file.attribute("/a", "version", 7u);
    file.close();
  }
  const hdf5::File file(path);
  EXPECT_EQ(file.reals("/a/b/reals"), reals);
  EXPECT_EQ(file.reals("/a/wholes"), (std::vector<float>{3, 4, 5}));
  EXPECT_EQ(file.integers("/a/wholes"), (std::vector<std::int64_t>{3, 4, 5}));
  EXPECT_EQ(file.texts("/a/texts"), texts);
  EXPECT_TRUE(file.texts("/a/none").empty());
  EXPECT_EQ(file.attribute("/a", "version"), std::vector<std::int64_t>{7});
  EXPECT_TRUE(file.attribute("/a", "none").empty());
  EXPECT_THAT(file.members("/a"), testing::ElementsAre("b", "none", "texts", "wholes"));
  EXPECT_EQ(file.kind("/a/b"), hdf5::Kind::group);
  EXPECT_EQ(file.kind("/x/y/z"), hdf5::Kind::none);
  EXPECT_THROW(file.texts("/a/wholes"), InputError);
  EXPECT_THROW(file.integers("/a/b/reals"), InputError);
  EXPECT_THROW(file.reals("/a/b"), InputError);
  EXPECT_THROW(file.reals("/a/x"), InputError);
  EXPECT_THROW(file.members("/a/texts"), InputError);
  fs::remove(path);
}

// ── Circuits of other programs ──

TEST(PublishedCircuits, OfTheAllenInstituteHaveTheirTypesInATable) {
  FOREST_REAL_DATA(folder, "sonata/allen_sonata_examples/300_cells");
  const SonataCircuit read = read_sonata(folder);
  EXPECT_EQ(read.circuit.instances.size(), 300u);
  EXPECT_EQ(read.circuit.morphologies.size(), 5u);
  EXPECT_EQ(read.circuit.types.size(), 5u);
  std::size_t inhibitory = 0;
  for (const auto& instance : read.circuit.instances)
    inhibitory += !read.circuit.types[instance.type].excitatory;
  EXPECT_EQ(inhibitory, 60u);
  const auto& first = read.circuit.instances[0];
  EXPECT_FLOAT_EQ(first.position.x(), -39.36520608835683f);
  const Vec3 east = first.orientation * Vec3::UnitX();  // turned by 5.4278 about y
  EXPECT_NEAR(std::atan2(-east.z(), east.x()), 5.427764850661566 - 2. * std::numbers::pi, 1e-5);
  for (const Morphology& m : read.morphologies) EXPECT_LT(centre(m).norm(), 2e-3f);
  const SonataOutline outline = outline_sonata(folder);
  EXPECT_EQ(outline.circuit, read.circuit);
  std::size_t warnings = outline.warnings.size();
  for (std::size_t i = 0; i < outline.files.size(); ++i) warnings += outline.morphology(i).warnings.size();
  EXPECT_EQ(warnings, read.warnings.size());
  EXPECT_THAT(read.warnings,
              testing::Contains(testing::Field(&Warning::code, "not-biophysical")));  // the external spikes
}

TEST(PublishedCircuits, OfTheBlueBrainProjectHaveTheirTypesInLibraries) {
  FOREST_REAL_DATA(folder, "sonata/sonata_extension/source/usecases/usecase3");
  const SonataCircuit read = read_sonata(folder / "circuit_sonata.json");
  EXPECT_EQ(read.circuit.instances.size(), 5u);  // three of one population and two of the other
  EXPECT_EQ(read.morphologies.size(), 4u);
  for (const Morphology& m : read.morphologies) EXPECT_GT(total_length(m), 100.);
}

TEST(PublishedCircuits, WithoutShapesOrMorphologiesAreRefusedInASentence) {
  FOREST_REAL_DATA(folder, "sonata");
  const auto says = [&](const char* place) {
    try {
      read_sonata(folder / place);
      return std::string("accepted");
    } catch (const InputError& error) {
      return std::string(error.what());
    }
  };
  EXPECT_THAT(says("allen_sonata_examples/300_intfire"), HasSubstr("no neuron of the circuit has a shape"));
  EXPECT_THAT(says("bluecellulab_quick_scx/circuit_sonata_quick_scx_multi_circuit/circuit_sonata.json"),
              HasSubstr(".swc there"));
  EXPECT_THAT(says("libsonata_tests/config"), testing::Not("accepted"));
  EXPECT_THAT(says("obi_tiny_circuits/blueetl_data/circuit/sonata"), testing::Not("accepted"));
}

TEST_F(Sonata, SynapsesComeBack) {
  const circuit::Projection made =
      circuit::made_up_synapses(circuit_, morphologies_, sonata_population(circuit_), 12, 5);
  write_sonata(folder(), circuit_, morphologies_, Progress::none(), std::span(&made, 1));
  const SonataOutline outline = outline_sonata(folder());
  const SonataEdges edges = read_edges(folder(), outline.circuit, outline.nodes);
  EXPECT_TRUE(edges.warnings.empty());
  ASSERT_EQ(edges.projections.size(), 1u);
  const circuit::Projection& back = edges.projections[0];
  EXPECT_EQ(back.name, "two_layers__two_layers__made_up");
  EXPECT_EQ(back.source, "two_layers");
  ASSERT_EQ(back.synapses.size(), made.synapses.size());
  for (std::size_t i = 0; i < made.synapses.size(); ++i) {
    const circuit::Synapse &a = made.synapses[i], &b = back.synapses[i];
    EXPECT_EQ(std::tuple(a.target, a.neuron, a.source, a.element, a.position, a.sign),
              std::tuple(b.target, b.neuron, b.source, b.element, b.position, b.sign));
  }
  const auto before = bytes(folder());
  write_sonata(folder(), circuit_, morphologies_, Progress::none(), std::span(&made, 1));  // over itself
  EXPECT_EQ(bytes(folder()), before);
  write();
  EXPECT_FALSE(fs::exists(folder() / "edges.h5"));
  EXPECT_TRUE(read_edges(folder(), outline.circuit, outline.nodes).projections.empty());
}

TEST_F(Sonata, DamagedSynapsesAreLeftOutAndOthersRead) {
  const circuit::Projection made =
      circuit::made_up_synapses(circuit_, morphologies_, sonata_population(circuit_), 2, 5);
  write_sonata(folder(), circuit_, morphologies_, Progress::none(), std::span(&made, 1));
  const SonataOutline outline = outline_sonata(folder());
  const auto reading = [&] {
    const SonataEdges edges = read_edges(folder(), outline.circuit, outline.nodes);
    EXPECT_LE(edges.damaged.size(), 1u);
    EXPECT_TRUE(edges.damaged.empty() || edges.projections.empty());
    return edges.damaged.empty() ? "accepted" : edges.damaged[0];
  };
  const std::string base = "/edges/two_layers__two_layers__made_up",
                    whole(MappedFile(folder() / "edges.h5").text());
  const auto file_with = [&](std::vector<std::uint64_t> sources, std::vector<std::uint64_t> targets,
                             std::vector<std::int32_t> sections) {
    hdf5::NewFile file(folder() / "edges.h5");
    file.write(base + "/source_node_id", std::span(std::as_const(sources)));
    file.write(base + "/target_node_id", std::span(std::as_const(targets)));
    file.attribute(base + "/target_node_id", "node_population", std::string("two_layers"));
    file.write(base + "/0/afferent_section_id", std::span(std::as_const(sections)));
    file.write(base + "/0/afferent_section_pos",
               std::span<const float>(std::vector<float>(sections.size(), .5f)));
    file.close();
  };
  file_with({0, 1}, {1, 0}, {1, 2});
  EXPECT_EQ(reading(), "accepted");
  file_with({0}, {1, 0}, {1, 2});
  EXPECT_THAT(reading(), HasSubstr("source_node_id has 1 entries, but the population has 2 edges"));
  file_with({0, 1}, {1, 0}, {1});
  EXPECT_THAT(reading(), HasSubstr("afferent_section_id has 1 entries, but edges refer to entry 1"));
  file_with({0, 1}, {1, ~0ull}, {1, 2});
  EXPECT_EQ(reading(), "accepted");  // ends on no neuron that is planted
  file_with({0, 1, 9}, {1, 4000, 0}, {1, 1, -1});
  const SonataEdges some = read_edges(folder(), outline.circuit, outline.nodes);
  ASSERT_EQ(some.projections.size(), 1u);
  EXPECT_EQ(some.projections[0].synapses.size(), 1u);
  EXPECT_EQ(some.warnings.size(), 2u);
  for (std::size_t size = 0; size < whole.size(); size += 211) {
    write_file(folder() / "edges.h5", std::string_view(whole).substr(0, size));
    EXPECT_NE(reading(), "accepted") << size;
  }
  // Another file, and another population of the same, are read all the same.
  write_file(folder() / "edges.h5", whole);
  replace("circuit_config.json", "\"edges\": [",
          "\"edges\": [{\"edges_file\": \"no.h5\", \"edge_types_file\": \"\"}, ");
  const SonataEdges rest = read_edges(folder(), outline.circuit, outline.nodes);
  ASSERT_EQ(rest.damaged.size(), 1u);
  EXPECT_THAT(rest.damaged[0], HasSubstr("no.h5"));
  EXPECT_EQ(rest.projections.size(), 1u);
}

TEST_F(Sonata, NodesHaveEachTheirNumber) {
  write();
  const auto bytes_of = [](std::array<std::uint64_t, 3> ids) {
    return std::string(reinterpret_cast<const char*>(ids.data()), sizeof ids);
  };
  replace("nodes.h5", bytes_of({3, 4, 5}), bytes_of({3, 9, 5}));
  EXPECT_THAT(reading(), HasSubstr("node_id holds 9 twice"));
}

// What the file says of places must be what the section and the position along it mean, on real circuits of others.
TEST(SonataEdges, SectionsAndPositionsMeanThePlacesThatTheFileHas) {
  FOREST_REAL_DATA(root, "sonata");
  const fs::path place = root / "obi_tiny_circuits/tiny_circuits/nbS1-O1-E2Sst-maxNsyn-HEX0-L5";
  const SonataCircuit read = read_sonata(place);
  const SonataEdges edges = read_edges(place, read.circuit, read.nodes);
  ASSERT_EQ(edges.projections.size(), 4u);
  std::size_t compared = 0, excitatory = 0;
  std::map<std::uint32_t, Vec3> offs;  // of each target
  for (const circuit::Projection& p : edges.projections)
    for (const circuit::Synapse& s : p.synapses) {
      excitatory += s.sign == circuit::Sign::excitatory;
      EXPECT_NE(s.sign, circuit::Sign::unknown) << p.name;
      // Places of the thalamic and external fibres are some µm off in the file itself, each by another way.
      if (s.element <= 0 || p.source != "S1nonbarrel_neurons") continue;
      const circuit::Instance& instance = read.circuit.instances[s.target];
      const Morphology& m = read.morphologies[instance.morphology];
      const SectionId section = reports::sections_of_elements(m)[std::size_t(s.element) - 1];
      double way = double(s.position) * section_length(m, section);
      const auto points = m.points(section);
      Vec3 at = points.back().position();
      for (std::size_t i = 1; i < points.size(); ++i) {
        const double length = segment_length(points[i - 1], points[i]);
        if (way <= length) {
          at = points[i - 1].position() +
               float(way / length) * (points[i].position() - points[i - 1].position());
          break;
        }
        way -= length;
      }
      // The program that wrote the file took another middle of the soma than we do: all are off by the same.
      const Vec3 off = instance.position + instance.orientation * at - s.centre;
      const Vec3& first = offs.try_emplace(s.target, off).first->second;
      EXPECT_LT(off.norm(), 2.f) << p.name << ' ' << s.element << ' ' << s.position;
      EXPECT_LT((off - first).norm(), .02f) << p.name << ' ' << s.element << ' ' << s.position;
      ++compared;
    }
  EXPECT_GT(compared, 40u);
  EXPECT_GT(excitatory, 1000u);
  // Older files have other names for them.
  const fs::path older = root / "allen_sonata_examples/9_cells";
  const SonataOutline outline = outline_sonata(older);
  const SonataEdges nine = read_edges(older, outline.circuit, outline.nodes);
  ASSERT_EQ(nine.projections.size(), 2u);
  EXPECT_EQ(nine.projections[0].synapses.size(), 659u);
  EXPECT_EQ(nine.projections[0].synapses[0].sign, circuit::Sign::excitatory);
  EXPECT_EQ(nine.projections[1].synapses[0].sign, circuit::Sign::inhibitory);
}

}  // namespace
}  // namespace forest::io
