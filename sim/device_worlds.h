#pragma once
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "sim/plan/sheet_plan.h"
#include "sim/world.h"

namespace flash::sim {

/// What steps worlds on a CUDA device. Their positions, velocities and bristles, and what solvers keep, are
/// there; all else is in the worlds. Throws a DeviceError where the device is lost, OutOfDeviceMemory where
/// its memory does not suffice.
class DeviceWorlds {
 public:
  virtual ~DeviceWorlds() = default;

  /// Takes the next steps of all worlds, as Worlds::step.
  virtual void step(int count, std::span<const int> shown, const std::function<void(int)>& seen,
                    const std::function<void(int)>& ended) = 0;

  // What has been changed in a world from outside:
  virtual void write_state(int environment) = 0;
  virtual void write_velocities(int environment) = 0;
  /// Material, gravity and obstacles; the solver starts anew.
  virtual void write_environment(int environment) = 0;
  virtual void forget_solver(int environment) = 0;

  /// Brings the state of a world from the device, unless it is there already.
  virtual void read_state(int environment) = 0;

  virtual std::vector<char> save(int environment) = 0;
  /// What was saved of a world that is the environment's by now.
  virtual void load(int environment, const std::vector<char>& saved) = 0;

  // Numbers on the device, in memory that is taken once they are asked for and stays where it is.
  virtual const double* positions() = 0;   ///< environments x vertices x 3 [m]
  virtual const double* velocities() = 0;  ///< likewise [m/s]
  /// A copy of numbers of the host, which stay where they are.
  virtual const double* copy_of(std::span<const double> numbers) = 0;
  /// Brings all of them to what is now. What others have queued on the default stream comes before.
  virtual void renew() = 0;

  /// Its positions and velocities are from now on where `before` has them, of which nothing is asked any
  /// more.
  virtual void take_views(DeviceWorlds& before) = 0;

  /// Ticks that processors spent in each ReplayPhase since they were last asked for.
  virtual std::vector<double> phase_ticks() = 0;
};

/// Worlds that are at their start. They and the settings outlive what steps them. Throws data::InputError
/// where this program was built without CUDA.
std::unique_ptr<DeviceWorlds> device_worlds(std::shared_ptr<const SheetPlan> plan, std::vector<World>& worlds,
                                            const WorldSettings& settings);

}  // namespace flash::sim
