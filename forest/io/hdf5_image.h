// SPDX-License-Identifier: Apache-2.0
// An HDF5 file in memory, read in place (HDF5 File Format Specification 3.0). The HDF5 library is not asked, for two
// reasons: it needs some hundred microseconds to open a small file, ten times what reading the neuron in it takes; and
// bytes from anywhere must end in a sentence, which it does not promise. Writing is its work (NewFile, hdf5.h).
//
// Read are superblocks 0 to 3, groups of any age, and arrays of numbers that are compact, contiguous or in chunks,
// deflated, shuffled and summed or not. What is left (external files, other filters, soft links) is refused or skipped;
// `h5repack` brings any file into this shape. Nothing is allocated that the bytes cannot fill.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace forest::io::hdf5 {

bool is_hdf5(std::string_view bytes);

/// Numbers of an array as they lie in the file, and their shape.
struct Array {
  std::vector<std::uint64_t> shape;  // empty: a single value
  bool real = false, is_signed = false, big_endian = false;
  std::size_t width = 0;  // bytes of one number
  std::string_view bytes;
  std::string decoded;  // holds `bytes` where the file has them in pieces

  std::size_t count() const { return width ? bytes.size() / width : 0; }
  /// Rounded to single precision; `values` has count() entries.
  void copy(std::span<float> values) const;
  /// Of whole numbers; those beyond the range become its ends.
  void copy(std::span<std::int64_t> values) const;
};

/// Every function throws InputError (the file's name, a sentence) where the file is damaged.
class Image {
 public:
  struct Message {
    std::uint16_t type = 0;
    bool shared = false;
    std::string_view data;
  };
  /// A group or an array: the messages of its header.
  struct Object {
    std::vector<Message> messages;
    bool is_group() const;
    bool is_array() const;
  };
  struct Link {
    static constexpr std::uint64_t soft =
        ~0ull;  // the address of one that names another by its path, or another file
    std::string name;
    std::uint64_t address = 0;
  };

  /// Throws InputError when this is no HDF5 file or was cut off. The bytes must outlive the image.
  Image(std::string_view bytes, const std::string& name);

  std::uint64_t root() const { return root_; }
  Object open(std::uint64_t address) const;
  std::vector<Link> links(const Object& group) const;  // sorted by name

  /// Throws also when it holds anything but numbers.
  Array array(const Object& object, std::string_view path) const;
  std::vector<std::string> attributes(
      const Object& object) const;  // their names, as far as they lie in its header
  std::vector<std::int64_t> integers(const Object& object, std::string_view attribute) const;  // empty: none
  std::optional<std::string> text(const Object& object, std::string_view attribute) const;

  const std::string& name() const { return name_; }
  [[noreturn]] void refuse(const std::string& sentence) const;  // throws InputError about this file

 private:
  friend class Cursor;
  struct Type;
  struct Attribute;
  struct AttributeParts;
  struct FractalHeap;
  std::string_view bytes_;
  const std::string& name_;
  std::uint64_t root_ = 0;

  [[noreturn]] void damaged(std::string_view what) const;
  std::string_view at(std::uint64_t address, std::uint64_t size, std::string_view what) const;
  std::string_view resolved(const Message& message) const;
  Type type(std::string_view message) const;
  std::vector<std::uint64_t> shape(std::string_view message) const;
  AttributeParts parts(const Message& message) const;
  std::optional<Attribute> attribute(const Object& object, std::string_view name) const;
  void symbols(std::string_view message, std::vector<Link>& links) const;
  Link link(std::string_view message) const;
  void dense_links(std::string_view message, std::vector<Link>& links) const;
  std::string_view heap_object(const FractalHeap& heap, std::string_view id) const;
  std::string chunks(const Object& object, std::string_view layout, const Array& array) const;
};

}  // namespace forest::io::hdf5
