// SPDX-License-Identifier: Apache-2.0
#include "forest/fitting/calibration.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>

#include <Eigen/Cholesky>
#include <fmt/format.h>

#include "forest/core/parallel.h"
#include "forest/core/random.h"
#include "forest/lsystem/derive.h"
#include "forest/lsystem/grammar.h"
#include "forest/lsystem/turtle.h"
#include "forest/statistics/dealing.h"
#include "forest/statistics/few_features.h"
#include "forest/statistics/summary.h"

namespace forest::fitting {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Neurons = std::vector<Morphology>;

constexpr std::string_view tasted[] = {"number_of_sections",
                                       "total_length",
                                       "length_fraction_along_z",
                                       "length_fraction_above_soma",
                                       "section_lengths mean",
                                       "section_lengths sd",
                                       "section_term_lengths mean",
                                       "section_path_distances mean",
                                       "section_radial_distances mean",
                                       "section_branch_orders mean",
                                       "section_length_fractions_along_z sd",
                                       "contraction mean",
                                       "contraction sd",
                                       "terminal_degree mean",
                                       "local_bifurcation_angles mean",
                                       "remote_bifurcation_angles mean",
                                       "partition_asymmetry mean",
                                       "partition_pairs_second mean",
                                       "segment_lengths mean",
                                       "segment_lengths sd",
                                       "segment_meander_angles mean",
                                       "y mean",
                                       "y sd",
                                       "z sd"};
constexpr double farthest = 3.;                     // standard deviations: what lies beyond counts as there
constexpr std::uint32_t third_stream = 0x74687264;  // "thrd"

/// A feature in standard deviations from the mean of the traced neurons. What hardly differs among them is not tasted: a
/// tracing in a plane has no slope but what rounding makes.
struct Scale {
  double mean = 0., sd = 0., square_sd = 1.;
  bool tasted() const { return sd > 1e-3 * std::abs(mean) && sd > 1e-4; }
};
std::vector<Scale> scales_of(const MatrixXd& traced) {
  std::vector<Scale> scales;
  for (const auto& column : traced.colwise()) {
    const std::vector<double> values(column.begin(), column.end());
    const statistics::Moments of = statistics::moments(values);
    Scale scale{of.mean, of.count > 1 ? of.sd : 0., 1.};
    if (scale.tasted()) {
      std::vector<double> squares;
      for (const double x : values)
        squares.push_back(std::min(farthest * farthest, std::pow((x - of.mean) / of.sd, 2)));
      if (const double sd = statistics::moments(squares).sd; sd > 0.) scale.square_sd = sd;
    }
    scales.push_back(scale);
  }
  return scales;
}

/// What the discriminator sees: every feature, then their squares; 0 where one is not defined.
MatrixXd seen(const MatrixXd& features, std::span<const Scale> scales) {
  const Index n = features.cols();
  MatrixXd out = MatrixXd::Zero(features.rows(), 2 * n);
  for (Index r = 0; r < features.rows(); ++r)
    for (Index c = 0; c < n; ++c) {
      const Scale& s = scales[std::size_t(c)];
      if (!s.tasted() || std::isnan(features(r, c))) continue;
      const double z = std::clamp((features(r, c) - s.mean) / s.sd, -farthest, farthest);
      out(r, c) = z, out(r, n + c) = (z * z - 1.) / s.square_sd;
    }
  return out;
}

MatrixXd features_of(std::span<const Morphology> neurons, const statistics::FewFeatures& few) {
  MatrixXd out(Index(neurons.size()), Index(few.size()));
  parallel_for(neurons.size(), 1, [&](std::size_t i) {
    out.row(Index(i)) = Eigen::Map<const Eigen::RowVectorXd>(few.measure(neurons[i]).data(), out.cols());
  });
  return out;
}

/// Candidates of as many neurons as there are cards, some times over, those of one neuron one after the other.
MatrixXd grown(const std::string& text, std::size_t cards, const statistics::FewFeatures& few,
               const Calibration& options, Progress& progress) {
  const lsystem::Grammar grammar = lsystem::parse(text, "model");
  MatrixXd out(Index(cards * options.repeats * options.candidates), Index(few.size()));
  parallel_ranges(cards * options.repeats, 1, [&](std::size_t begin, std::size_t end) {
    lsystem::Deriver deriver(grammar);
    for (std::size_t i = begin; i < end; ++i) {
      for (std::uint32_t c = 0; c < options.candidates; ++c) {
        const Morphology neuron =
            lsystem::interpret(deriver.derive(options.seed + i / cards, i % cards, {}, c), grammar);
        out.row(Index(i * options.candidates + c)) =
            Eigen::Map<const Eigen::RowVectorXd>(few.measure(neuron).data(), out.cols());
      }
      progress.advance();
    }
  });
  return out;
}

/// The chance of each candidate to be the one that is drawn of its neuron, over the number of neurons.
VectorXd chances(const MatrixXd& candidates, const VectorXd& weights, Index of_each) {
  VectorXd scores = candidates * weights;
  for (Index i = 0; i < scores.size(); i += of_each) {
    auto own = scores.segment(i, of_each);
    own = (own.array() - own.maxCoeff()).exp().matrix().eval();
    own /= own.sum();
  }
  return scores * double(of_each) / double(scores.size());
}

/// The weights after each round; the first are none.
std::vector<VectorXd> rounds(const MatrixXd& traced, const MatrixXd& candidates, const Calibration& options) {
  const VectorXd wanted = traced.colwise().mean().transpose();
  std::vector<VectorXd> all{VectorXd::Zero(traced.cols())};
  for (std::size_t round = 0; round < options.rounds; ++round) {
    const VectorXd chance = chances(candidates, all.back(), Index(options.candidates)),
                   mean = candidates.transpose() * chance;
    // Fisher's discriminant with a ridge: whither traced ones lie from drawn ones, in units of how these differ.
    const MatrixXd apart = candidates.rowwise() - mean.transpose();
    const MatrixXd spread = apart.transpose() * chance.asDiagonal() * apart +
                            options.ridge * MatrixXd::Identity(apart.cols(), apart.cols());
    all.push_back(all.back() + options.share * spread.ldlt().solve(wanted - mean));
  }
  return all;
}

/// A third for each neuron; a slice lies in one of them.
std::vector<int> thirds(std::size_t count, std::span<const std::uint32_t> slices, std::uint64_t seed) {
  Random random(seed, 0, third_stream);
  const std::vector<std::uint32_t> order = statistics::dealt(count, slices, random);
  std::vector<int> third(count);
  for (std::size_t i = 0; i < count; ++i)
    third[order[i]] = i > 0 && !slices.empty() && slices[order[i]] == slices[order[i - 1]]
                          ? third[order[i - 1]]
                          : int(3 * i / count);
  return third;
}

std::string signed_number(double value) {
  return fmt::format("{} {:.5g}", value < 0. ? '-' : '+', std::abs(value));
}

std::string text_of(const VectorXd& weights, std::span<const std::string> names,
                    std::span<const Scale> scales, const Calibration& options) {
  std::string text = fmt::format(
      "\n# Of so many candidates, which have the same stems, one is drawn by how well its features are "
      "liked, "
      "in standard deviations\n# of the traced neurons: weights of a linear discriminator of traced and "
      "grown "
      "ones, and of its squares.\ncandidates: {}\n"
      "function liked(z, a, b) = a * max(-{}, min({}, z)) + b * (min({}, z^2) - 1)\n",
      options.candidates, farthest, farthest, farthest * farthest);
  for (std::size_t i = 0; i < names.size(); ++i) {
    const Scale& s = scales[i];
    if (!s.tasted()) continue;
    fmt::format_to(std::back_inserter(text), "taste {}(x) = liked((x {}) / {:.5g}, {:.3g}, {:.3g})\n",
                   names[i], signed_number(-s.mean), s.sd, weights[Index(i)],
                   weights[Index(names.size() + i)] / s.square_sd);
  }
  return text;
}

Neurons of_third(std::span<const Morphology> neurons, std::span<const int> third, int which, bool in) {
  Neurons some;
  for (std::size_t i = 0; i < neurons.size(); ++i)
    if ((third[i] == which) == in) some.push_back(neurons[i]);
  return some;
}

}  // namespace

