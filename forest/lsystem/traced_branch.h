// SPDX-License-Identifier: Apache-2.0
// A branch as the turtle's Trace draws it: where its points come to lie and how thick it is there. Private to this room.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Geometry>

#include "forest/lsystem/body.h"
#include "forest/lsystem/sample.h"

namespace forest::lsystem {

/// What Trace is told, in the order of its parameters; what each does is in turtle_symbols().
struct Tracing {
  double sample = 0., row = 0., branch = 0., scale = 1., mirror = 0., turn = 1., bent = 1., like = -1.,
         thickness = 1., thinnest = 0., x = 0., y = 0., z = 0., last = -1., steep = 1., stairs = 1.,
         kinked = 1., kinks = 1., climbing = 0., about = 0., levelled = 0.;

  /// @param values  no more than there are; the others are as usual
  static Tracing told(std::span<const double> values);
};
inline constexpr std::size_t tracing_takes = sizeof(Tracing) / sizeof(double);

class TracedBranch {
 public:
  /// @param way      drawn from `from` on, by a turtle that heads to `heading`
  /// @param calibre  whose diameters it has
  /// @param gauge    to which these are rounded
  TracedBranch(const Tracing& told, const Trace& way, const Trace& calibre, const Gauge& gauge,
               const Eigen::Vector3d& from, const Eigen::Vector3d& heading);

  Eigen::Vector3d end() const { return place(way_.end()) + aside_; }
  double last_diameter() const;
  /// Unit: how the last step of what it leaves should lie for the fork to be as it was traced; nothing where that is not known.
  std::optional<Eigen::Vector3d> step_before() const;
  struct Ahead {
    Eigen::Vector3d heading, step;  // unit: where it heads at its end, and its own last step
  };
  std::optional<Ahead> ahead() const;  // nothing where it has no length

  struct Stop {
    Eigen::Vector3d place;
    double start, diameter;  // of the segment that ends here, at either end
    double ungauged;
  };
  /// To be called before stop().
  void follow();
  std::size_t stops() const { return course_->places.size(); }
  Stop stop(std::size_t i);  // after the one that was drawn last
  void drew(const Stop& stop) { thickness_before_ = stop.ungauged, drawn_before_ = stop.diameter; }

 private:
  Eigen::Vector3d mirrored(const Vec3& v) const { return sides_.cwiseProduct(v.cast<double>()); }
  Eigen::Vector3d place(const Vec3& at) const { return from_ + turn_ * (told_.scale * mirrored(at)); }
  double thick(float diameter, float part) const;

  Tracing told_;
  const Trace &way_, &calibre_;
  const Gauge& gauge_;
  Eigen::Vector3d from_, sides_, aside_;
  Eigen::Quaterniond turn_;
  double thickness_end_;

  std::optional<Course> course_;
  std::vector<Calibre> diameters_;
  std::vector<float> heights_;
  float whole_ = 0.f, gone_ = 0.f;  // µm, as it was traced
  double thickness_last_ = 0., thickness_before_ = 0., drawn_before_ = 0.;
  mutable float changed_ = 0.f;  // times_ is of this share
  mutable double times_;
};

}  // namespace forest::lsystem
