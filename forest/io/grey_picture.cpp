// SPDX-License-Identifier: Apache-2.0
#include "forest/io/grey_picture.h"

#include <algorithm>
#include <array>
#include <bit>
#include <csetjmp>
#include <cstring>
#include <limits>
#include <optional>
#include <png.h>
#include <tiffio.h>
#include <type_traits>

#include <fmt/format.h>

#include "forest/core/error.h"

namespace forest::io {
namespace {

constexpr std::uint64_t most_pixels = std::uint64_t(1) << 28;
constexpr std::uint64_t most_bytes = std::uint64_t(1) << 31;  // of what is unpacked at once

void check_size(std::uint64_t width, std::uint64_t height, const std::string& name) {
  if (width == 0 || height == 0 || width > most_pixels || width * height > most_pixels)
    throw InputError(
        name, 0,
        fmt::format("has {} × {} pixels, and 1 to {} are read; cut or scale it", width, height, most_pixels));
}

[[noreturn]] void refuse(const char* kind, std::string reason, const std::string& name) {
  while (!reason.empty() && (reason.back() == '.' || reason.back() == '\n')) reason.pop_back();
  throw InputError(name, 0,
                   fmt::format("is no {} picture that can be read ({}); write it again", kind, reason));
}

float luminance(float red, float green, float blue) { return .2126f * red + .7152f * green + .0722f * blue; }

// Whoever calls libpng comes back here by a jump, so nothing lives in functions that it leaves.
struct Png {
  std::string_view bytes;
  std::size_t at = 0;
  std::string reason;
  png_structp png = nullptr;
  png_infop info = nullptr;
  std::uint32_t width = 0, height = 0;
  int channels = 0, depth = 0;
  std::vector<png_byte> pixels;
  std::vector<png_bytep> rows;

  explicit Png(std::string_view whole) : bytes(whole) {
    png = png_create_read_struct(
        PNG_LIBPNG_VER_STRING, this,
        [](png_structp p, png_const_charp message) {
          static_cast<Png*>(png_get_error_ptr(p))->reason = message;
          png_longjmp(p, 1);
        },
        [](png_structp, png_const_charp) {});
    if (png) info = png_create_info_struct(png);
    if (!info) throw Error("there is no memory for a picture");
    png_set_read_fn(png, this, [](png_structp p, png_bytep to, std::size_t count) {
      Png& self = *static_cast<Png*>(png_get_io_ptr(p));
      if (count > self.bytes.size() - self.at) png_error(p, "it ends too early");
      std::memcpy(to, self.bytes.data() + self.at, count);
      self.at += count;
    });
  }
  ~Png() { png_destroy_read_struct(&png, &info, nullptr); }
  Png(const Png&) = delete;
  Png& operator=(const Png&) = delete;

