#pragma once
#include <Eigen/Geometry>
#include <span>
#include <string>
#include <vector>

#include "data/camera/camera.h"
#include "data/mesh/mesh.h"
#include "data/scene/scene.h"
#include "sim/render/depth_camera.h"
#include "sim/scene/end_effector.h"
#include "sim/scene/environment.h"
#include "sim/tensor.h"

namespace flash::sim {

/// A rigid body that cameras see.
struct RigidBody {
  std::string name;
  data::TriangleMesh surface;  ///< in its frame [m]
  int frame = base_frame;      ///< of the schedule
  bool collides = true;
};

/// Where it is in an environment, in the base frame.
data::TriangleMesh surface_now(const RigidBody& body, const Environment& environment);

/// How far from where a scene starts planes and cylinders without ends are drawn [m].
inline constexpr double drawn_reach = 100;

/// Objects show where they lie no deeper than this below the surface of a rigid body: what lies on a table is
/// at its height to rounding, and edges of a mesh cut what is round [m].
inline constexpr double drawn_through = 2e-3;

/// What the objects of a scene collide with, in the order of the obstacles of `environment`, which is one of
/// that scene. Round ones have 48 flat sides.
std::vector<RigidBody> rigid_bodies(const data::Scene& scene, const Environment& environment);

/// The box of an end effector, which stands in `frame`.
RigidBody rigid_body(const EndEffector& effector, int frame);

/// A camera that every environment has.
struct LiveCamera {
  std::string name;
  data::CameraIntrinsics lens;  ///< without distortion
  /// What moves, and the camera with it: an end effector, or an obstacle with a trajectory. Empty: the camera
  /// stands in the base frame.
  std::string carrier = {};
  /// Names of what it sees. Empty: all objects, and what they collide with.
  std::vector<std::string> sees = {};
};

/// A picture in each of some environments.
struct CameraViews {
  data::CameraIntrinsics lens;
  std::vector<Eigen::Isometry3d> base_from_camera;
  std::vector<SeenMesh> meshes;
};

/// The cameras of a live scene. Pictures name what is seen by its instance: its number among the objects and
/// then the rigid bodies. Numbers stay as bodies are added.
class LiveCameras {
 public:
  LiveCameras() = default;
  LiveCameras(std::vector<std::string> objects, std::vector<RigidBody> bodies);

  void add_body(RigidBody body);

  /// `poses`, of each environment x y z qx qy qz qw: of the optical frame (x right, y down, z forward) in the
  /// base frame or in that of the carrier. Throws data::InputError for a name that is taken or unknown, a
  /// lens that is none and for poses that are none.
  void add(const LiveCamera& camera, std::span<const int> every, const Tensor& poses);

  /// The same of the environments chosen alone.
  void set_poses(const std::string& name, std::span<const int> chosen, const Tensor& poses);

  std::vector<std::string> names() const;
  std::vector<std::string> instances() const;
  const std::vector<RigidBody>& bodies() const { return bodies_; }

  /// Throws data::InputError where there is none of that name.
  const LiveCamera& camera(const std::string& name) const;

  /// Objects and then the bodies, which have no poses yet.
  std::vector<SeenMesh> meshes(std::vector<SeenMesh> objects) const;

  /// What a camera sees of each of the environments chosen. `objects`: with the vertices of these;
  /// `environments`: they themselves, whose frames stand where they are at the time of their state.
  CameraViews views(const std::string& name, std::span<const int> chosen,
                    std::span<const Environment* const> environments, std::vector<SeenMesh> objects) const;

 private:
  struct Placed {
    LiveCamera camera;
    std::string name;
    int frame = base_frame;
    std::vector<Eigen::Isometry3d> poses;  ///< frame_from_camera of each environment
  };

  std::size_t placed(const std::string& name) const;
  bool sees(const LiveCamera& camera, std::size_t instance) const;

  std::vector<std::string> objects_;
  std::vector<RigidBody> bodies_;
  std::vector<Placed> cameras_;
};

}  // namespace flash::sim
