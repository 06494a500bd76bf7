// SPDX-License-Identifier: Apache-2.0
#include "forest/io/hdf5.h"

#include <algorithm>
#include <array>
#include <hdf5.h>
#include <memory>
#include <mutex>
#include <utility>

#include <fmt/format.h>

#include "forest/core/error.h"

namespace forest::io::hdf5 {
namespace {

static_assert(sizeof(hid_t) == sizeof(std::int64_t));

/// One turn with the library, during which it does not print its errors.
class Turn {
 public:
  Turn() : lock_(mutex()) {
    // At its exit the library would close what could not be closed on a full disk, and fall over it.
    [[maybe_unused]] static const herr_t left_alone = H5dont_atexit();
    H5Eget_auto2(H5E_DEFAULT, &print_, &data_);
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  }
  ~Turn() { H5Eset_auto2(H5E_DEFAULT, print_, data_); }
  Turn(const Turn&) = delete;
  Turn& operator=(const Turn&) = delete;

 private:
  static std::recursive_mutex& mutex() {
    static std::recursive_mutex one;
    return one;
  }
  std::lock_guard<std::recursive_mutex> lock_;
  H5E_auto2_t print_ = nullptr;
  void* data_ = nullptr;
};

/// An open object of the library, closed at the end of its scope.
template <herr_t (*close)(hid_t)>
class Handle {
 public:
  explicit Handle(hid_t id) : id_(id) {}
  ~Handle() {
    if (id_ >= 0) close(id_);
  }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;

  operator hid_t() const { return id_; }
  hid_t release() { return std::exchange(id_, -1); }  // not closed here any more
  bool good() const { return id_ >= 0; }

 private:
  hid_t id_;
};

using Group = Handle<H5Gclose>;
using Dataset = Handle<H5Dclose>;
using Space = Handle<H5Sclose>;
using Type = Handle<H5Tclose>;
using Attribute = Handle<H5Aclose>;
using Properties = Handle<H5Pclose>;
using Object = Handle<H5Oclose>;

Kind kind_of(hid_t type) {
  switch (H5Tget_class(type)) {
    case H5T_INTEGER:
    case H5T_ENUM:
      return Kind::integers;
    case H5T_FLOAT:
      return Kind::reals;
    case H5T_STRING:
      return Kind::texts;
    default:
      return Kind::other;
  }
}

// The library asks this step by step: it takes a missing group above the object for an error.
bool exists(hid_t file, const std::string& object) {
  for (std::size_t slash = object.find('/', 1);; slash = object.find('/', slash + 1)) {
    const std::string part = object.substr(0, slash);
    if (part != "/" && H5Lexists(file, part.c_str(), H5P_DEFAULT) <= 0) return false;
    if (slash == std::string::npos) return true;
  }
}

/// Even deflated by the most they can be, so many values need more bytes than the file has: it is damaged.
void check_claim(const File& owner, const std::string& path, std::size_t count, hid_t type,
                 std::uintmax_t file_bytes) {
  constexpr std::uintmax_t most_deflated = 1100;
  if (count > most_deflated * (file_bytes / std::max<std::size_t>(1, H5Tget_size(type)) + 1))
    owner.refuse(fmt::format("array {} claims {} values, more than the file can hold; the file is damaged",
                             path, count));
}

/// The library crashes where a damaged header says that the array lies within it, or in one piece, and is of another size, or
/// that it lies beyond the end.
void check_piece(const File& owner, const std::string& path, hid_t set, hid_t type, std::size_t count,
                 std::uintmax_t file_bytes) {
  const Properties made(H5Dget_create_plist(set));
  const H5D_layout_t layout = made.good() ? H5Pget_layout(made) : H5D_LAYOUT_ERROR;
  if ((layout != H5D_COMPACT && layout != H5D_CONTIGUOUS) || H5Tis_variable_str(type) > 0 ||
      kind_of(type) == Kind::other)
    return;
  const haddr_t begin = layout == H5D_COMPACT ? 0 : H5Dget_offset(set);
  const std::uintmax_t size = count * H5Tget_size(type);
  if (begin != HADDR_UNDEF &&  // which it is of one that was never written
      (H5Dget_storage_size(set) != size || size > file_bytes || begin > file_bytes - size))
    owner.refuse(fmt::format("array {} should have {} values, and other bytes are there; the file is damaged",
                             path, count));
}

/// A dataset with its type and length, both checked.
struct Array {
  Array(const File& owner, hid_t file, const std::string& path, std::uintmax_t file_bytes)
      : set(exists(file, path) ? H5Dopen2(file, path.c_str(), H5P_DEFAULT) : -1),
        type(set.good() ? H5Dget_type(set) : -1) {
    if (!set.good() || !type.good())
      owner.refuse(fmt::format("there is no array {}; the file is not complete", path));
    const Space space(H5Dget_space(set));
    const hssize_t points = H5Sget_simple_extent_npoints(space);
    const H5S_class_t shape = H5Sget_simple_extent_type(space);
    if (shape == H5S_NULL) return;  // h5py writes an empty array so
    if (shape != H5S_SIMPLE || H5Sget_simple_extent_ndims(space) != 1 || points < 0)
      owner.refuse(
          fmt::format("array {} has a shape other than a single row of values; write it as one", path));
    count = std::size_t(points);
    check_claim(owner, path, count, type, file_bytes);
    check_piece(owner, path, set, type, count, file_bytes);
  }

