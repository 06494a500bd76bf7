// SPDX-License-Identifier: Apache-2.0
// From a place back to the parameters: x → (element, u, v, w). A uniform grid names the elements whose bounding boxes reach a
// place; of these, the place must lie in the box around the control points in the element's own affine frame, since a Bézier
// element lies in the convex hull of its control points; the frame also tells where Newton's method begins. Where that does
// not find it, elements are halved, as long as their control points surround the place: what is inside is found.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "forest/cortex/hexahedron.h"

namespace forest::cortex {

/// (u, v, w) in [0, 1]³ of a place in one element. None: it is further than `slack` outside.
std::optional<Eigen::Vector3d> invert(const Hexahedron& hexahedron, const Eigen::Vector3d& place,
                                      double slack = 1e-3);

struct Location {
  static constexpr std::uint32_t nowhere = ~std::uint32_t(0);
  std::uint32_t element = nowhere;
  Eigen::Vector3d uvw = Eigen::Vector3d::Zero();  // in [0, 1]³

  bool found() const { return element != nowhere; }
};

class Locator {
 public:
  /// @param elements  must outlive it; any number
  /// @param slack     µm: what lies outside of all elements by no more is found on the nearest face
  /// Throws Error that names the first element whose control points are not finite.
  explicit Locator(std::span<const Hexahedron> elements, double slack = 1e-3);

  /// On a face that elements share, one of them. element.at(uvw) is within 1e-5 µm of a place that lies inside.
  Location find(const Eigen::Vector3d& place) const;
  /// Each of them, on all cores, neighbours after one another; the same at any number of threads.
  std::vector<Location> find(std::span<const Eigen::Vector3d> places) const;

 private:
  struct Frame {                // of one element
    Eigen::Matrix3d inverse;    // of the Jacobian in the middle
    Eigen::Vector3d origin;     // (u, v, w) is about inverse · place + origin
    Eigen::Vector3d low, high;  // of the control points in that frame, slack included
  };

  static constexpr std::size_t no_cell = ~std::size_t(0);
  std::size_t cell_of(const Eigen::Vector3d& place) const;

  std::span<const Hexahedron> elements_;
  double slack_;
  std::vector<Frame> frames_;
  // The elements that reach cell c are listed_[first_[c]] to listed_[first_[c + 1]].
  Eigen::Vector3d low_ = Eigen::Vector3d::Zero();
  double cell_ = 1.;
  Eigen::Vector3i size_ = Eigen::Vector3i::Ones();
  std::vector<std::uint32_t> first_, listed_;
};

}  // namespace forest::cortex
