// SPDX-License-Identifier: Apache-2.0
#include "forest/reports/activity.h"

#include <cmath>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/core/parallel.h"
#include "forest/core/random.h"
#include "forest/reports/synthetic.h"

#include "tests/sample_forest.h"

namespace forest::reports {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

struct Made {
  circuit::Circuit circuit;
  std::vector<Morphology> neurons;
  Nodes nodes;
  Report report;
  std::vector<Spikes> spikes = {};
  PackOptions options = {};
};

Made made(std::size_t neurons = 25, std::size_t steps = 150) {
  Made m{forest::testing::sample_circuit(neurons), forest::testing::sample_neurons(), {}, {}};
  m.nodes = nodes_of(m.circuit);
  m.report =
      synthetic_report(m.circuit, m.neurons, {.compartments = 200, .steps = steps, .step = .5, .seed = 3});
  m.options.tile = 700;  // many tiles of a few neurons each
  return m;
}

std::vector<std::byte> bytes_of(const Made& m) {
  std::string name = (fs::temp_directory_path() / "forest-activity.XXXXXX").string();
  ::close(::mkstemp(name.data()));
  const std::shared_ptr<void> removed(nullptr, [&](void*) { fs::remove(name); });  // if it throws, too
  pack(m.report, m.circuit, m.neurons, m.nodes, m.spikes, name, m.options);
  const MappedFile file(name);
  return {file.bytes().begin(), file.bytes().end()};
}

Activity packed(const Made& m) { return Activity::from_bytes(bytes_of(m)); }

std::vector<Code> row_of(const Activity& a, Level level, std::size_t time_level, std::uint64_t row) {
  std::vector<Code> codes(a.width(level));
  a.values(level, time_level, row, 0, codes);
  return codes;
}

std::string complaint(const std::function<void()>& act) {
  try {
    act();
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), ::testing::Not(HasSubstr("\n")));
    return error.what();
  }
  return "accepted";
}

TEST(Activity, HoldsEveryValueWithinTheStatedError) {
  const Made m = made();
  const Activity a = packed(m);
  ASSERT_EQ(a.width(Level::compartment), m.report.columns());
  ASSERT_EQ(a.row_count(0), m.report.steps);
  EXPECT_LE(a.facts().range.error(), .3f);
  std::vector<float> wanted(m.report.columns());
  for (std::size_t step = 0; step < m.report.steps; ++step) {
    m.report.read(step, 1, 0, wanted.size(), wanted.data());
    const auto codes = row_of(a, Level::compartment, 0, step);
    for (std::size_t n = 0; n < a.rows().size(); ++n) {
      const LayoutView layout = a.layout(a.rows()[n].layout);
      for (std::size_t c = 0; c < layout.compartments.size(); ++c)
        ASSERT_NEAR(a.facts().range.value(codes[a.rows()[n].first[0] + c]),
                    wanted[m.report.first_column[n] + layout.compartments[c].column],
                    double(a.facts().range.error()) + 1e-4)
            << step << " " << n << " " << c;
    }
  }
  a.verify();
}

TEST(Activity, CoarserLevelsAreMeansWeightedByLength) {
  const Made m = made();
  const Activity a = packed(m);
  for (const std::size_t step : {0u, 63u, 64u, 149u}) {
    const auto fine = row_of(a, Level::compartment, 0, step);
    const auto sections = row_of(a, Level::section, 0, step), branches = row_of(a, Level::branch, 0, step),
               neurons = row_of(a, Level::neuron, 0, step), somata = row_of(a, Level::soma, 0, step);
    for (std::size_t n = 0; n < a.rows().size(); ++n) {
      const Row& row = a.rows()[n];
      const LayoutView layout = a.layout(row.layout);
      double all = 0., weights = 0.;
      std::size_t section = 0;
      for (std::size_t b = 0; b < layout.branches.size(); ++b) {
        double branch = 0., of_branch = 0.;
        for (; section < layout.branches[b]; ++section) {
          const auto [begin, end] = layout.compartments_of(section);
          double sum = 0., weight = 0.;
          for (std::uint32_t c = begin; c < end; ++c) {
            sum += double(layout.compartments[c].weight) * fine[row.first[0] + c];
            weight += layout.compartments[c].weight;
          }
          ASSERT_NEAR(sections[row.first[1] + section], sum / weight, .5001);
          branch += sum, of_branch += weight;
        }
        ASSERT_NEAR(branches[row.first[2] + b], branch / of_branch, .5001);
        all += branch, weights += of_branch;
      }
      ASSERT_NEAR(neurons[row.first[3]], all / weights, .5001);
      ASSERT_EQ(somata[row.first[4]], fine[row.first[0] + layout.soma]);
      ASSERT_EQ(section, layout.sections.size());
    }
  }
}

