// SPDX-License-Identifier: Apache-2.0
// Memory that is wanted for every picture, and grows to what pictures need once.
#pragma once

#include <mutex>
#include <utility>
#include <vector>

namespace forest {

/// An object of its type that nobody else holds, as its last holder left it; given back when the scope ends. There are as many as
/// were ever held at a time, by all threads and by tasks within one another.
template <class T>
class Lent {
 public:
  Lent() {
    const std::lock_guard lock(mutex());
    if (pool().empty()) return;
    object_ = std::move(pool().back());
    pool().pop_back();
  }
  ~Lent() {
    const std::lock_guard lock(mutex());
    pool().push_back(std::move(object_));
  }
  Lent(const Lent&) = delete;
  Lent& operator=(const Lent&) = delete;

  T& operator*() { return object_; }
  T* operator->() { return &object_; }

 private:
  T object_;

  static std::mutex& mutex() {
    static std::mutex one;
    return one;
  }
  static std::vector<T>& pool() {
    static std::vector<T> objects;
    return objects;
  }
};

}  // namespace forest
