#include "python/bindings/worker.h"

#include <nanobind/nanobind.h>

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>
#include <utility>

#include "data/files/error.h"

namespace flash::python {

namespace nb = nanobind;
using namespace std::chrono_literals;

struct Worker::Thread {
  std::mutex mutex;  ///< of what is next
  std::condition_variable_any changed;
  std::packaged_task<void()> next;
  std::jthread thread{[this](const std::stop_token& stop) { run(stop); }};  // the last: it uses the others

  void run(const std::stop_token& stop) {
    while (true) {
      std::packaged_task<void()> work;
      {
        std::unique_lock lock(mutex);
        if (!changed.wait(lock, stop, [this] { return next.valid(); })) return;
        work = std::exchange(next, {});
      }
      work();
    }
  }
};

Worker::Worker() = default;

Worker::~Worker() {
  if (process_ != getpid()) (void)thread_.release();  // nothing to wait for
}

std::future<void> Worker::start(std::function<void()> work) {
  if (process_ != getpid()) {
    (void)thread_.release();
    thread_ = std::make_unique<Thread>();
    process_ = getpid();
  }
  std::packaged_task<void()> task(std::move(work));
  std::future<void> end = task.get_future();
  {
    const std::scoped_lock lock(thread_->mutex);
    thread_->next = std::move(task);
  }
  thread_->changed.notify_one();
  return end;
}

void await(std::future<void>& work, const std::function<void()>& stop) {
  const auto ended = [&](std::chrono::milliseconds time) {
    const nb::gil_scoped_release release;
    return work.wait_for(time) == std::future_status::ready;
  };
  while (!ended(20ms)) {
    if (PyErr_CheckSignals() == 0) continue;
    const nb::python_error signal;
    do stop();
    while (!ended(1ms));
    try {
      work.get();
    } catch (const data::Stopped&) {
    }
    throw signal;
  }
  work.get();
}

}  // namespace flash::python
