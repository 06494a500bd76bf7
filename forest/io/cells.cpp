// SPDX-License-Identifier: Apache-2.0
#include "forest/io/cells.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>
#include <optional>
#include <type_traits>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/hash.h"
#include "forest/io/cells_layout.h"
#include "forest/morphology/measure.h"
#include "forest/morphology/packing.h"

namespace forest::io {
namespace {

using namespace cells_layout;
static_assert(std::endian::native == std::endian::little, "a file of cells is little-endian");
static_assert(std::is_trivially_copyable_v<Point> && sizeof(Point) == 16);

std::span<const std::byte> bytes_of(std::string_view text) { return std::as_bytes(std::span(text)); }

/// The checksum of a structure before its member `hash`, then of the bytes that belong to it.
template <class T>
std::uint64_t seal(const T& head, std::string_view body) {
  return hash64(bytes_of(body), hash64(std::as_bytes(std::span(&head, 1)).first(offsetof(T, hash))));
}

std::uint64_t zigzag(std::int64_t value) { return (std::uint64_t(value) << 1) ^ std::uint64_t(value >> 63); }

/// Puts numbers and texts behind one another.
class Pen {
 public:
  std::string bytes;

  void number(
      std::uint64_t value) {  // seven bits a byte, the lowest first, the eighth bit set on all but the last
    for (; value > 127; value >>= 7) bytes += char(value | 128);
    bytes += char(value);
  }
  void signed_number(std::int64_t value) { number(zigzag(value)); }
  template <class T>
  void raw(const T& value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  void text(std::string_view text) {
    number(text.size());
    bytes += text;
  }
  void points(std::span<const Point> points) {
    bytes.append(reinterpret_cast<const char*>(points.data()), points.size_bytes());
  }
};

/// Reads what a Pen wrote; throws Error at the end of the bytes.
class Eye {
 public:
  explicit Eye(std::string_view bytes) : left_(bytes) {}

  std::uint64_t number() {
    std::uint64_t value = 0;
    for (int shift = 0; shift <= 63; shift += 7) {
      const auto byte = static_cast<unsigned char>(take(1)[0]);
      value |= std::uint64_t(byte & 127) << shift;
      if (byte < 128) return value;
    }
    throw damaged();
  }
  std::int64_t signed_number() {
    const std::uint64_t value = number();
    return std::int64_t(value >> 1) ^ -std::int64_t(value & 1);
  }
  std::int32_t small() {
    const std::int64_t value = signed_number();
    if (value != std::int32_t(value)) throw damaged();
    return std::int32_t(value);
  }
  /// How many of something follow, of which each takes so many bytes at least.
  std::size_t count(std::size_t bytes_each) {
    const std::uint64_t count = number();
    if (count > left_.size() / bytes_each) throw damaged();
    return std::size_t(count);
  }
  template <class T>
  T raw() {
    T value;
    std::memcpy(&value, take(sizeof value).data(), sizeof value);
    return value;
  }
  std::string_view text() { return take(count(1)); }
  std::vector<Point> points(std::size_t count) {
    if (count > left_.size() / sizeof(Point)) throw damaged();
    std::vector<Point> points(count);
    if (count) std::memcpy(points.data(), take(count * sizeof(Point)).data(), count * sizeof(Point));
    return points;
  }
  std::string_view take(std::size_t size) {
    if (size > left_.size()) throw damaged();
    const std::string_view taken = left_.substr(0, size);
    left_.remove_prefix(size);
    return taken;
  }
  bool at_end() const { return left_.empty(); }
  static Error damaged() { return Error("its numbers do not fit one another"); }

