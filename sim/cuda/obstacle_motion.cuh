#pragma once
#include "sim/cuda/replay_numbers.h"
#include "sim/cuda/team.cuh"

namespace flash::sim::cuda {

// Where the obstacles of an environment stand over a part of a step.

/// A vector turned by the rotation vector `turn` [rad] (Rodrigues).
__device__ inline Vector3<double> turned(const Vector3<double>& turn, const Vector3<double>& v) {
  const double angle = norm(turn);
  if (angle == 0) return v;
  const Vector3<double> axis = (1 / angle) * turn;
  return cos(angle) * v + sin(angle) * cross(axis, v) + ((1 - cos(angle)) * dot(axis, v)) * axis;
}

/// The frame at a share of the way from a pose to the next one: the translation is linear, the rotation even.
__device__ inline Frame<double> pose_between(const FramePose& from, const FramePose& to, double share) {
  if (share == 0) return from.frame;
  if (share == 1) return to.frame;
  const Vector3<double> turn = share * from.turn;
  return {turned(turn, from.frame.x), turned(turn, from.frame.y), turned(turn, from.frame.z),
          from.frame.origin + share * (to.frame.origin - from.frame.origin)};
}

/// A frame that stands at `place` in another one.
__device__ inline Frame<double> carried(const Frame<double>& by, const Frame<double>& place) {
  return {direction_from(by, place.x), direction_from(by, place.y), direction_from(by, place.z),
          place_from(by, place.origin)};
}

/// An obstacle between two shares of a step. `poses`: of the frames at the start of the step; those at its
/// end follow after `frames` of them.
__device__ inline MovingObstacle<double> placed_between(const PlacedObstacle& placed, const FramePose* poses,
                                                        int frames, double begin, double end) {
  MovingObstacle<double> moving = placed.obstacle;
  if (moving.moves) {
    const FramePose &from = poses[placed.frame], &to = poses[frames + placed.frame];
    moving.start = carried(pose_between(from, to, begin), placed.obstacle.start);
    moving.end = carried(pose_between(from, to, end), placed.obstacle.start);
  }
  return moving;
}

}  // namespace flash::sim::cuda
