// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/symmetry.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <optional>
#include <utility>

#include <Eigen/Eigenvalues>

#include "forest/core/parallel.h"
#include "forest/cortex/depth.h"
#include "forest/cortex/human_layers.h"
#include "forest/cortex/neighbourhood.h"

namespace forest::cortex {
namespace {

using Plane = Eigen::Vector2d;  // a place on a section, µm
constexpr int fine = 4;         // samples an element, along s and t
constexpr int layers = int(human_layers.size());
constexpr int depths = 2 * layers + 1;  // the tops of layers, their middles, and the end

double depth(int k) {
  const auto layer = std::size_t(k / 2);
  return k % 2 ? .5 * (layer_top(layer) + layer_top(layer + 1)) : layer_top(layer);
}

// An element as it is seen in a stretch: its curves, turned so that s runs where u did, and t where v did, after some quarters.
struct Cell {
  std::array<std::uint32_t, 16> curves;
  std::uint32_t element = 0;
  int quarters = 0;

  std::uint32_t operator[](std::size_t k) const { return curves[k]; }
};

Cell turned(const Cell& cell) {
  Cell next{{}, cell.element, cell.quarters + 1};
  for (int j = 0; j < 4; ++j)
    for (int i = 0; i < 4; ++i) next.curves[slot(i, j)] = cell[slot(3 - j, i)];
  return next;
}

// (u, v) of the element.
std::pair<double, double> of_element(const Cell& cell, double s, double t) {
  for (int q = 0; q < cell.quarters % 4; ++q) s = std::exchange(t, s), s = 1. - s;
  return {s, t};
}

class Sides {
 public:
  explicit Sides(const Elements& elements) : elements_(elements) {
    for (std::uint32_t e = 0; e < elements.size(); ++e) {
      const auto c = elements.corners_of(e);
      for (const auto& [a, b] : {std::pair{c[0], c[1]}, {c[1], c[3]}, {c[3], c[2]}, {c[2], c[0]}})
        sides_[std::minmax(a, b)].push_back(e);
    }
  }

  // What lies beside cells, seen as they are; nothing at a rim.
  std::optional<Cell> after_s(const Cell& c) const {
    return across(c, c[slot(3, 0)], c[slot(3, 3)], slot(0, 0), slot(0, 3));
  }
  std::optional<Cell> before_s(const Cell& c) const {
    return across(c, c[slot(0, 0)], c[slot(0, 3)], slot(3, 0), slot(3, 3));
  }
  std::optional<Cell> after_t(const Cell& c) const {
    return across(c, c[slot(0, 3)], c[slot(3, 3)], slot(0, 0), slot(3, 0));
  }
  std::optional<Cell> before_t(const Cell& c) const {
    return across(c, c[slot(0, 0)], c[slot(3, 0)], slot(0, 3), slot(3, 3));
  }

 private:
  std::optional<Cell> across(const Cell& from, std::uint32_t a, std::uint32_t b, std::size_t to_a,
                             std::size_t to_b) const {
    for (const std::uint32_t e : sides_.at(std::minmax(a, b))) {
      if (e == from.element) continue;
      Cell cell{elements_.elements[e], e, 0};
      for (int quarter = 0; quarter < 4; ++quarter, cell = turned(cell))
        if (cell[to_a] == a && cell[to_b] == b) return cell;
    }
    return std::nullopt;
  }

