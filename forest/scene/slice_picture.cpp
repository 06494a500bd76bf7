// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/slice_picture.h"

#include <algorithm>

#include <fmt/format.h>

#include "forest/core/parallel.h"
#include "forest/core/round_numbers.h"
#include "forest/core/srgb.h"
#include "forest/frame/matte.h"
#include "forest/scene/colour_bar.h"
#include "forest/scene/lettering.h"

namespace forest::scene {
namespace {

constexpr double rim_pixels = 1.1;  // how much darker line a profile has around it, where it is large enough
constexpr int lines = 4;            // a pixel's scan lines
constexpr std::size_t rows_at_once = 16;
constexpr std::uint32_t glance =
    320;  // pixels across of what is looked at to place the scale bar of vector graphics

struct Tones {
  Vec3 paper, ink, plate;  // linear light; the plate under a scale bar is seen on the paper
  float tint, rim;         // share of paper in a filled profile; light that its rim keeps
};
Tones tones_of(Background background) {
  return background != Background::dark ? Tones{.paper = Vec3::Constant(.86f),
                                                .ink = Vec3::Constant(.01f),
                                                .plate = Vec3::Constant(.77f),
                                                .tint = .30f,
                                                .rim = .22f}
                                        : Tones{.paper = Vec3(.006f, .009f, .014f),
                                                .ink = Vec3::Constant(.8f),
                                                .plate = Vec3(.016f, .021f, .030f),
                                                .tint = 0.f,
                                                .rim = .45f};
}

Vec3 fill_of(const Colouring& colouring, const Profile& p, const Tones& tones) {
  const Vec3& base = colouring.palette[colouring.entry(colouring.states[p.instance], p.segment, p.kind)];
  const float tint = colouring.gauge ? 0.f : tones.tint;  // a bar tells values by their very colours
  return base.cwiseMin(1.f) * (1.f - tint) + tones.paper * tint;
}

float srgb(float c) { return to_srgb(std::clamp(c, 0.f, 1.f)); }

std::string hex(const Vec3& linear) {
  const auto byte = [](float c) { return std::lround(255.f * srgb(c)); };
  return fmt::format("#{:02x}{:02x}{:02x}", byte(linear.x()), byte(linear.y()), byte(linear.z()));
}

// A profile in pixels, x to the right and y down, clockwise on the screen.
using Shape = std::vector<Place>;
Shape in_pixels(const Profile& profile, const SlicePicture& picture) {
  Shape shape = profile.shape.outline(.1 * picture.pixel(), 4e-3);
  for (Place& p : shape)
    p = Place(.5 * picture.width_pixels + (p.x() - picture.centre.x()) / picture.pixel(),
              .5 * picture.height_pixels - (p.y() - picture.centre.y()) / picture.pixel());
  return shape;
}

// The shape less a rim; empty when nothing remains.
Shape within_rim(const Shape& shape) {
  Shape inner;
  for (std::size_t i = 0; i < shape.size() && (inner.size() > 2 || i == 0); ++i) {
    const Place &p = shape[i], &q = shape[(i + 1) % shape.size()];
    const Place way = q - p;
    const Place inward = Place(way.y(), -way.x()) / std::max(way.norm(), 1e-12);
    // Cut what remains by the edge, moved inwards (Sutherland & Hodgman 1974).
    const Shape open = i == 0 ? shape : inner;
    inner.clear();
    const auto depth = [&](const Place& at) { return inward.dot(at - p) - rim_pixels; };
    for (std::size_t k = 0; k < open.size(); ++k) {
      const Place &a = open[k], &b = open[(k + 1) % open.size()];
      const double da = depth(a), db = depth(b);
      if (da >= 0.) inner.push_back(a);
      if ((da < 0.) != (db < 0.)) inner.push_back(a + da / (da - db) * (b - a));
    }
  }
  return inner.size() > 2 ? inner : Shape{};
}

class Sketchpad {
 public:
  Sketchpad(std::size_t width, std::size_t first, std::size_t last, const Vec3& colour)
      : width_(width), first_(first), last_(last), pixels_(width * (last - first), colour), covered_(width) {}

