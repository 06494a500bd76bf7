// SPDX-License-Identifier: Apache-2.0
#include "forest/io/elements_file.h"

#include <array>
#include <cmath>
#include <set>

#include "forest/core/file.h"
#include "forest/io/hdf5.h"

namespace forest::io {
namespace {

using cortex::Cortex;
using cortex::Line;

constexpr const char* magic = "brainforest cortex";
constexpr const char* fact_names =
    "volume of an element, volume between the surfaces, volume under the wall, w-angle median, w-angle p99, "
    "w-curves that "
    "arrive, elements mended";

void append(std::vector<double>& values, const cortex::Place& place) {
  values.insert(values.end(), {place[0], place[1], place[2]});
}

}  // namespace

void write_elements(const std::filesystem::path& path, const Cortex& cortex, double volume) {
  forest::NewFile place(path);  // first: where none can be made is told before anything is done
  hdf5::NewFile file;
  file.attribute("/", "magic", std::string(magic));
  file.attribute("/", "version", 1u);
  std::vector<double> numbers;
  numbers.reserve(cortex.elements.curves.size() * 12);
  for (const cortex::Depths& curve : cortex.elements.curves)
    for (const cortex::Place& p : curve) append(numbers, p);
  file.write("/curves/places", std::span<const double>(numbers));
  std::vector<std::uint32_t> curves;
  curves.reserve(cortex.elements.size() * 16);
  for (const auto& e : cortex.elements.elements) curves.insert(curves.end(), e.begin(), e.end());
  file.write("/elements/curves", std::span<const std::uint32_t>(curves));
  for (const auto& [name, tables] : {std::pair{"/corners/depths", &cortex.elements.depth.corners},
                                     std::pair{"/elements/depths", &cortex.elements.depth.elements}}) {
    std::vector<float> flat;
    for (const cortex::Depth::Table& table : *tables) flat.insert(flat.end(), table.begin(), table.end());
    if (!flat.empty()) file.write(name, std::span<const float>(flat));
  }
  file.write("/corners/on_valley", std::span<const std::uint8_t>(cortex.elements.on_valley));
  std::vector<double> points, strength;
  std::vector<std::uint32_t> starts;
  std::vector<std::uint8_t> kinds;
  for (const Line& line : cortex.lines) {
    starts.push_back(std::uint32_t(points.size() / 3));
    kinds.push_back(std::uint8_t(line.kind)), strength.push_back(line.strength);
    for (const cortex::Place& p : line.points) append(points, p);
  }
  file.write("/lines/points", std::span<const double>(points));
  file.write("/lines/starts", std::span<const std::uint32_t>(starts));
  file.write("/lines/kind", std::span<const std::uint8_t>(kinds));
  file.write("/lines/strength", std::span<const double>(strength));
  const std::array facts{volume,
                         cortex.between,
                         cortex.wall,
                         cortex.w_angle.median,
                         cortex.w_angle.p99,
                         cortex.w_reached,
                         double(cortex.mending.before)};
  file.write("/facts", std::span<const double>(facts));
  file.attribute("/facts", "names", std::string(fact_names));
  const std::string bytes = file.bytes();
  place.write(std::as_bytes(std::span(bytes)));
  place.commit();
}

ElementsFile read_elements(const std::filesystem::path& path) {
  const hdf5::File file(path);
  if (file.text_attribute("/", "magic") != magic)
    file.refuse("is no file of elements; make one with brainforest cortex build");
  const auto version = file.attribute("/", "version");
  if (version != std::vector<std::int64_t>{1})
    file.refuse("is of another version; build it anew with this program");
  ElementsFile result;
  Cortex& cortex = result.cortex;
  const auto places = file.doubles("/curves/places");
  if (places.size() % 12) file.refuse("/curves/places has a length that is no multiple of 12");
  for (const double x : places)
    if (!std::isfinite(x) || std::abs(x) > 1e7)
      file.refuse("/curves/places has a number that is no place in a brain");
  cortex.elements.curves.resize(places.size() / 12);
  for (std::size_t i = 0; i < places.size(); i += 3)
    cortex.elements.curves[i / 12][i % 12 / 3] = cortex::Place(places[i], places[i + 1], places[i + 2]);
  const auto curves = file.integers("/elements/curves");
  if (curves.empty() || curves.size() % 16)
    file.refuse("/elements/curves has a length that is no multiple of 16");
  cortex.elements.elements.resize(curves.size() / 16);
  for (std::size_t i = 0; i < curves.size(); ++i) {
    if (curves[i] < 0 || std::size_t(curves[i]) >= cortex.elements.curves.size())
      file.refuse("/elements/curves names a curve that is not there");
    cortex.elements.elements[i / 16][i % 16] = std::uint32_t(curves[i]);
  }
  for (const std::int64_t on : file.integers("/corners/on_valley"))
    cortex.elements.on_valley.push_back(on != 0);
  cortex.elements.corners = std::uint32_t(cortex.elements.on_valley.size());
  if (cortex.elements.corners > cortex.elements.curves.size())
    file.refuse("/corners/on_valley has more corners than curves");
  const auto tables = [&](const std::string& name, std::size_t rows) {
    std::vector<cortex::Depth::Table> read(rows);
    const auto numbers = file.reals(name);
    if (numbers.size() != rows * read.front().size()) file.refuse(name + " has not one row for each");
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      if (!(std::abs(numbers[i]) <= 1.f)) file.refuse(name + " has a number that is no depth");
      read[i / read.front().size()][i % read.front().size()] = numbers[i];
    }
    return read;
  };
  if (file.kind("/corners/depths") != hdf5::Kind::none && cortex.elements.corners > 0)
    cortex.elements.depth = {tables("/corners/depths", cortex.elements.corners),
                             tables("/elements/depths", cortex.elements.size())};
  for (const cortex::Depth::Table& table : cortex.elements.depth.corners)
    if (table.front() < 0.f || !std::ranges::is_sorted(table))
      file.refuse("/corners/depths has a table in which w falls");
  for (const auto& e : cortex.elements.elements)
    for (const std::size_t k : {0, 3, 12, 15})
      if (e[k] >= cortex.elements.corners) file.refuse("/elements/curves has a corner that is none");
  const auto points = file.doubles("/lines/points"), strength = file.doubles("/lines/strength");
  const auto starts = file.integers("/lines/starts"), kinds = file.integers("/lines/kind");
  if (points.size() % 3 || starts.size() != kinds.size() || starts.size() != strength.size())
    file.refuse("/lines has arrays of different lengths");
  using Kind = Line::Kind;
  const std::set<std::int64_t> known{int(Kind::crest), int(Kind::valley), int(Kind::sulcus)};
  for (std::size_t i = 0; i < starts.size(); ++i) {
    const std::int64_t end = i + 1 < starts.size() ? starts[i + 1] : std::int64_t(points.size() / 3);
    if (starts[i] < 0 || end < 2 || starts[i] > end - 2 || end > std::int64_t(points.size() / 3) ||
        !known.contains(kinds[i]) || !std::isfinite(strength[i]))
      file.refuse("/lines has a line that cannot be");
    Line line{.kind = Line::Kind(kinds[i]),
              .points = {},
              .triangles = {},
              .strength = strength[i],
              .closed = false};
    for (std::int64_t p = starts[i]; p < end; ++p) {
      const auto k = std::size_t(3 * p);
      line.points.emplace_back(points[k], points[k + 1], points[k + 2]);
      if (!line.points.back().allFinite()) file.refuse("/lines/points has a number that is no place");
    }
    cortex.lines.push_back(std::move(line));
  }
  const auto facts = file.doubles("/facts");
  if (facts.size() != 7) file.refuse("/facts has not 7 numbers");
  for (const double x : facts)
    if (!std::isfinite(x)) file.refuse("/facts has a number that is not finite");
  if (!(facts[6] >= 0. && facts[6] <= 4294967295.)) file.refuse("/facts has a count that is none");
  if (!(facts[0] > 0.)) file.refuse("/facts has a volume that is not positive");
  result.volume = facts[0], cortex.between = facts[1], cortex.wall = facts[2];
  cortex.w_angle = {facts[3], facts[4]}, cortex.w_reached = facts[5];
  cortex.mending.before = std::size_t(facts[6]);
  return result;
}

}  // namespace forest::io
