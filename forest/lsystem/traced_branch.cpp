// SPDX-License-Identifier: Apache-2.0
#include "forest/lsystem/traced_branch.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace forest::lsystem {

Tracing Tracing::told(std::span<const double> values) {
  auto all = std::bit_cast<std::array<double, tracing_takes>>(Tracing{});
  std::ranges::copy(values, all.begin());
  return std::bit_cast<Tracing>(all);
}

TracedBranch::TracedBranch(const Tracing& told, const Trace& way, const Trace& calibre, const Gauge& gauge,
                           const Eigen::Vector3d& from, const Eigen::Vector3d& heading)
    : told_(told),
      way_(way),
      calibre_(calibre),
      gauge_(gauge),
      from_(from),
      thickness_end_(told.last < 0. ? told.thickness : told.last),
      times_(told.thickness) {
  const auto mirror = int(told.mirror);
  sides_ = {mirror & 1 ? -1. : 1., 1., (mirror & 2 ? -1. : 1.) * told.steep};
  const Eigen::Vector3d before = mirrored(way.heading);
  const double across = before.x() * heading.y() - before.y() * heading.x(),
               along = before.x() * heading.x() + before.y() * heading.y();
  // Two that head nearly along z hardly have an angle about it.
  const double level = before.head<2>().norm() * heading.head<2>().norm();
  turn_ = Eigen::AngleAxisd(
      level * told.turn * std::atan2(across, along) + told.about * (std::numbers::pi / 180.),
      Eigen::Vector3d::UnitZ());
  // A branch that is level all along is not drawn aside along z, nor one with steps that are level by changing these.
  const double kept = told.climbing * (1. + std::min(std::clamp(told.levelled, -1., 1.), 0.));
  aside_ = {told.x, told.y, (way.level ? 1. - kept : 1.) * told.z};
}

// From the first to the last as many times as thick as the diameter itself changes, so that what is as thick as what was before it
// remains so.
double TracedBranch::thick(float diameter, float part) const {
  const bool changes = thickness_end_ != told_.thickness && told_.thickness > 0.;
  if (changes && part != changed_)
    times_ = told_.thickness * std::pow(thickness_end_ / told_.thickness, double(changed_ = part));
  return std::max(told_.thinnest, times_ * double(diameter));
}

double TracedBranch::last_diameter() const {
  return gauge_.nearest(thick(calibre_.stops.back().diameter, 1.f));
}

std::optional<Eigen::Vector3d> TracedBranch::step_before() const {
  if (way_.last_step.isZero(0.f)) return std::nullopt;
  return (turn_ * mirrored(way_.last_step)).stableNormalized();
}

std::optional<TracedBranch::Ahead> TracedBranch::ahead() const {
  const double length = told_.scale * double(way_.length());
  if (way_.ahead.isZero(0.f) || !(length > 0.)) return std::nullopt;
  return Ahead{(turn_ * mirrored(way_.ahead) + aside_ / length).stableNormalized(),
               (turn_ * mirrored(way_.own_last) + aside_ / length).stableNormalized()};
}

void TracedBranch::follow() {
  course_.emplace(way_, float(told_.scale));
  course_->levels(float(std::clamp(told_.levelled, -1., 1.)));
  if (told_.stairs != 1.) course_->stairs(float(told_.stairs));
  if (told_.kinked != 1. || told_.kinks != 1.) course_->kinks(float(told_.kinked), float(told_.kinks));
  whole_ = course_->length();
  diameters_ = calibres(calibre_, course_->lengths);
  const double along_z = told_.scale * sides_.z();
  heights_ = course_->climbed(told_.climbing > 0. && along_z != 0. ? float(aside_.z() / along_z) : 0.f);
  thickness_last_ = thick(diameters_.back().diameter, diameters_.back().change);
  thickness_before_ = thick(calibre_.diameter, 0.f), drawn_before_ = gauge_.nearest(thickness_before_);
}

TracedBranch::Stop TracedBranch::stop(std::size_t i) {
  const float here = course_->lengths[i], part = whole_ > 0.f ? here / whole_ : 1.f;
  const float step = float(told_.scale) * (here - std::exchange(gone_, here));
  const double most = double(calibre_.steepest) * double(step);
  double thickness = thick(diameters_[i].diameter, diameters_[i].change);
  const bool inner = calibre_.steepest > 0.f && i > 0 && i + 1 < stops();
  // As fast as it may change, it has to come to its end.
  const double left = double(calibre_.steepest) * told_.scale * double(whole_ - here);
  if (inner) {
    thickness = std::clamp(thickness, thickness_before_ - most, thickness_before_ + most);
    thickness = std::clamp(thickness, thickness_last_ - left, thickness_last_ + left);
  }
  double diameter = gauge_.nearest(thickness);
  if (inner && std::abs(diameter - drawn_before_) > most && std::abs(drawn_before_ - thickness_last_) <= left)
    diameter = drawn_before_;
  const Vec3 on_chord = way_.end() * part;
  Eigen::Vector3d at =
      place(on_chord + float(told_.bent) * (course_->places[i] - on_chord)) + double(part) * aside_;
  at.z() += told_.climbing * (from_.z() + told_.scale * sides_.z() * double(heights_[i]) - at.z());
  return {at, drawn_before_, diameter, thickness};
}

}  // namespace forest::lsystem
