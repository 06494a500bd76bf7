// SPDX-License-Identifier: Apache-2.0
// Do the branches that a picture shows hang together? A pure function of the cut: no graphics card is asked.
#pragma once

#include <vector>

#include "forest/scene/cut.h"

namespace forest::scene {

/// Whether a picture whose thinnest lines are so wide (frame::Frame::thinnest) draws this segment of this item, were nothing
/// before it: thin branches are left out by rank, after render/opengl/shaders (draw_line), which a test compares with this.
bool draws(const frame::Segment& segment, const frame::Instance& instance, const frame::Camera& camera,
           float focal, bool as_line, float thinnest);

struct Connections {
  std::uint64_t runs = 0;  // of drawn segments, each beginning where nothing drawn of its neuron ends
  std::uint64_t disconnected =
      0;  // of them, those that begin in the picture and neither at the soma nor at a root: the
          // piece that joins them to their parent is not drawn
};

/// Knows where the neurons of a forest begin; the forest must outlive it.
class Connectedness {
 public:
  explicit Connectedness(const Forest& forest);
  /// @param thinnest  of the picture; 0: nothing of the cut is too thin to be drawn
  Connections operator()(const Cut& cut, const frame::Camera& camera, const frame::Viewport& viewport,
                         float thinnest) const;

 private:
  const Forest& forest_;
  std::vector<std::vector<Vec3>> roots_;  // of each distinct neuron, sorted
};

}  // namespace forest::scene
