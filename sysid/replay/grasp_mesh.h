#pragma once
#include <optional>
#include <vector>

#include "data/meshing/graded.h"
#include "data/recording/recording.h"
#include "sysid/replay/replay.h"

namespace flash::sysid {

/// The size of what a grasp takes, as the settings have it: of a pinch its depth [m].
double size_of_patch(const data::RecordedGrasp& grasp, const ReplaySettings& settings);

/// The outlines of what the grasps hold, in the rest shape, under settings that may replace the recording's:
/// the edge of a clamped or pinched patch, and the point of one that is held in a point. Cells there are a
/// fifth of those of the mesh, or of the patch where that is smaller, unless settings.grasp_cell says
/// another size; at a corner of the patch and about a point an eighth of that.
std::vector<data::Outline> grasp_outlines(const data::Recording& recording, const ReplaySettings& settings);

/// The middle of what a grasp takes, in the rest shape [m]: of a corner's patch that of the square, whatever
/// the mesh; of other patches the mean of the vertices.
Eigen::RowVector3d patch_middle(const data::Recording& recording, const data::RecordedGrasp& grasp);

/// Whether the cells of a recorded sheet shrink towards its grasps. Those of a file do, and those of a
/// specification without a pattern; of one that names a pattern where settings.grasp_cell is given. A
/// grasp_cell of 0 leaves any mesh as it is.
bool are_graded(const data::Recording& recording, const ReplaySettings& settings);

/// Puts cells that shrink towards the grasps in place of those of a recorded sheet. One that is held by a
/// patch at its corner is a plate clamped along two edges which meet at a re-entrant corner: its curvature
/// grows as r^-0.46 about that (Williams 1952), and a motion on even cells is wrong by the first power of
/// their size. A sheet whose specification names no pattern is meshed anew in even triangles first; any other
/// keeps its vertices, but for those that slide onto an outline. Where a specification names a pattern in
/// rows, rows move onto the edge of a clamped patch at a corner, so that as much is held whatever the cells.
/// Anything else that is not are_graded stays as it is.
void grade_towards_grasps(const ReplaySettings& settings, data::Recording& recording);

/// Half of the cells of a recorded sheet, nested in them.
void halve_cells(data::Recording& recording);

/// A part of the size that grade_towards_grasps gave the cells at the grasps, nested in those of the
/// recording: those elsewhere stay.
void refine_grasps(const ReplaySettings& settings, double part, data::Recording& recording);

/// Whether the size of a grasp can be varied: that of a clamped patch at a corner of a sheet.
bool has_grasp_size(const data::RecordedGrasp& grasp, const ReplaySettings& settings);

/// The size of the first patch that has_grasp_size, as the settings have it [m]; empty where none has. A
/// patch across a whole strip, as jaws of a testing machine hold it, has none: its edge is straight.
std::optional<double> grasp_size(const data::Recording& recording, const ReplaySettings& settings);

/// Makes patches at corners as large as `size` [m]. The cells move with them, in the rest shape: a vertex at
/// a distance u from a side of the corner goes to
///
///     g(u) = u size / was  up to `was`,  and on linearly to g(R) = R,  R = 3 max(was, size),
///
/// so that edges stay on the outline and motions are smooth in the size. Throws data::InputError where it is
/// more than half of the sheet.
void resize_grasps(double size, ReplaySettings& settings, data::Recording& recording);

}  // namespace flash::sysid
