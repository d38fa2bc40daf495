#pragma once
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sim/device.h"
#include "sim/newton/restart_interval.h"
#include "sim/newton/solver.h"
#include "sim/oracle/projective.h"
#include "sim/plan/sheet_plan.h"
#include "sim/scene/environment.h"
#include "sim/step/contact_force.h"
#include "sim/world.h"

namespace flash::sim {

/// Numbers that a Batch owns, as DLPack describes them: valid until the batch advances or ends.
template <class Number>
struct View {
  const Number* data = nullptr;
  std::vector<std::ptrdiff_t> shape, strides;  ///< strides in numbers, not bytes
};

/// How one step of one environment went, in numbers alone.
struct StepStats {
  double residual = 0;         ///< relative residual, as in StepReport
  double penetration_max = 0;  ///< deepest vertex below a surface [m]
  int iterations = 0, solves = 0, factorizations = 0, substeps = 0;
  bool converged = false;
};

/// A phase of a step, and its share of the time of the processors at work.
struct PhaseShare {
  std::string name;
  double share = 0;
};

struct BatchSettings {
  SolverSettings solver{};
  /// The projective method in place of Newton's, with the time step of its own; of `solver` only `stop`
  /// holds. On the CPU alone.
  std::optional<ProjectiveSettings> projective{};
  int steps = 0;                  ///< last step of the whole replay
  std::vector<int> kept_steps{};  ///< steps whose positions are kept, ascending; step 0 is the start
  bool contacts = false;          ///< whether contacts and resultants are kept; on the CPU alone
  int first_step = 0;             ///< step at which the states of the environments stand
  int threads = 1;                ///< 0: one a processor; on a device they take the results
  Device device = Device::cpu;
  std::vector<int> cuda_devices{};  ///< by number, which share the environments; empty: the first
};

/// Many environments over one plan, each with its own material, for a whole replay: a loop over Worlds.
/// Environment e of a batch equals the same environment alone, bitwise, on any number of threads and devices
/// and however often it advances. Where a device has no room for all at once that holds where it advances by
/// multiples of restart_interval.
class Batch {
 public:
  /// Throws as Worlds does, and std::invalid_argument where the steps do not ascend from first_step to
  /// `steps`.
  Batch(std::shared_ptr<const SheetPlan> plan, std::vector<Environment> environments, BatchSettings settings);
  ~Batch();
  Batch(Batch&&) noexcept;

  int size() const;
  int step() const;  ///< steps taken, first_step included; -1 after advance has thrown

  /// Takes the next `steps` steps of each environment. The thread that took them calls `finished` with the
  /// number of the environment, so that its results can be used while others go on. Unconverged steps are
  /// in the statistics, never thrown. An environment that is lost finishes too: it stays where it was, and
  /// the steps it did not take are unconverged, with an infinite residual. Throws what a worker threw,
  /// data::InputError for what a device cannot do, data::Stopped where settings.solver.stop ended it. Where a
  /// device is lost or one environment alone does not fit into its memory it goes on with what it can and
  /// throws a DeviceError at the end, which names the environments without a result; all others have
  /// finished. A batch that has thrown cannot advance any more.
  void advance(int steps, const std::function<void(int)>& finished = {});

  /// Whether and why an environment is lost, as Worlds says.
  Lost lost(int environment) const;
  std::string why_lost(int environment) const;

  /// The state of one environment: another batch can go on from it.
  const State& state(int environment) const;

  View<double> positions() const;       ///< environments x vertices x 3 [m]
  View<double> velocities() const;      ///< environments x vertices x 3 [m/s]
  View<double> kept_positions() const;  ///< environments x kept steps x vertices x 3 [m]
  View<double> hold_forces() const;     ///< hold on sheet: environments x steps x holds x 3 [N]
  std::span<const StepStats> stats(int environment) const;  ///< a step each, from first_step on

  // With settings.contacts, as they are at the end of the last step of the last advance, or of the last part
  // of a step in parts; else empty. A force, then its torque about the origin of the base frame [N, N m].
  std::span<const ContactForce> contacts(int environment) const;
  View<double> body_resultants() const;      ///< on bodies of the sheet: environments x bodies x 6
  View<double> obstacle_resultants() const;  ///< on obstacles: environments x most obstacles of one x 6

  /// Where the time of the steps went on a device; empty on the CPU.
  std::vector<PhaseShare> phases() const;

  /// Positions of one environment at the kept step `index` of settings.kept_steps [m].
  Eigen::Map<const data::Points> kept_positions(int environment, int index) const;

 private:
  struct Storage;
  std::unique_ptr<Storage> storage_;
};

/// Replays any number of environments whole, in batches of at most `at_once`, so that memory holds those
/// alone. `environment_of` makes number i just before its batch, on any thread. `finished` gets i, its batch
/// and its place there, on the thread that simulated it. Throws as Batch does; a DeviceError goes by the
/// numbers i.
void replay_in_batches(const std::shared_ptr<const SheetPlan>& plan, std::size_t count, int at_once,
                       const BatchSettings& settings,
                       const std::function<Environment(std::size_t)>& environment_of,
                       const std::function<void(std::size_t, const Batch&, int)>& finished);

}  // namespace flash::sim
