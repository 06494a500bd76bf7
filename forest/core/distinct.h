// SPDX-License-Identifier: Apache-2.0
// Lists in which everything stands once.
#pragma once

#include <algorithm>
#include <vector>

namespace forest {

/// In order, each once.
template <class T>
std::vector<T> distinct(std::vector<T> list) {
  std::sort(list.begin(), list.end());
  list.erase(std::unique(list.begin(), list.end()), list.end());
  return list;
}

}  // namespace forest