  Dataset set;
  Type type;
  std::size_t count = 0;
};

std::string_view name_of(Kind kind) {
  constexpr std::string_view names[] = {"nothing",      "a group", "whole numbers",
                                        "real numbers", "texts",   "values of another kind"};
  return names[std::size_t(kind)];
}

}  // namespace

File::File(const std::filesystem::path& path) : path_(path.string()) {
  std::error_code failure;
  bytes_ = std::filesystem::file_size(path, failure);
  if (failure) refuse("cannot be opened (" + failure.message() + "); check the path");
  const Turn turn;
  file_ = H5Fopen(path_.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  if (file_ < 0) refuse("is not an HDF5 file, or was cut off; write or copy it again");
}

File::~File() {
  const Turn turn;
  H5Fclose(file_);
}

void File::refuse(const std::string& sentence) const { throw InputError(path_, 0, sentence); }

Kind File::kind(const std::string& object) const {
  const Turn turn;
  if (!exists(file_, object)) return Kind::none;
  const Object open(H5Oopen(file_, object.c_str(), H5P_DEFAULT));
  if (!open.good()) return Kind::other;
  if (H5Iget_type(open) == H5I_GROUP) return Kind::group;
  if (H5Iget_type(open) != H5I_DATASET) return Kind::other;
  const Type type(H5Dget_type(open));
  return kind_of(type);
}

std::vector<std::string> File::members(const std::string& group) const {
  const Turn turn;
  const Group open(exists(file_, group) ? H5Gopen2(file_, group.c_str(), H5P_DEFAULT) : -1);
  H5G_info_t info;
  if (!open.good() || H5Gget_info(open, &info) < 0)
    refuse(fmt::format("there is no group {}; the file is not complete, or of another kind", group));
  std::vector<std::string> names;
  for (hsize_t i = 0; i < info.nlinks; ++i) {
    const auto length = H5Lget_name_by_idx(open, ".", H5_INDEX_NAME, H5_ITER_INC, i, nullptr, 0, H5P_DEFAULT);
    if (length < 0)
      refuse(fmt::format("the members of group {} cannot be listed; the file is damaged", group));
    std::string name(std::size_t(length), '\0');
    H5Lget_name_by_idx(open, ".", H5_INDEX_NAME, H5_ITER_INC, i, name.data(), name.size() + 1, H5P_DEFAULT);
    names.push_back(std::move(name));
  }
  return names;
}

std::size_t File::size(const std::string& array) const {
  const Turn turn;
  return Array(*this, file_, array, bytes_).count;
}

std::vector<float> File::reals(const std::string& path) const {
  const Turn turn;
  const Array array(*this, file_, path, bytes_);
  const Kind kind = kind_of(array.type);
  if (kind != Kind::reals && kind != Kind::integers)
    refuse(fmt::format("array {} holds {}; numbers are expected", path, name_of(kind)));
  std::vector<float> values(array.count);
  if (array.count && H5Dread(array.set, H5T_NATIVE_FLOAT, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0)
    refuse(fmt::format("array {} cannot be read; the file is damaged", path));
  return values;
}

std::vector<double> File::doubles(const std::string& path) const {
  const Turn turn;
  const Array array(*this, file_, path, bytes_);
  const Kind kind = kind_of(array.type);
  if (kind != Kind::reals && kind != Kind::integers)
    refuse(fmt::format("array {} holds {}; numbers are expected", path, name_of(kind)));
  std::vector<double> values(array.count);
  if (array.count && H5Dread(array.set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0)
    refuse(fmt::format("array {} cannot be read; the file is damaged", path));
  return values;
}

std::vector<std::int64_t> File::integers(const std::string& path) const {
  const Turn turn;
  const Array array(*this, file_, path, bytes_);
  if (kind_of(array.type) != Kind::integers)
    refuse(fmt::format("array {} holds {}; whole numbers are expected", path, name_of(kind_of(array.type))));
  std::vector<std::int64_t> values(array.count);
  if (array.count && H5Dread(array.set, H5T_NATIVE_INT64, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0)
    refuse(fmt::format("array {} cannot be read; the file is damaged", path));
  return values;
}

std::vector<std::string> File::texts(const std::string& path) const {
  const Turn turn;
  const Array array(*this, file_, path, bytes_);
  if (kind_of(array.type) != Kind::texts)
    refuse(fmt::format("array {} holds {}; texts are expected", path, name_of(kind_of(array.type))));
  std::vector<std::string> values(array.count);
  if (!array.count) return values;
  const auto damaged = [&] { refuse(fmt::format("array {} cannot be read; the file is damaged", path)); };

  const Type memory(H5Tcopy(H5T_C_S1));
  H5Tset_cset(memory, H5Tget_cset(array.type));
  if (H5Tis_variable_str(array.type) > 0) {
    H5Tset_size(memory, H5T_VARIABLE);
    std::vector<char*> pointers(array.count, nullptr);
    const bool good = H5Dread(array.set, memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, pointers.data()) >= 0;
    for (std::size_t i = 0; good && i < pointers.size(); ++i)
      if (pointers[i]) values[i] = pointers[i];
    const Space space(H5Dget_space(array.set));
    H5Dvlen_reclaim(memory, space, H5P_DEFAULT, pointers.data());
    if (!good) damaged();
  } else {
    const std::size_t width = H5Tget_size(array.type);
    H5Tset_size(memory, width);
    H5Tset_strpad(memory, H5T_STR_NULLPAD);
    std::string all(width * array.count, '\0');
    if (H5Dread(array.set, memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, all.data()) < 0) damaged();
    for (std::size_t i = 0; i < array.count; ++i) {
      const std::string_view field(all.data() + i * width, width);
      values[i] = field.substr(0, std::min(width, field.find('\0')));
    }
  }
  return values;
}

std::vector<std::int64_t> File::attribute(const std::string& object, const std::string& name) const {
  const Turn turn;
  if (!exists(file_, object) || H5Aexists_by_name(file_, object.c_str(), name.c_str(), H5P_DEFAULT) <= 0)
    return {};
  const Attribute open(H5Aopen_by_name(file_, object.c_str(), name.c_str(), H5P_DEFAULT, H5P_DEFAULT));
  const Type type(H5Aget_type(open));
  const Space space(H5Aget_space(open));
  const hssize_t count = H5Sget_simple_extent_npoints(space);
  constexpr hssize_t most = 65536 / sizeof(std::int64_t);  // attributes live in headers of 64 kB
  if (kind_of(type) != Kind::integers || count < 0 || count > most)
    refuse(fmt::format("attribute {} of {} is not a few whole numbers; the file is of another kind", name,
                       object));
  std::vector<std::int64_t> values(static_cast<std::size_t>(count));
  if (count && H5Aread(open, H5T_NATIVE_INT64, values.data()) < 0)
    refuse(fmt::format("attribute {} of {} cannot be read; the file is damaged", name, object));
  return values;
}

std::string File::text_attribute(const std::string& object, const std::string& name) const {
  const Turn turn;
  if (!exists(file_, object) || H5Aexists_by_name(file_, object.c_str(), name.c_str(), H5P_DEFAULT) <= 0)
    return {};
  const Attribute open(H5Aopen_by_name(file_, object.c_str(), name.c_str(), H5P_DEFAULT, H5P_DEFAULT));
  const Type type(H5Aget_type(open)), memory(H5Tcopy(H5T_C_S1));
  const Space space(H5Aget_space(open));
  if (kind_of(type) != Kind::texts || H5Sget_simple_extent_npoints(space) != 1) return {};
  H5Tset_cset(memory, H5Tget_cset(type));
  std::string text;
  if (H5Tis_variable_str(type) > 0) {
    H5Tset_size(memory, H5T_VARIABLE);
    char* pointer = nullptr;
    if (H5Aread(open, memory, &pointer) >= 0 && pointer) text = pointer;
    H5Dvlen_reclaim(memory, space, H5P_DEFAULT, &pointer);
  } else {
    text.resize(std::min<std::size_t>(H5Tget_size(type), 65536));  // attributes live in headers of 64 kB
    H5Tset_size(memory, text.size());
    H5Tset_strpad(memory, H5T_STR_NULLPAD);
    if (H5Aread(open, memory, text.data()) < 0) return {};
    text.resize(std::min(text.size(), text.find('\0')));
  }
  return text;
}

Matrix::Matrix(std::shared_ptr<const File> file, const std::string& path)
    : file_(std::move(file)), path_(path) {
  const Turn turn;
  const File& owner = *file_;
  // The numbers of a report lie in chunks that several rectangles share.
  const Properties access(H5Pcreate(H5P_DATASET_ACCESS));
  constexpr std::size_t slots = 12421, bytes = 64 << 20;
  H5Pset_chunk_cache(access, slots, bytes, .75);
  Dataset set(exists(owner.file_, path) ? H5Dopen2(owner.file_, path.c_str(), access) : -1);
  if (!set.good()) owner.refuse(fmt::format("there is no array {}; the file is not complete", path));
  const Type type(H5Dget_type(set));
  if (const Kind kind = kind_of(type); kind != Kind::reals && kind != Kind::integers)
    owner.refuse(fmt::format("array {} holds {}; numbers are expected", path, name_of(kind)));
  const Space space(H5Dget_space(set));
  std::array<hsize_t, 2> shape{};
  if (H5Sget_simple_extent_ndims(space) != 2 || H5Sget_simple_extent_dims(space, shape.data(), nullptr) != 2)
    owner.refuse(fmt::format("array {} has a shape other than rows and columns; write it as a matrix", path));
  rows_ = shape[0], columns_ = shape[1];
  if (columns_ && rows_ > SIZE_MAX / columns_)
    owner.refuse(
        fmt::format("array {} claims {} rows of {} values; the file is damaged", path, rows_, columns_));
  check_claim(owner, path, rows_ * columns_, type, owner.bytes_);
  set_ = set.release();
}

Matrix::~Matrix() {
  const Turn turn;
  if (set_ >= 0) H5Dclose(set_);
}

void Matrix::read(std::size_t row, std::size_t rows, std::size_t column, std::size_t columns,
                  float* out) const {
  if (rows == 0 || columns == 0) return;
  const Turn turn;
  const Space space(H5Dget_space(set_));
  const std::array<hsize_t, 2> start{row, column}, count{rows, columns};
  const Space memory(H5Screate_simple(2, count.data(), nullptr));
  if (H5Sselect_hyperslab(space, H5S_SELECT_SET, start.data(), nullptr, count.data(), nullptr) < 0 ||
      H5Dread(set_, H5T_NATIVE_FLOAT, memory, space, H5P_DEFAULT, out) < 0)
    file_->refuse(
        fmt::format("rows {} to {} of array {} cannot be read; the file is damaged", row, row + rows, path_));
}

NewFile::NewFile(const std::filesystem::path& path, const std::filesystem::path& named)
    : path_((named.empty() ? path : named).string()) {
  const Turn turn;
  file_ = H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  check(file_ >= 0, "created");
}

NewFile::NewFile() : path_("a file in memory") {
  const Turn turn;
  const Properties access(H5Pcreate(H5P_FILE_ACCESS));
  constexpr std::size_t growth = 1 << 16;
  H5Pset_fapl_core(access, growth, false);
  H5Pset_meta_block_size(access, 256);  // by default 2 kB are set aside, most of a small neuron's file
  H5Pset_small_data_block_size(access, 256);
  // Never a file of this name: the core driver keeps all in memory. The library opens a name only once at a time.
  static std::size_t made = 0;
  file_ = H5Fcreate(fmt::format("brainforest-memory-{}", ++made).c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access);
  check(file_ >= 0, "created");
}

NewFile::~NewFile() {
  const Turn turn;
  if (file_ >= 0) H5Fclose(file_);
}

void NewFile::check(bool good, const std::string& what) const {
  if (!good)
    throw Error(path_ + ": cannot be " + what + "; check that the folder exists and the disk has room");
}

void NewFile::group(const std::string& path) {
  const Turn turn;
  const Properties links(H5Pcreate(H5P_LINK_CREATE)), create(H5Pcreate(H5P_GROUP_CREATE));
  H5Pset_create_intermediate_group(links, 1);
  H5Pset_obj_track_times(create, false);
  check(Group(H5Gcreate2(file_, path.c_str(), links, create, H5P_DEFAULT)).good(), "written");
}

void NewFile::write(const std::string& path, std::int64_t file_type, std::int64_t memory_type,
                    const void* values, std::size_t count, std::size_t columns) {
  const Properties links(H5Pcreate(H5P_LINK_CREATE)), create(H5Pcreate(H5P_DATASET_CREATE));
  H5Pset_create_intermediate_group(links, 1);
  H5Pset_obj_track_times(create, false);
  const std::array<hsize_t, 2> shape{columns ? count / columns : count, columns};
  const Space space(H5Screate_simple(columns ? 2 : 1, shape.data(), nullptr));
  const Dataset set(H5Dcreate2(file_, path.c_str(), file_type, space, links, create, H5P_DEFAULT));
  check(set.good() && (!count || H5Dwrite(set, memory_type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values) >= 0),
        "written");
}

void NewFile::matrix(const std::string& path, std::size_t rows, std::size_t columns) {
  const Turn turn;
  const Properties links(H5Pcreate(H5P_LINK_CREATE)), create(H5Pcreate(H5P_DATASET_CREATE));
  H5Pset_create_intermediate_group(links, 1);
  H5Pset_obj_track_times(create, false);
  H5Pset_fill_time(create, H5D_FILL_TIME_NEVER);  // room on the disk is zero without writing it twice
  const std::array<hsize_t, 2> shape{rows, columns};
  const Space space(H5Screate_simple(2, shape.data(), nullptr));
  check(Dataset(H5Dcreate2(file_, path.c_str(), H5T_IEEE_F32LE, space, links, create, H5P_DEFAULT)).good(),
        "written");
}

void NewFile::fill(const std::string& path, std::size_t row, std::size_t rows, std::size_t column,
                   std::size_t columns, const float* values) {
  const Turn turn;
  const Dataset set(H5Dopen2(file_, path.c_str(), H5P_DEFAULT));
  const Space space(H5Dget_space(set));
  const std::array<hsize_t, 2> start{row, column}, count{rows, columns};
  const Space memory(H5Screate_simple(2, count.data(), nullptr));
  check(H5Sselect_hyperslab(space, H5S_SELECT_SET, start.data(), nullptr, count.data(), nullptr) >= 0 &&
            H5Dwrite(set, H5T_NATIVE_FLOAT, memory, space, H5P_DEFAULT, values) >= 0,
        "written");
}

// Stored little-endian on every machine.
void NewFile::write(const std::string& path, std::span<const float> values, std::size_t columns) {
  const Turn turn;
  write(path, H5T_IEEE_F32LE, H5T_NATIVE_FLOAT, values.data(), values.size(), columns);
}

void NewFile::write(const std::string& path, std::span<const double> values) {
  const Turn turn;
  write(path, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, values.data(), values.size());
}

void NewFile::write(const std::string& path, std::span<const std::int32_t> values, std::size_t columns) {
  const Turn turn;
  write(path, H5T_STD_I32LE, H5T_NATIVE_INT32, values.data(), values.size(), columns);
}

void NewFile::write(const std::string& path, std::span<const std::uint8_t> values) {
  const Turn turn;
  write(path, H5T_STD_U8LE, H5T_NATIVE_UINT8, values.data(), values.size());
}

void NewFile::write(const std::string& path, std::span<const std::uint32_t> values) {
  const Turn turn;
  write(path, H5T_STD_U32LE, H5T_NATIVE_UINT32, values.data(), values.size());
}

void NewFile::write(const std::string& path, std::span<const std::uint64_t> values) {
  const Turn turn;
  write(path, H5T_STD_U64LE, H5T_NATIVE_UINT64, values.data(), values.size());
}

void NewFile::write(const std::string& path, std::span<const std::string> values) {
  const Turn turn;
  const Type type(H5Tcopy(H5T_C_S1));
  H5Tset_size(type, H5T_VARIABLE);
  H5Tset_cset(type, H5T_CSET_UTF8);
  std::vector<const char*> pointers;
  for (const std::string& value : values) pointers.push_back(value.c_str());
  write(path, type, type, pointers.data(), pointers.size());
}

void NewFile::attribute(const std::string& object, const std::string& name, std::uint32_t value) {
  const Turn turn;
  const Space space(H5Screate(H5S_SCALAR));
  const Attribute open(H5Acreate_by_name(file_, object.c_str(), name.c_str(), H5T_STD_U32LE, space,
                                         H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
  check(open.good() && H5Awrite(open, H5T_NATIVE_UINT32, &value) >= 0, "written");
}

void NewFile::attribute(const std::string& object, const std::string& name,
                        std::span<const std::uint32_t> values) {
  const Turn turn;
  const hsize_t size = values.size();
  const Space space(H5Screate_simple(1, &size, nullptr));
  const Attribute open(H5Acreate_by_name(file_, object.c_str(), name.c_str(), H5T_STD_U32LE, space,
                                         H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
  check(open.good() && H5Awrite(open, H5T_NATIVE_UINT32, values.data()) >= 0, "written");
}

void NewFile::attribute(const std::string& object, const std::string& name, const std::string& text) {
  const Turn turn;
  const Type type(H5Tcopy(H5T_C_S1));
  H5Tset_size(type, H5T_VARIABLE);  // as h5py writes text: it reads others as bytes
  H5Tset_cset(type, H5T_CSET_UTF8);
  const Space space(H5Screate(H5S_SCALAR));
  const char* const characters = text.c_str();
  const Attribute open(H5Acreate_by_name(file_, object.c_str(), name.c_str(), type, space, H5P_DEFAULT,
                                         H5P_DEFAULT, H5P_DEFAULT));
  check(open.good() && H5Awrite(open, type, &characters) >= 0, "written");
}

std::string NewFile::bytes() {
  const Turn turn;
  check(H5Fflush(file_, H5F_SCOPE_LOCAL) >= 0, "written");
  const auto size = H5Fget_file_image(file_, nullptr, 0);
  check(size > 0, "written");
  std::string image(std::size_t(size), '\0');
  check(H5Fget_file_image(file_, image.data(), image.size()) == size, "written");
  close();
  return image;
}

void NewFile::close() {
  const Turn turn;
  const bool good = H5Fflush(file_, H5F_SCOPE_LOCAL) >= 0;
  check(H5Fclose(std::exchange(file_, -1)) >= 0 && good, "written");
}

}  // namespace forest::io::hdf5
