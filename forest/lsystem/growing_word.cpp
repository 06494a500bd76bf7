// SPDX-License-Identifier: Apache-2.0
#include "forest/lsystem/growing_word.h"

#include <utility>

namespace forest::lsystem {

GrowingWord::Place GrowingWord::lay(std::span<const Shape> shapes, const double* values) {
  const auto begin = Place(nodes_.size());
  for (const Shape& s : shapes) {
    nodes_.push_back({s.symbol, s.count, std::uint32_t(parameters_.size()), none, none});
    parameters_.insert(parameters_.end(), values, values + s.count);
    values += s.count;
  }
  return begin;
}

void GrowingWord::start() {
  live_ = nodes_.size();
  for (Place i = 0; i < nodes_.size(); ++i) {
    nodes_[i].previous = i == 0 ? none : i - 1;
    nodes_[i].next = i + 1 == nodes_.size() ? none : i + 1;
  }
}

void GrowingWord::replace(Place place, Place begin, std::uint32_t count) {
  live_ = live_ + count - 1;
  Node& old = nodes_[place];
  if (count == 0) {
    old.symbol = blank, old.count = 0;
    return;
  }
  const Node& head = nodes_[begin];
  const Place after = old.next;
  old.symbol = head.symbol, old.count = head.count, old.first = head.first;
  Place at = place;
  for (Place n = begin + 1; n < begin + count; at = n++) nodes_[at].next = n, nodes_[n].previous = at;
  nodes_[at].next = after;
  if (after != none) nodes_[after].previous = at;
}

void GrowingWord::write(Word& word) const {
  word.modules.clear(), word.parameters.clear();
  word.modules.reserve(live_);
  for (Place n = begin(); n != none; n = nodes_[n].next) {
    if (nodes_[n].symbol == blank) continue;
    word.modules.push_back({nodes_[n].symbol, nodes_[n].count, std::uint32_t(word.parameters.size())});
    const auto values = parameters_.begin() + nodes_[n].first;
    word.parameters.insert(word.parameters.end(), values, values + nodes_[n].count);
  }
}

std::vector<GrowingWord::Place> GrowingWord::compact() {
  std::vector<Place> now(nodes_.size(), none);
  std::vector<Node> nodes;
  std::vector<double> parameters;
  nodes.reserve(live_);
  for (Place n = begin(); n != none; n = nodes_[n].next) {
    Node node = nodes_[n];
    now[n] = Place(nodes.size());
    if (node.symbol == blank) continue;
    const auto values = parameters_.begin() + node.first;
    node.first = std::uint32_t(parameters.size());
    parameters.insert(parameters.end(), values, values + node.count);
    nodes.push_back(node);
  }
  for (Place& n : now)
    if (n >= nodes.size()) n = none;
  nodes_ = std::move(nodes), parameters_ = std::move(parameters);
  start();
  return now;
}

}  // namespace forest::lsystem
