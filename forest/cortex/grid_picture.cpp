// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/grid_picture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <vector>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/cortex/grid_quality.h"

namespace forest::cortex {
namespace {

struct Class {
  double from;  // of the scaled Jacobian
  std::array<int, 3> colour;
  const char* name;
};
constexpr auto classes = std::to_array<Class>({{-2., {200, 50, 50}, "folded"},
                                               {1e-12, {240, 165, 70}, "below .2"},
                                               {.2, {247, 226, 160}, ".2 – .5"},
                                               {.5, {190, 217, 235}, ".5 – .8"},
                                               {.8, {120, 172, 214}, ".8 – 1"}});
std::size_t class_of(double scaled_jacobian) {
  std::size_t n = 0;
  while (n + 1 < classes.size() && scaled_jacobian >= classes[n + 1].from) ++n;
  return n;
}

struct Quad {
  std::array<Eigen::Vector2d, 4> corners;
  double depth = 0., light = 1.;
  std::size_t kind = 0;
};

// Rows: right, up, towards the eye.
Eigen::Matrix3d eye(const std::string& up) {
  const bool over = !up.empty() && up[0] == '-';
  const std::string letter = over ? up.substr(1) : up;
  if (letter != "x" && letter != "y" && letter != "z")
    throw Error(fmt::format("\"{}\" is no axis that could point up; give x, y, z, -x, -y or -z", up));
  const int a = letter[0] - 'x';
  Eigen::Vector3d z = Eigen::Vector3d::Unit(a), x = Eigen::Vector3d::Unit((a + 1) % 3);
  if (over) z = -z;
  const Eigen::Vector3d towards = (.62 * x + .55 * z.cross(x) * -1. + .56 * z).normalized();
  Eigen::Matrix3d m;
  m.row(2) = towards;
  m.row(0) = z.cross(towards).normalized();
  m.row(1) = towards.cross(Eigen::Vector3d(m.row(0)));
  return m;
}

// The faces of the cells that are shown which have no other such cell beyond them. act(cell, corners counter-clockwise from outside)
template <class Shown, class Act>
void for_faces(const Grid& grid, Shown&& shown, Act&& act) {
  const std::array<int, 3> n{grid.size[0] - 1, grid.size[1] - 1, grid.size[2] - 1};
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i) {
        const std::array<int, 3> at{i, j, k};
        if (!shown(at)) continue;
        for (const Face face : all_faces) {
          const auto a = std::size_t(axis(face)), b = (a + 1) % 3, c = (a + 2) % 3;
          std::array<int, 3> beyond = at;
          beyond[a] += is_far(face) ? 1 : -1;
          if (beyond[a] >= 0 && beyond[a] < n[a] && shown(beyond)) continue;
          std::array<std::size_t, 4> corners;
          for (std::size_t q = 0; q < 4; ++q) {
            std::array<int, 3> p = at;
            p[a] += is_far(face);
            const bool first = q == 1 || q == 2, second = q >= 2;
            p[b] += is_far(face) ? first : second;
            p[c] += is_far(face) ? second : first;
            corners[q] = grid.index(p[0], p[1], p[2]);
          }
          act(std::size_t(i + n[0] * (j + n[1] * k)), corners);
        }
      }
}

std::vector<Quad> quads_of(const Grid& grid, const GridPicture& picture) {
  const std::vector<double> values = measure(grid, cell_measure("scaled-jacobian"));
  std::vector<Quad> quads;
  if (grid.plane()) {
    for (std::size_t n = 0; n < grid.cells(); ++n) {
      const Corners x = grid.corners(n);
      quads.push_back({{x[0].head<2>(), x[1].head<2>(), x[3].head<2>(), x[2].head<2>()},
                       -values[n],
                       1.,
                       class_of(values[n])});
    }
  } else {
    const Eigen::Matrix3d view = eye(picture.up);
    // The corner of the block that is nearest to the eye.
    std::array<bool, 3> near{};
    double nearest = -std::numeric_limits<double>::infinity();
    for (int c = 0; c < 8; ++c) {
      const Eigen::Vector3d p = grid.point(c & 1 ? grid.size[0] - 1 : 0, c & 2 ? grid.size[1] - 1 : 0,
                                           c & 4 ? grid.size[2] - 1 : 0);
      if (const double d = view.row(2).dot(p); d > nearest)
        nearest = d, near = {bool(c & 1), bool(c & 2), bool(c & 4)};
    }
    const auto shown = [&](const std::array<int, 3>& at) {
      bool cut = picture.opened;
      for (std::size_t a = 0; a < 3; ++a)
        cut = cut && (near[a] ? at[a] >= grid.size[a] / 2 : at[a] < (grid.size[a] - 1) / 2);
      return !cut;
    };
    for_faces(grid, shown, [&](std::size_t cell, const std::array<std::size_t, 4>& corners) {
      Quad quad;
      std::array<Eigen::Vector3d, 4> p;
      for (std::size_t q = 0; q < 4; ++q) {
        p[q] = view * grid.points[corners[q]];
        quad.corners[q] = p[q].head<2>();
        quad.depth += .25 * p[q].z();
      }
      const Eigen::Vector3d normal = (p[2] - p[0]).cross(p[3] - p[1]).normalized();
      if (!(normal.z() > 0.)) return;  // seen from behind
      quad.light = .05 * std::round(20. * (.84 + .16 * normal.dot(Eigen::Vector3d(-.35, .75, .56))));
      quad.kind = class_of(values[cell]);
      quads.push_back(quad);
    });
  }
  std::ranges::stable_sort(quads, {}, &Quad::depth);  // what is far first; in the plane what is folded last
  return quads;
}

std::string colour_of(const Quad& quad) {
  const auto& c = classes[quad.kind].colour;
  const auto lit = [&](int value) { return int(std::lround(std::clamp(quad.light, .5, 1.) * value)); };
  return fmt::format("#{:02x}{:02x}{:02x}", lit(c[0]), lit(c[1]), lit(c[2]));
}

}  // namespace

