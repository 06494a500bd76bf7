// SPDX-License-Identifier: Apache-2.0
#include "forest/io/sonata_report.h"

#include <cmath>
#include <fstream>
#include <functional>
#include <map>
#include <optional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/io/hdf5.h"
#include "forest/io/sonata.h"
#include "forest/reports/activity.h"
#include "forest/reports/synthetic.h"

#include "tests/real_data.h"

namespace forest::io {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;

/// The arrays of one population as they are written; a test breaks one of them.
struct Written {
  std::string name = "column";
  std::optional<std::vector<std::uint64_t>> node_ids = {{7, 3}}, pointers = {{0, 2, 5}};
  std::string pointers_name = "index_pointers";
  std::optional<std::vector<std::uint32_t>> element_ids = {{0, 1, 0, 1, 2}};
  std::optional<std::vector<float>> element_pos = {{.5f, .5f, .5f, .25f, .75f}};
  std::optional<std::vector<float>> time = {{0, 2, .5f}};
  std::vector<float> data = [] {
    std::vector<float> values;
    for (int row = 0; row < 4; ++row)
      for (int column = 0; column < 5; ++column) values.push_back(float(-10 * row - column));
    return values;
  }();
  std::size_t columns = 5;
  std::string units = "mV", time_units = "ms";
  bool nothing = false;  // a group, and that is all
};

class Reports : public testing::Test {
 protected:
  Reports() {
    std::string root = (fs::temp_directory_path() / "forest-reports.XXXXXX").string();
    root_ = ::mkdtemp(root.data());
  }
  ~Reports() override { fs::remove_all(root_); }

  fs::path write(const std::vector<Written>& populations) const {
    const fs::path path = root_ / "report.h5";
    fs::remove(path);  // a report that is still open keeps its own
    hdf5::NewFile file(path);
    for (const Written& w : populations) {
      const std::string base = "/report/" + w.name, map = base + "/mapping/";
      file.group(w.nothing ? base : base + "/mapping");
      if (w.nothing) continue;
      file.write(base + "/data", std::span(w.data), w.columns);
      if (!w.units.empty()) file.attribute(base + "/data", "units", w.units);
      const auto put = [&](const std::string& name, const auto& values) {
        if (values) file.write(map + name, std::span(*values));
      };
      put("node_ids", w.node_ids), put(w.pointers_name, w.pointers), put("element_ids", w.element_ids);
      put("element_pos", w.element_pos), put("time", w.time);
      if (w.time && !w.time_units.empty()) file.attribute(map + "time", "units", w.time_units);
    }
    file.close();
    return path;
  }
  static std::string complaint(const std::function<void()>& act) {
    try {
      act();
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), testing::Not(HasSubstr("\n")));
      return error.what();
    }
    return "accepted";
  }
  std::string reading(const std::function<void(Written&)>& change) const {
    Written w;
    change(w);
    const fs::path path = write({w});
    return complaint([&] { read_sonata_report(path); });
  }

  fs::path root_;
};

TEST_F(Reports, TellTheirMappingAndEveryRectangleOfTheirValues) {
  const reports::Report report = read_sonata_report(write({Written{}}));
  EXPECT_EQ(report.steps, 4u);
  EXPECT_EQ(report.start, 0.);
  EXPECT_EQ(report.step, .5);
  EXPECT_EQ(report.units, "mV");
  EXPECT_THAT(report.populations, ElementsAre("column"));
  EXPECT_THAT(report.nodes, ElementsAre(reports::Node{0, 7}, reports::Node{0, 3}));
  EXPECT_THAT(report.first_column, ElementsAre(0, 2, 5));
  EXPECT_THAT(report.element_ids, ElementsAre(0, 1, 0, 1, 2));
  EXPECT_THAT(report.element_positions, ElementsAre(.5f, .5f, .5f, .25f, .75f));
  std::vector<float> values(4);
  report.read(1, 2, 2, 2, values.data());
  EXPECT_THAT(values, ElementsAre(-12.f, -13.f, -22.f, -23.f));
}