 private:
  std::string_view left_;
};

/// How the points of a neuron are divided into sections.
struct Divided {
  std::vector<std::int32_t> parents, counts;
  explicit Divided(std::span<const Section> sections) {
    for (const Section& s : sections) {
      parents.push_back(s.parent.valid() ? std::int32_t(s.parent.value()) : -1);
      counts.push_back(std::int32_t(s.point_count));
    }
  }
  PointRuns runs() const { return {parents, counts}; }
};

void put(Pen& pen, const Soma& soma) {
  pen.raw(soma.kind);
  pen.number(soma.points.size());
  pen.points(soma.points);
  pen.number(soma.parents.size());
  for (const std::int32_t parent : soma.parents) pen.signed_number(parent);
  pen.number(soma.contour_starts.size());
  for (const std::uint32_t start : soma.contour_starts) pen.number(start);
}

Soma soma_of(Eye& eye) {
  Soma soma;
  soma.kind = eye.raw<SomaKind>();
  if (soma.kind > SomaKind::contours) throw Eye::damaged();
  soma.points = eye.points(eye.count(sizeof(Point)));
  soma.parents.resize(eye.count(1));
  for (std::int32_t& parent : soma.parents) parent = eye.small();
  soma.contour_starts.resize(eye.count(1));
  for (std::uint32_t& start : soma.contour_starts) start = std::uint32_t(eye.number());
  const bool outlines = soma.kind == SomaKind::contours;
  if ((!outlines && !soma.contour_starts.empty()) ||
      (!soma.parents.empty() && soma.parents.size() != soma.points.size()))
    throw Eye::damaged();
  return soma;
}

void put(Pen& pen, std::span<const Section> sections) {
  pen.number(sections.size());
  for (std::size_t i = 0; i < sections.size(); ++i) {
    const Section& s = sections[i];
    pen.number(s.parent.valid() ? i - s.parent.value() : 0);  // a parent is never far
    pen.number(s.point_count);
    pen.raw(s.kind);
    pen.signed_number(s.tag);
    pen.signed_number(s.soma_point);
  }
}

bool is_kind(SectionKind kind) {
  return kind <= SectionKind::glia && kind != SectionKind(1);  // 1 is SWC's soma
}

std::vector<Section> sections_of(Eye& eye, std::size_t soma_points) {
  std::vector<Section> sections(eye.count(5));
  std::uint64_t first = 0;
  for (std::size_t i = 0; i < sections.size(); ++i) {
    Section& s = sections[i];
    const std::uint64_t back = eye.number(), points = eye.number();
    if (back > i || points > std::numeric_limits<std::int32_t>::max() ||
        first + points > std::numeric_limits<std::uint32_t>::max())
      throw Eye::damaged();
    if (back) s.parent = SectionId(i - std::size_t(back));
    s.first_point = std::uint32_t(first), s.point_count = std::uint32_t(points);
    s.kind = eye.raw<SectionKind>();
    s.tag = eye.small(), s.soma_point = eye.small();
    if (!is_kind(s.kind) || s.soma_point < -1 || s.soma_point >= std::int64_t(soma_points))
      throw Eye::damaged();
    first += points;
  }
  return sections;
}

void put(Pen& pen, const Spine& spine) {
  pen.number(spine.section.value());
  for (const float value : {spine.position, spine.head.x(), spine.head.y(), spine.head.z(),
                            spine.head_diameter, spine.neck_diameter})
    pen.raw(value);
  pen.raw(spine.shape);
}

Spine spine_of(Eye& eye, std::size_t sections) {
  const std::uint64_t section = eye.number();
  if (section >= sections) throw Eye::damaged();
  std::array<float, 6> values;
  for (float& value : values)
    if (value = eye.raw<float>(); !std::isfinite(value)) throw Eye::damaged();
  const auto shape = eye.raw<SpineShape>();
  if (shape > SpineShape::branched) throw Eye::damaged();
  return {.section = SectionId(std::size_t(section)),
          .position = values[0],
          .head = {values[1], values[2], values[3]},
          .head_diameter = values[4],
          .neck_diameter = values[5],
          .shape = shape};
}

void put(Pen& pen, const Annotations& annotations) {
  pen.number(annotations.size());
  for (const auto& [key, value] : annotations) pen.text(key), pen.text(value);
}

Annotations annotations_of(Eye& eye) {
  Annotations annotations(eye.count(2));
  for (auto& [key, value] : annotations) key = eye.text(), value = eye.text();
  return annotations;
}

void put(Pen& pen, const NamedMorphology& cell) {
  const Morphology& m = cell.morphology;
  pen.text(cell.name);
  put(pen, m.soma());
  put(pen, m.sections());
  const std::string packed = pack_points(m.points(), Divided(m.sections()).runs());
  pen.text(packed);
  if (packed.empty()) pen.points(m.points());
  pen.number(m.spines().size());
  for (const Spine& s : m.spines()) put(pen, s);
  put(pen, m.annotations());
}

NamedMorphology cell_of(std::string_view bytes) {
  Eye eye(bytes);
  NamedMorphology cell;
  MorphologyBuilder builder;
  cell.name = eye.text();
  Soma own = soma_of(eye);
  const std::size_t soma_points = own.points.size();
  builder.set_soma(std::move(own));
  std::vector<Section> branches = sections_of(eye, soma_points);
  const std::size_t count = branches.size();
  const std::size_t count_of_points =
      branches.empty() ? 0 : branches.back().first_point + branches.back().point_count;
  const std::string_view packed = eye.text();
  std::vector<Point> points =
      packed.empty() ? eye.points(count_of_points) : unpack_points(packed, Divided(branches).runs());
  builder.add_sections(std::move(points), std::move(branches));
  for (std::size_t left = eye.count(26); left > 0; --left) builder.add_spine(spine_of(eye, count));
  for (auto& [key, value] : annotations_of(eye)) builder.annotate(std::move(key), std::move(value));
  if (!eye.at_end()) throw Eye::damaged();
  cell.morphology = builder.build();
  return cell;
}

template <class T>
T structure_at(std::string_view bytes, std::uint64_t at) {
  T value;
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

std::string bytes_of(const CellsHead& head) {
  Pen about;
  put(about, head.about);
  Head start{magic, version, cells_per_block, head.cells, about.bytes.size(), 0};
  start.hash = seal(start, about.bytes);
  Pen pen;
  pen.raw(start);
  return std::move(pen.bytes) + about.bytes;
}

/// The head that bytes begin with, and how many they are; none when they do not, or not whole.
std::optional<std::pair<CellsHead, std::size_t>> head_of(std::string_view bytes) {
  if (bytes.size() < sizeof(Head)) return {};
  const Head start = structure_at<Head>(bytes, 0);
  if (start.magic != magic || start.version != version || start.per_block != cells_per_block ||
      start.about_size > bytes.size() - sizeof(Head))
    return {};
  const std::string_view about = bytes.substr(sizeof(Head), start.about_size);
  if (start.hash != seal(start, about)) return {};
  try {
    Eye eye(about);
    return std::pair(CellsHead{start.cells, annotations_of(eye)}, sizeof(Head) + about.size());
  } catch (const Error&) {
    return {};
  }
}

std::size_t cells_in(std::uint64_t cells, std::size_t block) {
  return std::size_t(std::min<std::uint64_t>(cells_per_block, cells - block * cells_per_block));
}

/// How long the block is that bytes begin with; 0 when it is not whole, or another than this one.
std::size_t block_at(std::string_view bytes, std::uint64_t cells, std::size_t number) {
  if (bytes.size() < sizeof(Block)) return 0;
  const Block head = structure_at<Block>(bytes, 0);
  if (head.mark != block_mark || head.cells != cells_in(cells, number) ||
      head.first != number * cells_per_block || head.size > bytes.size() - sizeof(Block) ||
      head.hash != seal(head, bytes.substr(sizeof(Block), head.size)))
    return 0;
  return sizeof(Block) + std::size_t(head.size);
}

void add(CellsTotal& total, const Block& block) {
  total.segments += block.segments, total.length += block.length;
}

std::string end_of(const std::vector<std::uint64_t>& begins, std::uint64_t end, const CellsTotal& total) {
  const std::string_view index(reinterpret_cast<const char*>(begins.data()),
                               begins.size() * sizeof(std::uint64_t));
  Foot foot{end, begins.size(), total.segments, total.length, 0, magic};
  foot.hash = seal(foot, index);
  Pen pen;
  pen.bytes = index;
  pen.raw(foot);
  return std::move(pen.bytes);
}

constexpr std::string_view not_whole =
    "is not whole: it was cut off, or is still being written; copy it again, or delete it and start the "
    "command again that grows it, which goes on where it stopped";

/// What is different in another head: "its seed is 3, not 4".
std::string difference(const CellsHead& there, const CellsHead& wanted) {
  if (there.cells != wanted.cells)
    return fmt::format("it is to hold {} cells, not {}", there.cells, wanted.cells);
  for (const auto& [key, value] : wanted.about) {
    const auto found = std::ranges::find(there.about, key, &Annotations::value_type::first);
    if (found == there.about.end()) return fmt::format("it does not say its {}", key);
    if (found->second != value) return fmt::format("its {} is {}, not {}", key, found->second, value);
  }
  return "it says more of its cells";
}

}  // namespace

std::string pack_block(std::uint64_t first, std::span<const NamedMorphology> cells) {
  Block head{block_mark, std::uint32_t(cells.size()), first, 0, 0, 0., 0};
  Pen pen;
  pen.bytes.resize(sizeof(Block) + cells.size() * sizeof(std::uint32_t));
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const std::size_t begin = pen.bytes.size();
    put(pen, cells[i]);
    const std::size_t size = pen.bytes.size() - begin;
    if (size > std::numeric_limits<std::uint32_t>::max())
      throw LimitError(
          fmt::format("cell {} takes more than 4 GiB and cannot be held by a file of cells", first + i));
    const auto small = std::uint32_t(size);
    std::memcpy(pen.bytes.data() + sizeof(Block) + i * sizeof small, &small, sizeof small);
    head.segments += cells[i].morphology.segment_count();
    head.length += total_length(cells[i].morphology);
  }
  head.size = pen.bytes.size() - sizeof(Block);
  head.hash = seal(head, std::string_view(pen.bytes).substr(sizeof(Block)));
  std::memcpy(pen.bytes.data(), &head, sizeof head);
  return std::move(pen.bytes);
}

CellsFile::CellsFile(std::string_view bytes, const std::string& name) : bytes_(bytes), name_(name) {
  if (!recognises_cells(bytes)) refuse("is no file of cells; name another");
  if (bytes.size() >= sizeof(Head) && structure_at<Head>(bytes, 0).version != version)
    refuse("is of a version that this program does not know; use the program that wrote it");
  const auto head = head_of(bytes);
  if (!head)
    refuse(bytes.size() < sizeof(Head) + sizeof(Foot) ? std::string(not_whole)
                                                      : "is damaged at its beginning; copy it again");
  head_ = head->first;
  const std::size_t begin = head->second;
  if (bytes.size() - begin < sizeof(Foot)) refuse(std::string(not_whole));
  const std::uint64_t end = bytes.size() - sizeof(Foot);
  const Foot foot = structure_at<Foot>(bytes, end);
  if (foot.magic != magic) refuse(std::string(not_whole));
  if (foot.index < begin || foot.index > end || foot.blocks != (end - foot.index) / sizeof(std::uint64_t) ||
      (end - foot.index) % sizeof(std::uint64_t) || foot.blocks != head_.blocks() ||
      foot.hash != seal(foot, bytes.substr(foot.index, end - foot.index)))
    refuse("is damaged at its end; copy it again");
  total_ = {foot.segments, foot.length};
  begins_.resize(std::size_t(foot.blocks) + 1);
  std::memcpy(begins_.data(), bytes.data() + foot.index, std::size_t(end - foot.index));
  begins_.back() = foot.index;
  if (begins_.front() != begin || !std::ranges::is_sorted(begins_))
    refuse("is damaged at its end; copy it again");
  looked_at_ = std::make_unique<std::atomic<bool>[]>(begins_.size());
}

std::string_view CellsFile::block(std::size_t number) const {
  const std::string_view block = bytes_.substr(begins_[number], begins_[number + 1] - begins_[number]);
  if (!looked_at_[number]) {
    if (block.empty() || block_at(block, head_.cells, number) != block.size())
      refuse(fmt::format("is damaged between bytes {} and {}, where cells {} to {} are; copy it again",
                         begins_[number], begins_[number + 1], number * cells_per_block,
                         number * cells_per_block + cells_in(head_.cells, number) - 1));
    looked_at_[number] = true;
  }
  return block;
}

/// What `read` makes of the bytes of a cell.
template <class Read>
auto CellsFile::at(std::size_t number, const Read& read) const {
  const std::size_t in_block = number / cells_per_block, place = number % cells_per_block;
  try {
    Eye eye(block(in_block).substr(sizeof(Block)));
    std::uint64_t before = 0;
    for (std::size_t i = 0; i < place; ++i) before += eye.raw<std::uint32_t>();
    const auto size = eye.raw<std::uint32_t>();
    eye.take((cells_in(head_.cells, in_block) - place - 1) * sizeof(std::uint32_t));
    eye.take(std::size_t(before));
    return read(eye.take(size));
  } catch (const InputError&) {
    throw;
  } catch (const Error& error) {
    refuse(fmt::format("cell {} is damaged: {}; make the file anew", number, error.what()));
  }
}

Cell CellsFile::read(std::size_t number) const {
  return at(number, [](std::string_view bytes) {
    NamedMorphology read = cell_of(bytes);
    return Cell{std::move(read.name), {std::move(read.morphology), {}}};
  });
}

std::string CellsFile::name(std::size_t number) const {
  return at(number, [](std::string_view bytes) { return std::string(Eye(bytes).text()); });
}

void CellsFile::refuse(const std::string& sentence) const { throw InputError(name_, 0, sentence); }

CellsWriter::CellsWriter(const std::filesystem::path& place, const CellsHead& head, bool replace,
                         Progress& progress)
    : head_bytes_(bytes_of(head)), all_(head.blocks()), part_(place) {
  const std::optional<MappedFile> there =
      part_.size() ? std::optional<MappedFile>(part_.path()) : std::nullopt;
  const std::string_view bytes = there ? there->text() : std::string_view();
  const bool begun = bytes.starts_with(head_bytes_);
  if (!begun && !head_bytes_.starts_with(bytes) && !replace) {
    const auto other = head_of(bytes);
    throw Error(fmt::format(
        "{}: {}; end it by the command that began it, choose another place, or begin anew with --force",
        part_.path().string(),
        other ? "is the beginning of another file: " + difference(other->first, head)
              : "lies where the new file is to grow and holds something else"));
  }
  if (!begun) {
    restart();
    return;
  }
  end_ = head_bytes_.size();
  progress.begin("checking what is there", bytes.size());
  while (begins_.size() < all_) {
    const std::string_view rest = bytes.substr(std::size_t(end_));
    const std::size_t size = block_at(rest, head.cells, begins_.size());
    if (!size) break;
    io::add(total_, structure_at<Block>(rest, 0));
    begins_.push_back(end_);
    end_ += size;
    progress.advance(size);
  }
  progress.end();
  part_.cut(end_);
}

void CellsWriter::restart() {
  part_.cut(0);
  begins_.clear(), total_ = {}, end_ = 0;
  append(head_bytes_);
}

std::string CellsWriter::last_block() const {
  return begins_.empty() ? std::string()
                         : std::string(MappedFile(part_.path()).text().substr(std::size_t(begins_.back())));
}

void CellsWriter::add(std::string_view block) {
  begins_.push_back(end_);
  io::add(total_, structure_at<Block>(block, 0));
  append(block);
}

void CellsWriter::finish() {
  append(end_of(begins_, end_, total_));
  part_.commit();
}

void CellsWriter::append(std::string_view bytes) {
  part_.write(bytes_of(bytes));
  end_ += bytes.size();
}

bool recognises_cells(std::string_view bytes) {
  return bytes.starts_with(std::string_view(magic.data(), magic.size()));
}

CellReader read_each_cells(std::string_view bytes, const std::string& name) {
  const auto file = std::make_shared<CellsFile>(bytes, name);
  if (file->size() == 0) throw InputError(name, 0, "holds no cell; name another file");
  return {file->size(), [file](std::size_t i) { return file->read(i); },
          [file](std::size_t i) { return file->name(i); }};
}

ReadResult read_cells(std::string_view bytes, const std::string& name) {
  const CellReader cells = read_each_cells(bytes, name);
  ReadResult first = cells.read(0).read;
  if (cells.count > 1)
    first.warnings.push_back(
        {0, "several-cells",
         fmt::format("there are {} cells; only the first is read here; import or convert the "
                     "file to have all",
                     cells.count)});
  return first;
}

std::vector<Cell> read_all_cells(std::string_view bytes, const std::string& name) {
  const CellReader cells = read_each_cells(bytes, name);
  std::vector<Cell> all;
  for (std::size_t i = 0; i < cells.count; ++i) all.push_back(cells.read(i));
  return all;
}

std::string write_cells(std::span<const NamedMorphology> cells, const Annotations& about) {
  const CellsHead head{cells.size(), about};
  std::string bytes = bytes_of(head);
  std::vector<std::uint64_t> begins;
  CellsTotal total;
  for (std::size_t b = 0; b < head.blocks(); ++b) {
    const std::size_t first = b * cells_per_block;
    const std::string block = pack_block(first, cells.subspan(first, cells_in(head.cells, b)));
    add(total, structure_at<Block>(block, 0));
    begins.push_back(bytes.size());
    bytes += block;
  }
  return bytes + end_of(begins, bytes.size(), total);
}

std::string write_cells(const Morphology& morphology) {
  const NamedMorphology cell{"", morphology};
  return write_cells({&cell, 1});
}

}  // namespace forest::io
