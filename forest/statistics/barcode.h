// SPDX-License-Identifier: Apache-2.0
// The topological morphology descriptor (Kanari et al. 2018, Neuroinformatics 16:3): an arbor as a barcode. Seen from its
// tips, each branch is a bar that begins at its tip and ends where it meets one whose tip is further out; the one with the
// furthest tip goes on to the start of the arbor.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "forest/statistics/arbors.h"

namespace forest::statistics {

/// What "further out" means, measured from the start of the arbor.
enum class Filtration : std::uint8_t { radial, path };  // straight distance; distance along the branches

/// A point of the persistence diagram.
struct Bar {
  double birth = 0.;  // distance of the tip, µm
  double death = 0.;  // of the branch point where it ends; of the start of the arbor, 0, for its longest one

  double length() const { return birth > death ? birth - death : death - birth; }  // persistence
  bool operator==(const Bar&) const = default;
};

/// The bars of all arbors, one a tip: those of the first arbor, those of the second, ….
class Barcodes {
 public:
  Barcodes(const Arbors& arbors, Filtration filtration);

  std::span<const Bar> bars() const { return bars_; }
  std::size_t size() const { return first_.size() - 1; }  // arbors
  std::span<const Bar> of_arbor(std::size_t arbor) const {
    return std::span(bars_).subspan(first_[arbor], first_[arbor + 1] - first_[arbor]);
  }

 private:
  std::vector<Bar> bars_;
  std::vector<std::size_t> first_;  // of each arbor, and the end
};

double total_persistence(std::span<const Bar> bars);  // sum of the bars' lengths, µm
double longest_bar(std::span<const Bar> bars);        // µm; 0 when there is none

/// Entropy of the bars' shares of the total persistence, in nats: 0 for one bar, ln n for n alike; NaN when none has length
/// (Chintakunta, Gentimis, Gonzalez-Diaz, Jimenez & Krim 2015, Pattern Recognition 48:391).
double entropy(std::span<const Bar> bars);

}  // namespace forest::statistics
