#pragma once
#include <nanobind/nanobind.h>

#include <atomic>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "data/scene/scene.h"
#include "python/bindings/worker.h"
#include "sim/device_copies.h"
#include "sim/live_scene.h"

namespace flash::python {

/// A live scene that one thread of Python uses at a time. Views of its state keep it alive.
class Simulation {
 public:
  /// `device`: one that sim::choose_device knows. "auto" is the processor where a CUDA device cannot step the
  /// scene, which is told in `notices`.
  Simulation(const data::Scene& scene, int environments, int threads, const std::string& device);

  /// Calls work(live scene). Throws std::runtime_error while another thread is in a call, and once it is
  /// closed.
  template <class Work>
  auto use(const Work& work) {
    if (busy_.exchange(true))
      throw std::runtime_error("the simulation is in use by another thread, expected one call at a time");
    const struct Leave {
      std::atomic<bool>& busy;
      ~Leave() { busy = false; }
    } leave{busy_};
    if (!live_)
      throw std::runtime_error(
          "found a simulation that was closed or initialized anew, expected what it gives now");
    std::optional<sim::KeptCudaDevice> kept;
    if (on_cuda_) kept.emplace();
    return work(*live_);
  }

  /// Takes steps without the lock of the interpreter. What the handler of a signal throws, as
  /// KeyboardInterrupt, ends it within a step.
  void step(int count);

  /// Seconds that steps take without Python in between. `poses` of an end effector: steps x environments x 7.
  double time_steps(const std::string& end_effector, const sim::Tensor& poses);

  /// Gives it back once no view of it is left.
  void close();

  const std::string& device() const { return device_; }
  std::vector<std::string> notices();
  std::shared_ptr<const sim::LiveScene> shared() const { return live_; }

 private:
  std::shared_ptr<sim::LiveScene> live_;
  bool on_cuda_ = false;
  std::string device_ = "cpu", why_not_cuda_;
  Worker worker_;
  std::atomic<bool> busy_ = false;
};

/// Throws data::InputError unless `device` names one that is there.
void check_device(const std::string& device);

void bind_simulation(nanobind::module_& module);

}  // namespace flash::python
