// SPDX-License-Identifier: Apache-2.0
#include "forest/io/hdf5_image.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <concepts>
#include <cstring>
#include <limits>
#include <utility>
#include <zlib.h>

#include <fmt/format.h>

#include "forest/core/error.h"

namespace forest::io::hdf5 {
namespace {

constexpr std::string_view signature("\x89HDF\r\n\x1a\n", 8);
constexpr std::uint64_t nowhere = ~0ull;
constexpr std::uint64_t most_deflated =
    1100;  // bytes that one deflated byte can stand for, and a little more

// Messages of object headers (section IV.A.2 of the specification).
enum : std::uint16_t {
  dataspace_message = 1,
  link_info_message = 2,
  datatype_message = 3,
  link_message = 6,
  layout_message = 8,
  filter_message = 11,
  attribute_message = 12,
  continuation_message = 16,
  symbols_message = 17,
  attribute_info_message = 21
};

std::size_t padded(std::size_t size) { return (size + 7) & ~std::size_t(7); }

/// Where the superblock is: after a user block of 0, 512, 1024, … bytes.
std::size_t find_signature(std::string_view bytes) {
  for (std::size_t at = 0; at + signature.size() <= bytes.size(); at = at ? 2 * at : 512)
    if (bytes.substr(at, signature.size()) == signature) return at;
  return bytes.npos;
}

template <class T>
T number_at(const char* p, bool big_endian) {
  std::array<char, sizeof(T)> bytes;
  std::memcpy(bytes.data(), p, sizeof(T));
  if (big_endian == (std::endian::native == std::endian::little)) std::ranges::reverse(bytes);
  return std::bit_cast<T>(bytes);
}

/// value = From at p, for all values of an array.
template <class From, class To>
void convert(const Array& array, std::span<To> values) {
  const char* p = array.bytes.data();
  for (To& value : values) {
    const From from = number_at<From>(p, array.big_endian);
    if constexpr (std::same_as<To, std::int64_t> && std::same_as<From, std::uint64_t>)
      value = std::int64_t(std::min(from, std::uint64_t(std::numeric_limits<std::int64_t>::max())));
    else
      value = static_cast<To>(from);
    p += sizeof(From);
  }
}

template <class To>
void convert_integers(const Array& array, std::span<To> values) {
  switch (array.width * 2 + array.is_signed) {
    case 2:
      return convert<std::uint8_t>(array, values);
    case 3:
      return convert<std::int8_t>(array, values);
    case 4:
      return convert<std::uint16_t>(array, values);
    case 5:
      return convert<std::int16_t>(array, values);
    case 8:
      return convert<std::uint32_t>(array, values);
    case 9:
      return convert<std::int32_t>(array, values);
    case 16:
      return convert<std::uint64_t>(array, values);
    default:
      return convert<std::int64_t>(array, values);
  }
}

}  // namespace

bool is_hdf5(std::string_view bytes) { return find_signature(bytes) != bytes.npos; }

void Array::copy(std::span<float> values) const {
  if (!real) return convert_integers(*this, values);
  if (width == 8) return convert<double>(*this, values);
  if (big_endian || std::endian::native != std::endian::little) return convert<float>(*this, values);
  if (!values.empty()) std::memcpy(values.data(), bytes.data(), values.size_bytes());
}

void Array::copy(std::span<std::int64_t> values) const {
  if (!real) return convert_integers(*this, values);
  std::vector<double> reals(values.size());
  if (width == 8)
    convert<double>(*this, std::span(reals));
  else
    convert<float>(*this, std::span(reals));
  constexpr double most = 9.2e18;
  for (std::size_t i = 0; i < reals.size(); ++i)
    values[i] = std::isnan(reals[i]) ? 0 : std::int64_t(std::clamp(reals[i], -most, most));
}

/// Little-endian fields, one after the other; past the end the file is damaged.
class Cursor {
 public:
  Cursor(const Image& image, std::string_view bytes, std::string_view what)
      : image_(image), bytes_(bytes), what_(what) {}

  std::string_view take(std::uint64_t size) {
    if (size > bytes_.size()) image_.damaged(what_);
    const std::string_view taken = bytes_.substr(0, std::size_t(size));
    bytes_.remove_prefix(std::size_t(size));
    return taken;
  }
  void skip(std::uint64_t size) { take(size); }
  void expect(std::string_view word) {
    if (take(word.size()) != word) image_.damaged(what_);
  }
  std::uint64_t number(std::size_t size) {
    const std::string_view field = take(size);
    std::uint64_t value = 0;
    for (std::size_t i = field.size(); i-- > 0;) value = value << 8 | static_cast<unsigned char>(field[i]);
    return value;
  }
  std::uint8_t byte() { return static_cast<std::uint8_t>(number(1)); }
  std::uint16_t two() { return static_cast<std::uint16_t>(number(2)); }
  std::uint32_t four() { return static_cast<std::uint32_t>(number(4)); }
  std::uint64_t eight() { return number(8); }
  std::size_t left() const { return bytes_.size(); }
  std::string_view rest() const { return bytes_; }