TEST_F(Reports, OfSeveralPopulationsLieSideBySide) {
  Written other;
  other.name = "other";
  for (float& value : other.data) value += 1000.f;
  const fs::path path = write({Written{}, other});
  const reports::Report report = read_sonata_report(path);
  EXPECT_THAT(report.populations, ElementsAre("column", "other"));
  EXPECT_THAT(report.first_column, ElementsAre(0, 2, 5, 7, 10));
  EXPECT_EQ(report.nodes[2], (reports::Node{1, 7}));
  std::vector<float> values(6);
  report.read(2, 2, 4, 3, values.data());
  EXPECT_THAT(values, ElementsAre(-24.f, 980.f, 979.f, -34.f, 970.f, 969.f));
  EXPECT_THAT(read_sonata_report(path, "other").populations, ElementsAre("other"));
  EXPECT_THAT(complaint([&] { read_sonata_report(path, "third"); }), HasSubstr("there are column, other"));
  other.time = {{0, 4, 1}};
  const fs::path slower = write({Written{}, other});
  EXPECT_THAT(complaint([&] { read_sonata_report(slower); }), HasSubstr("name one with --population"));
  EXPECT_EQ(read_sonata_report(slower, "other").step, 1.);
}

TEST_F(Reports, ThatAreWrittenComeBackEqual) {
  circuit::Circuit circuit;
  circuit.morphologies = {"none"};
  circuit.instances.resize(3000);
  const reports::Report report =
      reports::synthetic_report(circuit, std::vector<Morphology>(1), {.steps = 37});
  reports::Report wide = report;  // wider and longer than what is written at a time
  wide.first_column.clear(), wide.element_ids.assign(3000 * 30, 0),
      wide.element_positions.assign(3000 * 30, .25f);
  for (std::uint64_t n = 0; n <= 3000; ++n) wide.first_column.push_back(30 * n);
  wide.start = 100.25;
  wide.read = [](std::size_t row, std::size_t rows, std::size_t column, std::size_t columns, float* out) {
    for (std::size_t r = row; r < row + rows; ++r)
      for (std::size_t c = column; c < column + columns; ++c) *out++ = float(r * 100000 + c);
  };
  const fs::path path = root_ / "written.h5";
  write_sonata_report(path, wide);
  const reports::Report back = read_sonata_report(path);
  EXPECT_EQ(back.nodes, wide.nodes);
  EXPECT_EQ(back.first_column, wide.first_column);
  EXPECT_EQ(back.element_ids, wide.element_ids);
  EXPECT_EQ(back.element_positions, wide.element_positions);
  EXPECT_EQ(std::tie(back.start, back.step, back.steps, back.units),
            std::tie(wide.start, wide.step, wide.steps, wide.units));
  std::vector<float> one(37 * 90000), other(one.size());
  wide.read(0, 37, 0, 90000, one.data());
  back.read(0, 37, 0, 90000, other.data());
  EXPECT_TRUE(one == other);
  EXPECT_THROW(write_sonata_report(root_ / "no" / "x.h5", wide), Error);
}

TEST_F(Reports, AreReadInTheDialectsThatProgramsWrite) {
  EXPECT_EQ(reading([](Written& w) { w.pointers_name = "index_pointer"; }), "accepted");
  EXPECT_EQ(reading([](Written& w) { w.pointers = {{0, 2}}; }), "accepted");  // without the last
  EXPECT_EQ(reading([](Written& w) { w.element_pos.reset(); }), "accepted");
  EXPECT_EQ(reading([](Written& w) { w.units = w.time_units = ""; }), "accepted");
  EXPECT_EQ(reading([](Written& w) {
              w.time = {{10, 11.5f, .5f}};
            }),
            "accepted");  // the last step is the end
  EXPECT_EQ(complaint([&] {
              const reports::Report report =
                  read_sonata_report(write({Written{}, Written{.name = "empty", .nothing = true}}));
              EXPECT_EQ(report.step, .5);
            }),
            "accepted");
  Written w;
  w.time_units = "s", w.time = {{0, .002f, .0005f}};
  EXPECT_NEAR(read_sonata_report(write({w})).step, .5, 1e-6);
}