std::string to_svg(std::span<const GridPanel> panels, const GridPicture& picture) {
  const int columns = std::max(1, std::min(picture.columns, int(panels.size())));
  const int rows = (int(panels.size()) + columns - 1) / columns;
  const double caption = 20., entry = 78., line = 20., margin = 8., side = picture.panel;
  const double width = columns * side, legend = rows * (side + caption);  // where it begins
  const int abreast = std::max(1, int((width - margin) / entry));         // entries of it
  const double height = legend + 10. + line * double((int(classes.size()) + abreast - 1) / abreast);
  std::string text = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0:.0f} {1:.0f}\" width=\"{0:.0f}\" "
      "height=\"{1:.0f}\" "
      "font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n"
      "<g stroke=\"#333\" stroke-width=\"4\" stroke-linejoin=\"round\" transform=\"scale(.1)\">\n",
      width, height);
  const auto out = std::back_inserter(text);
  std::string captions;
  for (std::size_t n = 0; n < panels.size(); ++n) {
    const double left = side * double(int(n) % columns), top = (side + caption) * double(int(n) / columns);
    const std::vector<Quad> quads = quads_of(*panels[n].grid, picture);
    Eigen::Vector2d low = Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity()), high = -low;
    for (const Quad& quad : quads)
      for (const auto& p : quad.corners) low = low.cwiseMin(p), high = high.cwiseMax(p);
    const double scale = (side - 2. * margin) / std::max((high - low).maxCoeff(), 1e-300);
    const Eigen::Vector2d middle = .5 * (low + high);
    // One path a run of quads of one colour.
    std::string colour;
    for (const Quad& quad : quads) {
      if (const std::string next = colour_of(quad); next != colour) {
        fmt::format_to(out, "{}<path fill=\"{}\" d=\"", colour.empty() ? "" : "\"/>\n", next);
        colour = next;
      }
      Eigen::Vector2i from(0, 0);  // tenths of a pixel, one place from the one before
      for (std::size_t q = 0; q < 4; ++q) {
        const Eigen::Vector2d p = scale * (quad.corners[q] - middle);
        const Eigen::Vector2i at(int(std::lround(10. * (left + .5 * side + p.x()))),
                                 int(std::lround(10. * (top + .5 * side - p.y()))));
        fmt::format_to(out, "{}{} {}",
                       q == 0   ? "M"
                       : q == 1 ? "l"
                                : " ",
                       at.x() - from.x(), at.y() - from.y());
        from = at;
      }
      text += "z";
    }
    if (!colour.empty()) text += "\"/>\n";
    fmt::format_to(std::back_inserter(captions),
                   "<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{}</text>\n", left + .5 * side,
                   top + side + 12., panels[n].caption);
  }
  text += "</g>\n" + captions;
  for (std::size_t i = 0; i < classes.size(); ++i) {
    const Class& row = classes[i];
    const double x = margin + entry * double(int(i) % abreast), y = legend + line * double(int(i) / abreast);
    fmt::format_to(out,
                   "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"12\" height=\"12\" fill=\"#{:02x}{:02x}{:02x}\" "
                   "stroke=\"#333\" "
                   "stroke-width=\".4\"/><text x=\"{:.1f}\" y=\"{:.1f}\">{}</text>\n",
                   x, y + 10., row.colour[0], row.colour[1], row.colour[2], x + 16., y + 20., row.name);
  }
  return text + "</svg>\n";
}

std::string to_obj(const Grid& grid) {
  std::string text = "# a structured grid; micrometres\n";
  const auto out = std::back_inserter(text);
  for (const auto& p : grid.points) fmt::format_to(out, "v {:.9g} {:.9g} {:.9g}\n", p.x(), p.y(), p.z());
  const auto quad = [&](const std::array<std::size_t, 4>& c) {
    fmt::format_to(out, "f {} {} {} {}\n", c[0] + 1, c[1] + 1, c[2] + 1, c[3] + 1);
  };
  if (grid.plane())
    for (int j = 0; j + 1 < grid.size[1]; ++j)
      for (int i = 0; i + 1 < grid.size[0]; ++i)
        quad({grid.index(i, j), grid.index(i + 1, j), grid.index(i + 1, j + 1), grid.index(i, j + 1)});
  else
    for_faces(
        grid, [](const std::array<int, 3>&) { return true; },
        [&](std::size_t, const std::array<std::size_t, 4>& corners) { quad(corners); });
  return text;
}

}  // namespace forest::cortex
