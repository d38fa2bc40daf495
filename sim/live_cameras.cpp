#include "sim/live_cameras.h"

#include <algorithm>
#include <utility>

#include "data/files/error.h"
#include "data/scene/obstacle_surfaces.h"
#include "sim/named.h"
#include "sim/tensor_entries.h"

namespace flash::sim {

using data::InputError;
using Eigen::Isometry3d;

namespace {

/// Where a frame stands in each environment now.
std::vector<Isometry3d> poses_now(std::span<const Environment* const> environments, int frame) {
  std::vector<Isometry3d> poses;
  for (const Environment* environment : environments)
    poses.push_back(frame_pose(*environment, frame, environment->state.time));
  return poses;
}

}  // namespace

data::TriangleMesh surface_now(const RigidBody& body, const Environment& environment) {
  const Isometry3d pose = frame_pose(environment, body.frame, environment.state.time);
  data::TriangleMesh mesh = body.surface;
  mesh.vertices = (mesh.vertices * pose.linear().transpose()).rowwise() + pose.translation().transpose();
  return mesh;
}

std::vector<RigidBody> rigid_bodies(const data::Scene& scene, const Environment& environment) {
  const Eigen::Vector3d reach = Eigen::Vector3d::Constant(drawn_reach);
  Eigen::AlignedBox3d about;
  for (const auto& vertex : environment.state.positions.rowwise()) about.extend(vertex.transpose());
  about = Eigen::AlignedBox3d(about.min() - reach, about.max() + reach);
  std::vector<RigidBody> bodies;
  for (const data::SceneObstacle& obstacle : data::colliding(scene))
    bodies.push_back({.name = obstacle.name,
                      .surface = data::obstacle_surface(obstacle, about),
                      .frame = environment.obstacles[bodies.size()].frame});
  return bodies;
}

RigidBody rigid_body(const EndEffector& effector, int frame) {
  return {.name = effector.name,
          .surface = data::box_surface(2 * effector.half_extents),
          .frame = frame,
          .collides = effector.collides};
}

LiveCameras::LiveCameras(std::vector<std::string> objects, std::vector<RigidBody> bodies)
    : objects_(std::move(objects)), bodies_(std::move(bodies)) {}

void LiveCameras::add_body(RigidBody body) { bodies_.push_back(std::move(body)); }

void LiveCameras::add(const LiveCamera& camera, std::span<const int> every, const Tensor& poses) {
  if (camera.name.empty()) throw InputError("name: found \"\", expected a name");
  const std::vector<std::string> taken = names(), known = instances();
  if (std::find(taken.begin(), taken.end(), camera.name) != taken.end())
    throw InputError("name: found \"" + camera.name + "\", which another camera has, expected a new one");
  pinhole_of(camera.lens);
  for (const std::string& seen : camera.sees) number_of("sees", seen, known);
  int frame = base_frame;
  if (!camera.carrier.empty()) {
    std::vector<RigidBody> moving;
    std::copy_if(bodies_.begin(), bodies_.end(), std::back_inserter(moving),
                 [](const RigidBody& body) { return body.frame != base_frame; });
    frame = moving[number_of("carrier", camera.carrier, names_of(moving))].frame;
  }
  cameras_.push_back({camera, camera.name, frame, poses_of("poses", every, poses)});
}

void LiveCameras::set_poses(const std::string& name, std::span<const int> chosen, const Tensor& poses) {
  const std::size_t number = placed(name);
  const std::vector<Isometry3d> given = poses_of("poses", chosen, poses);
  for (std::size_t i = 0; i < chosen.size(); ++i)
    cameras_[number].poses[static_cast<std::size_t>(chosen[i])] = given[i];
}

std::vector<std::string> LiveCameras::names() const { return names_of(cameras_); }

std::vector<std::string> LiveCameras::instances() const {
  std::vector<std::string> all = objects_;
  for (const RigidBody& body : bodies_) all.push_back(body.name);
  return all;
}

const LiveCamera& LiveCameras::camera(const std::string& name) const { return cameras_[placed(name)].camera; }

std::size_t LiveCameras::placed(const std::string& name) const { return number_of("camera", name, names()); }

bool LiveCameras::sees(const LiveCamera& camera, std::size_t instance) const {
  const bool is_object = instance < objects_.size();
  if (camera.sees.empty()) return is_object || bodies_[instance - objects_.size()].collides;
  const std::string& name = is_object ? objects_[instance] : bodies_[instance - objects_.size()].name;
  return std::find(camera.sees.begin(), camera.sees.end(), name) != camera.sees.end();
}

std::vector<SeenMesh> LiveCameras::meshes(std::vector<SeenMesh> objects) const {
  std::vector<SeenMesh> meshes = std::move(objects);
  for (const RigidBody& body : bodies_)
    meshes.push_back({.triangles = &body.surface.triangles,
                      .vertex_count = body.surface.vertices.rows(),
                      .vertices = {body.surface.vertices.data()},
                      .yields = drawn_through});
  return meshes;
}

CameraViews LiveCameras::views(const std::string& name, std::span<const int> chosen,
                               std::span<const Environment* const> environments,
                               std::vector<SeenMesh> objects) const {
  const Placed& own = cameras_[placed(name)];
  CameraViews views{own.camera.lens, poses_now(environments, own.frame), meshes(std::move(objects))};
  for (std::size_t b = 0; b < bodies_.size(); ++b)
    views.meshes[objects_.size() + b].base_from_mesh = poses_now(environments, bodies_[b].frame);
  for (std::size_t m = 0; m < views.meshes.size(); ++m)
    if (!sees(own.camera, m)) views.meshes[m].triangles = nullptr;
  for (std::size_t i = 0; i < chosen.size(); ++i)
    views.base_from_camera[i] = views.base_from_camera[i] * own.poses[static_cast<std::size_t>(chosen[i])];
  return views;
}

}  // namespace flash::sim
