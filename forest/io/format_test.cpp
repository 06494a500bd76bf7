// SPDX-License-Identifier: Apache-2.0
// Laws that hold for every row of the table of formats; a new format meets all of them by being a row.
#include "forest/io/format.h"

#include <algorithm>
#include <cmath>
#include <set>

#include <gtest/gtest.h>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/core/random.h"
#include "forest/io/swc.h"
#include "forest/morphology/measure.h"
#include "forest/morphology/validate.h"

#include "tests/real_data.h"
#include "tests/refused.h"
#include "tests/zoo.h"

namespace forest::io {
namespace {

class EveryFormat : public testing::TestWithParam<Format> {};

/// Reads whatever is in `bytes`. A value must be one that can be used; an error must name the file and say something.
bool reads(const Format& format, std::string_view bytes) {
  try {
    const ReadResult result = format.read(bytes, "cell");
    const Morphology& m = result.morphology;
    for (std::size_t i = 0; i < m.sections().size(); ++i) {
      const Section& section = m.sections()[i];
      if (section.parent.valid() && section.parent.value() >= i)
        ADD_FAILURE() << "a child precedes its parent";
    }
    EXPECT_GE(total_length(m), 0.);
    (void)validate(m);
    for (const Warning& warning : result.warnings)
      EXPECT_FALSE(warning.code.empty() || warning.sentence.empty());
    EXPECT_TRUE(std::ranges::is_sorted(result.warnings, {}, &Warning::line));
    if (format.write) {
      const std::string written = format.write(m);
      EXPECT_EQ(format.write(format.read(written, "again").morphology), written);
    }
    return true;
  } catch (const InputError& error) {
    EXPECT_EQ(error.file(), "cell");
    EXPECT_GT(error.sentence().size(), 10u);
    return false;
  }
}

/// Whether the format can hold a neuron of this size. Where not it must say so.
bool fits(const Format& format, const Morphology& m) {
  try {
    check_fits(m, format.keeps);
    return true;
  } catch (const LimitError& error) {
    EXPECT_THROW(format.write(m), LimitError);
    EXPECT_GT(std::string_view(error.what()).size(), 10u);
    return false;
  }
}

/// What a format that keeps all returns, and what one that keeps less returns of the neuron that is left.
void expect_same_neuron(const Morphology& read, const Morphology& written, const Keeps& keeps = {}) {
  const Morphology left = as_kept(written, keeps);
  ASSERT_EQ(read.sections().size(), left.sections().size());
  for (std::size_t i = 0; i < read.sections().size(); ++i) {
    const Section &a = read.sections()[i], &b = left.sections()[i];
    ASSERT_EQ(a.parent, b.parent);
    ASSERT_EQ(a.kind, b.kind);
    ASSERT_EQ(a.tag, b.tag);
  }
  const double off = 1e-6 + double(keeps.step);  // relative, of what has a size of 1 µm and more
  EXPECT_NEAR(total_length(read), total_length(left), off * total_length(left));
  EXPECT_NEAR(total_area(read), total_area(left), off * total_area(left));
  EXPECT_NEAR(read.soma().area(), left.soma().area(), off * left.soma().area());
  EXPECT_EQ(read.spines().size(), left.spines().size());
}

TEST_P(EveryFormat, IsFoundByItsNameAndItsExtensions) {
  const Format& format = GetParam();
  EXPECT_EQ(find_format(format.name)->title, format.title);
  for (const std::string_view extension : format.extensions) {
    const auto shares = [&](const Format& other) {
      return std::ranges::find(other.extensions, extension) != other.extensions.end();
    };
    if (std::ranges::count_if(formats(), shares) > 1) continue;  // the content decides
    EXPECT_EQ(format_of("a folder.swc/cell" + std::string(extension)).name, format.name);
  }
}

TEST_P(EveryFormat, ReadsBackWhatItWrote) {
  const Format& format = GetParam();
  if (!format.write) GTEST_SKIP() << "is only read";
  if (!format.read) GTEST_SKIP() << "is only written";
  for (const Specimen& specimen : zoo()) {
    SCOPED_TRACE(specimen.name);
    if (!fits(format, specimen.morphology)) continue;
    const std::string bytes = format.write(specimen.morphology);
    const Morphology read = format.read(bytes, specimen.name).morphology;
    expect_same_neuron(read, specimen.morphology, format.keeps);
    EXPECT_EQ(format.write(read), bytes) << "written again, the bytes differ";
  }
}

/// From a neuron to this format and on to every other: what the two keep comes through.
void expect_through_every_other(const Format& format, const Morphology& m) {
  if (!fits(format, m)) return;
  const Morphology once = format.read(format.write(m), "once").morphology;
  expect_same_neuron(once, m, format.keeps);
  for (const Format& other : formats()) {
    if (!other.read || !other.write || other.name == format.name) continue;
    SCOPED_TRACE(other.name);
    if (fits(other, once))
      expect_same_neuron(other.read(other.write(once), "twice").morphology, once, other.keeps);
  }
}

TEST_P(EveryFormat, LeadsToEveryOther) {
  if (!GetParam().read || !GetParam().write) GTEST_SKIP() << "is not both read and written";
  for (const Specimen& specimen : zoo()) {
    SCOPED_TRACE(specimen.name);
    expect_through_every_other(GetParam(), specimen.morphology);
  }
}

TEST_P(EveryFormat, LeadsTracedNeuronsToEveryOther) {
  if (!GetParam().read || !GetParam().write) GTEST_SKIP() << "is not both read and written";
  FOREST_REAL_DATA(folder, "morphologies/real");
  std::set<std::filesystem::path> populations;
  for (const char* const extension : {".swc", ".asc", ".h5"})
    for (const auto& path : files_below(folder, extension))
      if (populations.insert(path.parent_path()).second) {  // one cell of each
        SCOPED_TRACE(path.string());
        expect_through_every_other(GetParam(), read(path).morphology);
      }
  EXPECT_GT(populations.size(), 10u);
}

TEST_P(EveryFormat, WritesTheSameBytesForWhatIsLeftOfANeuron) {
  const Format& format = GetParam();
  if (!format.write) GTEST_SKIP() << "is only read";
  for (const Specimen& specimen : zoo()) {
    SCOPED_TRACE(specimen.name);
    if (!fits(format, specimen.morphology)) continue;
    const std::string bytes = format.write(specimen.morphology);
    EXPECT_FALSE(bytes.empty());
    EXPECT_EQ(format.write(specimen.morphology), bytes) << "writing is not deterministic";
    EXPECT_EQ(format.write(as_kept(specimen.morphology, format.keeps)), bytes)
        << "more is written than is told";
    EXPECT_EQ(bytes.find("nan"), std::string::npos);
    EXPECT_EQ(bytes.find("inf,"), std::string::npos);
  }
}

TEST_P(EveryFormat, ANeuronWithoutPointsIsNotTakenForAFileThatWasCutOff) {
  const Format& format = GetParam();
  if (!format.read || !format.write) GTEST_SKIP() << "is not both read and written";
  const Morphology nothing, tree = zoo_parts::binary_tree(3);
  expect_same_neuron(format.read(format.write(nothing), "nothing").morphology, nothing, format.keeps);
  const std::string bytes = format.write(tree);
  for (std::size_t length = 0; length < std::min<std::size_t>(bytes.size(), 400); ++length) try {
      const Morphology cut = format.read(bytes.substr(0, length), "cut").morphology;
      EXPECT_FALSE(cut.points().empty() && cut.soma().kind == SomaKind::none) << length;
    } catch (const InputError&) {
    }
}

TEST_P(EveryFormat, AFileIsWrittenWholeAndReadBack) {
  const Format& format = GetParam();
  if (!format.write) GTEST_SKIP() << "is only read";
  const auto folder =
      std::filesystem::path(testing::TempDir()) / ("forest_format_" + std::string(format.name));
  std::filesystem::create_directories(folder);
  const auto path = folder / ("tree" + std::string(format.extensions[0]));
  const Morphology tree = zoo_parts::binary_tree(3);
  write(path, tree);
  if (format.read)
    expect_same_neuron(read(path).morphology, tree, format.keeps);
  else
    EXPECT_EQ(MappedFile(path).text(), format.write(tree));
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder), {}), 1);
  std::filesystem::remove_all(folder);
}