  bool begin() {
    if (setjmp(png_jmpbuf(png))) return false;
    png_read_info(png, info);
    width = png_get_image_width(png, info), height = png_get_image_height(png, info);
    return true;
  }
  bool unpack() {
    if (setjmp(png_jmpbuf(png))) return false;
    png_set_expand(png);
    png_set_strip_alpha(png);
    if constexpr (std::endian::native == std::endian::little) png_set_swap(png);
    png_set_interlace_handling(png);
    png_read_update_info(png, info);
    channels = png_get_channels(png, info), depth = png_get_bit_depth(png, info);
    const std::size_t row = png_get_rowbytes(png, info);
    pixels.resize(row * height), rows.resize(height);
    for (std::size_t y = 0; y < height; ++y) rows[y] = pixels.data() + y * row;
    png_read_image(png, rows.data());
    png_read_end(png, nullptr);
    return true;
  }
};

GreyPicture read_png(std::string_view bytes, const std::string& name) {
  Png png(bytes);
  if (!png.begin()) refuse("PNG", png.reason, name);
  check_size(png.width, png.height, name);
  if (!png.unpack()) refuse("PNG", png.reason, name);
  GreyPicture picture{png.width, png.height, std::vector<float>(std::size_t(png.width) * png.height)};
  const auto channels = std::size_t(png.channels);
  for (std::size_t i = 0; i < picture.values.size(); ++i) {
    const auto value = [&](std::size_t channel) {
      const png_byte* at = png.pixels.data() + (i * channels + channel) * std::size_t(png.depth / 8);
      if (png.depth == 8) return float(*at) / 255.f;
      std::uint16_t wide = 0;
      std::memcpy(&wide, at, 2);
      return float(wide) / 65535.f;
    };
    picture.values[i] = channels == 1 ? value(0) : luminance(value(0), value(1), value(2));
  }
  return picture;
}

// A TIFF that lies in memory.
class Tiff {
 public:
  Tiff(std::string_view bytes, const std::string& name) : bytes_(bytes), name_(name) {
    const std::unique_ptr<TIFFOpenOptions, void (*)(TIFFOpenOptions*)> options(TIFFOpenOptionsAlloc(),
                                                                               TIFFOpenOptionsFree);
    TIFFOpenOptionsSetErrorHandlerExtR(
        options.get(),
        [](TIFF*, void* self, const char*, const char* format, va_list arguments) {
          std::array<char, 256> text{};
          std::vsnprintf(text.data(), text.size(), format, arguments);
          if (std::string& reason = static_cast<Tiff*>(self)->reason_; reason.empty()) reason = text.data();
          return 1;
        },
        this);
    TIFFOpenOptionsSetWarningHandlerExtR(
        options.get(), [](TIFF*, void*, const char*, const char*, va_list) { return 1; }, nullptr);
    tiff_ = TIFFClientOpenExt(name.c_str(), "rm", this, read, write, seek, close, size, map, unmap,
                              options.get());
    if (!tiff_) refuse();
  }
  ~Tiff() { TIFFClose(tiff_); }
  Tiff(const Tiff&) = delete;
  Tiff& operator=(const Tiff&) = delete;

  std::size_t pages() { return TIFFNumberOfDirectories(tiff_); }
  GreyPicture page(std::size_t number) {
    // Sought, a page is found by way of all before it.
    if (number == at_page_ + 1 ? !TIFFReadDirectory(tiff_) : !TIFFSetDirectory(tiff_, tdir_t(number)))
      refuse();
    at_page_ = number;
    width_ = tag<std::uint32_t>(TIFFTAG_IMAGEWIDTH), height_ = tag<std::uint32_t>(TIFFTAG_IMAGELENGTH);
    check_size(width_, height_, name_);
    if (tag<std::uint16_t>(TIFFTAG_ORIENTATION) > ORIENTATION_BOTLEFT)
      throw InputError(name_, 0,
                       "has a page that lies on its side (Orientation); turn it, and write it again");
    bits_ = tag<std::uint16_t>(TIFFTAG_BITSPERSAMPLE), samples_ = tag<std::uint16_t>(TIFFTAG_SAMPLESPERPIXEL);
    format_ = tag<std::uint16_t>(TIFFTAG_SAMPLEFORMAT);
    const auto shown = tag<std::uint16_t>(TIFFTAG_PHOTOMETRIC);
    const bool grey = shown == PHOTOMETRIC_MINISBLACK || shown == PHOTOMETRIC_MINISWHITE,
               colours = shown == PHOTOMETRIC_RGB && samples_ >= 3,
               whole = (format_ == SAMPLEFORMAT_UINT || (format_ == SAMPLEFORMAT_INT && grey)) &&
                       (bits_ == 8 || bits_ == 16 || bits_ == 32),
               real = format_ == SAMPLEFORMAT_IEEEFP && bits_ == 32;
    GreyPicture picture{width_, height_, std::vector<float>(std::size_t(width_) * height_)};
    if (!(grey || colours) || !(whole || real)) {
      as_shown(picture);
      return picture;
    }
    for (std::uint16_t k = 0; k < (grey ? 1 : 3); ++k) add(picture, k, grey ? 1.f : shares[k]);
    if (shown == PHOTOMETRIC_MINISWHITE && whole)
      for (float& v : picture.values) v = 1.f - v;
    turn_upright(picture);
    return picture;
  }

