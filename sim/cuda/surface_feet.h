#pragma once
#include <Eigen/Geometry>
#include <memory>
#include <span>
#include <vector>

#include "data/mesh/mesh.h"
#include "sim/law/surface_foot.h"

namespace flash::sim::cuda {

/// A time of a motion: between two steps, as far from the first to the second as `fraction` says.
struct BetweenSteps {
  int first = 0, last = 0;  ///< last: first, where the surface is at rest, or the one behind it
  double fraction = 0;
};

/// Finds on a device where a moving surface is nearest to the points of some clouds, each at a time of its
/// own. Exact in double precision; of triangles that are equally near, as at an edge, rounding decides. An
/// object serves one thread at a time, several do side by side.
class SurfaceFeet {
 public:
  /// `order`: all triangles, neighbours in space one after the other. `sets`: of clouds [m], each with one a
  /// time, which may be empty. Works on the CUDA device `device`. Throws OutOfMemory, and std::runtime_error
  /// with the device's message.
  SurfaceFeet(int device, const data::Triangles& triangles, Eigen::Index vertices,
              const std::vector<int>& order, const std::vector<std::vector<data::Points>>& sets);
  ~SurfaceFeet();
  SurfaceFeet(SurfaceFeet&&) noexcept;

  /// Forgets the steps of the motion before.
  void begin_motion();

  /// The feet of the points of a set, cloud by cloud; valid until the next call. `motion`: positions by step,
  /// where they are read [m], `time_step` apart [s]; the device keeps two of them for each cloud. `times`:
  /// one a cloud. `surface_from_cloud` takes the points to where the surface is; directions are of that
  /// frame.
  std::vector<std::span<const SurfaceFoot>> find(std::size_t set, const std::vector<data::Points>& motion,
                                                 double time_step, const std::vector<BetweenSteps>& times,
                                                 const Eigen::Isometry3d& surface_from_cloud);

 private:
  struct Memory;
  std::unique_ptr<Memory> memory_;
};

}  // namespace flash::sim::cuda