TEST(Activity, CoarserTimesKeepTheGreatest_AsDoesAnyRunOfSteps) {
  const Made m = made(9);
  const Activity a = packed(m);
  for (const Level level : {Level::compartment, Level::section, Level::branch, Level::neuron, Level::soma}) {
    std::vector<std::vector<Code>> steps;
    for (std::size_t i = 0; i < m.report.steps; ++i) steps.push_back(row_of(a, level, 0, i));
    const auto greatest = [&](std::size_t begin, std::size_t end) {
      std::vector<Code> codes = steps[begin];
      for (std::size_t i = begin + 1; i < end; ++i)
        for (std::size_t k = 0; k < codes.size(); ++k) codes[k] = std::max(codes[k], steps[i][k]);
      return codes;
    };
    for (std::size_t t = 1, factor = 4; t < time_level_count; ++t, factor *= 4) {
      ASSERT_EQ(a.row_count(t), (m.report.steps + factor - 1) / factor);
      for (std::size_t row = 0; row < a.row_count(t); ++row)
        ASSERT_EQ(row_of(a, level, t, row),
                  greatest(row * factor, std::min(m.report.steps, (row + 1) * factor)));
    }
    Random random(1);
    for (int i = 0; i < 30; ++i) {
      const std::uint32_t begin = random.below(150), end = begin + 1 + random.below(150 - begin);
      std::vector<Code> codes(a.width(level));
      a.greatest(level, begin, end, 0, codes);
      ASSERT_EQ(codes, greatest(begin, end)) << begin << " " << end;
    }
  }
}

TEST(Activity, PiecesGatheredNeuronsAndHistoriesAreThoseOfWholeRows) {
  const Made m = made();
  const Activity a = packed(m);
  Random random(2);
  std::vector<std::vector<Code>> whole;
  for (const Level level : {Level::compartment, Level::section, Level::branch, Level::neuron, Level::soma}) {
    whole.push_back(row_of(a, level, 0, 77));
    for (int i = 0; i < 50; ++i) {
      const auto first = random.below(std::uint32_t(whole.back().size()));
      std::vector<Code> piece(random.below(std::uint32_t(whole.back().size()) - first + 1));
      a.values(level, 77, first, piece);
      ASSERT_TRUE(std::equal(piece.begin(), piece.end(), whole.back().begin() + first));
    }
    const auto value = random.below(std::uint32_t(whole.back().size()));
    const auto history = a.history(level, value);
    ASSERT_EQ(history.size(), m.report.steps);
    for (std::size_t step = 0; step < history.size(); ++step)
      ASSERT_EQ(history[step], row_of(a, level, 0, step)[value]);
  }
  std::vector<Wanted> wanted;
  std::vector<Code> expected;
  for (int i = 0; i < 60; ++i) {  // in any order, some twice
    wanted.push_back({random.below(25), Level(random.below(5))});
    const Row& row = a.rows()[wanted.back().row];
    const auto l = std::size_t(wanted.back().level);
    const auto begin = whole[l].begin() + std::ptrdiff_t(row.first[l]);
    expected.insert(expected.end(), begin,
                    begin + std::ptrdiff_t(a.count(wanted.back().row, wanted.back().level)));
  }
  std::vector<Code> gathered(expected.size());
  a.gather(wanted, 0, 77, gathered);
  EXPECT_EQ(gathered, expected);
  a.gather({}, 0, 77, {});
  gathered.pop_back();
  EXPECT_THROW(a.gather(wanted, 0, 77, gathered), Error);
  EXPECT_THROW(a.gather(std::vector<Wanted>{{25, Level::soma}}, 0, 0, std::span(gathered).first(1)), Error);
  EXPECT_THROW(a.values(Level::soma, 150, 0, gathered), Error);
  EXPECT_THROW(a.history(a.width(Level::compartment)), Error);
}

