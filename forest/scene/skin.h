// SPDX-License-Identifier: Apache-2.0
// The skin of neurons near the eye: where a branch is wide in the picture, capsules go over into one smooth surface, rounded
// where branches meet, with spines on dendrites. It is made in pieces (geometry/polygonise.h), cells of a lattice in the
// coordinates of a distinct neuron, when they are first seen, and kept; all neurons of that form share them.
//
// Capsules are drawn all the same, and the skin lies around them, but for what is rounded never further out than `skin_gap`
// pixels: so it may fade in (its presence grows with the width of the branch), a piece may be missing, or finer than the
// one beside it, and no hole is seen. Nothing jumps: what a vertex shows depends on its own size in the picture.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <tuple>
#include <vector>

#include "forest/core/progress.h"
#include "forest/frame/frame.h"
#include "forest/geometry/polygonise.h"
#include "forest/scene/chooser.h"
#include "forest/scene/colouring.h"
#include "forest/scene/forest.h"
#include "forest/scene/level.h"

namespace forest::scene {

// Pixels: from which width of a branch (in full from the second on) its skin is there. A soma, which is a ball anyway, has
// one from twice that width on, a neuron forced to have one from half of it on.
inline constexpr float skin_begins = 24.f, skin_complete = 40.f;
// Pixels a µm from which spines are there, in full from the second on.
inline constexpr float spines_begin = 18.f, spines_complete = 30.f;
// µm before the eye: nearer than the first there is none, in full from the second on. A branch there fills the picture, and
// would take all triangles.
inline constexpr float skin_nearest = 3.f, skin_near = 7.f;
inline constexpr float voxel_pixels = 6.f;  // a voxel is at most so large, and at least half of that
inline constexpr float skin_gap = .1f * voxel_pixels;  // pixels

struct SkinLimits {
  std::size_t triangles =
      400'000;  // of a picture, pieces aside of which nothing faces the eye: towards it voxels and the widths above grow; what is too much is left out, the farthest first
  std::size_t new_pieces =
      1u << 20;  // made for one picture, the nearest first; others are left out until the next
  Progress* progress = &Progress::none();
};

/// A spine of the shaft: neck and head. Real ones are not kept in a forest file, so that these are made up: see Skin::spines.
struct Spine {
  Vec3 base = Vec3::Zero(), tip = Vec3::Zero();  // on the axis of the dendrite; the middle of the head
  float neck = 0.f, head = 0.f;                  // radii, µm
  std::uint32_t segment = 0;                     // it sits on, among the neuron's original ones
};

class Skin {
 public:
  explicit Skin(Forest forest);
  ~Skin();
  Skin(Skin&&) noexcept;
  Skin& operator=(Skin&&) noexcept;

  /// Adds the surfaces near the eye to the frame composed of `cut`. The frame must not outlive this object, or its next call.
  /// The same at any number of threads.
  /// @param painter  of activity; may be empty
  void show(frame::Frame& frame, const Cut& cut, const Eye& eye, const Colouring& colouring,
            const Chooser::Painter& painter = {}, const SkinLimits& limits = {});

  struct Figures {
    std::size_t pieces = 0, made = 0, missing = 0, triangles = 0;
    Figures& operator+=(const Figures& more) {
      pieces += more.pieces, made += more.made, missing += more.missing, triangles += more.triangles;
      return *this;
    }
  };
  const Figures& figures() const { return figures_; }  // of the last picture
  void rest() { figures_ = {}; }                       // a picture without any

  /// The spines of a distinct neuron: on the dendrites of neurons that are planted as excitatory, from 20 µm from the soma on,
  /// one a µm, which is about what counts of pyramidal cells find (Luebke 2017, Front Neuroanat 11:11, reviews them; they differ
  /// between cells and along them). Their places are random, as those in human cortex are (Morales et al. 2014, J Neurosci
  /// 34:10078), and a function of neuron, section and number alone. Sizes are spread about those of 72 spines of an apical
  /// dendrite: .85 µm from base to tip, heads of .03 µm³ (Bartol et al. 2015, Front Synaptic Neurosci 7:17), without types, as
  /// a continuum (Arellano et al. 2007, Front Neurosci 1:131).
  const std::vector<Spine>& spines(std::uint32_t neuron);

  /// One piece, made if it is not there.
  struct Made {
    Piece piece;                         // in the neuron's coordinates
    std::vector<std::uint32_t> segment;  // of every vertex: the original segment it is nearest to
    std::vector<float> width;            // µm, of that vertex's section; negative on spines
    std::vector<std::uint8_t> kind;      // its section's
    std::uint64_t version = 0, used = 0;
  };
  using Key =
      std::tuple<std::uint32_t, int, PieceLattice::Cell>;  // neuron, level (voxels of 2^-level µm), cell
  const Made& piece(const Key& key);
  PieceLattice lattice(std::uint32_t neuron, int level);

 private:
  struct Shape;
  Shape& shape(std::uint32_t neuron);
  const Shape& prepared(const Key& key);  // with all that its piece needs
  float widest(std::uint32_t neuron);
  static std::unique_ptr<Made> make(const Shape& shape, const PieceLattice& lattice, const Key& key);

  Forest forest_;
  std::map<std::uint32_t, std::unique_ptr<Shape>> shapes_;
  std::vector<float> widest_;  // of distinct neurons; below 0: not known yet
  std::map<Key, std::unique_ptr<Made>> made_;
  std::uint64_t picture_ = 0;
  std::size_t kept_ = 0;  // triangles
  Figures figures_;
  std::vector<std::vector<std::uint8_t>> entries_, presence_;
  std::vector<frame::Surface> shown_;
};

}  // namespace forest::scene
