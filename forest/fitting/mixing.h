// SPDX-License-Identifier: Apache-2.0
// Of which traced neurons a grown one is made, so that it is like none of them all over and is still as a neuron can be. Private to
// this room.
//
// Every neuron has a mate and a third, as alike to it as can be when each is another's mate only once, and third only once, and
// neither is one of its kin, the few that are most like it: then what is grown would lie too near. So many grown neurons as were
// traced have the stems of each, and the diameters of each. Its soma, where it lies in the slice, how its branches wind and how its
// tracer set points are its own, its diameters those of the third. The stems and their style are the mate's: where both have basal dendrites, these
// alone; else all, if both have the same kinds of them. So no kind of dendrite comes more often than it was traced.
//
// Where the mate's stems leave the soma and whither they lead is, stem by stem, as in a fourth neuron that has as many of them: of
// each once, too. What stems there are says little of where they lie, so that this is nearly free, and what has its stems where no
// neuron like it has them is farther from all.
#pragma once

#include <cstddef>
#include <vector>

#include "forest/fitting/traced.h"

namespace forest::fitting {

struct Mixed {
  std::vector<std::size_t> kin;     // the neurons most like it, the most alike first
  std::vector<const Stem*> stems;   // one after the other
  std::vector<const Stem*> poses;   // … and as which each of these leaves the soma: of its kind
  std::size_t basal_as, others_as;  // the neurons whose style its basal dendrites have, and all else
  std::size_t thin_as;              // … whose diameters it has
};

/// Of each neuron. At least two.
/// @param kin  how many there are of these, as far as there are others; one of them is its mate or third only where there is
///             nobody else, and a neuron with kinds of stems that nobody shares is its own mate
std::vector<Mixed> mix(const Traced& traced, std::size_t kin);

/// How little alike two neurons are: the sum of squares over their styles, but for how steep and kinked they were drawn.
double apart(const Cell& one, const Cell& other);

}  // namespace forest::fitting
