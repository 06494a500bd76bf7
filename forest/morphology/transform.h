// SPDX-License-Identifier: Apache-2.0
// Neurons moved in space.
#pragma once

#include <cstdint>
#include <span>

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

/// The same neuron stretched along the axes, from its centre on: what a slice that swelled or shrank, or a wrong step of
/// the microscope's stage, makes of it. Radii stay.
Morphology stretched(const Morphology& m, const Vec3& factors);

/// The same neuron, its sections' points at other places, one for each of m.points(); soma and heads of spines are turned about the
/// origin. Radii stay.
Morphology reshaped(const Morphology& m, std::span<const Vec3> points, const Quat& turn);

/// The same neuron with every daughter at a bifurcation turned about the branch point, with all beyond it, by a random
/// angle of this standard deviation about a random axis across its direction: lengths, diameters and topology stay, angles
/// do not.
/// @param item  what the random numbers are drawn for: the index of the neuron
Morphology jittered(const Morphology& m, float degrees, std::uint64_t seed, std::uint64_t item);

}  // namespace forest
