#pragma once
#include <nanobind/nanobind.h>

#include <atomic>
#include <memory>

#include "data/scene/scene.h"
#include "sim/live_scene.h"

namespace flash::python {

/// A live scene that one thread of Python uses at a time. Views of its state keep it alive.
class Simulation {
 public:
  Simulation(const data::Scene& scene, int environments, int threads)
      : live_(std::make_shared<sim::LiveScene>(scene, environments, threads)) {}

  /// Calls work(live scene). Throws std::runtime_error while another thread is in a call.
  template <class Work>
  auto use(const Work& work) {
    if (busy_.exchange(true))
      throw std::runtime_error("the simulation is in use by another thread, expected one call at a time");
    const struct Leave {
      std::atomic<bool>& busy;
      ~Leave() { busy = false; }
    } leave{busy_};
    return work(*live_);
  }

  /// Takes steps without the lock of the interpreter. What the handler of a signal throws, as
  /// KeyboardInterrupt, ends it within a step.
  void step(int count);

  std::shared_ptr<const sim::LiveScene> shared() const { return live_; }

 private:
  std::shared_ptr<sim::LiveScene> live_;
  std::atomic<bool> busy_ = false;
};

void bind_simulation(nanobind::module_& module);

}  // namespace flash::python