std::vector<std::string> tasted_features(std::span<const Morphology> neurons, statistics::KindSet kinds) {
  constexpr double nearly_all = .9;
  std::vector<std::string> names;
  for (const SectionKind kind :
       {SectionKind::axon, SectionKind::basal, SectionKind::apical, SectionKind::glia, SectionKind::undefined,
        SectionKind::unspecified, SectionKind::custom}) {
    if (!kinds.contains(kind)) continue;
    const auto having = std::ranges::count_if(neurons, [&](const Morphology& m) {
      return std::ranges::any_of(m.sections(), [&](const Section& s) { return s.kind == kind; });
    });
    if (double(having) < nearly_all * double(neurons.size())) continue;
    for (const std::string_view feature : tasted)
      names.push_back(fmt::format("{} {}", name_of(kind), feature));
  }
  return names;
}

Calibrated calibrated_grammar(std::span<const Morphology> neurons, std::span<const std::uint32_t> slices,
                              const std::string& title, const Resampling& resampling,
                              const Calibration& options, Progress& progress) {
  Calibrated out{.text = resampling_grammar(neurons, title, resampling, progress)};
  const std::vector<std::string> names = tasted_features(neurons, resampling.kinds);
  if (neurons.size() < options.least || options.candidates < 2 || names.empty()) return out;
  statistics::FewFeatures few;
  for (const std::string& name : names) few.add(name);

  const std::vector<int> third = thirds(neurons.size(), slices, options.seed);
  progress.begin("calibrating", 3 * neurons.size() * options.repeats);  // two thirds three times, and all
  std::vector<double> gaps(options.rounds + 1, 0.);
  for (int held = 0; held < 3; ++held) {
    const Neurons fitted = of_third(neurons, third, held, false), back = of_third(neurons, third, held, true);
    if (fitted.size() < 4 || back.size() < 2 || !can_be_resampled(fitted, resampling.kinds)) continue;
    const MatrixXd traced = features_of(fitted, few);
    const std::vector<Scale> scales = scales_of(traced);
    const MatrixXd candidates = seen(
        grown(resampling_grammar(fitted, title, resampling), fitted.size(), few, options, progress), scales);
    const VectorXd wanted = seen(features_of(back, few), scales).colwise().mean().transpose();
    const std::vector<VectorXd> weights = rounds(seen(traced, scales), candidates, options);
    for (std::size_t r = 0; r < weights.size(); ++r)
      gaps[r] +=
          (candidates.transpose() * chances(candidates, weights[r], Index(options.candidates)) - wanted)
              .squaredNorm() /
          (3. * double(wanted.size()));
  }
  out.rounds = std::size_t(std::ranges::min_element(gaps) - gaps.begin());
  out.gap_before = gaps.front(), out.gap_after = gaps[out.rounds];
  if (out.rounds > 0) {
    const MatrixXd traced = features_of(neurons, few);
    const std::vector<Scale> scales = scales_of(traced);
    const MatrixXd candidates = seen(grown(out.text, neurons.size(), few, options, progress), scales);
    out.text +=
        text_of(rounds(seen(traced, scales), candidates, options)[out.rounds], names, scales, options);
  }
  progress.end();
  return out;
}

}  // namespace forest::fitting