  /// A convex shape, its edges by the share of each pixel that it covers.
  void fill(const Shape& shape, const Vec3& colour) {
    if (shape.size() < 3) return;
    double top = INFINITY, bottom = -INFINITY;
    for (const Place& p : shape) top = std::min(top, p.y()), bottom = std::max(bottom, p.y());
    const auto from = std::max(double(first_), std::floor(top)),
               to = std::min(double(last_), std::ceil(bottom));
    for (double row = from; row < to; row += 1.) {
      std::size_t low = width_, high = 0;
      for (int line = 0; line < lines; ++line) {
        const double y = row + (line + .5) / lines;
        double left = INFINITY, right = -INFINITY;
        for (std::size_t i = 0; i < shape.size(); ++i) {
          const Place &p = shape[i], &q = shape[(i + 1) % shape.size()];
          if ((p.y() <= y) == (q.y() <= y)) continue;
          const double x = p.x() + (y - p.y()) / (q.y() - p.y()) * (q.x() - p.x());
          left = std::min(left, x), right = std::max(right, x);
        }
        left = std::max(left, 0.), right = std::min(right, double(width_));
        if (!(left < right)) continue;
        const auto first = std::size_t(left), last = std::min(width_ - 1, std::size_t(right));
        low = std::min(low, first), high = std::max(high, last + 1);
        for (std::size_t x = first; x <= last; ++x)
          covered_[x] += float(std::min(right, double(x + 1)) - std::max(left, double(x))) / float(lines);
      }
      Vec3* pixels = &pixels_[(std::size_t(row) - first_) * width_];
      for (std::size_t x = low; x < high; ++x) {
        pixels[x] += std::clamp(covered_[x], 0.f, 1.f) * (colour - pixels[x]);
        covered_[x] = 0.f;
      }
    }
  }
  const std::vector<Vec3>& pixels() const { return pixels_; }

