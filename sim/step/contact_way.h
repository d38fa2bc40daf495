#pragma once
#include <Eigen/Core>
#include <optional>
#include <vector>

#include "sim/step/contact_geometry.h"

namespace flash::sim {

/// How vertices that start a step inside an obstacle come out of it.
struct Exit {
  double speed;  ///< greatest speed [m/s]; 0: vertices may stay, no deeper
  /// Unit direction in which vertices leave each obstacle; zero: each leaves by the side nearest to it.
  Eigen::Vector3d way = Eigen::Vector3d::Zero();
};

/// The other obstacles of a step, as one of them sees them; none by default.
struct OtherObstacles {
  const std::vector<Obstacle>* obstacles = nullptr;
  const std::vector<ObstacleMotion>* motions = nullptr;
  int own = -1;

  /// Whether one of them covers `point` at the end of the step [m].
  bool cover(const Eigen::Vector3d& point) const;
};

/// A flat surface that the way of a vertex meets: normal . x >= offset outside, at the end of the step.
struct MetSurface {
  double entry;  ///< share of the way before it; 0: the vertex starts on it
  Eigen::Vector3d normal;
  double offset;  ///< [m]
};

/// The surface of a plane or a box that the straight way from `start` to `end`, seen from the obstacle,
/// meets, also where it ends on it or leaves it by an edge beside. None for a cylinder, and where the way
/// starts inside.
std::optional<MetSurface> met_surface(const Obstacle& obstacle, const ObstacleMotion& motion,
                                      const OtherObstacles& others, const Eigen::Vector3d& start,
                                      const Eigen::Vector3d& end);

/// How a vertex that comes from `start` [m] at the start of the step stands at `point` at its end. The way
/// between them is straight, seen from the obstacle:
/// - a point in a box, or behind it, stands against the face through which its way entered; one behind the
///   axis of a cylinder against the tangent plane where its way entered. So nothing passes through, however
///   thin. A way that leaves a box by a face beside rounds its edge and is released.
/// - a way in the plane of a face, to within a micrometre, belongs to that face. Where another obstacle
///   covers it, it is no surface: the way enters by the face that it crosses.
/// - a vertex that meets other surfaces before slides along them: `slid` is where its way would end so,
///   `point` where it meets none. That way decides which face of a box it meets, so that it slides over boxes
///   that stand flush.
/// - a vertex that starts inside stands against a surface below the obstacle's own (`sunk`), so that it comes
///   out as `exit` says.
Gap gap_after(const Obstacle& obstacle, const ObstacleMotion& motion, const OtherObstacles& others,
              const Eigen::Vector3d& start, const Eigen::Vector3d& point, const Eigen::Vector3d& slid,
              double time_step, const Exit& exit);

/// How far a vertex at `start` is inside the obstacle below the side that faces `way`, at the start of the
/// step [m]. Infinity where there is no such side.
double depth_along(const Obstacle& obstacle, const ObstacleMotion& motion, const Eigen::Vector3d& start,
                   const Eigen::Vector3d& way);

/// Lowers distances[i] to that of gap_after for every vertex, where it is smaller. `starts` and `points` have
/// a row for each vertex; none of them meets another obstacle.
void lower_to_gaps(const Obstacle& obstacle, const ObstacleMotion& motion, const data::Points& starts,
                   const data::Points& points, double time_step, const Exit& exit,
                   std::vector<double>& distances);

}  // namespace flash::sim
