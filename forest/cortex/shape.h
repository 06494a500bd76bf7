// SPDX-License-Identifier: Apache-2.0
// Elements whose parameters are nearly in one direction somewhere, or even turned inside out, get a better shape: all places of
// their curves move, those on a surface along it, until
//
//     Σ max(0, wanted − s)² / χ(s)  +  even · Σ (volume beyond least … most)²  +  level · Σ (tilt)²
//                                   +  Σ (way / along)² / 100  +  Σ (distance / off)² / 100
//
// is least. The first sum is over 5×5×5 places of each element, s is the scaled Jacobian there (Knupp 2000, "Achieving finite element
// mesh quality via optimization of the Jacobian matrix norm and associated quantities. Part I", Int J Numer Meth Eng 48:401, of whose
// measures this one is bounded and so can begin at folded elements), and χ(s) is s well above 0 and never 0, so that what is
// nearly folded counts by far the most (gauge.h). The second is over elements, in wanted volumes; so is the third, of how much more of an
// element lies above its middle than below, beside the mean of those around it: where neighbours taper otherwise, layers bulge between
// them (depth.h). The fourth is over places, and how far they went; the last over places on a surface, and how far they are from it.
// What is well shaped stays where it is.
// The last may be over 5×5 places of faces instead, since a face bulges between its curves: each is held to the plane nearest to it, the
// less the farther that is beyond .1 mm, and not where it is beyond .3 mm or the other bank's.
#pragma once

#include <span>

#include "forest/cortex/elements.h"

namespace forest::cortex {

struct Shaping {
  double enough = .53;             // scaled Jacobian: elements that have it everywhere are left alone
  double wanted = .65;             // of others
  double volume = 1e9;             // µm³
  double least = .85, most = 1.2;  // of it
  double even = 4.;                // what (a volume beyond these)² counts, in wanted volumes
  double level = 30.;  // what (more above its middle than elements around have)² counts, likewise
  double along =
      400.;  // µm: as far, a place moves as gladly as it lets the Jacobian at one place fall short by a tenth
  double off = 25.;  // µm, likewise from a surface
  /// Of the curves of the worst: a surface may be creased more sharply than an element can be.
  double worst_off = 100.;
  int rounds = 3;       // of looking for what is badly shaped, and where the surfaces are
  int iterations = 60;  // in each
  double gain = .02;    // of the whole, by five of these: with less a patch is left
  int room = 1;         // rings of elements around the worst that move with them
  int patch = 24;       // elements that are shaped at once
  /// µm; above 0 it is 5×5 places of each face that are held to a surface, not the curves' own, and elements with one that is farther
  /// off are shaped, too.
  double close = 0.;
  bool finely = false;  // what lies between is looked at, too: at 9×9×9 places of each element
};

/// @param among  elements that are looked at; none: all of them
void improve_shapes(Elements& elements, const SurfaceTrees& surfaces, const Shaping& shaping,
                    Progress& progress, std::span<const std::uint32_t> among = {});

}  // namespace forest::cortex
