// SPDX-License-Identifier: Apache-2.0
// How a moving picture keeps its pace: where one takes longer than its time, the next ones show less detail.
#pragma once

namespace forest::studio {

class Pace {
 public:
  explicit Pace(float budget = 40.f) : budget_(budget) {}

  /// A moving picture took so many milliseconds.
  void drew(float milliseconds);
  /// The acceptable error of the next moving picture, where a still one may have `wanted` (pixels).
  float error(float wanted) const;
  float milliseconds() const { return milliseconds_; }  // of one picture, smoothed; 0 before the first

 private:
  float budget_, factor_ = 1.f, milliseconds_ = 0.f;
  int warming_up_ = 2;  // the first pictures make programs and buffers
};

}  // namespace forest::studio
