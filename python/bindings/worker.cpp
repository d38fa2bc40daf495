#include "python/bindings/worker.h"

#include <condition_variable>
#include <mutex>
#include <thread>
#include <utility>

namespace flash::python {

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

}  // namespace flash::python