 private:
  static constexpr std::array shares{.2126f, .7152f, .0722f};

  [[noreturn]] void refuse() const { io::refuse("TIFF", reason_.empty() ? "it is damaged" : reason_, name_); }

  template <class T>
  T tag(std::uint32_t which) const {
    T value{};
    TIFFGetFieldDefaulted(tiff_, which, &value);
    return value;
  }

  // By the place of its first pixel.
  void turn_upright(GreyPicture& picture) const {
    const auto first = tag<std::uint16_t>(TIFFTAG_ORIENTATION);
    if (first == ORIENTATION_BOTRIGHT || first == ORIENTATION_BOTLEFT)
      for (std::size_t y = 0; y < height_ / 2; ++y)
        std::swap_ranges(picture.values.begin() + std::ptrdiff_t(y * width_),
                         picture.values.begin() + std::ptrdiff_t((y + 1) * width_),
                         picture.values.begin() + std::ptrdiff_t((height_ - 1 - y) * width_));
    if (first == ORIENTATION_BOTRIGHT || first == ORIENTATION_TOPRIGHT)
      for (std::size_t y = 0; y < height_; ++y)
        std::reverse(picture.values.begin() + std::ptrdiff_t(y * width_),
                     picture.values.begin() + std::ptrdiff_t((y + 1) * width_));
  }

  // What a viewer shows: palettes, JPEG, few bits.
  void as_shown(GreyPicture& picture) {
    std::vector<std::uint32_t> pixels(picture.values.size());
    if (!TIFFReadRGBAImageOriented(tiff_, width_, height_, pixels.data(), ORIENTATION_TOPLEFT, 1)) refuse();
    std::ranges::transform(pixels, picture.values.begin(), [](std::uint32_t p) {
      return luminance(float(TIFFGetR(p)), float(TIFFGetG(p)), float(TIFFGetB(p))) / 255.f;
    });
  }

  // One of the samples of all pixels, times its share.
  void add(GreyPicture& picture, std::uint16_t sample, float share) {
    const bool apart = tag<std::uint16_t>(TIFFTAG_PLANARCONFIG) == PLANARCONFIG_SEPARATE,
               tiled = TIFFIsTiled(tiff_);
    const std::uint32_t wide = tiled ? tag<std::uint32_t>(TIFFTAG_TILEWIDTH) : width_,
                        high = std::min(tiled ? tag<std::uint32_t>(TIFFTAG_TILELENGTH)
                                              : tag<std::uint32_t>(TIFFTAG_ROWSPERSTRIP),
                                        tiled ? UINT32_MAX : height_);
    const std::size_t pixel = std::size_t(apart ? 1 : samples_) * (bits_ / 8),
                      first = apart ? 0 : sample * (bits_ / 8u);
    const auto full = std::uint64_t(tiled ? TIFFTileSize64(tiff_) : TIFFStripSize64(tiff_));
    if (wide == 0 || high == 0 || full == 0 || full > most_bytes || full / high / pixel < wide) refuse();
    block_.resize(full);
    for (std::uint32_t top = 0; top < height_; top += high)
      for (std::uint32_t left = 0; left < width_; left += wide) {
        const std::uint32_t rows = std::min(high, height_ - top), columns = std::min(wide, width_ - left);
        const std::size_t stride = full / high;  // bytes of a row of the block
        const tmsize_t got = tiled ? TIFFReadEncodedTile(tiff_, TIFFComputeTile(tiff_, left, top, 0, sample),
                                                         block_.data(), tmsize_t(full))
                                   : TIFFReadEncodedStrip(tiff_, TIFFComputeStrip(tiff_, top, sample),
                                                          block_.data(), tmsize_t(full));
        if (got < 0 || std::uint64_t(got) < std::uint64_t(rows) * stride) refuse();
        for (std::size_t y = 0; y < rows; ++y) {
          float* to = picture.values.data() + (top + y) * width_ + left;
          const std::byte* from = block_.data() + y * stride + first;
          for (std::size_t x = 0; x < columns; ++x, from += pixel) to[x] += share * value(from);
        }
      }
  }