TEST_F(Reports, ThatContradictThemselvesAreRefusedInASentence) {
  EXPECT_THAT(reading([](Written& w) { w.node_ids.reset(); }),
              HasSubstr("there is no array /report/column/mapping/node_ids"));
  EXPECT_THAT(reading([](Written& w) { w.pointers.reset(); }), HasSubstr("index_pointer"));
  EXPECT_THAT(reading([](Written& w) { w.element_ids.reset(); }), HasSubstr("element_ids"));
  EXPECT_THAT(reading([](Written& w) { w.time.reset(); }), HasSubstr("mapping/time"));
  EXPECT_THAT(reading([](Written& w) {
                w.pointers = {{0, 4, 3}};
              }),
              HasSubstr("must rise from 0 to the 5 columns"));
  EXPECT_THAT(reading([](Written& w) {
                w.pointers = {{0, 2, 99}};
              }),
              HasSubstr("must rise from 0 to the 5 columns"));
  EXPECT_THAT(reading([](Written& w) {
                w.pointers = {{0, 2, 3, 5}};
              }),
              HasSubstr("one more than the 2 nodes"));
  EXPECT_THAT(reading([](Written& w) {
                w.pointers = {{0, ~0ull, 5}};
              }),
              testing::AnyOf(HasSubstr("below zero"), HasSubstr("damaged"), HasSubstr("must rise")));
  EXPECT_THAT(reading([](Written& w) {
                w.pointers = {{0, 0, 5}};
              }),
              HasSubstr("node 7 of population column has no compartment"));
  EXPECT_THAT(reading([](Written& w) { w.element_ids->pop_back(); }),
              HasSubstr("has 4 entries, but the values have 5 columns"));
  EXPECT_THAT(reading([](Written& w) { w.element_pos->push_back(0); }),
              HasSubstr("element_pos has 6 entries"));
  EXPECT_THAT(reading([](Written& w) {
                w.node_ids = {{3, 3}};
              }),
              HasSubstr("node 3 of population column occurs twice"));
  EXPECT_THAT(reading([](Written& w) { w.columns = 0; }), HasSubstr("rows and columns"));
  EXPECT_THAT(reading([](Written& w) { w.data.resize(10); }), HasSubstr("has 2 rows"));
}

TEST_F(Reports, WithTimesThatMakeNoSenseAreRefused) {
  const float nan = std::nanf("");
  for (const std::vector<float>& time : std::vector<std::vector<float>>{
           {0, 2, 0}, {0, 2, -.5f}, {0, 20, .5f}, {nan, 2, .5f}, {0, 2, nan}, {0, INFINITY, .5f}})
    EXPECT_THAT(reading([&](Written& w) { w.time = time; }), HasSubstr("but /report/column/data has 4 rows"))
        << time[2];
  EXPECT_THAT(reading([](Written& w) { w.time = {{0, 2}}; }), HasSubstr("start, stop and step"));
  EXPECT_THAT(reading([](Written& w) { w.time_units = "furlongs"; }),
              HasSubstr("is in \"furlongs\"; give times in ms"));
}

TEST_F(Reports, CutOffAnywhereOrOfAnotherKindAreRefused) {
  const fs::path path = write({Written{}});
  const std::string whole(MappedFile(path).text());
  for (std::size_t size = 0; size < whole.size(); size += size < 600 || size + 64 > whole.size() ? 1 : 17) {
    write_file(path, std::string_view(whole).substr(0, size));
    ASSERT_THAT(complaint([&] { read_sonata_report(path); }),
                HasSubstr("is not an HDF5 file, or was cut off"))
        << size;
    ASSERT_THAT(complaint([&] { read_sonata_spikes(path); }), HasSubstr("cut off")) << size;
  }
  EXPECT_THAT(complaint([&] { read_sonata_report(root_ / "none.h5"); }), HasSubstr("cannot be opened"));
  write_file(path, whole);
  EXPECT_THAT(complaint([&] { read_sonata_spikes(path); }), HasSubstr("there is no group /spikes"));
  {
    hdf5::NewFile file(path);
    file.group("/report");
    file.close();
  }
  EXPECT_THAT(complaint([&] { read_sonata_report(path); }), HasSubstr("group /report has no population"));
}