  const Elements& elements_;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::vector<std::uint32_t>> sides_;
};

// Rows of cells, or nothing where the lattice has a fault or ends.
std::optional<std::vector<std::vector<Cell>>> stretch_around(const Sides& lattice, const Cell& middle,
                                                             const SymmetryOptions& options) {
  Cell first = middle;
  for (int j = 0; j < options.along / 2; ++j) {
    const auto next = lattice.before_t(first);
    if (!next) return std::nullopt;
    first = *next;
  }
  for (int i = 0; i < options.across / 2; ++i) {
    const auto next = lattice.before_s(first);
    if (!next) return std::nullopt;
    first = *next;
  }
  std::vector<std::vector<Cell>> rows;
  for (int j = 0; j < options.along; ++j) {
    if (j > 0) {
      const auto next = lattice.after_t(first);
      if (!next) return std::nullopt;
      first = *next;
    }
    std::vector<Cell> row{first};
    for (int i = 1; i < options.across; ++i) {
      const auto next = lattice.after_s(row.back());
      if (!next) return std::nullopt;
      row.push_back(*next);
    }
    for (std::size_t i = 0; j > 0 && i < row.size(); ++i) {
      const Cell& below = rows.back()[i];
      if (row[i][slot(0, 0)] != below[slot(0, 3)] || row[i][slot(3, 0)] != below[slot(3, 3)])
        return std::nullopt;
    }
    rows.push_back(std::move(row));
  }
  return rows;
}

// Places of a section: those of a depth after those of another, s runs fastest.
struct Slice {
  int wide = 0;  // places along s
  std::vector<Place> places;
};

// Sections at every sample of t.
std::vector<Slice> sampled(const Elements& elements, const std::vector<std::vector<Cell>>& rows) {
  const int wide = int(rows[0].size()) * fine + 1, high = int(rows.size()) * fine + 1;
  std::vector<Slice> sections(std::size_t(high), {wide, std::vector<Place>(std::size_t(wide * depths))});
  for (std::size_t j = 0; j < rows.size(); ++j)
    for (std::size_t i = 0; i < rows[j].size(); ++i) {
      const Cell& cell = rows[j][i];
      const Hexahedron h = elements.hexahedron(cell.element);
      const Layers element_layers(elements, cell.element);
      const auto place = [&](double s, double t, double d) {
        const auto [u, v] = of_element(cell, s, t);
        return h.at(u, v, element_layers.w(u, v, d));
      };
      for (int t = 0; t <= fine; ++t)
        for (int s = 0; s <= fine; ++s)
          for (int k = 0; k < depths; ++k)
            sections[j * fine + std::size_t(t)].places[std::size_t(k * wide + int(i) * fine + s)] =
                place(double(s) / fine, double(t) / fine, depth(k));
    }
  return sections;
}

// Where a plane meets every line of t; nothing when it misses one.
std::optional<Slice> cut(const std::vector<Slice>& sections, const Place& normal, double offset) {
  Slice result{sections[0].wide, std::vector<Place>(sections[0].places.size())};
  for (std::size_t p = 0; p < result.places.size(); ++p) {
    bool met = false;
    for (std::size_t t = 0; !met && t + 1 < sections.size(); ++t) {
      const Place &a = sections[t].places[p], &b = sections[t + 1].places[p];
      const double x = a.dot(normal) - offset, y = b.dot(normal) - offset;
      if (!(x <= 0. && y > 0.)) continue;
      result.places[p] = a + x / (x - y) * (b - a), met = true;
    }
    if (!met) return std::nullopt;
  }
  return result;
}

// A section laid flat: s to the right, the pia upwards, its centre in the middle.
std::vector<Plane> flat(const Slice& section) {
  Place centre = Place::Zero();
  for (const Place& p : section.places) centre += p;
  centre /= double(section.places.size());
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const Place& p : section.places) spread += (p - centre) * (p - centre).transpose();
  const Place normal = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors().col(0);
  Place right = Place::Zero(), up = Place::Zero();
  for (int k = 0; k < depths; ++k)
    right += section.places[std::size_t(k * section.wide + section.wide - 1)] -
             section.places[std::size_t(k * section.wide)];
  for (int s = 0; s < section.wide; ++s)
    up += section.places[std::size_t(s)] - section.places[std::size_t((depths - 1) * section.wide + s)];
  right = (right - normal * normal.dot(right)).normalized();
  const Place across = normal.cross(right);
  up = across.dot(up) < 0. ? Place(-across) : across;
  std::vector<Plane> result;
  for (const Place& p : section.places) result.emplace_back(right.dot(p - centre), up.dot(p - centre));
  return result;
}

// The layers of a section as a picture: 0 outside, else the layer's number from 1 on.
struct Picture {
  Plane low = Plane::Zero();
  int width = 0, height = 0;
  std::vector<std::uint8_t> layer;
  std::size_t covered = 0;