TEST(Activity, TouchesOnlyTheTilesThatAreLookedAt) {
  const Made m = made();
  const Activity a = packed(m);
  EXPECT_EQ(a.touched(), 0u);
  std::vector<Code> one(a.count(0, Level::compartment));
  a.values(Level::compartment, 3, 0, one);
  EXPECT_GT(a.touched(), 0u);
  EXPECT_LT(a.touched(), 2 * m.options.tile);
}

TEST(Activity, RasterIsTheSomataTurned_AndItsPictureLosesNoSpike) {
  const Made m = made();
  const Activity a = packed(m);
  const auto raster = a.raster();
  for (std::size_t step = 0; step < m.report.steps; ++step) {
    const auto somata = row_of(a, Level::soma, 0, step);
    for (std::size_t n = 0; n < somata.size(); ++n) ASSERT_EQ(raster[n * m.report.steps + step], somata[n]);
  }
  EXPECT_EQ(a.raster_picture(0, 150, 150, 25), raster);
  const auto small = a.raster_picture(0, 150, 10, 5);
  for (std::size_t y = 0; y < 5; ++y)
    for (std::size_t x = 0; x < 10; ++x) {
      Code most = 0;
      for (std::size_t n = y * 5; n < y * 5 + 5; ++n)
        for (std::size_t s = x * 15; s < x * 15 + 15; ++s) most = std::max(most, raster[n * 150 + s]);
      ASSERT_EQ(small[y * 10 + x], most);
    }
  const auto large = a.raster_picture(10, 20, 100, 250);
  EXPECT_EQ(large[0], raster[10]);
  EXPECT_EQ(large.back(), raster[24 * 150 + 19]);
}

TEST(Activity, IsTheSameAtAnyNumberOfThreads_AndItsValuesAtAnySizeOfTile) {
  Made m = made();
  const auto bytes = bytes_of(m);
  {
    const ThreadLimit one(1);
    EXPECT_EQ(bytes_of(m), bytes);
  }
  const Activity small = Activity::from_bytes(bytes);
  for (const std::uint32_t tile : {1u, 100000u}) {
    m.options.tile = tile;
    const Activity other = packed(m);
    for (const Level level : {Level::compartment, Level::branch, Level::soma})
      EXPECT_EQ(row_of(other, level, 0, 100), row_of(small, level, 0, 100)) << tile;
  }
}

TEST(Activity, TellsWhatIsNoNumberAndWhatLiesBeyondTheRange) {
  Made m = made(4, 70);
  m.report.read = [](std::size_t row, std::size_t rows, std::size_t column, std::size_t columns, float* out) {
    for (std::size_t r = row; r < row + rows; ++r)
      for (std::size_t c = column; c < column + columns; ++c)
        *out++ = r == 5 || c == 0 ? std::nanf("") : r == 6 ? 1e30f : r == 7 ? -INFINITY : -60.f;
  };
  const Activity a = packed(m);
  const std::uint64_t width = m.report.columns();
  EXPECT_EQ(a.facts().not_numbers, width + 69);
  EXPECT_EQ(a.facts().clamped, 2 * (width - 1));
  const auto nothing = row_of(a, Level::neuron, 0, 5), top = row_of(a, Level::section, 0, 6);
  EXPECT_THAT(nothing, ::testing::Each(no_value));
  EXPECT_EQ(top.back(), 254);
  EXPECT_EQ(row_of(a, Level::compartment, 0, 8)[0], no_value);
  EXPECT_NEAR(a.facts().range.value(row_of(a, Level::neuron, 0, 8)[0]), -60., .3);  // of those that have one
  EXPECT_EQ(row_of(a, Level::compartment, 1, 1)[1], 254);  // steps 4 to 7: no value gives way
}

