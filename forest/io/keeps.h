// SPDX-License-Identifier: Apache-2.0
// What a file format can hold of a neuron, as data: from it follow the warnings a person gets, the neuron that is left,
// and what tests may expect back.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "forest/morphology/morphology.h"

namespace forest::io {

/// A deviation from a format that was read all the same, and how; or what was lost in writing.
struct Warning {
  std::size_t line = 0;           // 1-based; 0 when the whole file is meant
  std::string_view code;          // a stable word, for example "negative-radius"
  std::string sentence;           // what stands there and how it was read
  std::string_view mending = {};  // as in Oddity
  bool lost = false;              // as in Oddity
  std::size_t times = 1;          // on how many lines, where only the last of them is told
};
inline std::size_t count_of(std::span<const Warning> warnings) {
  std::size_t sum = 0;
  for (const Warning& w : warnings) sum += w.times;
  return sum;
}

/// What of a neuron a format has words for. What it has none for is told when a neuron that has it is written.
struct Keeps {
  bool kinds = true;         // axon, basal, apical, glia
  bool tags = true;          // the numbers of custom kinds
  bool foreign_tags = true;  // numbers that say another kind in SWC, as HDF5 has of glia; else the kind's own
  bool cylinders = true;     // a soma of several points; else a sphere of its mean size
  bool contours = true;      // a soma of outlines; else a sphere of their mean radius
  bool loose_roots = true;   // neurites that leave from no soma
  bool soma_points = true;   // which soma point a neurite leaves from
  bool joints = true;        // a daughter's own radius at the branch point
  bool single_daughters = true;  // a node with one daughter; else the two are one section
  bool stumps = true;            // a root of a single point
  bool still_points =
      true;  // points at the place of the one before; else the first of them (needs !lengthless)
  bool lengthless = true;  // sections without length; else their end is moved to the next_place
  bool zero_radii = true;  // kept in any case, but told where a simulator cannot compute with them
  bool spines = true;
  bool spine_sizes = true;  // heads, necks and shapes of spines; else only where they sit
  bool annotations = true;
  bool keys =
      true;  // of annotations; else only the header keys of SWC and own_keys, and all others are comments
  std::span<const std::string_view> own_keys = {};
  float least_diameter = 0.f;  // a diameter of 0 becomes this, µm, where a format refuses it
  bool order = true;           // the order of sections; else depth first: a branch, then all that hangs on it
  float step = 0.f;            // coordinates and diameters are rounded to this, µm; 0: not at all

  // What is larger cannot be written.
  std::int32_t largest_tag = std::numeric_limits<std::int32_t>::max();  // left out: the kind's own number
  float largest_place = std::numeric_limits<float>::max();              // refused, µm
  float largest_diameter = std::numeric_limits<float>::max();           // refused, µm
};

/// 1e-6 µm from this point, or where its coordinates have no such step the next they have: no length that counts in a
/// neuron, yet one a simulator can divide by.
Point next_place(Point point);

/// Throws LimitError when a place or a diameter (that of a sphere for the soma aside) is larger than the format can hold.
/// Writers begin with it.
void check_fits(const Morphology& morphology, const Keeps& keeps);

/// What of this neuron is not kept, and what it becomes: one warning (line 0) for each kind of loss.
std::vector<Warning> losses(const Morphology& morphology, const Keeps& keeps);

/// The neuron that is left: the same one when all is kept. Writers begin with it.
Morphology as_kept(const Morphology& morphology, const Keeps& keeps);

}  // namespace forest::io
