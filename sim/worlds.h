#pragma once
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "data/asset/material.h"
#include "sim/tensor.h"
#include "sim/world.h"

namespace flash::sim {

/// How the last step of an environment went: a row of Worlds::status.
struct WorldStatus {
  double steps = 0;        ///< taken since the start or the last reset, first_step included
  double time = 0;         ///< [s]
  double converged = 1;    ///< 1, or 0 where the step is not solved to the tolerance
  double residual = 0;     ///< as StepReport has it
  double penetration = 0;  ///< deepest vertex below a surface [m]
  double parts = 1;        ///< in which the step was taken
  double lost = 0;         ///< 0, or the number of the reason in Lost
};

/// Which environments are meant: by default all. A list without a number means none.
class Chosen {
 public:
  Chosen() = default;
  Chosen(std::span<const int> numbers) : all_(false), numbers_(numbers) {}
  Chosen(const std::vector<int>& numbers) : Chosen(std::span(numbers)) {}

  bool all() const { return all_; }
  std::span<const int> numbers() const { return numbers_; }

 private:
  bool all_ = true;
  std::span<const int> numbers_;
};

/// Environments as they stand, with their solvers. Takes as much memory as these do.
class Checkpoint {
 public:
  int size() const;

 private:
  friend class Worlds;
  struct Saved;
  std::shared_ptr<const Saved> saved_;
};

/// Many environments over one plan that stay alive, each with its own materials, motion and state. What is
/// given from outside, at any step, holds from the next step on. There is no last step. On a CUDA device they
/// stay there: a step brings the poses of its frames there, and what `seen` and the status need back.
///
/// Environment e equals the same environment alone, bitwise, on any number of threads, in whatever parts the
/// steps are taken, and after save and load. One that was reset equals a new one.
///
/// An environment whose step fails is lost: it stays where it is, its status says why, and the others go on
/// until a reset brings it back. Exceptions come from the constructor and from setters alone, before anything
/// is changed, and name the environment; step throws what is no fault of an environment, as
/// std::bad_alloc.
///
/// Setters are for the environments chosen. Numbers come as dense tensors of float64, an entry for each of
/// them in their order. Vertices are in the order of the mesh. Poses are x y z qx qy qz qw: [m] and a unit
/// quaternion, T_base_frame.
class Worlds {
 public:
  /// Frames that are to be given poses need a place to start from: a schedule of at least one pose each.
  /// Throws as check_environments does; on a CUDA device data::InputError for what it cannot do, and a
  /// DeviceError, OutOfDeviceMemory where its memory does not suffice.
  Worlds(std::shared_ptr<const SheetPlan> plan, std::vector<Environment> environments,
         WorldSettings settings);
  ~Worlds();
  Worlds(Worlds&&) noexcept;
  Worlds& operator=(Worlds&&) noexcept;

  int size() const;

  /// Gives every environment an end effector, open, at its pose: environments x 7. The tensors of forces are
  /// others from then on. A device takes the memory of the environments anew before it gives back what they
  /// had. Throws data::InputError where a step has been taken, where the environments
  /// differ in the number of their frames or obstacles, for what is no size, threshold or friction, and for
  /// an obstacle more than a device meets.
  EndEffectorNumbers add(const EndEffector& effector, const Tensor& poses);

  /// Where a frame of the schedule is at the end of the next step: environments x 7. It stays there until it
  /// is given another pose. Throws data::InputError.
  void set_poses(const Chosen& environments, int frame, const Tensor& poses);

  /// Of one body, a material for each environment. Energy that a material stores jumps with it. Throws
  /// data::InputError.
  void set_materials(const Chosen& environments, std::span<const data::SheetMaterial> materials,
                     int body = 0);
  void set_materials(const Chosen& environments, std::span<const data::SolidMaterial> materials,
                     int body = 0);