 private:
  std::size_t width_, first_, last_;
  std::vector<Vec3> pixels_;
  std::vector<float> covered_;
};

struct ScaleBar {
  double length;  // µm
  std::string label;
};
ScaleBar scale_bar_of(const SlicePicture& picture) {
  const double length = round_below(.2 * picture.width_pixels * picture.pixel());
  if (length < 1.) return {length, fmt::format("{:.0f} nm", 1000. * length)};
  return {length,
          length < 1000. ? fmt::format("{:.0f} µm", length) : fmt::format("{:.0f} mm", length / 1000.)};
}

Block scale_block(const SlicePicture& picture, const Tones& tones) {
  const ScaleBar bar = scale_bar_of(picture);
  const float height = std::max(7.f, std::round(float(picture.height_pixels) / 60.f)), pad = .7f * height,
              length = float(bar.length / picture.pixel());
  const Lettering letters{.height = height, .colour = tones.ink.unaryExpr(&srgb)};
  return {Block::scale,
          Spot::bottom_left,
          std::max(length, letters.width(bar.label)) + 2.f * pad,
          2.1f * height + 2.f * pad,
          height,
          [=](frame::Image& image, float left, float top) {
            left += pad, top += pad + 1.7f * height;
            fill(image, {left, top, left + length, top + .4f * height}, letters.colour);
            letters.write(image, bar.label, left, top - .7f * height);
          }};
}

// "z = 0.245 mm", or a point of it and what stands on it where that is no axis.
std::string position_of(const Plane& plane) {
  const Vec3 mm = plane.origin / 1000.f;
  for (int axis = 0; axis < 3; ++axis)
    if (std::abs(plane.normal[axis]) > .9999f)
      return fmt::format("{} = {:.6g} mm", "xyz"[axis], mm[axis] + 0.f);
  const Vec3& n = plane.normal;
  return fmt::format("through {:.6g}, {:.6g}, {:.6g} mm, across {:.3g}, {:.3g}, {:.3g}", mm.x(), mm.y(),
                     mm.z(), n.x(), n.y(), n.z());
}

// What tells how long and what the colours mean.
std::vector<Block> words_of(const Colouring& colouring, const SlicePicture& picture, const Tones& tones) {
  std::vector<Block> words;
  if (!picture.words) return words;
  if (const auto bar = bar_of(colouring, picture.background)) {
    const frame::Viewport size{float(picture.width_pixels), float(picture.height_pixels)};
    if (auto block = block_of(std::span(&*bar, 1), size, picture.background))
      words.push_back(std::move(*block));
  }
  words.push_back(scale_block(picture, tones));
  return words;
}

Paper paper_of(const SlicePicture& picture, const Tones& tones) {
  return {tones.paper, tones.paper, tones.plate.unaryExpr(&srgb),
          picture.background == Background::transparent};
}

}  // namespace

Sheet SlicePicture::sheet() const {
  const Place half(.5 * width_pixels * pixel(), .5 * height);
  return {centre - half, centre + half};
}

Slice visible(Slice slice, const Colouring& colouring) {
  std::erase_if(slice.profiles,
                [&](const Profile& p) { return !colouring.states[p.instance].is(frame::State::visible); });
  return slice;
}

namespace {

frame::Image paint_profiles(const Slice& slice, const Colouring& colouring, const SlicePicture& picture,
                            const Vec3& behind) {
  const std::size_t width = picture.width_pixels, height = picture.height_pixels;
  const Tones tones = tones_of(picture.background);
  struct Drawn {
    Shape whole, inner;
    double top = INFINITY, bottom = -INFINITY;
  };
  std::vector<Drawn> drawn(slice.profiles.size());
  parallel_for(drawn.size(), 64, [&](std::size_t i) {
    Drawn& d = drawn[i];
    d.whole = in_pixels(slice.profiles[i], picture);
    for (const Place& p : d.whole) d.top = std::min(d.top, p.y()), d.bottom = std::max(d.bottom, p.y());
    if (d.bottom - d.top > 2. * rim_pixels) d.inner = within_rim(d.whole);
  });
  frame::Image image{std::uint32_t(width), std::uint32_t(height),
                     std::vector<std::uint8_t>(width * height * 4, 255), 0.};
  parallel_for((height + rows_at_once - 1) / rows_at_once, 1, [&](std::size_t band) {
    const std::size_t first = band * rows_at_once, last = std::min(height, first + rows_at_once);
    Sketchpad paper(width, first, last, behind);
    const auto fill = [&](std::size_t i, bool rim) {
      const Drawn& d = drawn[i];
      if (d.bottom < double(first) || d.top > double(last)) return;
      const Vec3 colour = fill_of(colouring, slice.profiles[i], tones);
      if (rim)
        paper.fill(d.whole, d.inner.empty() ? colour : Vec3(tones.rim * colour));
      else
        paper.fill(d.inner, colour);
    };
    // A neuron's rims first, so that where its profiles overlap no line runs through them; the soma, its first, on top.
    for (std::size_t i = 0; i < drawn.size();) {
      std::size_t end = i;
      while (end < drawn.size() && slice.profiles[end].instance == slice.profiles[i].instance) ++end;
      for (std::size_t k = i; k < end; ++k) fill(k, true);
      for (std::size_t k = end; k-- > i;) fill(k, false);
      i = end;
    }
    for (std::size_t i = 0; i < paper.pixels().size(); ++i)
      for (int c = 0; c < 3; ++c)
        image.pixels[4 * (first * width + i) + std::size_t(c)] =
            std::uint8_t(std::lround(255.f * srgb(paper.pixels()[i][c])));
  });
  return image;
}

frame::Image paint_profiles(const Slice& slice, const Colouring& colouring, const SlicePicture& picture) {
  const auto on = [&](const Vec3& behind) { return paint_profiles(slice, colouring, picture, behind); };
  return picture.background == Background::transparent ? frame::matted(on(Vec3::Zero()), on(Vec3::Ones()))
                                                       : on(tones_of(picture.background).paper);
}

// The same words in the units of a drawing, placed by a glance at its pixels.
std::string words_in_svg(const Slice& slice, const Colouring& colouring, const SlicePicture& picture) {
  SlicePicture small = picture;
  small.width_pixels = glance;
  small.height_pixels = std::max(1u, std::uint32_t(glance * picture.height_pixels / picture.width_pixels));
  const frame::Image seen = paint_profiles(slice, colouring, small);
  const Tones tones = tones_of(picture.background);
  const Paper paper = paper_of(picture, tones);
  const frame::Viewport drawing{float(picture.width_pixels * picture.pixel()), float(picture.height)};
  const double letter = .9 * .035 * picture.height, pad = .5 * letter;
  Arrangement places;
  std::string svg = fmt::format("<g font-family=\"sans-serif\" font-size=\"{:.4g}\" fill=\"{}\">\n", letter,
                                hex(tones.ink));
  const auto write = [&](double x, double y, const char* anchor, const std::string& words) {
    svg += fmt::format("<text x=\"{:.4g}\" y=\"{:.4g}\" text-anchor=\"{}\">{}</text>\n", x, y, anchor, words);
  };
  // A plate as wide and high inside, where it is needed; the corner that words begin at.
  const auto stand = [&](Block::Kind kind, Spot usual, double width, double height) {
    Block block{.kind = kind, .usual = usual};
    block.width = float(width + 2. * pad), block.height = float(height + 2. * pad), block.margin = float(pad);
    Block in_pixels = block;
    for (float* length : {&in_pixels.width, &in_pixels.height, &in_pixels.margin})
      *length /= float(small.pixel());
    places.look_at(seen, paper, {&in_pixels, 1});
    const Box pixels = places.place(in_pixels, {float(small.width_pixels), float(small.height_pixels)}),
              box = places.place(block, drawing);
    if (const float opacity = plate_opacity(hidden_by(pixels, seen, paper), paper); opacity > 0.f)
      svg += fmt::format(
          "<rect x=\"{:.4g}\" y=\"{:.4g}\" width=\"{:.4g}\" height=\"{:.4g}\" fill=\"{}\" "
          "fill-opacity=\"{:.2f}\"/>\n",
          box.left, box.top, block.width, block.height, hex(tones.plate), opacity);
    return Place(double(box.left) + pad, double(box.top) + pad);
  };
  if (const auto bar = bar_of(colouring, picture.background)) {
    const double width = 16. * letter, thick = .9 * letter;
    const Place at = stand(Block::values, Spot::top_left, width, 3.4 * letter);
    write(at.x(), at.y() + .8 * letter, "start", bar->title);
    write(at.x() + width, at.y() + .8 * letter, "end", bar->units);
    svg += "<linearGradient id=\"measure\">";
    constexpr int stops = 10;
    for (int i = 0; i <= stops; ++i)
      svg += fmt::format("<stop offset=\"{:g}\" stop-color=\"{}\"/>", i / double(stops),
                         hex((*bar->map)(float(i) / float(stops))));
    svg += fmt::format(
        "</linearGradient>\n<rect x=\"{:.4g}\" y=\"{:.4g}\" width=\"{:.4g}\" height=\"{:.4g}\" "
        "fill=\"url(#measure)\"/>\n",
        at.x(), at.y() + 1.2 * letter, width, thick);
    write(at.x(), at.y() + 3.1 * letter, "start", bar->ends().first);
    write(at.x() + width, at.y() + 3.1 * letter, "end", bar->ends().second);
  }
  const ScaleBar bar = scale_bar_of(picture);
  const std::string position = position_of(slice.plane);
  const double label = .6 * letter * double(bar.label.size() + 2),
               width = std::max(bar.length, label + .55 * letter * double(position.size()));
  const Place at = stand(Block::scale, Spot::bottom_left, width, 1.4 * letter);
  write(at.x(), at.y() + .8 * letter, "start", bar.label);
  write(at.x() + label, at.y() + .8 * letter, "start", position);
  return svg + fmt::format("<rect x=\"{:.4g}\" y=\"{:.4g}\" width=\"{:.6g}\" height=\"{:.4g}\"/>\n</g>\n",
                           at.x(), at.y() + 1.15 * letter, bar.length, .25 * letter);
}

}  // namespace

frame::Image paint(const Slice& slice, const Colouring& colouring, const SlicePicture& picture,
                   Arrangement& places) {
  frame::Image image = paint_profiles(slice, colouring, picture);
  const Tones tones = tones_of(picture.background);
  places.paint(image, paper_of(picture, tones), words_of(colouring, picture, tones));
  return image;
}

frame::Image paint(const Slice& slice, const Colouring& colouring, const SlicePicture& picture) {
  Arrangement places;
  return paint(slice, colouring, picture, places);
}

void look_at(const Slice& slice, const Colouring& colouring, const SlicePicture& picture,
             Arrangement& places) {
  const Tones tones = tones_of(picture.background);
  places.look_at(paint_profiles(slice, colouring, picture), paper_of(picture, tones),
                 words_of(colouring, picture, tones));
}

std::string to_svg(const Slice& slice, const Colouring& colouring, const SlicePicture& picture) {
  const Tones tones = tones_of(picture.background);
  const double wide = picture.width_pixels * picture.pixel();
  const auto at = [&](const Place& p) {  // µm from the upper left corner
    return fmt::format("{:.3f} {:.3f}", p.x() - picture.centre.x() + .5 * wide,
                       picture.centre.y() + .5 * picture.height - p.y());
  };
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{}\" height=\"{}\" viewBox=\"0 0 {:.6g} {:.6g}\">\n",
      picture.width_pixels, picture.height_pixels, wide, picture.height);
  if (picture.background != Background::transparent)
    svg += fmt::format("<rect width=\"100%\" height=\"100%\" fill=\"{}\"/>\n", hex(tones.paper));
  for (std::size_t i = 0; i < slice.profiles.size();) {
    const Profile& first = slice.profiles[i];
    svg += fmt::format("<g id=\"neuron-{}\">", first.instance);
    std::vector<std::vector<Place>> all;
    while (i < slice.profiles.size() && slice.profiles[i].instance == first.instance) {
      const Profile& p = slice.profiles[i++];
      all.push_back(p.shape.outline(.1 * picture.pixel(), 4e-3));
      svg += fmt::format("<path fill=\"{}\" d=\"M{}", hex(fill_of(colouring, p, tones)), at(all.back()[0]));
      for (std::size_t k = 1; k < all.back().size(); ++k) svg += "L" + at(all.back()[k]);
      svg += "Z\"/>";
    }
    svg +=
        fmt::format("<path fill=\"none\" stroke=\"{}\" stroke-width=\"{:.4g}\" stroke-linecap=\"round\" d=\"",
                    hex(tones.rim * fill_of(colouring, first, tones)), rim_pixels * picture.pixel());
    Place before = Place::Constant(INFINITY);
    for (const auto& [p, q] : boundary_of_union(all)) {
      if (p != before) svg += "M" + at(p);
      svg += "L" + at(q);
      before = q;
    }
    svg += "\"/></g>\n";
  }
  if (picture.words) svg += words_in_svg(slice, colouring, picture);
  return svg + "</svg>\n";
}

