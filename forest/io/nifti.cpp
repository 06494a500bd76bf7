// SPDX-License-Identifier: Apache-2.0
#include "forest/io/nifti.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/io/inflate.h"

namespace forest::io {
namespace {

constexpr std::size_t most_bytes = std::size_t(1) << 32, most_voxels = std::size_t(1) << 30;

// Where things lie in the header: version 1, version 2.
struct Layout {
  std::size_t header, magic, dim, type, pixdim, offset, slope, inter, units, qform, sform, quatern, shift,
      srow;
  bool wide;  // dim and offset are of 64 bits, others double
};
constexpr Layout one{348, 344, 40, 70, 76, 108, 112, 116, 123, 252, 254, 256, 268, 280, false};
constexpr Layout two{540, 4, 16, 12, 104, 168, 176, 184, 500, 344, 348, 352, 376, 400, true};

struct TypeRow {
  int code;
  std::size_t size;
  double (*read)(const char*);
};
template <class T>
double as(const char* at) {
  T value;
  std::memcpy(&value, at, sizeof value);
  return double(value);
}
constexpr std::array<TypeRow, 10> types{{{2, 1, as<std::uint8_t>},
                                         {256, 1, as<std::int8_t>},
                                         {4, 2, as<std::int16_t>},
                                         {512, 2, as<std::uint16_t>},
                                         {8, 4, as<std::int32_t>},
                                         {768, 4, as<std::uint32_t>},
                                         {1024, 8, as<std::int64_t>},
                                         {1280, 8, as<std::uint64_t>},
                                         {16, 4, as<float>},
                                         {64, 8, as<double>}}};

class Header {
 public:
  Header(std::string_view bytes, const std::string& name) : bytes_(bytes), name_(name) {
    if (bytes.size() < 4) fail("is no NIfTI volume; give a .nii or .nii.gz file");
    for (const Layout* layout : {&one, &two})
      for (const bool swapped : {false, true}) {
        std::array<char, 4> size{bytes[0], bytes[1], bytes[2], bytes[3]};
        if (swapped) std::swap(size[0], size[3]), std::swap(size[1], size[2]);
        if (as<std::int32_t>(size.data()) == double(layout->header)) layout_ = layout, swapped_ = swapped;
      }
    if (!layout_) fail("is no NIfTI volume; give a .nii or .nii.gz file");
    if (bytes.size() < layout_->header)
      fail(fmt::format("ends within its header of {} bytes; get the whole file", layout_->header));
    const std::string_view magic = bytes.substr(layout_->magic, 3);
    if (magic == "ni1" || magic == "ni2")
      fail(
          "keeps its voxels in another file (.img); bring both together, such as by 'fslchfiletype "
          "NIFTI_GZ'");
    if (magic != (layout_->wide ? "n+2" : "n+1"))
      fail("has the header of an older format (ANALYZE) or a damaged one; convert it to NIfTI");
  }

  const Layout& at() const { return *layout_; }
  double whole(std::size_t place, bool wide) const {
    return wide ? number<std::int64_t>(place) : number<std::int16_t>(place);
  }
  double real(std::size_t place, std::size_t index = 0) const {
    return layout_->wide ? number<double>(place + 8 * index) : number<float>(place + 4 * index);
  }
  template <class T>
  double number(std::size_t place) const {
    return number_at(bytes_.data() + place, sizeof(T), as<T>);
  }
  double number_at(const char* place, std::size_t size, double (*read)(const char*)) const {
    std::array<char, 8> raw{};
    for (std::size_t i = 0; i < size; ++i) raw[i] = place[swapped_ ? size - 1 - i : i];
    return read(raw.data());
  }
  [[noreturn]] void fail(const std::string& sentence) const { throw InputError(name_, 0, sentence); }

