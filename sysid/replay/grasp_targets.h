#pragma once
#include <Eigen/Core>

#include "data/recording.h"
#include "data/trajectory.h"
#include "sim/scene/grasp.h"
#include "sysid/replay/replay.h"

namespace flash::sysid {

/// The shape of a grasp under the settings, which may replace the recording's.
data::GraspShape shape_of(const data::RecordedGrasp& grasp, const ReplaySettings& settings);

/// The trajectory of the gripper of a grasp. Throws data::InputError where the recording has none of that
/// name.
const data::Trajectory& trajectory_of(const data::Recording& recording, const data::RecordedGrasp& grasp);

/// A grasp of the recording as it is simulated: its patch, when it closes and where it takes the vertices.
/// `flat`: the sheet as it lies before the table is raised [m].
sim::Grasp make_grasp(const Replay& replay, const data::RecordedGrasp& recorded,
                      const ReplayNuisance& nuisance, const data::Points& flat);

/// Where the vertices of a grasp are held, base frame, gripper at its pose of the grasp's start.
/// clamp: where the sheet lies. point: the vertex nearest the corner alone. pinch: the patch folded about the
/// line through its centre along `ridge` and standing on the table, so that a vertex at (a, b) along and
/// across the ridge is held at m + a ridge + (max|b| - |b|) up, the whole then tilted by `pitch` about the
/// axis across the ridge through m.
data::Points pinch_targets(const data::Points& flat, const Eigen::Vector3d& ridge, const Eigen::Vector3d& up,
                           double pitch);

/// Makes stiff the triangles inside patches that a clamp takes at the beginning and never lets go.
void stiffen_clamped(const Replay& replay, sim::Sheet& sheet);

}  // namespace flash::sysid
