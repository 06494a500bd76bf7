// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/chooser.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

namespace forest::scene {

// How far it is looked, round by round: to where an earlier picture ended nearly everywhere, beyond the last bits of it, and to
// the end. What is near hides most of what is far, and then nobody has to choose it.
Chooser::Horizons Chooser::horizons_of(const frame::DepthMap& seen) {
  constexpr std::array<float, 3> shares{.6f, .85f, .98f};
  constexpr float least = 100.f;  // µm: an eye within a bush is told little of where it is going
  Horizons horizons{INFINITY, INFINITY, INFINITY};
  // Some thousand say how they are spread.
  const std::size_t every = std::max<std::size_t>(1, seen.depths.size() / 8192);
  std::vector<float> depths;
  for (std::size_t i = 0; i < seen.depths.size(); i += every)
    if (std::isfinite(seen.depths[i])) depths.push_back(seen.depths[i]);
  for (std::size_t i = 0; i < shares.size() && !depths.empty(); ++i) {
    const auto nth = depths.begin() + std::ptrdiff_t(shares[i] * float(depths.size() - 1));
    std::nth_element(depths.begin(), nth, depths.end());
    horizons[i] = std::max(*nth, least * float(1u << i));
  }
  return horizons;
}

// When nothing is known yet.
Chooser::Horizons Chooser::first_horizons(const Forest& forest, const Eye& eye) {
  if (forest.groves().nodes().empty()) return {INFINITY, INFINITY, INFINITY};
  const float nearest = eye.nearest_depth(forest.groves().nodes().front().sphere);
  return {nearest + 150.f, nearest + 300.f, nearest + 600.f};
}

const Cut& Chooser::choose(const Eye& eye, const Shown& shown, Painter painter) {
  Chooser* one[] = {this};
  choose(one, {&eye, 1}, shown, painter);
  return cut_;
}

void Chooser::choose(std::span<Chooser* const> choosers, std::span<const Eye> eyes, const Shown& shown,
                     const Painter& painter) {
  Chooser& front = *choosers.front();
  const auto& first = front.eye_;
  const std::uint32_t turns = eyes.front().detail().turns;
  Turn turn{{}, front.pictures_++ % turns, turns};
  bool all_know = std::exchange(front.together_, choosers.size()) == choosers.size() && turns > 1;
  std::vector<Sight> sights;
  for (std::size_t i = 0; i < choosers.size(); ++i) {
    Chooser& c = *choosers[i];
    if (!c.before_) c.horizons_ = first_horizons(c.forest_, eyes[i]);
    // One that was not asked for a while knows what another camera saw.
    const bool knows = c.before_ && first && c.eye_->camera() == first->camera();
    all_know = all_know && knows && !c.reached_.empty();
    sights.push_back({eyes[i], knows ? &*c.before_ : nullptr, c.horizons_[0]});
  }
  if (all_know) {
    for (const Chooser* c : choosers.subspan(1))
      std::ranges::transform(front.reached_, c->reached_, front.reached_.begin(), std::bit_or());
    turn.seen = front.reached_;
  }
  std::shared_ptr<Closeness>& closeness = front.closeness_;
  if (!closeness) closeness = std::make_shared<Closeness>(front.forest_);
  closeness->seen_by(eyes.front());
  std::vector<Cut> cuts = scene::choose(front.forest_, sights, shown, closeness.get(), turn);
  for (std::size_t i = 0; i < choosers.size(); ++i) {
    Chooser& c = *choosers[i];
    c.closeness_ = closeness;
    c.eye_ = eyes[i], c.shown_ = shown, c.painter_ = painter;
    c.revealed_segments_ = c.drawings_ = 0;
    c.cut_ = std::move(cuts[i]);
    c.in_sight_.clear(c.forest_.instances().size());
    c.in_sight_.add(c.cut_);
    if (painter) painter(c.cut_, eyes[i]);
  }
}

void Chooser::complete(frame::Frame& frame) {
  frame.rest = [this](const frame::DepthMap& seen, std::uint32_t round) {
    if (round == 0) round_ = 0, ++drawings_;
    const Occluders now(seen, eye_->camera(), eye_->viewport());
    do {
      const std::span<const LeftOut> left = round_ ? revealed_.left_out : cut_.left_out;
      if (left.empty()) return frame::Lists{};
      // A map of nothing hides nothing: there is no use in rounds.
      const bool rounds = !seen.depths.empty() && round_ + 1 < horizons_.size();
      const float horizon = rounds ? horizons_[round_ + 1] : INFINITY;
      revealed_ = revealed(forest_, {*eye_, &now, horizon}, left, shown_, closeness_.get());
      in_sight_.add(revealed_);
      ++round_;
    } while (revealed_.lists().empty());
    if (painter_) painter_(revealed_, *eye_);
    revealed_segments_ += revealed_.segments;
    return revealed_.lists();
  };
}

void Chooser::remember(const frame::DepthMap& seen, std::span<const std::uint8_t> reached) {
  reached_.assign(reached.begin(), reached.end());
  before_.emplace(seen, eye_->camera(), eye_->viewport());
  horizons_ = horizons_of(seen);
}

}  // namespace forest::scene
