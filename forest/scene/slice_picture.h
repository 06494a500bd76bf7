// SPDX-License-Identifier: Apache-2.0
// A slice drawn: as pixels, as vector graphics, and where it lies in the main view.
#pragma once

#include <string>

#include "forest/scene/arrangement.h"
#include "forest/scene/slice.h"
#include "forest/scene/view.h"

namespace forest::scene {

/// The picture of a slice: profiles filled in the colour of their neuron, with a darker rim, on light ground as in electron
/// micrographs, on dark ground, or with none.
struct SlicePicture {
  Place centre{0., 0.};  // in the middle of the picture, along the plane's right and up, µm
  double height = 100.;  // of the picture, µm
  std::uint32_t width_pixels = 1280, height_pixels = 720;
  Background background = Background::light;
  bool words = true;  // a scale bar, and what colours measure (gauge.h), where they hide least

  double pixel() const { return height / height_pixels; }  // µm
  Sheet sheet() const;
};

/// Without the profiles of neurons that are hidden.
Slice visible(Slice slice, const Colouring& colouring);

/// @param places  where the words stand, in all pictures that share it at one spot
frame::Image paint(const Slice& slice, const Colouring& colouring, const SlicePicture& picture,
                   Arrangement& places);
frame::Image paint(const Slice& slice, const Colouring& colouring, const SlicePicture& picture);
/// Has a look at one of the pictures of a film.
void look_at(const Slice& slice, const Colouring& colouring, const SlicePicture& picture,
             Arrangement& places);

/// The same as SVG with one path a neuron, its profiles united; ids are the neurons' numbers.
std::string to_svg(const Slice& slice, const Colouring& colouring, const SlicePicture& picture);

/// The plane in the main view: glass as wide as the forest, and its edge as overlays.
frame::Glass plane_glass(const Forest& forest, const CutPlane& plane, Background background);
std::vector<frame::Overlay> plane_marks(const Forest& forest, const CutPlane& plane);

}  // namespace forest::scene