 private:
  const Image& image_;
  std::string_view bytes_, what_;
};

struct Image::Type {
  enum Class { integer, real, text, variable_text, other } kind = other;
  bool is_signed = false, big_endian = false;
  std::size_t width = 0;
};

struct Image::FractalHeap {
  std::size_t id_size = 0, columns = 0, rows = 0, offset_bits = 0;
  std::uint64_t first_block = 0, largest_direct = 0, root = 0;
};

struct Image::Attribute {
  Type type;
  std::vector<std::uint64_t> shape;
  std::string_view data;
};

bool Image::Object::is_group() const {
  return std::ranges::any_of(messages, [](const Message& m) {
    return m.type == symbols_message || m.type == link_info_message || m.type == link_message;
  });
}

bool Image::Object::is_array() const {
  return std::ranges::any_of(messages, [](const Message& m) { return m.type == layout_message; });
}

void Image::refuse(const std::string& sentence) const { throw InputError(name_, 0, sentence); }

void Image::damaged(std::string_view what) const {
  refuse(fmt::format("is damaged: {} is not what it should be; write or copy the file again", what));
}

std::string_view Image::at(std::uint64_t address, std::uint64_t size, std::string_view what) const {
  if (address > bytes_.size() || size > bytes_.size() - address) damaged(what);
  return bytes_.substr(std::size_t(address), std::size_t(size));
}

Image::Image(std::string_view bytes, const std::string& name) : bytes_(bytes), name_(name) {
  const std::size_t begin = find_signature(bytes);
  if (begin == bytes.npos) refuse("is not an HDF5 file; give one, or use the extension of what it is");
  bytes_.remove_prefix(begin);
  constexpr std::string_view what = "the first block";
  Cursor block(*this, bytes_, what);
  block.skip(signature.size());
  const std::uint8_t version = block.byte();
  if (version > 3)
    refuse(fmt::format("has an HDF5 superblock of version {}; write it with `h5repack --high=2`", version));
  if (version < 2) block.skip(4);
  const std::uint8_t offset_size = block.byte(), length_size = block.byte();
  if (offset_size != 8 || length_size != 8)
    refuse(
        fmt::format("has addresses of {} bytes instead of 8; write it again with `h5repack`", offset_size));
  block.skip(version == 0 ? 9 : version == 1 ? 13 : 1);
  const std::uint64_t base = block.eight();  // behind the user block; all other addresses count from there
  block.skip(8);                             // free space or the superblock's extension
  const std::uint64_t end = block.eight() - base;
  if (version < 2) block.skip(8 + 8);  // the driver's block, the name of the root
  root_ = block.eight();
  if (end > bytes_.size())
    refuse(fmt::format("was cut off: {} of {} bytes are there; copy it again", bytes_.size(), end));
}

Image::Object Image::open(std::uint64_t address) const {
  constexpr std::string_view what = "the header of an object";
  Object object;
  std::vector<std::pair<std::uint64_t, std::uint64_t>> blocks;  // address and size of those that continue it
  // The blocks of one header do not overlap: together they are no larger than the file.
  std::uint64_t total = 0;
  const auto read = [&](Cursor messages, bool second_version, bool creation_order) {
    const std::size_t head = second_version ? 4 + 2 * std::size_t(creation_order) : 8;
    while (messages.left() >= head) {
      Message message;
      message.type = second_version ? messages.byte() : messages.two();
      const std::uint16_t size = messages.two();
      message.shared = messages.byte() & 2;
      messages.skip(second_version ? 2 * std::size_t(creation_order) : 3);
      if (size > messages.left() && message.type == 0) break;
      message.data = messages.take(size);
      if (message.type == continuation_message) {
        Cursor more(*this, message.data, what);
        const std::uint64_t where = more.eight(), length = more.eight();
        blocks.emplace_back(where, length);
      } else if (message.type != 0) {
        object.messages.push_back(message);
      }
    }
  };

  if (at(address, 4, what) == "OHDR") {
    Cursor header(*this, bytes_.substr(std::size_t(address)), what);
    header.skip(4);
    if (header.byte() != 2) damaged(what);
    const std::uint8_t flags = header.byte();
    header.skip((flags & 0x20 ? 16 : 0) + (flags & 0x10 ? 4 : 0));
    const std::uint64_t size = header.number(std::size_t(1) << (flags & 3));
    const bool creation_order = flags & 4;
    read(Cursor(*this, header.take(size), what), true, creation_order);
    for (std::size_t i = 0; i < blocks.size(); ++i) {
      const auto [where, length] = blocks[i];
      if (length < 8 || (total += length) > bytes_.size()) damaged(what);
      Cursor block(*this, at(where, length, what), what);
      block.expect("OCHK");
      read(Cursor(*this, block.take(length - 8), what), true, creation_order);  // the last 4 are a checksum
    }
  } else {
    Cursor header(*this, at(address, 16, what), what);
    if (header.byte() != 1) damaged(what);
    header.skip(7);
    const std::uint32_t size = header.four();
    read(Cursor(*this, at(address + 16, size, what), what), false, false);
    for (std::size_t i = 0; i < blocks.size(); ++i) {
      const auto [where, length] = blocks[i];
      if (!length || (total += length) > bytes_.size()) damaged(what);
      read(Cursor(*this, at(where, length, what), what), false, false);
    }
  }
  return object;
}

// Groups
// ---------------------------------------------------------------------------

std::vector<Image::Link> Image::links(const Object& group) const {
  std::vector<Link> links;
  for (const Message& message : group.messages) {
    if (message.type == symbols_message) symbols(message.data, links);
    if (message.type == link_message) links.push_back(link(message.data));
    if (message.type == link_info_message) dense_links(message.data, links);
  }
  std::ranges::sort(links, {}, &Link::name);
  return links;
}

/// A group of the first kind: a B-tree whose leaves are tables of names in a heap.
void Image::symbols(std::string_view message, std::vector<Link>& links) const {
  constexpr std::string_view what = "the list of a group";
  Cursor table(*this, message, what);
  const std::uint64_t tree = table.eight(), heap_address = table.eight();
  Cursor heap(*this, at(heap_address, 32, what), what);
  heap.expect("HEAP");
  heap.skip(4);
  const std::uint64_t heap_size = heap.eight();
  heap.skip(8);
  const std::string_view names = at(heap.eight(), heap_size, what);

  std::vector<std::pair<std::uint64_t, int>> nodes{{tree, -1}};  // and their level, where it is known
  std::size_t visited = 0;
  while (!nodes.empty()) {
    const auto [address, level] = nodes.back();
    nodes.pop_back();
    if (++visited > bytes_.size() / 8 + 1) damaged(what);
    if (level == -2) {
      Cursor entries(*this, bytes_.substr(std::size_t(std::min<std::uint64_t>(address, bytes_.size()))),
                     what);
      entries.expect("SNOD");
      entries.skip(2);
      for (std::uint16_t left = entries.two(); left > 0; --left) {
        const std::uint64_t name = entries.eight(), object = entries.eight();
        entries.skip(24);
        if (name >= names.size()) damaged(what);
        const std::string_view text = names.substr(std::size_t(name));
        links.push_back({std::string(text.substr(0, text.find('\0'))), object});
      }
      if (links.size() > bytes_.size()) damaged(what);
      continue;
    }
    Cursor node(*this, at(address, 24, what), what);
    node.expect("TREE");
    if (node.byte() != 0) damaged(what);
    const int depth = node.byte();
    if (level >= 0 && depth != level) damaged(what);
    const std::uint16_t count = node.two();
    Cursor children(*this, at(address + 24, 16ull * count + 8, what), what);
    const std::size_t first = nodes.size();
    for (std::uint16_t i = 0; i < count; ++i) {
      children.skip(8);
      nodes.emplace_back(children.eight(), depth == 0 ? -2 : depth - 1);
    }
    std::reverse(nodes.begin() + std::ptrdiff_t(first), nodes.end());
    if (nodes.size() > bytes_.size()) damaged(what);
  }
}

Image::Link Image::link(std::string_view message) const {
  Cursor fields(*this, message, "a link of a group");
  if (fields.byte() != 1) damaged("a link of a group");
  const std::uint8_t flags = fields.byte();
  const std::uint8_t kind = flags & 8 ? fields.byte() : 0;
  fields.skip((flags & 4 ? 8 : 0) + (flags & 16 ? 1 : 0));
  const std::string_view name = fields.take(fields.number(std::size_t(1) << (flags & 3)));
  return Link{std::string(name), kind == 0 ? fields.eight() : Link::soft};
}

/// A group of the second kind with many members: link messages in a fractal heap, found by a B-tree of version 2.
void Image::dense_links(std::string_view message, std::vector<Link>& links) const {
  constexpr std::string_view what = "the list of a large group";
  Cursor info(*this, message, what);
  if (info.byte() != 0) damaged(what);
  const std::uint8_t flags = info.byte();
  if (flags & 1) info.skip(8);
  const std::uint64_t heap_address = info.eight(), tree_address = info.eight();
  if (heap_address == nowhere || tree_address == nowhere) return;

  Cursor heap(*this, at(heap_address, 146, what), what);
  heap.expect("FRHP");
  heap.skip(1);
  FractalHeap objects;
  objects.id_size = heap.two();
  if (heap.two() != 0) refuse("has a packed group; write it again with `h5repack`");
  heap.skip(1 + 4 + 8 + 8 + 8 + 8 + 8 + 8 + 8 + 8 + 8 + 8 + 8 + 8);
  objects.columns = heap.two();
  objects.first_block = heap.eight();
  objects.largest_direct = heap.eight();
  objects.offset_bits = heap.two();
  heap.skip(2);
  objects.root = heap.eight();
  objects.rows = heap.two();
  if (!objects.columns || !std::has_single_bit(objects.first_block) ||
      !std::has_single_bit(objects.largest_direct) || objects.offset_bits > 64 || objects.id_size < 5 ||
      objects.id_size > 64)
    damaged(what);

  Cursor tree(*this, at(tree_address, 34, what), what);
  tree.expect("BTHD");
  tree.skip(1);
  if (tree.byte() != 5) damaged(what);  // records of names
  const std::uint32_t node_size = tree.four();
  const std::size_t record = tree.two();
  const int depth = tree.two();
  tree.skip(2);
  const std::uint64_t root = tree.eight();
  const std::size_t root_count = tree.two();
  if (root == nowhere) return;
  if (record != 4u + objects.id_size || node_size < record + 10 || depth > 20) damaged(what);
  // How many records a node of each level and all below it hold at most: the counts beside its addresses take as few
  // bytes as that needs.
  const auto bytes_for = [](std::uint64_t most) { return std::size_t(std::bit_width(most) + 7) / 8; };
  std::vector<std::uint64_t> most{(node_size - 10) / record}, below{most[0]};
  for (int level = 1; level <= depth; ++level) {
    const std::size_t pointer = 8 + bytes_for(most[0]) + (level > 1 ? bytes_for(below.back()) : 0);
    if (node_size < 10 + pointer + record) damaged(what);
    most.push_back((node_size - 10 - pointer) / (record + pointer));
    if (below.back() > (1ull << 40)) damaged(what);
    below.push_back((most.back() + 1) * below.back() + most.back());
  }

  struct Node {
    std::uint64_t address;
    std::size_t count;
    int level;
  };
  std::vector<Node> nodes{{root, root_count, depth}};
  for (std::size_t visited = 0; !nodes.empty(); ++visited) {
    const Node node = nodes.back();
    nodes.pop_back();
    if (visited > bytes_.size() / 16) damaged(what);
    Cursor fields(*this, at(node.address, node_size, what), what);
    fields.expect(node.level ? "BTIN" : "BTLF");
    fields.skip(2);
    for (std::size_t i = 0; i < node.count; ++i) {
      fields.skip(4);  // the name's hash
      links.push_back(link(heap_object(objects, fields.take(objects.id_size))));
      if (links.size() > bytes_.size()) damaged(what);
    }
    for (std::size_t i = 0; node.level && i <= node.count; ++i) {
      const std::uint64_t address = fields.eight();
      const std::size_t count = std::size_t(fields.number(bytes_for(most[0])));
      if (node.level > 1) fields.skip(bytes_for(below[std::size_t(node.level) - 1]));
      nodes.push_back({address, count, node.level - 1});
    }
  }
}

/// An object by its id: the heap is a table of blocks that double in size every second row, some of them tables again.
std::string_view Image::heap_object(const FractalHeap& heap, std::string_view id) const {
  constexpr std::string_view what = "the list of a large group";
  Cursor fields(*this, id, what);
  if (fields.byte() & 0xf0) refuse("has links of great length; write the file again with `h5repack`");
  const std::size_t offset_size = (heap.offset_bits + 7) / 8;
  std::uint64_t offset = fields.number(offset_size);
  const std::uint64_t largest = std::min<std::uint64_t>(heap.largest_direct, 1ull << 32);
  const std::uint64_t length =
      fields.number(std::min<std::size_t>(std::size_t(std::bit_width(largest) + 7) / 8, fields.left()));
  std::uint64_t block = heap.root, block_size = heap.first_block;
  std::size_t rows = heap.rows;
  for (int level = 0; rows > 0; ++level) {
    if (level > 40) damaged(what);
    // The row that holds the offset: rows 0 and 1 have blocks of the first size, every later one of twice the last.
    std::uint64_t begin = 0, size = heap.first_block;
    std::size_t row = 0;
    while (offset - begin >= size * heap.columns) {
      begin += size * heap.columns;
      if (row++ > 0) size *= 2;
      if (row >= rows || size > (1ull << 48)) damaged(what);
    }
    const std::uint64_t index = (offset - begin) / size;
    offset -= begin + index * size;
    Cursor table(*this, bytes_.substr(std::size_t(std::min<std::uint64_t>(block, bytes_.size()))), what);
    table.expect("FHIB");
    table.skip(1 + 8 + offset_size + 8 * (row * heap.columns + index));
    block = table.eight();
    block_size = size;
    if (size <= heap.largest_direct) break;
    rows = std::size_t(std::bit_width(size / heap.first_block / heap.columns));  // of a block that is a table
  }
  if (offset > block_size || length > block_size - offset) damaged(what);
  return at(block, block_size, what).substr(std::size_t(offset), std::size_t(length));
}

// Values
// ---------------------------------------------------------------------------

std::string_view Image::resolved(const Message& message) const {
  if (!message.shared) return message.data;
  constexpr std::string_view what = "a shared description";
  Cursor fields(*this, message.data, what);
  const std::uint8_t version = fields.byte();
  fields.skip(version == 1 ? 7 : 1);
  const Object owner = open(fields.eight());
  for (const Message& other : owner.messages)
    if (other.type == message.type && !other.shared) return other.data;
  damaged(what);
}

Image::Type Image::type(std::string_view message) const {
  constexpr std::string_view what = "a type of values";
  Cursor fields(*this, message, what);
  std::uint8_t kind = fields.byte() & 15;
  std::uint32_t bits = std::uint32_t(fields.number(3));
  std::uint32_t width = fields.four();
  if (kind == 8) {  // an enumeration: numbers with names
    kind = fields.byte() & 15;
    bits = std::uint32_t(fields.number(3));
    width = fields.four();
    if (kind != 0) return {};
  }
  Type type{.is_signed = (bits & 8) != 0, .big_endian = (bits & 1) != 0, .width = width};
  switch (kind) {
    case 0: {
      const std::uint16_t offset = fields.two(), precision = fields.two();
      if (width && width <= 8 && std::has_single_bit(width) && offset == 0 && precision == 8 * width)
        type.kind = Type::integer;
      break;
    }
    case 1: {
      const std::uint64_t layout = fields.eight();
      const auto field = [&](int byte) { return std::uint8_t(layout >> (8 * byte)); };
      const bool plain = field(0) == 0 && field(1) == 0 && !(bits & 0x40);
      if (plain && width == 4 && field(5) == 8 && field(7) == 23) type.kind = Type::real;
      if (plain && width == 8 && field(5) == 11 && field(7) == 52) type.kind = Type::real;
      break;
    }
    case 3:
      type.kind = Type::text;
      break;
    case 9:
      if ((bits & 15) == 1) type.kind = Type::variable_text;
      break;
    default:
      break;
  }
  return type;
}

std::vector<std::uint64_t> Image::shape(std::string_view message) const {
  constexpr std::string_view what = "a shape";
  Cursor fields(*this, message, what);
  const std::uint8_t version = fields.byte(), rank = fields.byte();
  if (version != 1 && version != 2) damaged(what);
  fields.skip(1);
  const bool nothing = version == 2 && fields.byte() == 2;
  if (version == 1) fields.skip(5);
  std::vector<std::uint64_t> shape;
  for (int i = 0; i < rank; ++i) shape.push_back(fields.eight());
  if (nothing) shape.assign(1, 0);
  return shape;
}

Array Image::array(const Object& object, std::string_view path) const {
  const std::string what = fmt::format("array {}", path);
  const Message *type_found = nullptr, *shape_found = nullptr, *layout_found = nullptr;
  for (const Message& message : object.messages) {
    if (message.type == datatype_message) type_found = &message;
    if (message.type == dataspace_message) shape_found = &message;
    if (message.type == layout_message) layout_found = &message;
  }
  if (!type_found || !shape_found || !layout_found)
    refuse(
        fmt::format("has no array {}, but something else of that name; the file is of another kind", path));
  const Type kind = type(resolved(*type_found));
  if (kind.kind != Type::integer && kind.kind != Type::real)
    refuse(fmt::format("array {} holds something other than plain numbers; write numbers", path));
  Array result{.shape = shape(resolved(*shape_found)),
               .real = kind.kind == Type::real,
               .is_signed = kind.is_signed,
               .big_endian = kind.big_endian,
               .width = kind.width,
               .bytes = {},
               .decoded = {}};
  std::uint64_t size = kind.width;
  for (const std::uint64_t extent : result.shape) {
    if (extent && size > most_deflated * (bytes_.size() + 64) / extent)
      refuse(fmt::format("array {} claims more values than the file can hold; the file is damaged", path));
    size *= extent;
  }
  if (size == 0) return result;

  Cursor layout(*this, layout_found->data, what);
  const std::uint8_t version = layout.byte();
  if (version == 0 || version > 4)
    refuse(
        fmt::format("array {} is laid out in a way not known; write the file again with `h5repack`", path));
  std::uint8_t rank = 0;
  if (version < 3) rank = layout.byte();
  const std::uint8_t storage = layout.byte();  // 0 in the header itself, 1 in one piece, 2 in chunks
  if (version < 3) layout.skip(5);
  const auto in_one_piece = [&](std::uint64_t address) {
    if (address == nowhere) refuse(fmt::format("array {} was never filled; write the file again", path));
    result.bytes = at(address, size, what);
  };
  if (storage == 0) {
    if (version < 3) layout.skip(4ull * rank);
    const std::uint64_t held = version < 3 ? layout.four() : layout.two();
    if (held < size) damaged(what);
    result.bytes = layout.take(held).substr(0, std::size_t(size));
  } else if (storage == 1) {
    in_one_piece(layout.eight());
  } else if (storage == 2) {
    result.decoded = chunks(object, layout_found->data, result);
    result.bytes = result.decoded;
  } else {
    refuse(fmt::format("array {} is put together from others; write the file again with `h5repack`", path));
  }
  return result;
}

struct Image::AttributeParts {
  std::string_view name, type, shape, data;
  bool shares_type = false;  // with other objects
};

Image::AttributeParts Image::parts(const Message& message) const {
  constexpr std::string_view what = "an attribute";
  Cursor fields(*this, message.data, what);
  const std::uint8_t version = fields.byte(), flags = fields.byte();
  if (version < 1 || version > 3) damaged(what);
  const std::size_t name_size = fields.two(), type_size = fields.two(), shape_size = fields.two();
  if (version == 3) fields.skip(1);
  const auto part = [&](std::size_t size) {
    return fields.take(version == 1 ? std::min(padded(size), fields.left()) : size).substr(0, size);
  };
  AttributeParts result;
  result.name = part(name_size);
  result.name = result.name.substr(0, result.name.find('\0'));
  result.type = part(type_size);
  result.shape = part(shape_size);
  result.data = fields.rest();
  result.shares_type = version > 1 && (flags & 3);
  return result;
}

std::vector<std::string> Image::attributes(const Object& object) const {
  std::vector<std::string> names;
  for (const Message& message : object.messages) {
    if (message.type == attribute_message && !message.shared) names.emplace_back(parts(message).name);
    if (message.type == attribute_info_message) {  // many attributes lie in a heap of their own
      Cursor fields(*this, message.data, "the place of attributes");
      fields.skip(1);
      if (fields.byte() & 1) fields.skip(2);
      if (fields.eight() != nowhere) names.emplace_back("…");
    }
  }
  return names;
}

std::optional<Image::Attribute> Image::attribute(const Object& object, std::string_view name) const {
  for (const Message& message : object.messages) {
    if (message.type != attribute_message || message.shared) continue;
    const AttributeParts found = parts(message);
    if (found.name != name) continue;
    if (found.shares_type) return std::nullopt;  // never of what is asked here
    return Attribute{type(found.type), shape(found.shape), found.data};
  }
  return std::nullopt;
}

std::vector<std::int64_t> Image::integers(const Object& object, std::string_view name) const {
  const auto found = attribute(object, name);
  if (!found || (found->type.kind != Type::integer && found->type.kind != Type::real)) return {};
  std::uint64_t count = 1;
  for (const std::uint64_t extent : found->shape) {
    if (extent > 65536) damaged("an attribute");
    count = std::min<std::uint64_t>(count * extent, 65536);
  }
  if (count * found->type.width > found->data.size()) damaged("an attribute");
  const Array array{.shape = found->shape,
                    .real = found->type.kind == Type::real,
                    .is_signed = found->type.is_signed,
                    .big_endian = found->type.big_endian,
                    .width = found->type.width,
                    .bytes = found->data.substr(0, std::size_t(count) * found->type.width),
                    .decoded = {}};
  std::vector<std::int64_t> values(array.count());
  array.copy(std::span(values));
  return values;
}

std::optional<std::string> Image::text(const Object& object, std::string_view name) const {
  const auto found = attribute(object, name);
  if (!found || std::ranges::count(found->shape, 0u)) return std::nullopt;
  const auto until_null = [](std::string_view text) { return std::string(text.substr(0, text.find('\0'))); };
  if (found->type.kind == Type::text) return until_null(found->data.substr(0, found->type.width));
  if (found->type.kind != Type::variable_text) return std::nullopt;
  constexpr std::string_view what = "a text";
  Cursor reference(*this, found->data, what);
  const std::uint32_t size = reference.four();
  const std::uint64_t address = reference.eight();
  const std::uint32_t index = reference.four();
  if (size == 0 || address == 0) return std::string();
  Cursor head(*this, at(address, 16, what), what);
  head.expect("GCOL");
  head.skip(4);
  Cursor heap(*this, at(address, head.eight(), what), what);
  heap.skip(16);
  while (heap.left() >= 16) {
    const std::uint16_t own = heap.two();
    heap.skip(6);
    const std::uint64_t length = heap.eight();
    if (own == 0) break;
    if (own == index) return until_null(heap.take(std::min<std::uint64_t>(length, size)));
    const std::size_t held = std::size_t(std::min<std::uint64_t>(length, heap.left()));
    heap.skip(std::min(padded(held), heap.left()));
  }
  damaged(what);
}

namespace {

struct Filter {
  enum Id : std::uint16_t { deflate = 1, shuffle = 2, sum = 3 };
  std::uint16_t id = 0;
};

/// The bytes of one chunk as they were before the filters; false when they cannot be.
bool unfilter(std::string& chunk, std::span<const Filter> filters, std::uint32_t skipped, std::size_t width,
              std::size_t size) {
  for (std::size_t i = filters.size(); i-- > 0;) {
    if (i < 32 && (skipped >> i & 1)) continue;
    switch (filters[i].id) {
      case Filter::sum:
        if (chunk.size() < 4) return false;
        chunk.resize(chunk.size() - 4);
        break;
      case Filter::deflate: {
        std::string plain(size + 4, '\0');  // a sum may have been added before
        uLongf length = uLongf(plain.size());
        if (uncompress(reinterpret_cast<Bytef*>(plain.data()), &length,
                       reinterpret_cast<const Bytef*>(chunk.data()), uLong(chunk.size())) != Z_OK)
          return false;
        plain.resize(length);
        chunk = std::move(plain);
        break;
      }
      default: {
        const std::size_t count = chunk.size() / width;
        std::string plain = chunk;
        for (std::size_t byte = 0; byte < width; ++byte)
          for (std::size_t k = 0; k < count; ++k) plain[k * width + byte] = chunk[byte * count + k];
        chunk = std::move(plain);
      }
    }
  }
  return chunk.size() >= size;
}

}  // namespace

std::string Image::chunks(const Object& object, std::string_view message, const Array& array) const {
  constexpr std::string_view what = "an array in chunks";
  const auto unknown = [&] {
    refuse("keeps an array in a way that is not read here; write the file again with `h5repack`");
  };
  std::vector<Filter> filters;
  for (const Message& m : object.messages) {
    if (m.type != filter_message) continue;
    Cursor fields(*this, m.data, what);
    const std::uint8_t version = fields.byte(), count = fields.byte();
    if (version == 1) fields.skip(6);
    for (int i = 0; i < count; ++i) {
      const std::uint16_t id = fields.two();
      const std::uint16_t name = version == 1 || id >= 256 ? fields.two() : 0;
      fields.skip(2);
      const std::uint16_t values = fields.two();
      fields.skip(version == 1 ? padded(name) : name);
      fields.skip(4ull * values + (version == 1 && values % 2 ? 4 : 0));
      if (id < Filter::deflate || id > Filter::sum)
        refuse(fmt::format("is packed by filter {}; write it again with `h5repack -f GZIP=4`", id));
      filters.push_back({id});
    }
  }

  const std::size_t rank = array.shape.size();
  Cursor layout(*this, message, what);
  const std::uint8_t version = layout.byte();
  if (version < 3 || rank == 0) unknown();
  layout.skip(1);
  const std::uint8_t flags = version == 4 ? layout.byte() : 0;
  if (layout.byte() != rank + 1) damaged(what);
  std::uint64_t index = nowhere;
  if (version == 3) index = layout.eight();
  const std::size_t extent_size = version == 4 ? layout.byte() : 4;
  if (extent_size == 0 || extent_size > 8) damaged(what);
  std::vector<std::uint64_t> extent(rank), grid(rank);
  std::uint64_t size = array.width, cells = 1;
  const std::uint64_t most = most_deflated * (bytes_.size() + 64);
  for (std::size_t d = 0; d < rank; ++d) {
    extent[d] = layout.number(extent_size);
    if (extent[d] == 0 || size > most / extent[d]) damaged(what);
    size *= extent[d];
    grid[d] = (array.shape[d] + extent[d] - 1) / extent[d];
    cells *= grid[d];  // no more than the values there are
  }
  layout.skip(extent_size);
  if (cells > most / size) damaged(what);

  std::uint64_t total = array.width;
  for (const std::uint64_t n : array.shape) total *= n;
  std::string values(std::size_t(total), '\0');
  std::uint64_t placed = 0, filled = 0;
  const auto place = [&](std::span<const std::uint64_t> first, std::uint64_t address, std::uint64_t stored,
                         std::uint32_t skipped) {
    if (++placed > cells) damaged(what);
    for (std::size_t d = 0; d < rank; ++d)
      if (first[d] >= array.shape[d] || first[d] % extent[d]) return;  // beyond an array that was shortened
    ++filled;
    std::string chunk(at(address, stored, what));
    if (!unfilter(chunk, filters, skipped, array.width, std::size_t(size))) damaged(what);
    // Rows along the last dimension.
    const std::size_t row = std::size_t(std::min(extent[rank - 1], array.shape[rank - 1] - first[rank - 1]));
    std::vector<std::uint64_t> at_row(rank, 0);
    while (true) {
      std::uint64_t from = 0, to = 0;
      for (std::size_t d = 0; d < rank; ++d) {
        from = from * extent[d] + at_row[d];
        to = to * array.shape[d] + first[d] + at_row[d];
      }
      std::memcpy(values.data() + to * array.width, chunk.data() + from * array.width, row * array.width);
      std::size_t d = rank - 1;
      while (d-- > 0) {
        if (++at_row[d] < extent[d] && first[d] + at_row[d] < array.shape[d]) break;
        at_row[d] = 0;
      }
      if (d == std::size_t(-1)) break;
    }
  };

  const auto whole = [&] {
    if (filled < cells)
      refuse(fmt::format("lacks {} of {} pieces of an array, which were never written; write the file again",
                         cells - filled, cells));
    return std::move(values);
  };

  if (version == 3) {
    if (index == nowhere) return whole();
    std::vector<std::pair<std::uint64_t, int>> nodes{{index, -1}};
    std::vector<std::uint64_t> first(rank);
    for (std::size_t visited = 0; !nodes.empty(); ++visited) {
      const auto [address, level] = nodes.back();
      nodes.pop_back();
      if (visited > bytes_.size() / 24) damaged(what);
      Cursor node(*this, at(address, 24, what), what);
      node.expect("TREE");
      if (node.byte() != 1) damaged(what);
      const int depth = node.byte();
      if (level >= 0 && depth != level) damaged(what);
      const std::uint16_t count = node.two();
      const std::uint64_t key = 8 + 8 * (rank + 1);
      Cursor children(*this, at(address + 24, count * (key + 8) + key, what), what);
      for (std::uint16_t i = 0; i < count; ++i) {
        const std::uint32_t stored = children.four(), skipped = children.four();
        for (std::uint64_t& n : first) n = children.eight();
        children.skip(8);
        const std::uint64_t child = children.eight();
        if (depth == 0)
          place(first, child, stored, skipped);
        else
          nodes.emplace_back(child, depth - 1);
      }
      if (nodes.size() > bytes_.size()) damaged(what);
    }
    return whole();
  }

  const std::uint8_t kind = layout.byte();  // of the chunk index
  const auto first_of = [&](std::uint64_t cell) {
    std::vector<std::uint64_t> first(rank);
    for (std::size_t d = rank; d-- > 0; cell /= grid[d]) first[d] = cell % grid[d] * extent[d];
    return first;
  };
  if (kind == 1) {  // a single chunk
    std::uint64_t stored = size;
    std::uint32_t skipped = 0;
    if (flags & 2) stored = layout.eight(), skipped = layout.four();
    const std::uint64_t address = layout.eight();
    if (address != nowhere) place(first_of(0), address, stored, skipped);
  } else if (kind == 2) {  // one after the other
    const std::uint64_t address = layout.eight();
    for (std::uint64_t cell = 0; address != nowhere && cell < cells; ++cell)
      place(first_of(cell), address + cell * size, size, 0);
  } else if (kind == 3) {  // a fixed array of addresses
    layout.skip(1);
    const std::uint64_t address = layout.eight();
    if (address == nowhere) return whole();
    Cursor header(*this, at(address, 28, what), what);
    header.expect("FAHD");
    header.skip(1);
    const bool filtered = header.byte() == 1;
    const std::uint8_t entry = header.byte(), page_bits = header.byte();
    const std::uint64_t count = header.eight(), block = header.eight();
    if (block == nowhere) return whole();
    if (page_bits < 64 && count > (1ull << page_bits)) unknown();
    Cursor entries(*this, bytes_.substr(std::size_t(std::min<std::uint64_t>(block, bytes_.size()))), what);
    entries.expect("FADB");
    entries.skip(1 + 1 + 8);
    if (filtered && (entry < 13 || entry > 20)) damaged(what);
    for (std::uint64_t cell = 0; cell < std::min(count, cells); ++cell) {
      const std::uint64_t chunk = entries.eight();
      const std::uint64_t stored = filtered ? entries.number(std::size_t(entry) - 12) : size;
      const std::uint32_t skipped = filtered ? entries.four() : 0;
      if (chunk != nowhere) place(first_of(cell), chunk, stored, skipped);
    }
  } else {
    unknown();
  }
  return whole();
}

}  // namespace forest::io::hdf5
