// SPDX-License-Identifier: Apache-2.0
// Loops on all cores (oneTBB). Results must not depend on the number of threads: iteration i writes only what
// is i's.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <utility>

namespace forest {

/// Calls body(begin, end) for disjoint ranges that cover [0, count), at least `grain` iterations each where
/// possible. Of bodies that throw, what the first range that does throws is rethrown here, at any number of threads, when all
/// ranges before it are done; some of those after it are left out.
void parallel_ranges(std::size_t count, std::size_t grain,
                     const std::function<void(std::size_t begin, std::size_t end)>& body);

/// Calls body(i) for every i in [0, count), or for every one before the first that throws, which is rethrown here.
template <class Body>
void parallel_for(std::size_t count, std::size_t grain, Body&& body) {
  parallel_ranges(count, grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) body(i);
  });
}

namespace detail {
void in_order(std::size_t count, const std::function<std::shared_ptr<void>(std::size_t)>& make,
              const std::function<void(std::size_t, void*)>& take, std::size_t ahead);
}

/// What make(i) returns goes to take(i, …), in the order of i and one at a time, while later ones are being made on all
/// cores; no more than `ahead` wait at any time. What the first i that throws does is rethrown here, when all before it are taken.
template <class Make, class Take>
void parallel_in_order(std::size_t count, Make&& make, Take&& take, std::size_t ahead = 64) {
  using T = decltype(make(std::size_t()));
  detail::in_order(
      count, [&](std::size_t i) { return std::make_shared<T>(make(i)); },
      [&](std::size_t i, void* made) { take(i, std::move(*static_cast<T*>(made))); }, ahead);
}

/// Sorted by the first number, then by the second.
using Keyed = std::pair<std::uint64_t, std::uint64_t>;
void parallel_sort(std::span<Keyed> numbers);

/// Limits every parallel loop for as long as the object lives; 0 means all cores.
class ThreadLimit {
 public:
  explicit ThreadLimit(unsigned threads);
  ~ThreadLimit();
  ThreadLimit(const ThreadLimit&) = delete;
  ThreadLimit& operator=(const ThreadLimit&) = delete;

 private:
  void* control_ = nullptr;
};

}  // namespace forest
