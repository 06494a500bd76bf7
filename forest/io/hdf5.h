// SPDX-License-Identifier: Apache-2.0
// The part of HDF5 that circuits and reports need: groups, arrays of numbers and texts, and attributes; neurons are
// read without the library (hdf5_image.h). For the formats of this room; no type of the HDF5 library is seen here. Objects are named by their
// path, "/nodes/column/0/x". The library is not safe in several threads: calls take turns.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace forest::io::hdf5 {

enum class Kind : std::uint8_t { none, group, integers, reals, texts, other };

/// A file being read. Every function throws InputError (file, sentence that names the object) when the object is
/// missing, is of another kind or larger than the file can hold.
class File {
 public:
  /// Throws InputError when the file is missing, is no HDF5 file or was cut off.
  explicit File(const std::filesystem::path& path);
  ~File();
  File(const File&) = delete;
  File& operator=(const File&) = delete;

  Kind kind(const std::string& object) const;                        // none when there is no such object
  std::vector<std::string> members(const std::string& group) const;  // names, sorted
  std::size_t size(const std::string& array) const;

  std::vector<float> reals(const std::string& array) const;     // of whole numbers, too
  std::vector<double> doubles(const std::string& array) const;  // the same
  std::vector<std::int64_t> integers(const std::string& array) const;
  std::vector<std::string> texts(const std::string& array) const;
  std::vector<std::int64_t> attribute(const std::string& object,
                                      const std::string& name) const;  // empty: none
  std::string text_attribute(const std::string& object,
                             const std::string& name) const;  // "": none, or no text

  [[noreturn]] void refuse(const std::string& sentence) const;  // throws InputError about this file

 private:
  friend class Matrix;
  std::string path_;
  std::uintmax_t bytes_ = 0;
  std::int64_t file_ = -1;
};

/// An array of rows and columns of numbers, read a rectangle at a time and never whole.
class Matrix {
 public:
  /// Throws InputError, as File does.
  Matrix(std::shared_ptr<const File> file, const std::string& array);
  ~Matrix();
  Matrix(const Matrix&) = delete;
  Matrix& operator=(const Matrix&) = delete;

  std::size_t rows() const { return rows_; }
  std::size_t columns() const { return columns_; }
  /// Rows [row, row + rows) of columns [column, column + columns), row after row; they must be in the matrix.
  void read(std::size_t row, std::size_t rows, std::size_t column, std::size_t columns, float* out) const;

 private:
  std::shared_ptr<const File> file_;
  std::string path_;
  std::int64_t set_ = -1;
  std::size_t rows_ = 0, columns_ = 0;
};

/// A file being written. The same calls give the same bytes: no times are stored. Groups above an object are made
/// on the way. Throws Error when the disk is full.
class NewFile {
 public:
  /// @param named  what errors call it, where it is still written under another name; empty: by its path
  explicit NewFile(const std::filesystem::path& path, const std::filesystem::path& named = {});
  NewFile();  // in memory: bytes() ends it
  ~NewFile();
  NewFile(const NewFile&) = delete;
  NewFile& operator=(const NewFile&) = delete;

  void group(const std::string& path);
  /// Rows of `columns` values; 0: a single row of all of them.
  void write(const std::string& path, std::span<const float> values, std::size_t columns = 0);
  void write(const std::string& path, std::span<const double> values);
  void write(const std::string& path, std::span<const std::int32_t> values, std::size_t columns = 0);
  void write(const std::string& path, std::span<const std::uint8_t> values);
  void write(const std::string& path, std::span<const std::uint32_t> values);
  void write(const std::string& path, std::span<const std::uint64_t> values);
  void write(const std::string& path, std::span<const std::string> values);  // UTF-8, of variable length
  /// An array of 32-bit floats that is filled a piece at a time; what is never filled is zero.
  void matrix(const std::string& path, std::size_t rows, std::size_t columns);
  /// Rows [row, row + rows) of it, columns [column, column + columns), row after row.
  void fill(const std::string& path, std::size_t row, std::size_t rows, std::size_t column,
            std::size_t columns, const float* values);
  void attribute(const std::string& object, const std::string& name, std::uint32_t value);
  void attribute(const std::string& object, const std::string& name, const std::string& text);  // UTF-8
  void attribute(const std::string& object, const std::string& name, std::span<const std::uint32_t> values);

  /// Must be the last call; the destructor throws nothing and so cannot say that the disk was full.
  void close();
  std::string bytes();  // of a file in memory, which it closes

 private:
  void write(const std::string& path, std::int64_t file_type, std::int64_t memory_type, const void* values,
             std::size_t count, std::size_t columns = 0);
  void check(bool good, const std::string& what) const;

  std::string path_;
  std::int64_t file_ = -1;
};

}  // namespace forest::io::hdf5