frame::Glass plane_glass(const Forest& forest, const CutPlane& cut, Background background) {
  const Plane plane = Plane::through(cut.at, cut.normal);
  const Sheet sheet = sheet_of(forest, plane);
  return {.plane = plane,
          .low = sheet.low.cast<float>(),
          .high = sheet.high.cast<float>(),
          .colour = background == Background::dark ? Vec3(.30f, .42f, .60f) : Vec3(.25f, .40f, .65f),
          .opacity = cut.opacity};
}

std::vector<frame::Overlay> plane_marks(const Forest& forest, const CutPlane& cut) {
  const Plane plane = Plane::through(cut.at, cut.normal);
  const Sheet sheet = sheet_of(forest, plane);
  std::vector<frame::Overlay> marks;
  const auto line = [&](double ax, double ay, double bx, double by) {
    marks.push_back({plane.point(Vec2(float(ax), float(ay))), plane.point(Vec2(float(bx), float(by))), .5f,
                     outline_entry});
  };
  const auto [left, low] = std::pair(sheet.low.x(), sheet.low.y());
  const auto [right, high] = std::pair(sheet.high.x(), sheet.high.y());
  line(left, low, right, low), line(right, low, right, high), line(right, high, left, high),
      line(left, high, left, low);
  return marks;
}

}  // namespace forest::scene
