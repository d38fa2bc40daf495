#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <random>
#include <vector>

#include "data/camera/camera.h"
#include "data/mesh/mesh.h"

namespace flash::sysid {

/// What a pinhole camera sees through the centre of each pixel; row v, column u.
struct DepthView {
  Eigen::ArrayXXd depth;     ///< along the optical axis [m]; infinity where there is nothing
  Eigen::ArrayXXi surface;   ///< index of the surface seen; -1 where there is nothing
  Eigen::ArrayXXi triangle;  ///< index of the triangle seen in its surface; -1 where there is nothing
};

/// Renders triangle meshes (base frame) as sim::see does, so that each hides what lies behind it, itself
/// included. The depth is exact at the pixel centre. Throws data::InputError as that does.
DepthView render_depth(const data::CameraIntrinsics& camera, const Eigen::Isometry3d& base_from_camera,
                       const std::vector<data::TriangleMesh>& surfaces);

/// The pixels of one surface as points in the base frame [m], each moved along its ray by Gaussian noise of
/// standard deviation `depth_noise` [m].
data::Points visible_points(const DepthView& view, int surface, const data::CameraIntrinsics& camera,
                            const Eigen::Isometry3d& base_from_camera, double depth_noise,
                            std::mt19937_64& random);

/// A camera at `position` whose optical axis meets `target`, image upright against `up`. T_base_camera.
Eigen::Isometry3d look_at(const Eigen::Vector3d& position, const Eigen::Vector3d& target,
                          const Eigen::Vector3d& up);

/// The surface of a box: 12 triangles.
data::TriangleMesh box_mesh(const Eigen::Vector3d& half_extents, const Eigen::Isometry3d& base_from_box);

}  // namespace flash::sysid