TEST_P(EveryFormat, CutAtAnyByteItIsAnErrorOrANeuron) {
  const Format& format = GetParam();
  if (!format.write) GTEST_SKIP() << "is only read";
  if (!format.read) GTEST_SKIP() << "is only written";
  for (const Specimen& specimen : zoo()) {
    if (!fits(format, specimen.morphology)) continue;
    const std::string bytes = format.write(specimen.morphology);
    if (bytes.size() > 12000) continue;
    SCOPED_TRACE(specimen.name);
    for (std::size_t size = 0; size < bytes.size(); size += 1 + bytes.size() / 3000)
      reads(format, std::string(bytes, 0, size));
  }
}

TEST_P(EveryFormat, WithAnyBytesChangedItIsAnErrorOrANeuron) {
  const Format& format = GetParam();
  if (!format.write) GTEST_SKIP() << "is only read";
  if (!format.read) GTEST_SKIP() << "is only written";
  constexpr std::string_view telling = "0123456789-+.eE#, \t\r\n\0\xff(){}<>\"n";
  Random random(2024, 0, 5);
  std::size_t read = 0, refused = 0;
  for (const Specimen& specimen : zoo()) {
    if (!fits(format, specimen.morphology)) continue;
    const std::string bytes = format.write(specimen.morphology);
    if (bytes.size() > 20000) continue;
    SCOPED_TRACE(specimen.name);
    for (int trial = 0; trial < 150; ++trial) {
      std::string changed = bytes;
      for (std::uint32_t change = 0, changes = 1 + random.below(4); change < changes && !changed.empty();
           ++change) {
        const std::size_t at = random.below(std::uint32_t(changed.size()));
        const char byte =
            random.below(2) ? telling[random.below(std::uint32_t(telling.size()))] : char(random.below(256));
        switch (random.below(4)) {
          case 0:
            changed.erase(at, 1 + random.below(8));
            break;
          case 1:
            changed.insert(at, 1, byte);
            break;
          case 2:
            changed.insert(at, changed.substr(random.below(std::uint32_t(changed.size())), random.below(60)));
            break;
          default:
            changed[at] = byte;
        }
      }
      ++(reads(format, changed) ? read : refused);
    }
  }
  EXPECT_GT(read, 0u);
  EXPECT_GT(refused, 0u);
}

