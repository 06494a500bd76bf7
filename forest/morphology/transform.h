// SPDX-License-Identifier: Apache-2.0
// Neurons moved in space.
#pragma once

#include "forest/morphology/morphology.h"

namespace forest {

/// The place a neuron is planted by: the centre of its soma, or where its first root begins when it has none.
/// The origin for an empty neuron.
Vec3 centre(const Morphology& m);

/// The same neuron `by` µm further; annotations are kept.
Morphology translated(const Morphology& m, const Vec3& by);

/// The same neuron with its centre at the origin, as circuits want it. One that is there already (to a
/// thousandth of a µm) is returned as it is, so that doing this again changes nothing.
Morphology centred(const Morphology& m);

}  // namespace forest
