#pragma once
#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace flash::data {

/// Calls work(i) for 0 <= i < count, each once, on up to `threads` threads (0: one a processor). What the
/// first failure threw is thrown again after all have ended.
template <class Work>
void for_each_in_parallel(std::size_t count, int threads, const Work& work) {
  if (threads <= 0) threads = static_cast<int>(std::thread::hardware_concurrency());
  std::atomic<std::size_t> next = 0;
  std::exception_ptr failure;
  std::mutex mutex;  // of failure
  const auto take = [&] {
    try {
      for (std::size_t i = next++; i < count; i = next++) work(i);
    } catch (...) {
      next = count;
      const std::scoped_lock lock(mutex);
      if (!failure) failure = std::current_exception();
    }
  };
  {
    std::vector<std::jthread> workers;
    const int more = std::min(threads, static_cast<int>(std::min<std::size_t>(count, 1024)));
    for (int t = 1; t < more; ++t) workers.emplace_back(take);
    take();
  }
  if (failure) std::rethrow_exception(failure);
}

}  // namespace flash::data