TEST(Activity, OfSomaReportsHasOneValueANeuronAtEveryLevel) {
  Made m = made(6, 10);
  m.report.first_column.clear();
  for (std::uint64_t i = 0; i <= 6; ++i) m.report.first_column.push_back(i);
  m.report.element_ids.assign(6, 0);
  m.report.element_positions.clear();
  m.report.read = [](std::size_t row, std::size_t rows, std::size_t column, std::size_t columns, float* out) {
    for (std::size_t r = row; r < row + rows; ++r)
      for (std::size_t c = column; c < column + columns; ++c) *out++ = -float(10 * c) - float(r);
  };
  const Activity a = packed(m);
  for (const Level level : {Level::compartment, Level::section, Level::branch, Level::neuron, Level::soma}) {
    ASSERT_EQ(a.width(level), 6u);
    EXPECT_NEAR(a.facts().range.value(row_of(a, level, 0, 3)[4]), -43., .3);
  }
  const LayoutView layout = a.layout(0);
  EXPECT_EQ(layout.at(soma_run, .9f), 0u);
  EXPECT_EQ(layout.at_element(0, .9f), 0u);
  EXPECT_FALSE(layout.at(0, .5f));
}

TEST(Activity, KnowsThePartOfACircuitThatWasReported_InTheReportsOrder) {
  Made m = made(10, 10);
  std::swap(m.report.nodes[0],
            m.report.nodes[9]);  // of the same morphology or not: columns follow their node
  const auto morphology = [&](std::size_t i) { return m.circuit.instances[i].morphology; };
  if (morphology(0) != morphology(9)) m.circuit.instances[9].morphology = morphology(0);
  m = {m.circuit, m.neurons, m.nodes,
       synthetic_report(m.circuit, m.neurons, {.compartments = 50, .steps = 10})};
  std::swap(m.report.nodes[0], m.report.nodes[9]);
  m.report.nodes.resize(6), m.report.first_column.resize(7);
  m.report.element_ids.resize(m.report.first_column[6]),
      m.report.element_positions.resize(m.report.first_column[6]);
  const Activity a = packed(m);
  EXPECT_EQ(a.rows().size(), 6u);
  EXPECT_EQ(a.rows()[0].instance, 9u);
  EXPECT_EQ(a.row_of_instance(9), 0u);
  EXPECT_EQ(a.row_of_instance(3), 3u);
  EXPECT_FALSE(a.row_of_instance(0));
  EXPECT_FALSE(a.row_of_instance(7));
  EXPECT_FALSE(a.row_of_instance(1000000));
}

TEST(Activity, TellsTheCompartmentOfEveryPlace) {
  const Made m = made(3, 10);
  const Activity a = packed(m);
  Random random(5);
  for (const Row& row : a.rows()) {
    const LayoutView layout = a.layout(row.layout);
    const Morphology& neuron = m.neurons[layout.morphology];
    std::vector<std::uint32_t> parents;
    for (const Section& section : neuron.sections())
      parents.push_back(section.parent.valid() ? section.parent.value() : soma_run);
    std::vector<Place> places{{soma_run, .5f}};
    for (int i = 0; i < 200; ++i)
      places.push_back({random.below(std::uint32_t(parents.size())), float(random.uniform(-.1, 1.1))});
    const auto found = compartments_at(layout, parents, places);
    ASSERT_EQ(found[0], layout.soma);
    for (std::size_t i = 1; i < places.size(); ++i) {
      const auto expected = layout.at(places[i].section, places[i].position);
      ASSERT_FLOAT_EQ(std::abs(layout.compartments[found[i]].position - places[i].position),
                      std::abs(layout.compartments[*expected].position - places[i].position));
      const std::uint32_t run = layout.runs(parents.size())[places[i].section];
      ASSERT_EQ(layout.sections[run].section, places[i].section);
      const std::uint32_t branch = layout.branch_of(run);
      ASSERT_LT(run, layout.branches[branch]);
      ASSERT_TRUE(branch == 0 || run >= layout.branches[branch - 1]);
    }
  }
  // Sections 0 ← 1 ← 2, and 3; only the soma and section 0 were reported.
  const std::vector<Compartment> compartments{{0, .5f, 1}, {1, .25f, 1}, {2, .75f, 1}};
  const std::vector<SectionRun> sections{{soma_run, 0, 1}, {0, 1, 3}};
  const std::vector<std::uint32_t> branches{1, 2}, parents{soma_run, 0, 1, soma_run};
  const LayoutView layout{0, 0, compartments, sections, branches};
  EXPECT_THAT(
      compartments_at(layout, parents,
                      std::vector<Place>{{0, 0.f}, {0, .6f}, {1, 0.f}, {2, .5f}, {3, .5f}, {99, 0.f}}),
      ::testing::ElementsAre(1, 2, 2, 2, 0, 0));
}

