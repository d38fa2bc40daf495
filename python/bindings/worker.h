#pragma once
#include <unistd.h>

#include <functional>
#include <future>
#include <memory>

namespace flash::python {

/// A thread that waits for work. The runtime of a device keeps what it has of a thread, which a new one for
/// each work would make anew.
class Worker {
 public:
  Worker();
  ~Worker();

  /// Work that begins now; the one before has ended.
  std::future<void> start(std::function<void()> work);

 private:
  struct Thread;
  std::unique_ptr<Thread> thread_;
  pid_t process_ = 0;  ///< which has the thread; a fork does not
};

/// Waits for work without the lock of the interpreter. What the handler of a signal raises, as
/// KeyboardInterrupt, ends it: `stop` is called until the work has ended, which may throw data::Stopped then.
void await(std::future<void>& work, const std::function<void()>& stop);

}  // namespace flash::python