 private:
  std::string_view bytes_;
  const std::string& name_;
  const Layout* layout_ = nullptr;
  bool swapped_ = false;
};

using Affine = Eigen::Matrix<double, 3, 4>;

// From voxels to the unit of the file.
Affine affine_of(const Header& header, const std::array<double, 3>& step) {
  const Layout& at = header.at();
  const auto code = [&](std::size_t place) {
    return at.wide ? header.number<std::int32_t>(place) : header.number<std::int16_t>(place);
  };
  Affine affine = Affine::Zero();
  if (code(at.sform) > 0.) {
    for (std::size_t r = 0; r < 3; ++r)
      for (std::size_t c = 0; c < 4; ++c)
        affine(Eigen::Index(r), Eigen::Index(c)) = header.real(at.srow, 4 * r + c);
    return affine;
  }
  for (int k = 0; k < 3; ++k) affine(k, k) = step[std::size_t(k)];
  if (code(at.qform) > 0.) {
    const double b = header.real(at.quatern, 0), c = header.real(at.quatern, 1),
                 d = header.real(at.quatern, 2);
    const double a = std::sqrt(std::max(0., 1. - b * b - c * c - d * d));
    const double flip = header.real(at.pixdim, 0) < 0. ? -1. : 1.;
    affine.leftCols<3>() = Eigen::Quaterniond(a, b, c, d).normalized().toRotationMatrix() *
                           Eigen::Vector3d(step[0], step[1], flip * step[2]).asDiagonal();
    for (int k = 0; k < 3; ++k) affine(k, 3) = header.real(at.shift, std::size_t(k));
  }
  return affine;
}

}  // namespace

bool may_be_nifti(std::string_view bytes) {
  if (bytes.starts_with("\x1f\x8b")) return true;
  for (const std::string_view size :
       {std::string_view("\x5c\x01\0\0", 4), std::string_view("\0\0\x01\x5c", 4),
        std::string_view("\x1c\x02\0\0", 4), std::string_view("\0\0\x02\x1c", 4)})
    if (bytes.starts_with(size)) return true;
  return false;
}

NiftiVolume read_nifti(std::string_view packed, const std::string& name) {
  std::string place;
  std::string_view bytes = packed;
  if (packed.starts_with("\x1f\x8b")) bytes = place = inflated(packed, most_bytes, name);
  const Header header(bytes, name);
  const Layout& at = header.at();
  const std::size_t each = at.wide ? 8 : 2;
  const double axes = header.whole(at.dim, at.wide);
  if (!(axes >= 2. && axes <= 7.))
    header.fail(fmt::format("has {} axes where a volume has 3; get the file again", axes));
  std::array<std::size_t, 3> size{1, 1, 1};
  std::array<double, 3> step{};
  double voxels = 1.;
  for (std::size_t k = 0; k < 3; ++k) {
    const double count = double(k) < axes ? header.whole(at.dim + each * (k + 1), at.wide) : 1.;
    voxels *= count;
    if (!(count >= 1. && voxels <= double(most_voxels)))
      header.fail(fmt::format("says that it has {} voxels along axis {}; get the file again", count, k + 1));
    size[k] = std::size_t(count);
    step[k] = std::abs(header.real(at.pixdim, k + 1));
  }
  const auto code = int(header.number<std::int16_t>(at.type));
  const auto type = std::ranges::find(types, code, &TypeRow::code);
  if (type == types.end())
    header.fail(
        fmt::format("has voxels of type {}, which is none of one number each; write it as float", code));
  const double offset = at.wide ? header.number<std::int64_t>(at.offset) : header.number<float>(at.offset);
  if (!(offset >= double(at.header) && offset <= double(bytes.size())) ||
      voxels * double(type->size) > double(bytes.size()) - offset)
    header.fail(fmt::format(
        "should have {:.0f} voxels of {} bytes from byte {:.0f} on and has {} bytes; get the whole file",
        voxels, type->size, offset, bytes.size()));
  // Units: 1 m, 2 mm, 3 µm; 0 is not said, and then mm as all write.
  const int unit =
      int(at.wide ? header.number<std::int32_t>(at.units) : header.number<std::int8_t>(at.units)) & 7;
  const double scale = unit == 1 ? 1e6 : unit == 3 ? 1. : 1e3;
  const Affine affine = affine_of(header, step) * scale;
  if (!affine.allFinite()) header.fail("has a place or a voxel size that is no number; get the file again");
  // Which axis of the file is which of space: the largest of each column; what is left over of a voxel is the obliqueness.
  std::array<int, 3> which{};
  double oblique = 0.;
  for (int c = 0; c < 3; ++c) {
    affine.col(c).cwiseAbs().maxCoeff(&which[std::size_t(c)]);
    const double edge = std::abs(affine(which[std::size_t(c)], c));
    for (int r = 0; r < 3; ++r)
      if (r != which[std::size_t(c)])
        oblique = std::max(oblique, std::abs(affine(r, c)) / edge * double(size[std::size_t(c)]));
    if (!(edge > 1e-6 && edge < 1e9))
      header.fail(fmt::format("has voxels of {} µm along axis {}; get the file again", edge, c + 1));
  }
  if (which[0] == which[1] || which[0] == which[2] || which[1] == which[2] || oblique > .2)
    header.fail(
        "has axes that are oblique to those of space; resample it, such as by 'flirt' or 'mri_convert'");
  double slope = header.real(at.slope), inter = header.real(at.inter);
  if (!(std::isfinite(slope) && std::isfinite(inter)) || slope == 0.) slope = 1., inter = 0.;

  NiftiVolume result;
  double more = 1.;  // volumes
  for (std::size_t k = 3; double(k) < axes; ++k)
    more *= std::max(1., header.whole(at.dim + each * (k + 1), at.wide));
  if (more > 1.) result.oddities.push_back(fmt::format("has {} volumes; the first is taken", more));
  cortex::Volume& volume = result.volume;
  std::array<std::ptrdiff_t, 3> stride{};  // by axis of the file, in the result
  for (std::size_t c = 0; c < 3; ++c) volume.size[std::size_t(which[c])] = size[c];
  const std::array<std::ptrdiff_t, 3> own{1, std::ptrdiff_t(volume.size[0]),
                                          std::ptrdiff_t(volume.size[0] * volume.size[1])};
  std::ptrdiff_t first = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    const int r = which[c];
    const double edge = affine(r, Eigen::Index(c));
    volume.step[r] = std::abs(edge);
    volume.origin[r] = affine(r, 3) + (edge < 0. ? edge * double(size[c] - 1) : 0.);
    stride[c] = own[std::size_t(r)] * (edge < 0. ? -1 : 1);
    if (edge < 0.) first -= stride[c] * std::ptrdiff_t(size[c] - 1);
  }
  volume.values.resize(std::size_t(voxels));
  const char* from = bytes.data() + std::size_t(offset);
  for (std::size_t k = 0; k < size[2]; ++k)
    for (std::size_t j = 0; j < size[1]; ++j) {
      std::ptrdiff_t to = first + std::ptrdiff_t(k) * stride[2] + std::ptrdiff_t(j) * stride[1];
      for (std::size_t i = 0; i < size[0]; ++i, from += type->size, to += stride[0])
        volume.values[std::size_t(to)] =
            float(slope * header.number_at(from, type->size, type->read) + inter);
    }
  if (const auto odd = std::ranges::count_if(volume.values, [](float v) { return std::isnan(v); }))
    result.oddities.push_back(fmt::format("has {} voxel{} no number; what is none counts as outside", odd,
                                          odd == 1 ? " that is" : "s that are"));
  return result;
}

}  // namespace forest::io
