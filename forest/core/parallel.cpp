// SPDX-License-Identifier: Apache-2.0
#include "forest/core/parallel.h"

#include <atomic>
#include <exception>
#include <mutex>
#include <vector>

#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_pipeline.h>
#include <tbb/parallel_sort.h>

namespace forest {

void parallel_ranges(std::size_t count, std::size_t grain,
                     const std::function<void(std::size_t, std::size_t)>& body) {
  using Range = tbb::blocked_range<std::size_t>;
  std::atomic<std::size_t> first = count;  // range that threw
  std::exception_ptr thrown;
  std::mutex mutex;
  tbb::parallel_for(Range(0, count, grain ? grain : 1), [&](const Range& r) {
    if (r.begin() > first) return;
    try {
      body(r.begin(), r.end());
    } catch (...) {
      const std::scoped_lock lock(mutex);
      if (r.begin() < first) first = r.begin(), thrown = std::current_exception();
    }
  });
  if (thrown) std::rethrow_exception(thrown);
}

void detail::in_order(std::size_t count, const std::function<std::shared_ptr<void>(std::size_t)>& make,
                      const std::function<void(std::size_t, void*)>& take, std::size_t ahead) {
  using tbb::filter_mode;
  // Number i waits in place i % ahead, which i - ahead has left by then. Here, and not with the pipeline, which forgets what is
  // on its way when somebody throws.
  struct Made {
    std::shared_ptr<void> thing;
    std::exception_ptr thrown;
  };
  std::vector<Made> made(ahead);
  std::size_t next = 0;
  tbb::parallel_pipeline(
      ahead,
      tbb::make_filter<void, std::size_t>(filter_mode::serial_in_order, [&](tbb::flow_control& control) {
        if (next == count) control.stop();
        return next++;
      }) & tbb::make_filter<std::size_t, std::size_t>(filter_mode::parallel, [&](std::size_t i) {
        try {
          made[i % ahead].thing = make(i);
        } catch (...) {
          made[i % ahead].thrown = std::current_exception();
        }
        return i;
      }) & tbb::make_filter<std::size_t, void>(filter_mode::serial_in_order, [&](std::size_t i) {
        const Made taken = std::move(made[i % ahead]);
        if (taken.thrown) std::rethrow_exception(taken.thrown);
        take(i, taken.thing.get());
      }));
}

void parallel_sort(std::span<Keyed> numbers) { tbb::parallel_sort(numbers.begin(), numbers.end()); }

ThreadLimit::ThreadLimit(unsigned threads) {
  if (threads) control_ = new tbb::global_control(tbb::global_control::max_allowed_parallelism, threads);
}

ThreadLimit::~ThreadLimit() { delete static_cast<tbb::global_control*>(control_); }

}  // namespace forest