TEST(Activity, HasSpikesSortedByTime) {
  Made m = made(5, 10);
  m.nodes.ends = {8};  // nodes 5 to 7 have no shape
  m.spikes = {{"spikes.h5", m.circuit.name, {3., 1., 2., 1., 9., 9.}, {4, 3, 0, 1, 6, 2}}};
  const Activity a = packed(m);
  EXPECT_THAT(a.spikes(),
              ::testing::ElementsAre(Spike{1., 1}, Spike{1., 3}, Spike{2., 0}, Spike{3., 4}, Spike{9., 2}));
  EXPECT_THAT(a.spikes(1., 3.), ::testing::ElementsAre(Spike{1., 1}, Spike{1., 3}, Spike{2., 0}));
  EXPECT_TRUE(a.spikes(3.5, 9.).empty());
  EXPECT_TRUE(a.spikes(9., 1.).empty());
  EXPECT_EQ(a.facts().spikes_left_out, 1u);
  m.spikes.push_back({"spikes.h5", "inputs", {5., 6.}, {0, 77}});
  EXPECT_THAT(complaint([&] { packed(m); }), HasSubstr("population inputs is not in the circuit"));
  m.nodes.shapeless = {"inputs"};
  EXPECT_EQ(packed(m).facts().spikes_left_out, 3u);
  m.spikes.pop_back();
  m.spikes[0].nodes[0] = 8;
  EXPECT_THAT(complaint([&] { packed(m); }),
              HasSubstr("spikes.h5: node 8 of population column spikes and is not in"));
  m.spikes[0].nodes[0] = 0, m.spikes[0].times[2] = std::nan("");
  EXPECT_THAT(complaint([&] { packed(m); }),
              HasSubstr("the time of spike 2 of population column is no number"));
}

TEST(Activity, IsRefusedWhereverItIsCutOff) {
  Made m = made(2, 5);
  m.report = synthetic_report(m.circuit, m.neurons, {.compartments = 1, .steps = 5});
  m.spikes = {{"spikes.h5", m.circuit.name, {3., 1.}, {0, 1}}};
  const auto bytes = bytes_of(m);
  const std::size_t stride = std::max<std::size_t>(1, bytes.size() / 3000);
  for (std::size_t size = 0; size < bytes.size();
       size += size < 100 || size + 500 > bytes.size() ? 1 : stride)
    ASSERT_THAT(complaint([&] {
                  Activity::from_bytes({bytes.begin(), bytes.begin() + std::ptrdiff_t(size)});
                }),
                ::testing::AnyOf(HasSubstr("pack the report again"), HasSubstr("too short")))
        << size;
  auto longer = bytes;
  longer.push_back({});
  EXPECT_THAT(complaint([&] { Activity::from_bytes(longer); }), HasSubstr("cut short or has grown"));
}

