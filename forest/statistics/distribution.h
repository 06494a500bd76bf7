// SPDX-License-Identifier: Apache-2.0
// What a measured quantity is drawn from: one of the families below or a mixture of up to three, beside them atoms
// (values that come back exactly, such as ratios of 1), and the steps that a tracer counted in. A distribution writes itself
// in the notation of grammars (docs/lsystem/notation.md), so that what was fitted is what grows.
//
//   Distribution d{.components = {{find_family("gamma"), {2, 15}, 0.8}}, .atoms = {{1., 0.2}}};
//   d.expression() == "if(chance(0.2), 1, gamma(2, 15))"
#pragma once

#include <array>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "forest/core/random.h"

namespace forest::statistics {

using Parameters = std::array<double, 4>;  // as many as the family has, in the order of the notation

/// A family of continuous distributions: one row here is known to fitting, drawing, grammars and tests.
struct Family {
  std::string_view name;  // as the notation calls it
  int count;              // of parameters
  std::array<std::string_view, 4> parameters;
  std::string_view meaning;
  enum Support : unsigned char { line, positive, interval, circle } support;
  /// What maximum likelihood finds at the outermost values, where the likelihood is not smooth.
  std::array<bool, 4> is_limit;
  std::array<bool, 4> is_positive;

  double (*log_density)(const Parameters&, double x);
  double (*cdf)(const Parameters&, double x);
  double (*quantile)(const Parameters&, double p);  // 0 < p < 1
  double (*draw)(const Parameters&, Random&);
  /// By maximum likelihood of values with weights (none: all count 1). False when it has no maximum there, as of values
  /// that are all the same or outside of the support.
  bool (*fit)(std::span<const double> x, std::span<const double> weights, Parameters& out);
};

std::span<const Family> families();
const Family* find_family(std::string_view name);  // null when there is none

struct Component {
  const Family* family = nullptr;
  Parameters parameters{};
  double weight = 1.;
};

struct Atom {
  double value = 0., weight = 0.;
};

struct Distribution {
  std::vector<Component> components;  // none to three
  std::vector<Atom> atoms;            // their weights and those of the components sum to 1
  double step = 0.;        // what the components give is rounded to whole multiples of this; 0: it is not
  double origin = 0.;      // from which the components count, where values cannot lie on the other side …
  bool downwards = false;  // … upwards, or down: a contraction is 1 - gamma(2, 0.05)

  double density(double x) const;  // of the components, before rounding; atoms have none
  double cdf(double x) const;      // that a value is <= x
  /// The least x for which cdf(x) >= p; 0 <= p <= 1, at the ends NaN where it has no limit.
  double quantile(double p) const;
  double draw(Random& random) const;
  /// Between a value and what the components give for it.
  double counted(double x) const { return downwards ? origin - x : x - origin; }
  double placed(double counted) const { return downwards ? origin - counted : origin + counted; }
  /// What an expression of the components has before it: "1 - ", or nothing.
  std::string prefix() const;
  /// For the right side of `distribution NAME = …`.
  std::string expression() const;
  /// `distribution NAME = …`; of a single value, which is no draw, `function NAME = …`. Both are called NAME().
  std::string declaration(std::string_view name) const;
};

/// A number as grammars write it, in six digits: "0.25", "-1.3e-05".
std::string number_text(double value);

}  // namespace forest::statistics
