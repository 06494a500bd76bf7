// SPDX-License-Identifier: Apache-2.0
// Do the branches that a picture shows hang together? A pure function of the cut, every segment of which a renderer draws: no
// graphics card is asked.
#pragma once

#include <vector>

#include "forest/scene/cut.h"

namespace forest::scene {

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
  Connections operator()(const Cut& cut, const frame::Camera& camera, const frame::Viewport& viewport) const;

 private:
  const Forest& forest_;
  std::vector<std::vector<Vec3>> roots_;  // of each distinct neuron, sorted
};

}  // namespace forest::scene
