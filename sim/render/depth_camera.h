#pragma once
#include <Eigen/Geometry>
#include <cstdint>
#include <span>
#include <vector>

#include "data/camera/camera.h"
#include "data/mesh/mesh.h"
#include "sim/render/depth_pictures.h"

namespace flash::sim {

/// A triangle mesh that cameras see, with both sides, in one or many pictures.
struct SeenMesh {
  const data::Triangles* triangles = nullptr;  ///< null: it is not seen, and keeps its number
  std::ptrdiff_t vertex_count = 0;
  std::vector<const double*> vertices{};  ///< in each picture: x y z of each [m]; one: the same in all
  std::vector<Eigen::Isometry3d> base_from_mesh{};  ///< in each picture; one: likewise; none: the base frame
  /// Meshes that yield nothing show through it where they lie no deeper than this below its surface [m]:
  /// cloth lies on a table, and not half in it.
  double yields = 0;
};

/// What each pixel sees, row by row; nothing hides what lies before it. Each pixel is drawn once where two
/// triangles share an edge. Of two at one depth, to single precision, the first shows. Triangles with a
/// corner that is no number are not seen. Throws data::InputError for an empty picture, a focal length that
/// is not above 0, a centre that is no number and a lens with distortion: pictures of depth are rectified
/// before they are used.
std::vector<PixelHit> see(const data::CameraIntrinsics& camera, const Eigen::Isometry3d& base_from_camera,
                          std::span<const SeenMesh> meshes);

/// Of a camera without distortion. Throws as `see` does.
Pinhole pinhole_of(const data::CameraIntrinsics& camera);

inline constexpr std::size_t most_meshes = 255;  ///< of a picture; the number that is left is nothing

/// Where the frame of a mesh stands in that of the camera of a picture.
Frame<double> camera_from_mesh(const SeenMesh& mesh, std::size_t picture,
                               const Eigen::Isometry3d& camera_from_base);

/// A picture from each pose of `base_from_camera`. The same bits on any number of threads; 0: one a
/// processor. Throws as `see` does, and data::InputError for more than most_meshes and for a mesh that has
/// vertices or poses for another number of pictures.
void render(const data::CameraIntrinsics& camera, std::span<const Eigen::Isometry3d> base_from_camera,
            std::span<const SeenMesh> meshes, const DepthPictures& pictures, int threads);

}  // namespace flash::sim