  std::uint8_t at(const Plane& place, double pixel) const {
    const int x = int(std::floor((place[0] - low[0]) / pixel)),
              y = int(std::floor((place[1] - low[1]) / pixel));
    return x < 0 || y < 0 || x >= width || y >= height ? std::uint8_t(0) : layer[std::size_t(y * width + x)];
  }
};

Picture picture_of(const Slice& section, double pixel) {
  const std::vector<Plane> places = flat(section);
  Picture picture;
  Plane high = places[0];
  picture.low = places[0];
  for (const Plane& p : places) picture.low = picture.low.cwiseMin(p), high = high.cwiseMax(p);
  picture.width = int((high[0] - picture.low[0]) / pixel) + 1;
  picture.height = int((high[1] - picture.low[1]) / pixel) + 1;
  picture.layer.assign(std::size_t(picture.width * picture.height), 0);
  const auto fill = [&](const Plane& a, const Plane& b, const Plane& c, std::uint8_t layer) {
    const auto side = [](const Plane& p, const Plane& q, const Plane& r) {
      return (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
    };
    const Plane from = (a.cwiseMin(b).cwiseMin(c) - picture.low) / pixel,
                to = (a.cwiseMax(b).cwiseMax(c) - picture.low) / pixel;
    const double turn = side(a, b, c) < 0. ? -1. : 1.;
    for (int y = int(from[1]); y <= int(to[1]); ++y)
      for (int x = int(from[0]); x <= int(to[0]); ++x) {
        const Plane p = picture.low + pixel * Plane(x + .5, y + .5);
        if (turn * side(a, b, p) >= 0. && turn * side(b, c, p) >= 0. && turn * side(c, a, p) >= 0.)
          picture.layer[std::size_t(y * picture.width + x)] = layer;
      }
  };
  for (int k = 0; k + 1 < depths; ++k)
    for (int s = 0; s + 1 < section.wide; ++s) {
      const auto at = [&](int ds, int dk) { return places[std::size_t((k + dk) * section.wide + s + ds)]; };
      fill(at(0, 0), at(1, 0), at(1, 1), std::uint8_t(k / 2 + 1));
      fill(at(0, 0), at(1, 1), at(0, 1), std::uint8_t(k / 2 + 1));
    }
  picture.covered =
      picture.layer.size() - std::size_t(std::count(picture.layer.begin(), picture.layer.end(), 0));
  return picture;
}

// 1 − intersection over union of the layers of two sections, laid over one another as well as can be.
double difference(const Picture& one, const Picture& two, double pixel) {
  const auto agreement = [&](double dx, double dy, double angle) {
    const double c = std::cos(angle), s = std::sin(angle);
    std::size_t same = 0;
    for (int y = 0; y < two.height; ++y)
      for (int x = 0; x < two.width; ++x) {
        const std::uint8_t layer = two.layer[std::size_t(y * two.width + x)];
        if (layer == 0) continue;
        const Plane p = two.low + pixel * Plane(x + .5, y + .5);
        same += one.at(Plane(c * p[0] - s * p[1] + dx, s * p[0] + c * p[1] + dy), pixel) == layer;
      }
    return double(same) / double(one.covered + two.covered - same);
  };
  std::array<double, 3> at{0., 0., 0.};
  double best = agreement(0., 0., 0.);
  for (double step = 4.; step > .4; step /= 2.)  // pixels; degrees
    for (bool better = true; better;) {
      better = false;
      for (std::size_t k = 0; k < 3; ++k)
        for (const double sign : {-1., 1.}) {
          auto next = at;
          next[k] += sign * step * (k < 2 ? pixel : std::numbers::pi / 180.);
          const double score = agreement(next[0], next[1], next[2]);
          if (score > best) best = score, at = next, better = true;
        }
    }
  return 1. - best;
}

double mean_difference(const std::vector<Slice>& sections, double pixel) {
  std::vector<Picture> pictures;
  for (const Slice& s : sections) pictures.push_back(picture_of(s, pixel));
  double sum = 0.;
  for (std::size_t i = 0; i + 1 < pictures.size(); ++i)
    sum += difference(pictures[i], pictures[i + 1], pixel);
  return sum / double(pictures.size() - 1);
}

// Of a stretch: by its rows, and by planes.
std::optional<std::pair<double, double>> measure(const Elements& elements,
                                                 const std::vector<std::vector<Cell>>& rows, double pixel) {
  const std::vector<Slice> samples = sampled(elements, rows);
  std::vector<Slice> whole;
  for (std::size_t t = 0; t < samples.size(); t += fine) whole.push_back(samples[t]);
  double spacing = 0.;
  for (std::size_t t = 0; t + 1 < whole.size(); ++t)
    for (std::size_t p = 0; p < whole[t].places.size(); ++p)
      spacing += (whole[t + 1].places[p] - whole[t].places[p]).norm();
  spacing /= double((whole.size() - 1) * whole[0].places.size());

  const Slice& centre = samples[samples.size() / 2];
  Place along = Place::Zero(), middle = Place::Zero(), across = Place::Zero();
  for (std::size_t p = 0; p < centre.places.size(); ++p)
    along += samples.back().places[p] - samples.front().places[p], middle += centre.places[p];
  middle /= double(centre.places.size());
  across = centre.places[std::size_t(centre.wide - 1)] - centre.places[0];
  along.normalize();
  across = (across - along * along.dot(across)).normalized();
  const Place third = along.cross(across);

  const auto planar = [&](double a, double b) -> std::optional<double> {
    const Place normal = (along + std::tan(a) * across + std::tan(b) * third).normalized();
    std::vector<Slice> sections;
    const auto from = cut(samples, normal, middle.dot(normal));
    if (!from) return std::nullopt;
    sections.push_back(*from);
    for (const double sign : {-1., 1.})
      for (int k = 1;; ++k) {
        const auto next = cut(samples, normal, middle.dot(normal) + sign * k * spacing);
        if (!next) break;
        sections.insert(sign < 0. ? sections.begin() : sections.end(), *next);
      }
    if (sections.size() < 3) return std::nullopt;
    return mean_difference(sections, pixel);
  };
  constexpr double degree = std::numbers::pi / 180.;
  std::optional<double> best;
  double at_a = 0., at_b = 0.;
  const auto consider = [&](double a, double b) {
    if (std::hypot(a, b) > 40.) return;
    const auto score = planar(a * degree, b * degree);
    if (score && (!best || *score < *best)) best = score, at_a = a, at_b = b;
  };
  for (int a = -2; a <= 2; ++a)
    for (int b = -2; b <= 2; ++b) consider(16. * a, 16. * b);
  for (const double step : {8., 4.}) {
    const double a = at_a, b = at_b;
    for (const double da : {-step, 0., step})
      for (const double db : {-step, 0., step})
        if (da != 0. || db != 0.) consider(a + da, b + db);
  }
  if (!best) return std::nullopt;
  return std::pair(mean_difference(whole, pixel), *best);
}

}  // namespace

Symmetry symmetry(const Elements& elements, std::span<const Line> lines, const SymmetryOptions& options) {
  const Mesh crests = pieces(lines, Line::Kind::crest);
  if (crests.triangles.empty()) return {};
  const std::vector<Place> alongs = directions(lines, Line::Kind::crest);
  const TriangleTree tree(crests);
  const Sides lattice(elements);

  // Stretches that share no element, tried in an order that spreads them.
  std::vector<std::vector<std::vector<Cell>>> stretches;
  std::vector<std::uint8_t> taken(elements.size(), 0);
  const std::size_t n = elements.size();
  std::size_t stride = std::size_t(double(n) * .6180339887) | 1;
  while (std::gcd(stride, n) > 1) stride += 2;  // or else it comes to some of them only
  for (std::size_t k = 0, e = 0; k < n && stretches.size() < options.stretches; ++k, e = (e + stride) % n) {
    Cell cell{elements.elements[e], std::uint32_t(e), 0};
    const auto corner = [&](std::size_t c) -> Place {  // half way down
      return .5 * (elements.curves[cell[c]][1] + elements.curves[cell[c]][2]);
    };
    const Place centre =
        .25 * (corner(slot(0, 0)) + corner(slot(3, 0)) + corner(slot(0, 3)) + corner(slot(3, 3)));
    const auto hit = tree.nearest(centre, .7 * (corner(slot(3, 0)) - corner(slot(0, 0))).norm());
    if (!hit) continue;
    const Place& along = alongs[hit->triangle];
    const auto runs = [&] {
      return (corner(slot(0, 3)) - corner(slot(0, 0)) + corner(slot(3, 3)) - corner(slot(3, 0)))
          .normalized()
          .dot(along);
    };
    for (int quarter = 0; quarter < 4 && runs() < std::numbers::sqrt2 / 2.; ++quarter) cell = turned(cell);
    const auto rows = stretch_around(lattice, cell, options);
    if (!rows) continue;
    bool free = true;
    for (const auto& row : *rows)
      for (const Cell& c : row) free = free && !taken[c.element];
    if (!free) continue;
    for (const auto& row : *rows)
      for (const Cell& c : row) taken[c.element] = 1;
    stretches.push_back(*rows);
  }
  std::vector<std::optional<std::pair<double, double>>> results(stretches.size());
  parallel_for(stretches.size(), 1,
               [&](std::size_t i) { results[i] = measure(elements, stretches[i], options.pixel); });
  Symmetry symmetry;
  for (const auto& result : results)
    if (result)
      symmetry.elements += result->first, symmetry.best_planar += result->second, ++symmetry.stretches;
  if (symmetry.stretches > 0)
    symmetry.elements /= double(symmetry.stretches), symmetry.best_planar /= double(symmetry.stretches);
  return symmetry;
}

}  // namespace forest::cortex