TEST_P(EveryFormat, OddNumbersAnywhereAreAnErrorOrANeuron) {
  const Format& format = GetParam();
  if (!format.write) GTEST_SKIP() << "is only read";
  if (!format.read) GTEST_SKIP() << "is only written";
  const std::vector<std::string> odd{"nan",
                                     "-nan",
                                     "inf",
                                     "-inf",
                                     "1e999",
                                     "-1e999",
                                     "1e-999",
                                     "99999999999999999999",
                                     "-99999999999999999999",
                                     "2147483647",
                                     "2147483648",
                                     "-2147483648",
                                     "9223372036854775807",
                                     "4294967295",
                                     "18446744073709551616",
                                     "1e38",
                                     "3.5e38",
                                     "-0",
                                     "1e",
                                     ".",
                                     "-",
                                     "+",
                                     "",
                                     std::string(5000, '9'),
                                     "0." + std::string(5000, '0') + "1"};
  for (const Specimen& specimen : zoo()) {
    if (!fits(format, specimen.morphology)) continue;
    const std::string bytes = format.write(specimen.morphology);
    if (bytes.size() > 1000) continue;
    SCOPED_TRACE(specimen.name);
    const auto part_of_number = [](char c) { return (c >= '0' && c <= '9') || c == '-' || c == '.'; };
    for (std::size_t begin = 0; begin < bytes.size();) {
      std::size_t end = begin;
      while (end < bytes.size() && part_of_number(bytes[end])) ++end;
      if (end == begin) {
        ++begin;
        continue;
      }
      for (const std::string& number : odd)
        reads(format, bytes.substr(0, begin) + number + bytes.substr(end));
      begin = end;
    }
  }
}

/// The same for formats whose numbers are bytes: what is at the ends of the range of a length, an address, a float.
TEST_P(EveryFormat, OddBytesAnywhereAreAnErrorOrANeuron) {
  const Format& format = GetParam();
  if (!format.write) GTEST_SKIP() << "is only read";
  if (!format.read) GTEST_SKIP() << "is only written";
  using namespace std::string_view_literals;
  constexpr std::string_view odd[] = {"\0"sv,
                                      "\x01"sv,
                                      "\x7f"sv,
                                      "\x80"sv,
                                      "\xff"sv,
                                      "\xff\xff"sv,
                                      "\0\0\0\0"sv,
                                      "\xff\xff\xff\xff"sv,
                                      "\xff\xff\xff\x7f"sv,
                                      "\0\0\xc0\x7f"sv,
                                      "\0\0\0\x80"sv,
                                      "\0\0\0\0\0\0\0\x80"sv,
                                      "\xff\xff\xff\xff\xff\xff\xff\xff"sv,
                                      "\xff\xff\xff\xff\xff\xff\xff\x7f"sv};
  for (const Specimen& specimen : zoo()) {
    if (!fits(format, specimen.morphology)) continue;
    const std::string bytes = format.write(specimen.morphology);
    if (bytes.size() > 6000) continue;
    SCOPED_TRACE(specimen.name);
    for (std::size_t at = 0; at < bytes.size(); at += 1 + bytes.size() / 300) {
      std::string changed = bytes;
      const std::string_view word = odd[at % std::size(odd)];
      changed.replace(at, std::min(word.size(), bytes.size() - at), word.substr(0, bytes.size() - at));
      reads(format, changed);
    }
  }
}

