#pragma once
#include <atomic>
#include <cstddef>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "data/mesh/mesh.h"
#include "data/scene/scene.h"
#include "sim/live_cameras.h"
#include "sim/live_object.h"
#include "sim/material_numbers.h"
#include "sim/worlds.h"

namespace flash::sim {

/// The objects of a scene in many environments that stay alive, with end effectors that code adds, moves,
/// closes and opens. What moves by the scene's own file goes on doing so. Of what Worlds promises all holds.
///
/// Objects and end effectors are meant by name. What throws data::InputError names the argument, and changes
/// nothing.
class LiveScene {
 public:
  /// `environments` of each object, all alike. Throws data::InputError as load_scene and scene_worlds do.
  /// `threads`: 0: one a processor. On a CUDA device, the first of those chosen, as Worlds do.
  LiveScene(const data::Scene& scene, int environments, int threads, const DeviceChoice& device = {});
  ~LiveScene();

  int size() const;
  DeviceChoice device() const;  ///< where they are stepped; a CUDA device has its number
  double time_step() const;     ///< [s]
  const std::vector<LiveObject>& objects() const;
  std::vector<std::string> end_effectors() const;   ///< those that were added, in their order
  std::vector<std::string> obstacles() const;       ///< of the scene, and end effectors that collide
  const std::vector<std::string>& notices() const;  ///< what was understood of the scene

  /// `poses`: environments x 7, as Worlds has them. Throws after the first step, and for a name that is
  /// taken.
  void add_end_effector(const EndEffector& effector, const Tensor& poses);

  /// Where it is at the end of the next step: environments x 7.
  void move_end_effector(const std::string& name, const Chosen& environments, const Tensor& poses);

  /// Closes it in the next step, on what is within its reach when that begins. One that is closed stays so,
  /// with what it carries or with nothing.
  void close(const std::string& name, const Chosen& environments);

  /// Opens it in the next step.
  void open(const std::string& name, const Chosen& environments);

  /// How many vertices an end effector carries in each environment.
  std::vector<int> held(const std::string& name) const;

  /// Of one object, numbers for the environments chosen; those without a name here stay. Energy that a
  /// material stores jumps with it.
  void set_material(const std::string& object, const Chosen& environments, const MaterialNumbers& numbers);

  /// All numbers of the material of one object, one for each environment.
  MaterialNumbers material(const std::string& object) const;

  /// Whether an obstacle takes the friction of the object's material, as it states none of its own.
  bool uses_material_friction(const std::string& object) const;

  /// Coulomb coefficients of an obstacle on an object, one for each environment.
  void set_friction(const std::string& object, const std::string& obstacle, const Chosen& environments,
                    const std::vector<double>& friction);

  /// environments x 3 [m/s^2].
  void set_gravity(const Chosen& environments, const Tensor& gravity);

  /// environments x vertices of the object x 3 [m/s].
  void set_velocities(const std::string& object, const Chosen& environments, const Tensor& velocities);

  /// Back to the start: state, what is held, end effectors, but not materials, friction and gravity. The k-th
  /// tensors are those of the k-th object, environments x its vertices x 3. One with positions alone starts
  /// there without velocity; one with neither, or of a list that ends before, as the scene says.
  void reset(const Chosen& environments, const std::vector<Tensor>& positions = {},
             const std::vector<Tensor>& velocities = {});

  /// Takes the next steps of all environments. Throws data::Stopped where `stop` was called meanwhile, and
  /// what else Worlds::step does. After that it refuses to, until all environments were reset or loaded.
  void step(int count = 1);

  /// Ends a `step` in another thread soon.
  void stop();

  // Views that stay where they are, those of positions and velocities where the environments are, the others
  // on the processor. What is in them is as it was at the end of the last step.
  Tensor positions(const std::string& object) const;   ///< environments x vertices x 3 [m]
  Tensor velocities(const std::string& object) const;  ///< environments x vertices x 3 [m/s]
  /// Of an end effector, an obstacle or a hold of the file on the objects, by name: environments x 3 [N].
  Tensor force(const std::string& name) const;
  std::vector<std::string> forces() const;  ///< the names that `force` knows
  /// Where the vertices are that something with such a name carries in an environment: a row each [m].
  data::Points held_places(const std::string& name, int environment) const;
  Tensor pose(const std::string& end_effector) const;  ///< where it was told to be: environments x 7
  Tensor status() const;  ///< environments x 7, the fields of WorldStatus, the worst of the objects

  /// A view of forces or of the status where the environments are: on a device a copy that goes with it.
  Tensor on_device(const Tensor& view) const;

  /// Why an environment is lost; empty where it is not.
  const std::string& why_lost(int environment) const;

  /// What pictures tell apart, by its number there: the objects, the obstacles, then end effectors that were
  /// added.
  std::vector<std::string> instances() const;
  /// What pictures of an instance are drawn from: in the base frame, as an environment stands now.
  data::TriangleMesh surface(const std::string& instance, int environment) const;
  std::vector<std::string> cameras() const;  ///< in their order
  const LiveCamera& camera(const std::string& name) const;

  /// A camera in every environment, at any time. `poses`: environments x 7, of its optical frame (x right, y
  /// down, z forward) in the base frame, or in that of its carrier.
  void add_camera(const LiveCamera& camera, const Tensor& poses);
  void set_camera(const std::string& name, const Chosen& environments, const Tensor& poses);

  /// Draws the environments chosen as they stand now, a picture each, in their order, where they are. What
  /// has no end reaches `drawn_reach` past the objects' start. The same bits on any number of threads. `at`:
  /// whose memory the pictures are in; the processor's, or that of the device that steps.
  void render(const std::string& camera, const Chosen& environments, const DepthPictures& pictures,
              Device at = Device::cpu) const;

  /// Environments as they stand. Takes as much memory as they do.
  class Saved;
  std::shared_ptr<const Saved> save(const Chosen& environments) const;

  /// The i-th environment that was saved goes to the i-th of these. Throws data::InputError unless this scene
  /// has saved it.
  void load(const Chosen& environments, const Saved& saved);

 private:
  struct Storage;
  std::unique_ptr<Storage> storage_;
};

}  // namespace flash::sim
