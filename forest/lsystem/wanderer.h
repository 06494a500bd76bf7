// SPDX-License-Identifier: Apache-2.0
// The turtle as it goes over a word that still grows: it draws nothing, tells where it is, and can be put back where it
// stood. Private to this room.
#pragma once

#include <memory>
#include <span>

#include <Eigen/Core>

#include "forest/cortex/environment.h"
#include "forest/lsystem/drawing.h"
#include "forest/lsystem/grammar.h"

namespace forest::lsystem {

/// What a turtle remembers at a [.
struct Stance {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // µm
  Eigen::Matrix3d frame;                               // columns: heading, left, up
  Eigen::Vector3d step = Eigen::Vector3d::Zero();      // the direction of the last one
  double diameter = 1., tropism = 0., outward = 0., flat = 0., seek = 0., shun = 0.;
  double shun_reach = 0.;
  double spines = 0.;                                  // per µm
  double avoid = -1.;                                  // µm kept free; below 0: it goes through everything
  Eigen::Vector3d towards = Eigen::Vector3d::UnitY();  // of tropism
  Eigen::Vector3d across = Eigen::Vector3d::UnitZ();   // of flattening
  Drawing::Node node = Drawing::none;                  // the drawn point the turtle stands on
  Drawing::Node begun = Drawing::none;                 // … and that where the traced branch to it began
  Drawing::Pen pen;

  Stance();
};

class Turtle;

class Wanderer {
 public:
  /// Both must outlive it.
  Wanderer(const Grammar& grammar, const cortex::Site& site);
  ~Wanderer();

  /// Does what a module tells a turtle to do; answers are written into the parameters of a question (Prusinkiewicz,
  /// James & Měch 1994, "Synthetic topiary"). Throws as interpret() does.
  void act(Symbol symbol, std::span<double> parameters);

  const Stance& stance() const;
  void return_to(const Stance& stance);
  bool has_soma() const;  // places are counted from the soma

 private:
  std::unique_ptr<Turtle> turtle_;
};

}  // namespace forest::lsystem
