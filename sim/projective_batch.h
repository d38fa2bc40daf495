#pragma once
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "sim/batch.h"

namespace flash::sim {

/// Results of one environment over some steps of a batch.
struct DeviceSteps {
  int environment;
  int first, count;                     ///< steps
  std::span<const StepStats> stats;     ///< one a step
  std::span<const double> hold_forces;  ///< steps x holds x 3 [N]
};

/// What takes the results; called on several threads, for different environments.
struct DeviceResults {
  std::function<void(const DeviceSteps&)> stepped;
  /// Where the positions of a kept step go, vertices x 3; those of later ones follow.
  std::function<double*(int environment, int index)> kept_at;
  std::function<void(int environment)> finished;             ///< its state is that at the end
  std::function<void(std::span<const double> ticks)> timed;  ///< ticks of processors in each phase of a step
};

/// Takes environments by the projective method from the step `first` on `steps` further on the CUDA devices.
/// Those with the same bending operator, whose holds change in the same steps, run together, as many as fit
/// into a device's memory. What an environment gets depends neither on the others nor on how many devices
/// there are, bitwise. Throws data::InputError where the device cannot do what an environment asks for,
/// data::Stopped once settings.solver.stop is set. Where a device is lost or one environment alone does not
/// fit into its memory it goes on with what it can, and throws a DeviceError at the end, which names the
/// environments without a result; all others have finished.
void advance_projective(const std::shared_ptr<const SheetPlan>& plan, std::vector<Environment>& environments,
                        const BatchSettings& settings, int first, int steps, const DeviceResults& results);

}  // namespace flash::sim
