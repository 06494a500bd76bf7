// SPDX-License-Identifier: Apache-2.0
// The constants of a picture as every renderer takes them, derived from its frame in one place.
#pragma once

#include "forest/frame/frame.h"

namespace forest::frame {

/// Of one subframe, which looks at sample_place.
Constants constants_of(const Frame& frame, std::uint32_t subframe);

/// How an overlay is drawn: a segment in the world whose meta word names its palette entry.
Segment segment_of(const Overlay& overlay);

/// Depth codes of a key (layout.h).
float depth_of_code(std::uint32_t code);

}  // namespace forest::frame
