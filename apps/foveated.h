// SPDX-License-Identifier: Apache-2.0
// Pictures for an eye that looks at one place (scene/fovea.h), drawn layer by layer: what the command line and the studio share.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "forest/render/renderer.h"
#include "forest/scene/chooser.h"
#include "forest/scene/fovea.h"

namespace forest {

class Foveated {
 public:
  using Maker = std::function<std::unique_ptr<render::Renderer>()>;

  /// @param make  a renderer for a layer; called once for each
  Foveated(scene::Forest forest, Maker make) : forest_(std::move(forest)), make_(std::move(make)) {}

  /// Adds surfaces to the frame of every layer, which is composed of that cut.
  using Dresser = std::function<void(frame::Frame&, const scene::Cut&, const scene::Eye&)>;

  struct Figures {
    double cull = 0., draw = 0., unite = 0.;    // milliseconds
    std::uint64_t segments = 0;                 // chosen, of all layers
    std::uint64_t drawn = 0;                    // of them, as frame::Timing has it
    std::uint32_t neurons = 0;                  // in sight, of the layer that sees most
    std::vector<std::uint64_t> layer_segments;  // the same of each, finest first
  };
  /// Its subframes [first, last) of view.samples, as frame::Frame has them.
  /// Layers are chosen together, and drawn at the same time where their renderers can and there is neither painter nor dresser.
  const frame::Image& draw(const scene::View& view, std::uint32_t width, std::uint32_t height,
                           const scene::Colouring& colouring, std::span<const frame::Overlay> overlays = {},
                           const std::optional<frame::Glass>& glass = {}, std::uint32_t first = 0,
                           std::uint32_t last = 1024, const scene::Chooser::Painter& painter = {},
                           const Dresser& dress = {});
  const Figures& figures() const { return figures_; }

 private:
  struct Drawn {
    scene::Chooser chooser;
    std::unique_ptr<render::Renderer> renderer;
    frame::Image image;
  };

  scene::Forest forest_;
  Maker make_;
  std::vector<std::unique_ptr<Drawn>> layers_;
  frame::Image whole_;
  Figures figures_;
};

}  // namespace forest