  template <class T>
  static float share_of_most(const std::byte* at) {
    T number{};
    std::memcpy(&number, at, sizeof number);
    if constexpr (std::is_floating_point_v<T>)
      return number;
    else
      return float(double(number) / double(std::numeric_limits<T>::max()));
  }
  float value(const std::byte* at) const {
    if (format_ == SAMPLEFORMAT_IEEEFP) return share_of_most<float>(at);
    const bool has_sign = format_ == SAMPLEFORMAT_INT;
    if (bits_ == 8) return has_sign ? share_of_most<std::int8_t>(at) : share_of_most<std::uint8_t>(at);
    if (bits_ == 16) return has_sign ? share_of_most<std::int16_t>(at) : share_of_most<std::uint16_t>(at);
    return has_sign ? share_of_most<std::int32_t>(at) : share_of_most<std::uint32_t>(at);
  }

  static Tiff& of(thandle_t self) { return *static_cast<Tiff*>(self); }
  static tmsize_t read(thandle_t self, void* to, tmsize_t count) {
    Tiff& t = of(self);
    const std::size_t size =
        t.at_ < t.bytes_.size() ? std::min(std::size_t(count), t.bytes_.size() - t.at_) : 0;
    std::memcpy(to, t.bytes_.data() + t.at_, size);
    t.at_ += size;
    return tmsize_t(size);
  }
  static tmsize_t write(thandle_t, void*, tmsize_t) { return -1; }
  static toff_t seek(thandle_t self, toff_t by, int from) {
    Tiff& t = of(self);
    const toff_t begin = from == SEEK_SET ? 0 : from == SEEK_CUR ? t.at_ : t.bytes_.size();
    return t.at_ = begin + by;
  }
  static int close(thandle_t) { return 0; }
  static toff_t size(thandle_t self) { return of(self).bytes_.size(); }
  static int map(thandle_t, void**, toff_t*) { return 0; }
  static void unmap(thandle_t, void*, toff_t) {}

  std::string_view bytes_;
  const std::string& name_;
  std::string reason_;  // the first of libtiff's
  std::size_t at_ = 0;
  TIFF* tiff_ = nullptr;
  std::size_t at_page_ = 0;
  std::uint32_t width_ = 0, height_ = 0;
  std::uint16_t bits_ = 0, samples_ = 0, format_ = 0;
  std::vector<std::byte> block_;
};

bool is_png(std::string_view bytes, const std::string& name) {
  if (bytes.starts_with("\x89PNG")) return true;
  if (!bytes.starts_with("II") && !bytes.starts_with("MM"))
    throw InputError(name, 0, "is neither a PNG nor a TIFF picture; write it as one of them");
  return false;
}

}  // namespace

bool is_picture_name(std::string_view extension) {
  return extension == ".png" || extension == ".tif" || extension == ".tiff";
}

class GreyFile::Pages {
 public:
  Pages(std::string_view bytes, const std::string& name) : bytes_(bytes), name_(name) {
    if (!is_png(bytes, name_)) tiff_.emplace(bytes, name_);
    count_ = tiff_ ? tiff_->pages() : 1;
  }
  std::size_t count() const { return count_; }
  GreyPicture read(std::size_t page) {
    if (page >= count_)
      throw InputError(name_, 0, fmt::format("has {} pages, and none with the number {}", count_, page + 1));
    return tiff_ ? tiff_->page(page) : read_png(bytes_, name_);
  }

 private:
  std::string_view bytes_;
  std::string name_;
  std::optional<Tiff> tiff_;  // none: a PNG
  std::size_t count_;
};

GreyFile::GreyFile(std::string_view bytes, const std::string& name)
    : pages_(std::make_unique<Pages>(bytes, name)) {}
GreyFile::~GreyFile() = default;
std::size_t GreyFile::pages() const { return pages_->count(); }
GreyPicture GreyFile::read(std::size_t page) { return pages_->read(page); }

}  // namespace forest::io
