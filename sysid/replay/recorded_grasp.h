#pragma once
#include <Eigen/Core>

#include "data/motion/trajectory.h"
#include "data/recording/recording.h"
#include "sim/scene/hold.h"
#include "sysid/replay/replay.h"

namespace flash::sysid {

/// The shape of a grasp under the settings, which may replace the recording's.
data::GraspShape shape_of(const data::RecordedGrasp& grasp, const ReplaySettings& settings);

/// The largest distance between two vertices that a grasp of the recording takes, at rest [m].
double held_extent(const Replay& replay, const data::RecordedGrasp& grasp);

/// Throws data::InputError, naming --grasp-within, unless a patch of so many metres is a corner of the sheet:
/// at most half of its longer side.
void check_patch_size(double within, const data::TriangleMesh& mesh);

/// The trajectory of the gripper of a grasp. Throws data::InputError where the recording has none of that
/// name.
const data::Trajectory& trajectory_of(const data::Recording& recording, const data::RecordedGrasp& grasp);

/// Throws data::InputError where a grasp lasts so short that it acts in no step of the replay.
void check_grasps_act(const Replay& replay);

/// The grippers of a replay over its steps, a frame for each grasp of the recording.
std::shared_ptr<const sim::Schedule> gripper_schedule(const Replay& replay);

/// A grasp of the recording as it is simulated: its patch, when it closes and where it takes the vertices.
/// clamp: where the sheet lies, by springs where the nuisance has a grasp_stiffness. point: the vertex
/// nearest the corner alone. pinch: folded to a ridge. `frame`: of the gripper in replay.schedule. `flat`:
/// the sheet as it lies before the table is raised [m].
sim::Hold make_hold(const Replay& replay, const data::RecordedGrasp& recorded, int frame,
                    const ReplayNuisance& nuisance, const data::Points& flat);

/// Adds what holds the object where it starts, and what hangs on it.
void add_supports(const Replay& replay, sim::Environment& environment);

/// Makes stiff the triangles inside patches that a clamp takes at the beginning and never lets go.
void stiffen_clamped(const Replay& replay, sim::Sheet& sheet);

}  // namespace flash::sysid