TEST_F(Reports, OfSpikesAreReadAsTheyLie) {
  const fs::path path = root_ / "spikes.h5";
  const auto write_spikes = [&](const std::vector<float>& times, const std::vector<std::uint64_t>& nodes) {
    hdf5::NewFile file(path);
    file.write("/spikes/column/timestamps", std::span(times));
    file.write("/spikes/column/node_ids", std::span(nodes));
    file.close();
  };
  write_spikes({3, 1, 2}, {5, 6, 7});
  const auto spikes = read_sonata_spikes(path);
  ASSERT_EQ(spikes.size(), 1u);
  EXPECT_EQ(spikes[0].population, "column");
  EXPECT_THAT(spikes[0].times, ElementsAre(3., 1., 2.));
  EXPECT_THAT(spikes[0].nodes, ElementsAre(5, 6, 7));
  write_spikes({3, 1, 2}, {5, 6});
  EXPECT_THAT(complaint([&] { read_sonata_spikes(path); }), HasSubstr("has 3 entries and"));
  {
    hdf5::NewFile file(path);
    const std::vector<std::uint64_t> gids{1, 2};
    file.write("/spikes/gids", std::span(gids));
    file.close();
  }
  EXPECT_THAT(complaint([&] { read_sonata_spikes(path); }), HasSubstr("an early layout"));
}

// ── Reports of other programs ──

struct Simulated {
  const char *circuit, *report, *spikes;
  std::size_t neurons, compartments, steps;
};

TEST_F(Reports, OfOtherProgramsAreMatchedWithTheirCircuits) {
  FOREST_REAL_DATA(folder, "sonata");
  for (const Simulated& s : std::vector<Simulated>{
           {"sonata_extension/source/usecases/usecase1/circuit_sonata.json",
            "sonata_extension/source/usecases/usecase1/reporting/compartment_report.h5",
            "sonata_extension/source/usecases/usecase1/reporting/spikes.h5", 2, 3328, 10},
           {"sonata_extension/source/usecases/usecase3/circuit_sonata.json",
            "sonata_extension/source/usecases/usecase3/reporting/compartment_report.h5",
            "sonata_extension/source/usecases/usecase3/reporting/spikes.h5", 5, 5884, 10},
           {"sonata_extension/source/usecases/usecase3/circuit_sonata.json",
            "sonata_extension/source/usecases/usecase3/reporting/soma_report.h5", "", 5, 5, 10},
           {"allen_sonata_examples/9_cells", "allen_sonata_examples/9_cells/output/membrane_potential.h5",
            "allen_sonata_examples/9_cells/output/spikes.h5", 9, 9, 30000}}) {
    const SonataCircuit circuit = read_sonata(folder / s.circuit);
    const reports::Report report = read_sonata_report(folder / s.report);
    const auto spikes = *s.spikes ? read_sonata_spikes(folder / s.spikes) : std::vector<reports::Spikes>();
    const fs::path out = root_ / "x.activity";
    std::string wrong = complaint(
        [&] { reports::pack(report, circuit.circuit, circuit.morphologies, circuit.nodes, spikes, out); });
    ASSERT_EQ(wrong, "accepted") << s.report;
    const auto activity = reports::Activity::open(out);
    EXPECT_EQ(activity.rows().size(), s.neurons) << s.report;
    EXPECT_EQ(activity.width(reports::Level::compartment), s.compartments);
    EXPECT_EQ(activity.facts().steps, s.steps);
    activity.verify();
    std::vector<float> wanted(report.columns());
    std::vector<reports::Code> codes(wanted.size());
    const std::size_t last = s.steps - 1;
    report.read(last, 1, 0, wanted.size(), wanted.data());
    activity.values(reports::Level::compartment, last, 0, codes);
    const auto& range = activity.facts().range;
    for (const reports::Row& row : activity.rows()) {
      const auto layout = activity.layout(row.layout);
      for (std::size_t c = 0; c < layout.compartments.size(); ++c)
        ASSERT_NEAR(range.value(codes[row.first[0] + c]),
                    std::clamp(wanted[row.first[0] + layout.compartments[c].column], range.low, range.high),
                    .3);
    }
  }
}

TEST_F(Reports, ThatBelongToAnotherCircuitNameTheDifference) {
  FOREST_REAL_DATA(folder, "sonata");
  const SonataCircuit circuit =
      read_sonata(folder / "sonata_extension/source/usecases/usecase1/circuit_sonata.json");
  const auto says = [&](const char* report) {
    return complaint([&] {
      reports::pack(read_sonata_report(folder / report), circuit.circuit, circuit.morphologies, circuit.nodes,
                    {}, root_ / "x.activity");
    });
  };
  EXPECT_THAT(says("allen_sonata_examples/9_cells/output/membrane_potential.h5"),
              HasSubstr("population cortex is not in the circuit, which has nodeA"));
  EXPECT_FALSE(fs::exists(root_ / "x.activity"));
}

}  // namespace
}  // namespace forest::io
