// SPDX-License-Identifier: Apache-2.0
// Every segment of every neuron in sight, without levels of detail: what quick pictures are compared with.
#pragma once

#include "forest/scene/cut.h"

namespace forest::scene {

/// All original segments whose cluster's sphere the camera may see, as capsules; in one band.
Cut whole(const Forest& forest, const frame::Camera& camera, const frame::Viewport& viewport);

}  // namespace forest::scene
