// SPDX-License-Identifier: Apache-2.0
#include "forest/cortex/curved_elements.h"

#include <cmath>
#include <numbers>

namespace forest::cortex {

// A sheet whose middle swings as a meander (the direction is a sine of the arc length, as rivers do), with the depth along the
// normal: crowns and fundi of radius about 2 mm, so that the inner surface at a crown, or the outer one in a fundus, is tight.
std::vector<Hexahedron> folded_sheet(std::size_t across, std::size_t along) {
  constexpr double side = 650., half = 1100., wave = 14000., swing = 1.15;  // µm; radians
  const double turn = 2. * std::numbers::pi / wave;
  const auto middle = [&](double s) {  // ∫ (cos θ, sin θ) ds by Simpson, from 0, θ = swing sin(turn s)
    const int n = 2 * (int(s / 50.) + 1);
    double x = 0., y = 0.;
    for (int i = 0; i <= n; ++i) {
      const double angle = swing * std::sin(turn * s * i / n), weight = (i == 0 || i == n ? 1.
                                                                         : i % 2          ? 4.
                                                                                          : 2.) *
                                                                        s / (3. * n);
      x += weight * std::cos(angle), y += weight * std::sin(angle);
    }
    return Eigen::Vector2d(x, y);
  };
  // Columns of lattice places: three to an element.
  const std::size_t columns = 3 * across + 1, rows = 3 * along + 1;
  std::vector<Eigen::Vector3d> lattice(columns * rows * 4);
  for (std::size_t i = 0; i < columns; ++i) {
    const double s = side * double(i) / 3.;
    const Eigen::Vector2d m = middle(s);
    for (std::size_t j = 0; j < rows; ++j) {
      const double z = side * double(j) / 3., lean = .1 * std::sin(z / 2100.);
      const double angle = swing * std::sin(turn * s) + lean;
      for (std::size_t k = 0; k < 4; ++k) {
        const double depth = half * (1. + .1 * std::sin(z / 1700. + s / 2300.)) * (2. * double(k) / 3. - 1.);
        // Outwards is (−sin, cos): u × v = w, which runs inwards.
        lattice[(i * rows + j) * 4 + k] = {m.x() + depth * std::sin(angle), m.y() - depth * std::cos(angle),
                                           z + 60. * std::sin(s / 900.)};
      }
    }
  }
  std::vector<Hexahedron> elements;
  elements.reserve(across * along);
  for (std::size_t a = 0; a < across; ++a)
    for (std::size_t b = 0; b < along; ++b) {
      std::array<Eigen::Vector3d, 64> places;
      for (int k = 0; k < 4; ++k)
        for (int j = 0; j < 4; ++j)
          for (int i = 0; i < 4; ++i)
            places[Hexahedron::index(i, j, k)] =
                lattice[((3 * a + std::size_t(i)) * rows + 3 * b + std::size_t(j)) * 4 + std::size_t(k)];
      elements.push_back(through_lattice(places));
    }
  return elements;
}

}  // namespace forest::cortex
