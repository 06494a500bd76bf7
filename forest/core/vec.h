// SPDX-License-Identifier: Apache-2.0
// Vectors, matrices and rotations: Eigen's, under the names used throughout. Lengths are µm, y points to the
// pia.
#pragma once

#include <numbers>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace forest {

using Vec2 = Eigen::Vector2f;
using Vec3 = Eigen::Vector3f;
using Vec4 = Eigen::Vector4f;
using Mat3 = Eigen::Matrix3f;
using Mat4 = Eigen::Matrix4f;
using Quat = Eigen::Quaternionf;

inline constexpr float pi = std::numbers::pi_v<float>;
constexpr float radians(float degrees) { return degrees * (pi / 180.f); }
constexpr float degrees(float radians) { return radians * (180.f / pi); }

}  // namespace forest