  /// environments x 3 [m/s^2]. Throws data::InputError.
  void set_gravity(const Chosen& environments, const Tensor& gravity);

  /// Coulomb coefficients of an obstacle on one body, one for each environment. Throws data::InputError.
  void set_friction(const Chosen& environments, int obstacle, std::span<const double> friction, int body = 0);

  /// A hold closes in the next step, on what is where the environment stands then. One that is closed goes on
  /// with what it carries. Throws data::InputError for vertices that are not there, and other vertices than
  /// those of a hold with targets or a stiffness.
  void grasp(const Chosen& environments, int hold, const Grasp& grasp = {});

  /// A hold opens in the next step. Throws data::InputError.
  void release(const Chosen& environments, int hold);

  /// environments x vertices x 3 [m/s]. Throws data::InputError.
  void set_velocities(const Chosen& environments, const Tensor& velocities);

  /// Back to the start: its state, holds and schedule, but not its materials. With positions, environments x
  /// vertices x 3 [m], it starts there instead, at the same time, with nothing held and without velocity if
  /// none is given. Throws data::InputError.
  void reset(const Chosen& environments, const Tensor& positions = {}, const Tensor& velocities = {});

  /// Takes the next steps of each environment. On one thread for each, `seen` is called for each of its
  /// steps in turn, and `finished` once status and report are those of the last one. On a device the
  /// positions of environment(e) are those of the step in `seen` after the steps of `positions_at` alone,
  /// which ascend; they are numbered as WorldStatus::steps. Throws data::Stopped once settings.solver.stop is
  /// set, a DeviceError, and what these throw; then no step is to be used.
  void step(int count = 1, const std::function<void(int environment)>& seen = {},
            const std::function<void(int environment)>& finished = {},
            std::span<const int> positions_at = {});

  // Views of numbers where the environments are. They stay where they are as long as the worlds do, those of
  // forces, and of the status of a device, until an end effector is added. What is in them is as it was at
  // the end of the last `step`. Those of a device take their memory when they are first asked for.
  Tensor positions() const;        ///< environments x vertices x 3 [m]
  Tensor velocities() const;       ///< environments x vertices x 3 [m/s]
  Tensor hold_forces() const;      ///< hold on sheet: environments x holds x 3 [N]
  Tensor obstacle_forces() const;  ///< obstacle on sheet: environments x most obstacles of one x 3 [N]
  Tensor status() const;           ///< environments x 7, the fields of WorldStatus
  const WorldStatus& status(int environment) const;

  Lost lost(int environment) const;
  /// Why an environment is lost, in a line; empty where it is not.
  const std::string& why_lost(int environment) const;

  /// Up to the last step that it has taken. Brings its state from a device first; threads may ask for
  /// different ones at the same time.
  const Environment& environment(int environment) const;
  /// The same as it was given, with what it holds: its positions and velocities may be old ones on a device,
  /// which is not asked.
  const Environment& given(int environment) const;
  /// A device says nothing of the work, of gravitational energy, and of what is held or starts inside
  /// obstacles: these are zero.
  const StepReport& report(int environment) const;
  std::vector<ContactForce> contacts(int environment) const;  ///< on the processor alone; else empty

  /// Gives back the memory of an environment's solver; on a device it stays. The next step starts as that of
  /// a new one.
  void drop_solver(int environment);

  /// Ticks that a device's processors spent in each phase of a step since they were last asked for; empty on
  /// the processor.
  std::vector<double> phase_ticks() const;

  /// Throws data::InputError where an environment is not there.
  Checkpoint save(const Chosen& environments) const;

  /// The i-th environment that was saved goes to the i-th of these. Throws data::InputError unless both are
  /// of one plan, one method, one kind of device and one time step, with as many holds and no more obstacles.
  void load(const Chosen& environments, const Checkpoint& checkpoint);

 private:
  struct Storage;
  std::unique_ptr<Storage> storage_;
};

}  // namespace flash::sim
