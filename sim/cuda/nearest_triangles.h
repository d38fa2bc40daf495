#pragma once
#include <Eigen/Geometry>
#include <memory>
#include <vector>

#include "data/mesh.h"

namespace flash::sim::cuda {

/// A time of a motion: between two steps, as far from the first to the second as `fraction` says.
struct BetweenSteps {
  int first = 0, last = 0;  ///< last: first or the one behind it
  double fraction = 0;
};

/// Finds on a device which triangle of a moving surface each point of some clouds is nearest to. A cloud is
/// compared with the surface at a time of its own. Exact in double precision; of triangles that are equally
/// near, as at an edge, rounding decides. An object serves one thread at a time, several do side by side.
class NearestTriangles {
 public:
  /// `order`: all triangles, neighbours in space one after the other. `sets`: of clouds [m], each with one a
  /// time, which may be empty. Works on the CUDA device `device`. Throws OutOfMemory, and std::runtime_error
  /// with the device's message.
  NearestTriangles(int device, const data::Triangles& triangles, Eigen::Index vertices,
                   const std::vector<int>& order, const std::vector<std::vector<data::Points>>& sets);
  ~NearestTriangles();
  NearestTriangles(NearestTriangles&&) noexcept;

  /// Forgets the steps of the motion before.
  void begin_motion();

  /// The triangles nearest to the points of a set, to `nearest`, cloud by cloud. `motion`: positions by step,
  /// where they are read [m]; the device keeps two for each cloud. `times`: one a cloud. `surface_from_cloud`
  /// takes the points to where the surface is.
  void find(std::size_t set, const std::vector<data::Points>& motion, const std::vector<BetweenSteps>& times,
            const Eigen::Isometry3d& surface_from_cloud, std::vector<std::vector<int>>& nearest);

 private:
  struct Memory;
  std::unique_ptr<Memory> memory_;
};

}  // namespace flash::sim::cuda