TEST(Activity, IsRefusedWhereverAByteIsWrong_AtTheLatestWhenItIsLookedAt) {
  Made m = made(2, 5);
  m.report = synthetic_report(m.circuit, m.neurons, {.compartments = 1, .steps = 5});
  m.spikes = {{"spikes.h5", m.circuit.name, {3., 1.}, {0, 1}}};
  auto bytes = bytes_of(m);
  const std::size_t stride = std::max<std::size_t>(1, bytes.size() / 3000);
  Random random(4);
  for (std::size_t at = 0; at < bytes.size(); at += at < 300 || at + 500 > bytes.size() ? 1 : stride) {
    const std::byte old = bytes[at];
    bytes[at] ^= std::byte(1u << random.below(8));
    ASSERT_NE(complaint([&] { Activity::from_bytes(bytes).verify(); }), "accepted") << at;
    bytes[at] = old;
  }
  EXPECT_EQ(complaint([&] { Activity::from_bytes(bytes).verify(); }), "accepted");
}

TEST(Activity, OfAnotherVersionOrKindSaysSo) {
  auto bytes = bytes_of(made(2, 5));
  bytes[8] = std::byte{9};
  EXPECT_THAT(complaint([&] { Activity::from_bytes(bytes, "x.activity"); }),
              HasSubstr("x.activity: has version 9 of the activity file and this program reads version 1"));
  bytes[0] = std::byte{'X'};
  EXPECT_THAT(complaint([&] { Activity::from_bytes(bytes); }), HasSubstr("is not an activity file"));
  EXPECT_THAT(complaint([&] { Activity::open("/nonexistent/x.activity"); }), HasSubstr("cannot be opened"));
}

TEST(Activity, NamesWhatDoesNotFitTheCircuit) {
  const auto says = [](const std::function<void(Made&)>& change) {
    Made m = made(5, 10);
    m.report.source = "report.h5";
    change(m);
    return complaint([&] { packed(m); });
  };
  EXPECT_THAT(says([](Made& m) { m.report.populations = {"other"}; }),
              HasSubstr("report.h5: population other is not in the circuit, which has column"));
  EXPECT_THAT(
      says([](Made& m) { m.report.nodes[2].id = 77; }),
      HasSubstr(
          "node 77 of population column is not in the circuit, where 5 neurons of it have a shape, the last "
          "of them node 4"));
  EXPECT_THAT(says([](Made& m) { m.report.nodes[2].id = 1; }),
              HasSubstr("node 1 of population column occurs twice"));
  EXPECT_THAT(says([](Made& m) { m.report.element_ids[7] = 999; }),
              HasSubstr("has a compartment in section 999, but its morphology"));
  EXPECT_THAT(says([](Made& m) { m.report.element_positions[7] = 1.5f; }),
              HasSubstr("has a compartment at 1.5 of section"));
  EXPECT_THAT(says([](Made& m) { m.report.element_positions[7] = std::nanf(""); }),
              HasSubstr("positions are from 0 to 1"));
  EXPECT_THAT(says([](Made& m) { m.report.first_column[1] = 0; }),
              HasSubstr("node 0 of population column has no compartment"));
  EXPECT_THAT(says([](Made& m) { m.report.first_column.pop_back(); }), HasSubstr("its mapping does not fit"));
  EXPECT_THAT(says([](Made& m) { m.report.steps = 0; }), HasSubstr("holds no step"));
  EXPECT_THAT(says([](Made& m) { m.report.step = std::nan(""); }), HasSubstr("time must go on"));
  EXPECT_THAT(says([](Made& m) { m.options.range = {50.f, -100.f}; }), HasSubstr("give its lower end first"));
  EXPECT_THAT(says([](Made& m) { m.options.range.high = INFINITY; }), HasSubstr("holds no value"));
}

TEST(Activity, OfAReportThatFailsHalfWayLeavesNoFile) {
  Made m = made(5, 200);
  m.report.read = [](std::size_t row, auto...) {
    if (row >= 64) throw InputError("report.h5", 0, "is damaged");
  };
  const fs::path folder = fs::temp_directory_path() / "forest-activity-none";
  fs::remove_all(folder);
  fs::create_directory(folder);
  EXPECT_THROW(pack(m.report, m.circuit, m.neurons, m.nodes, {}, folder / "x.activity"), InputError);
  EXPECT_TRUE(fs::is_empty(folder));
  fs::remove_all(folder);
}

}  // namespace
}  // namespace forest::reports
