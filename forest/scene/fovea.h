// SPDX-License-Identifier: Apache-2.0
// A picture for an eye that looks at one place: the same view drawn at falling resolution, one layer within the other, as
// Guenter et al. 2012 ("Foveated 3D graphics", ACM Trans Graph 31:164) do. Around the gaze every pixel is drawn as without
// a gaze; from where the eye resolves two pixels no better than one, half the resolution is enough, and so on to an
// eighth. Each layer draws what its own pixels show: fewer clusters, and of thin branches a share that keeps their area.
#pragma once

#include <span>
#include <vector>

#include "forest/scene/view.h"

namespace forest::scene {

struct Layer {
  std::uint32_t width = 0, height = 0;  // of the whole view at this layer's resolution, pixels
  float scale = 1.f;                    // pixels of the picture as wide as one of the layer
  frame::Area area = {};                // what of it is needed
  frame::Area hole = {};                // … and what of that finer layers show, as far as it is a rectangle
  std::vector<std::uint8_t> unwanted =
      {};             // as frame::Frame has it: squares of pixels of which nothing is needed
  float gaps = 0.f;   // as frame::Frame has it: what is seen through them is too small to be resolved
  float until = 0.f;  // eccentricity where it begins to fade into the next, degrees
  float gone = 0.f;   // … and where it is gone; the last layer never is
};

/// Whether a picture of it is united from others, of another size.
inline bool layered(const View& view) { return view.detail.gaze || view.detail.pixel > 1.f; }

/// Finest first; one alone when the view has no gaze or all of the picture is resolved. None is finer than Detail::pixel.
std::vector<Layer> layers_of(const View& view, std::uint32_t width, std::uint32_t height);

/// The view's detail for drawing a layer: the gaze in its pixels, and only its area.
Detail detail_for(const View& view, const Layer& layer, std::uint32_t width, std::uint32_t height);

/// The view as a layer shows it. Rims around nearer branches measure some of its pixels, so they are as much weaker as those are larger,
/// and the picture is as bright; and where a moving picture has one sample a pixel, large pixels have four, lest they are seen as squares.
View view_for(const View& view, const Layer& layer);

/// One picture of the layers' pictures, bilinearly enlarged. Up to the first layer's `until` it is that layer, pixel by pixel.
void unite(const View& view, std::span<const Layer> layers, std::span<const frame::Image* const> pictures,
           std::uint32_t width, std::uint32_t height, frame::Image& whole);

/// Draws lines over a united picture where its first layer does not show: in the pixels of coarser layers they would be thick
/// and blurred. What stands before them is judged by how much of a pixel branches cover (its fourth byte): a line that is nearer
/// than `middle` (a depth, µm) hides it, one that is farther is seen through its gaps.
/// @param like  a frame of all of the picture: its camera, palette and style
void trace_lines(const View& view, std::span<const Layer> layers, std::span<const frame::Overlay> lines,
                 const frame::Frame& like, float middle, frame::Image& whole);

}  // namespace forest::scene
