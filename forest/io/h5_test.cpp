// SPDX-License-Identifier: Apache-2.0
#include "forest/io/h5.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <thread>

#include <gtest/gtest.h>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/io/hdf5.h"
#include "forest/io/hdf5_image.h"
#include "forest/morphology/measure.h"

#include "tests/real_data.h"
#include "tests/refused.h"
#include "tests/zoo.h"

namespace forest::io {
namespace {

/// A file to be spoiled: an outline, a stem and two daughters.
struct Sample {
  std::vector<float> points{0, 0, 0, 1, 2, 0, 0, 1, 1, 2, 0, 1, 2, 0, 0, 2,  7, 0,
                            0, 2, 7, 0, 0, 2, 9, 4, 0, 1, 7, 0, 0, 1, 9, -4, 0, 1};
  std::vector<std::int32_t> structure{0, 1, -1, 3, 3, 0, 5, 3, 1, 7, 3, 1};
  std::array<std::uint32_t, 2> version{1, 3};
  std::uint32_t family = 0;
  std::vector<float> perimeters;

  std::string bytes() const {
    hdf5::NewFile file;
    file.write("/points", points, 4);
    file.write("/structure", structure, 3);
    file.group("/metadata");
    file.attribute("/metadata", "version", version);
    file.attribute("/metadata", "cell_family", family);
    if (!perimeters.empty()) file.write("/perimeters", perimeters);
    return file.bytes();
  }
  ReadResult read() const { return read_h5(bytes(), "sample"); }
  std::string refusal() const {
    try {
      read();
      return "";
    } catch (const InputError& error) {
      return error.sentence();
    }
  }
};

bool told(const ReadResult& result, std::string_view code) {
  return std::ranges::find(result.warnings, code, &Warning::code) != result.warnings.end();
}

bool contains(const std::string& text, std::string_view part) { return text.find(part) != text.npos; }

std::string annotation(const Morphology& m, std::string_view key) {
  for (const auto& [k, value] : m.annotations())
    if (k == key) return value;
  return "";
}

TEST(H5, PointsAreDiametersAndSectionsFollowTheRows) {
  const ReadResult result = Sample().read();
  const Morphology& m = result.morphology;
  EXPECT_TRUE(result.warnings.empty());
  ASSERT_EQ(m.sections().size(), 3u);
  EXPECT_EQ(m.soma().kind, SomaKind::contours);
  EXPECT_EQ(m.soma().points.size(), 3u);
  EXPECT_EQ(m.section(SectionId(0)).soma_point, 0);
  EXPECT_EQ(m.section(SectionId(0)).kind, SectionKind::basal);
  EXPECT_FLOAT_EQ(m.points(SectionId(0))[0].radius, 1.f);
  EXPECT_EQ(m.children(SectionId(0)).size(), 2u);
  EXPECT_FLOAT_EQ(m.points(SectionId(2))[0].radius, .5f);  // the daughter's own
  EXPECT_NEAR(total_length(m), 5. + 2 * std::sqrt(20.), 1e-6);
}

TEST(H5, WhatCannotBeReadIsRefusedWithAReason) {
  const auto spoiled = [](auto spoil) {
    Sample sample;
    spoil(sample);
    return sample.refusal();
  };
  EXPECT_TRUE(contains(spoiled([](Sample& s) { s.version = {1, 4}; }), "version 1.4"));
  EXPECT_TRUE(contains(spoiled([](Sample& s) { s.family = 3; }), "cell_family is 3"));
  EXPECT_TRUE(contains(spoiled([](Sample& s) { s.family = 1; }), "without perimeters"));
  EXPECT_TRUE(contains(spoiled([](Sample& s) { s.structure[4] = 1; }), "only row 0 may be the soma"));
  EXPECT_TRUE(contains(spoiled([](Sample& s) { s.structure[6] = 2; }), "rows must follow"));
  EXPECT_TRUE(contains(spoiled([](Sample& s) { s.structure[9] = 10; }), "begins at point 10 of 9"));
  EXPECT_TRUE(contains(spoiled([](Sample& s) { s.structure[5] = 3; }), "its own ancestor"));
  EXPECT_TRUE(contains(spoiled([](Sample& s) { s.structure[3] = 1; }), "soma of one point"));
  EXPECT_TRUE(contains(spoiled([](Sample& s) { s.structure.clear(); }), "holds no section"));
  EXPECT_EQ(Sample().refusal(), "");
}

TEST(H5, DeviationsAreReadAndTold) {
  struct Case {
    std::string_view code;
    void (*spoil)(Sample&);
    std::size_t sections, roots;
  };
  const std::vector<Case> cases{
      {"empty-section", [](Sample& s) { s.structure[9] = 9; }, 2, 1},
      {"empty-section", [](Sample& s) { s.structure[6] = 3; }, 2, 2},
      {"soma-two-points", [](Sample& s) { s.structure[3] = 2; }, 3, 1},
      {"root-marker", [](Sample& s) { s.structure[5] = -1; }, 3, 1},
      {"self-parent", [](Sample& s) { s.structure[8] = 2; }, 3, 2},
      {"missing-parent", [](Sample& s) { s.structure[8] = 17; }, 3, 2},
      {"child-first", [](Sample& s) { s.structure[5] = 2, s.structure[8] = 0; }, 3, 1},
      {"joint-missing", [](Sample& s) { s.points[20] = 8; }, 3, 1},
      {"single-daughter", [](Sample& s) { s.structure[11] = 2; }, 3, 1},
      {"unknown-place", [](Sample& s) { s.points[17] = NAN; }, 3, 1},
      {"negative-radius", [](Sample& s) { s.points[19] = -2; }, 3, 1},
      {"type-custom", [](Sample& s) { s.structure[4] = 20; }, 3, 1},
      {"type-custom", [](Sample& s) { s.structure[4] = -2; }, 3, 1},
      {"perimeters-size",
       [](Sample& s) {
         s.perimeters = {1, 2};
       },
       3, 1},
      {"glia-unsaid", [](Sample& s) { s.perimeters.assign(9, 2.f); }, 3, 1},
      {"unused-points", [](Sample& s) { s.structure = {3, 3, -1, 5, 3, 0, 7, 3, 0}; }, 3, 1},
  };
  std::vector<std::string_view> codes;
  for (const Case& c : cases) {
    SCOPED_TRACE(c.code);
    Sample sample;
    c.spoil(sample);
    const ReadResult result = sample.read();
    EXPECT_TRUE(told(result, c.code));
    EXPECT_EQ(result.morphology.sections().size(), c.sections);
    EXPECT_EQ(result.morphology.roots().size(), c.roots);
    codes.push_back(c.code);
  }
  for (const Oddity& oddity : h5_oddities()) {
    const bool elsewhere = oddity.code == "several-cells" || oddity.code == "version-2" ||
                           oddity.code == "organelles-odd" || oddity.code == "not-kept";
    EXPECT_TRUE(elsewhere || std::ranges::find(codes, oddity.code) != codes.end()) << oddity.code;
  }
}

TEST(H5, AttributesThatAreTextsAreKeptAndOthersTold) {
  const auto sample = [](auto more) {
    hdf5::NewFile file;
    const Sample usual;
    file.write("/points", usual.points, 4);
    file.write("/structure", usual.structure, 3);
    file.group("/metadata");
    file.attribute("/metadata", "version", usual.version);
    more(file);
    return read_h5(file.bytes(), "sample");
  };
  const ReadResult kept = sample([](hdf5::NewFile& file) {
    file.attribute("/", "software", "a tracer");
    file.attribute("/metadata", "creator", "a hand");
  });
  EXPECT_TRUE(kept.warnings.empty());
  EXPECT_EQ(annotation(kept.morphology, "software"), "a tracer");
  EXPECT_EQ(annotation(kept.morphology, "creator"), "a hand");
  EXPECT_EQ(read_h5(write_h5(kept.morphology), "again").morphology.annotations(),
            kept.morphology.annotations());
  const ReadResult lost = sample([](hdf5::NewFile& file) {
    file.attribute("/metadata", "voxel", std::array<std::uint32_t, 2>{1, 2});
  });
  ASSERT_TRUE(told(lost, "not-kept"));
  EXPECT_TRUE(contains(lost.warnings[0].sentence, "attribute voxel"));
  EXPECT_TRUE(lost.warnings[0].lost);
  const ReadResult many = sample([](hdf5::NewFile& file) {
    for (int i = 0; i < 40; ++i)
      file.attribute("/", "x" + std::to_string(i), std::array<std::uint32_t, 1>{1});
  });
  EXPECT_TRUE(told(many, "not-kept"));
}

TEST(H5, GliaAndSpinesKeepTheirNumbersAndFamilies) {
  Sample glia;
  glia.family = 1, glia.perimeters = {0, 0, 0, 6, 6, 6, 3, 3, 3};
  const Morphology process = glia.read().morphology;
  EXPECT_EQ(process.section(SectionId(1)).kind, SectionKind::glia);
  EXPECT_EQ(process.section(SectionId(1)).tag, 3);
  EXPECT_EQ(annotation(process, "perimeters"), "6 6 6 3 3 3");
  Sample spine;
  spine.family = 2, spine.structure = {0, 2, -1, 3, 3, 0, 5, 3, 1, 7, 3, 1};
  const Morphology head = spine.read().morphology;
  EXPECT_EQ(head.section(SectionId(0)).tag, 2);
  for (const Morphology& m : {process, head}) {
    const Morphology again = read_h5(write_h5(m), "again").morphology;
    EXPECT_EQ(again, m);
    EXPECT_EQ(again.annotations(), m.annotations());
  }
}

TEST(H5, AllOfTheZooComesBackAsItWas) {
  for (const Specimen& specimen : zoo()) {
    SCOPED_TRACE(specimen.name);
    const ReadResult result = read_h5(write_h5(specimen.morphology), specimen.name);
    EXPECT_EQ(result.morphology, specimen.morphology);
    EXPECT_EQ(result.morphology.annotations().size(), specimen.morphology.annotations().size());
    // What the file says itself is no deviation of it.
    EXPECT_EQ(std::ranges::count(result.warnings, std::string_view("single-daughter"), &Warning::code), 0);
  }
}

TEST(H5, AContainerHoldsManyNeurons) {
  std::vector<NamedMorphology> cells;
  for (std::uint64_t i = 0; i < 100; ++i)
    cells.push_back({"layer " + std::to_string(i % 3) + "/cell " + std::to_string(100 + i),
                     zoo_parts::random_tree(i, 20)});
  const std::string bytes = write_h5(cells);
  EXPECT_EQ(write_h5(cells), bytes);
  const std::vector<Cell> read = read_all_h5(bytes, "container");
  ASSERT_EQ(read.size(), cells.size());
  for (const Cell& cell : read) {
    const auto written = std::ranges::find(cells, cell.name, &NamedMorphology::name);
    ASSERT_NE(written, cells.end()) << cell.name;
    EXPECT_EQ(cell.read.morphology, written->morphology);
  }
  EXPECT_TRUE(told(read_h5(bytes, "container"), "several-cells"));
  cells.push_back(cells.front());
  EXPECT_THROW(write_h5(cells), Error);
}

TEST(H5, WhatAContainerSaysOfAllCellsIsTold) {
  hdf5::NewFile file;
  const Sample sample;
  for (const char* cell : {"/a", "/b"}) {
    file.group(cell);
    file.write(std::string(cell) + "/points", sample.points, 4);
    file.write(std::string(cell) + "/structure", sample.structure, 3);
    file.group(std::string(cell) + "/metadata");
    file.attribute(std::string(cell) + "/metadata", "version", sample.version);
  }
  file.attribute("/", "laboratory", "of cells");
  const std::vector<Cell> cells = read_all_h5(file.bytes(), "container");
  ASSERT_EQ(cells.size(), 2u);
  ASSERT_TRUE(told(cells[0].read, "not-kept"));
  EXPECT_TRUE(contains(cells[0].read.warnings.back().sentence, "laboratory"));
  EXPECT_FALSE(told(cells[1].read, "not-kept"));
}

TEST(H5, CellsOfAContainerMayBeCalledAsThePartsOfOne) {
  std::vector<NamedMorphology> cells;
  for (const char* name :
       {"neuron1", "points", "structure", "metadata", "a/neuron1", "b/points", "b/structure"})
    cells.push_back({name, zoo_parts::random_tree(cells.size(), 5)});
  const std::vector<Cell> read = read_all_h5(write_h5(cells), "container");
  ASSERT_EQ(read.size(), cells.size());
  for (const Cell& cell : read) {
    const auto written = std::ranges::find(cells, cell.name, &NamedMorphology::name);
    ASSERT_NE(written, cells.end()) << cell.name;
    EXPECT_EQ(cell.read.morphology, written->morphology);
  }
  for (const char* name : {"", "/a", "a//b", "a/", ".", "a/./b", "points/of", "b"}) {
    SCOPED_TRACE(name);
    std::vector<NamedMorphology> more = cells;
    more.push_back({name, cells[0].morphology});
    EXPECT_THROW(write_h5(more), Error);
  }
}

TEST(H5, AnnotationsKeepTheirOrder) {
  for (const Annotations& annotations :
       {Annotations{{"comment", "one"}, {"CREATURE", "rat"}},
        Annotations{{"CREATURE", "rat"}, {"comment", "one"}},
        Annotations{{"comment", "one"}, {"comment", "one"}},
        Annotations{{"a", ""}, {"comment", "one"}, {"b", ""}, {"comment", "two"}, {"comment", "one"}}}) {
    MorphologyBuilder builder;
    for (const auto& [key, value] : annotations) builder.annotate(key, value);
    EXPECT_EQ(read_h5(write_h5(builder.build()), "annotated").morphology.annotations(), annotations);
  }
}

TEST(H5, AContainerHoldsNeuronsWithoutPointsToo) {
  MorphologyBuilder builder;
  builder.annotate("CREATURE", "rat");
  const std::vector<NamedMorphology> cells{{"nothing", builder.build()}, {"tree", zoo_parts::binary_tree(3)}};
  const std::vector<Cell> read = read_all_h5(write_h5(cells), "container");
  ASSERT_EQ(read.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(read[i].name, cells[i].name);
    EXPECT_EQ(read[i].read.morphology, cells[i].morphology);
  }
}

TEST(H5, ManyThreadsWriteAtOnce) {
  std::vector<Morphology> cells;
  for (std::uint64_t i = 0; i < 64; ++i) cells.push_back(zoo_parts::random_tree(i, 20));
  std::vector<std::string> written(cells.size());
  {
    std::vector<std::jthread> threads;
    for (std::size_t t = 0; t < 4; ++t)
      threads.emplace_back([&, t] {
        for (std::size_t i = t; i < cells.size(); i += 4) written[i] = write_h5(cells[i]);
      });
  }
  for (std::size_t i = 0; i < cells.size(); ++i) {
    EXPECT_EQ(written[i], write_h5(cells[i]));
    EXPECT_EQ(read_h5(written[i], "many").morphology, cells[i]);
  }
}

/// Written by h5py, in every layout the library has: fuzz/corpus/h5.
TEST(H5, EveryLayoutOfTheLibraryHoldsTheSameNeuron) {
  const std::filesystem::path folder = FOREST_SOURCE_DIR "/fuzz/corpus/h5";
  const Morphology expected = read(folder / "outline.h5").morphology;
  EXPECT_EQ(annotation(expected, "comment"), "made by hand");
  for (const char* name : {"doubles_big_endian.h5", "packed.h5", "newest.h5", "newest_chunks.h5",
                           "newest_packed.h5", "version_2.h5"}) {
    const Morphology m = read(folder / name).morphology;
    ASSERT_EQ(m.sections().size(), expected.sections().size()) << name;
    EXPECT_NEAR(total_length(m), total_length(expected), 1e-6) << name;
    EXPECT_NEAR(total_area(m), total_area(expected), 1e-5) << name;
    EXPECT_EQ(m.soma().points.size(), 3u) << name;
  }
  const auto cells = [&](const char* name) {
    const MappedFile file(folder / name);
    return read_all_h5(file.text(), name);
  };
  EXPECT_EQ(cells("container.h5").size(), 2u);
  EXPECT_EQ(cells("container.h5")[0].name, "a/b");
  EXPECT_EQ(cells("many.h5").size(), 12u);
  const Morphology organelles = read(folder / "glia_organelles.h5").morphology;
  EXPECT_EQ(annotation(organelles, "mitochondrion"), "-1 0 0.5 10 1 0.2 3");
  EXPECT_EQ(annotation(organelles, "endoplasmic_reticulum"), "1 0.5 2 1");
  EXPECT_EQ(annotation(read(folder / "spine_density.h5").morphology, "postsynaptic_density"), "1 0 0.5");
}

TEST(H5, BehindAUserBlockIsReadAsWithout) {
  const Morphology m = read(FOREST_SOURCE_DIR "/fuzz/corpus/h5/user_block.h5").morphology;
  EXPECT_EQ(m.soma().points.size(), 3u);
  EXPECT_EQ(m.sections().size(), 1u);
}

TEST(H5, OfWhichAPartIsNotThereIsRefused) {
  const auto sentence = [](const std::string& name) {
    return refused<InputError>([&] { read(FOREST_SOURCE_DIR "/fuzz/corpus/h5/" + name); });
  };
  for (const std::string version : {"", "newest_"}) {
    EXPECT_THAT(sentence(version + "unwritten.h5"), testing::HasSubstr("lacks 1 of 3 pieces of an array"));
    EXPECT_THAT(sentence(version + "soft_link.h5"), testing::HasSubstr("points is a soft link"));
  }
}

TEST(H5RealData, Version2AndContainersHoldTheSameCells) {
  FOREST_REAL_DATA(folder, "morphologies/broken/morphio/h5");
  const Morphology first = read(folder / "v1/Neuron.h5").morphology,
                   second = read(folder / "v2/Neuron.h5").morphology;
  EXPECT_TRUE(std::ranges::equal(first.points(), second.points()));
  EXPECT_TRUE(std::ranges::equal(first.sections(), second.sections()));
  EXPECT_EQ(read_all_h5(MappedFile(folder / "merged.h5").text(), "merged").size(), 9u);
  EXPECT_EQ(read_all_h5(MappedFile(folder / "v1/merged.h5").text(), "merged").size(), 6u);
}

TEST(H5RealData, RealCellsComeBackAsTheyWere) {
  std::size_t files = 0, cells = 0;
  FOREST_REAL_DATA(data, "morphologies");
  for (const auto& path : files_below(data, ".h5")) {
    const MappedFile file(path);
    std::vector<Cell> all;
    try {
      all = read_all_h5(file.text(), path.string());
    } catch (const InputError&) {
      EXPECT_TRUE(contains(path.string(), "/broken/")) << path;
      continue;
    }
    ++files;
    for (const Cell& cell : all) {
      const Morphology& m = cell.read.morphology;
      const std::string bytes = write_h5(m);
      const Morphology again = read_h5(bytes, path.string()).morphology;
      EXPECT_EQ(again, m) << path << cell.name;
      EXPECT_EQ(again.annotations(), m.annotations()) << path << cell.name;
      EXPECT_EQ(write_h5(again), bytes) << path << cell.name;
      ++cells;
    }
  }
  std::printf("  %zu files, %zu cells\n", files, cells);
  EXPECT_GE(cells, 20u);
}

}  // namespace
}  // namespace forest::io
