// SPDX-License-Identifier: Apache-2.0
// Pictures of one forest, one after the other: what the last one hid is guessed to be hidden in the next, and looked at
// again once the rest is drawn. The pictures are those that would be drawn without a guess; they are drawn sooner.
#pragma once

#include <array>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>

#include "forest/scene/cut.h"

namespace forest::scene {

class Chooser {
 public:
  explicit Chooser(Forest forest) : forest_(std::move(forest)) {}

  /// Colours all that is drawn, now and when it is revealed.
  using Painter = std::function<void(Cut&, const Eye&)>;

  /// The cut of the next picture; valid until the one after it. What `shown` points to must last until it is drawn.
  const Cut& choose(const Eye& eye, const Shown& shown = {}, Painter painter = {});
  /// The same for parts of one view, seen by one camera, all at once: chooser i, of the same forest, for eye i.
  static void choose(std::span<Chooser* const> choosers, std::span<const Eye> eyes, const Shown& shown = {},
                     const Painter& painter = {});
  const Cut& cut() const { return cut_; }
  /// Gives the frame composed of that cut what reveals the rest. The frame must not be drawn once this object is gone.
  void complete(frame::Frame& frame);
  /// To be told after each drawing of such a frame.
  /// @param reached  as render::Renderer::reached
  void remember(const frame::DepthMap& seen, std::span<const std::uint8_t> reached = {});

  /// Of the last picture, chosen and revealed: segments, all subframes' mean, and neurons in sight.
  std::uint64_t segments() const { return cut_.segments + (drawings_ ? revealed_segments_ / drawings_ : 0); }
  std::uint32_t neurons() const { return in_sight_.count(); }

 private:
  Forest forest_;
  std::optional<Eye> eye_;
  Shown shown_;
  std::optional<Occluders> before_;
  std::shared_ptr<Closeness> closeness_;  // of all that are asked together
  std::vector<std::uint8_t> reached_;     // in the picture before; empty: nobody knows
  std::size_t together_ = 0;              // parts of that picture, if this chose for the first of them
  std::uint32_t pictures_ = 0;
  using Horizons = std::array<float, 3>;  // µm along the view
  static Horizons horizons_of(const frame::DepthMap& seen);
  static Horizons first_horizons(const Forest& forest, const Eye& eye);
  Horizons horizons_{INFINITY, INFINITY, INFINITY};
  std::size_t round_ = 0;  // of those after the cut
  Painter painter_;
  Cut cut_, revealed_;
  NeuronsInSight in_sight_;
  std::uint64_t revealed_segments_ = 0, drawings_ = 0;
};

}  // namespace forest::scene