TEST_P(EveryFormat, AnEmptyFileIsRefusedWithASentence) {
  if (!GetParam().read) GTEST_SKIP() << "is only written";
  EXPECT_FALSE(reads(GetParam(), ""));
  EXPECT_FALSE(reads(GetParam(), "\n"));
  EXPECT_FALSE(reads(GetParam(), std::string(1000, '\0')));
}

/// Kept inputs of the fuzzer (fuzz/corpus/<format>): each once crashed a reader or leads far into one.
TEST_P(EveryFormat, TheFuzzersCorpusIsReadOrRefused) {
  if (!GetParam().read) GTEST_SKIP() << "is only written";
  std::size_t files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(
           std::filesystem::path(FOREST_SOURCE_DIR "/fuzz/corpus") / GetParam().name)) {
    SCOPED_TRACE(entry.path().filename().string());
    reads(GetParam(), MappedFile(entry.path()).text());
    ++files;
  }
  EXPECT_GT(files, 0u);
}

INSTANTIATE_TEST_SUITE_P(Formats, EveryFormat, testing::ValuesIn(formats().begin(), formats().end()),
                         [](const auto& row) {
                           std::string name(row.param.name);
                           std::ranges::replace(name, '-', '_');
                           return name;
                         });

TEST(Formats, HaveDifferentNamesAndExtensionsOrAreRecognised) {
  std::set<std::string_view> names, extensions;
  for (const Format& format : formats()) {
    EXPECT_TRUE(names.insert(format.name).second);
    for (const std::string_view extension : format.extensions) {
      const bool fresh = extensions.insert(extension).second;
      EXPECT_TRUE(fresh || format.recognises) << extension;
    }
  }
}

TEST(Formats, FilesOfOtherKindsAreToldAsWhatTheyAre) {
  using namespace std::string_view_literals;
  const std::pair<std::string_view, std::string_view> files[] = {
      {"", "is empty"},
      {"\x1f\x8b\x08 ..."sv, "unpack it"},
      {"PK\x03\x04 ..."sv, "unpack it"},
      {"<!DOCTYPE HTML><html>404</html>", "is a web page"},
      {"\0\5\26\7 ..."sv, "macOS"},
      {"((Axon) (0 0 0 1) (0 1 0 1))", "name it .asc"},
      {"<neuroml id=\"n\"/>", "name it .nml"},
  };
  for (const auto& [bytes, words] : files) {
    try {
      read_all(*find_format("swc"), bytes, "cell.swc");
      ADD_FAILURE() << bytes;
    } catch (const InputError& error) {
      EXPECT_NE(error.sentence().find(words), std::string::npos) << error.what();
    }
  }
  EXPECT_THROW(read_all(*find_format("genesis"), "#!/usr/bin/perl\nprint 1;\n", "script.p"), NotANeuron);
  EXPECT_THROW(read_all(*find_format("neuroml"), "<project/>", "build.xml"), NotANeuron);
  EXPECT_THROW(read_all(*find_format("asc"), "(\"pia\" (Color Red) (1 2 3 1) (2 3 4 1))", "pia.asc"),
               NotANeuron);
}

TEST(Formats, AnUnknownExtensionIsRefusedWithTheKnownOnes) {
  EXPECT_EQ(find_format("wordstar"), nullptr);
  EXPECT_EQ(format_of("CELL.SWC").name, "swc");
  EXPECT_NE(refused<InputError>([] { format_of("cell.doc"); }).find(".swc"), std::string::npos);
}

TEST(Zoo, IsWhatItsLabelsSay) {
  for (const Specimen& specimen : zoo()) {
    SCOPED_TRACE(specimen.name);
    const Morphology& m = specimen.morphology;
    EXPECT_EQ(m.sections().size(), specimen.sections);
    std::size_t tips = 0;
    for (std::size_t i = 0; i < m.sections().size(); ++i) tips += m.is_terminal(SectionId(i));
    EXPECT_EQ(tips, specimen.tips);
    if (specimen.length) {
      EXPECT_NEAR(total_length(m), *specimen.length, 1e-9 * *specimen.length);
    }
  }
}

}  // namespace
}  // namespace forest::io
