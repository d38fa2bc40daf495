#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <set>
#include <vector>

#include "data/mesh/mesh.h"
#include "data/recording/recording.h"

namespace flash::sysid {

/// The table as n . (x - point) = 0; n is unit and points up, out of the table.
struct TablePlane {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();    ///< [m]
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit
};

/// Cylinder that the arm fills above the gripper; its points are never cloth.
struct ArmCylinder {
  Eigen::Vector3d tip = Eigen::Vector3d::Zero();  ///< centre of the lower end: the tool centre point [m]
  double radius = 0.06;                           ///< about the vertical through the tip [m]; 0: no arm
};

struct SegmentSettings {
  data::CropBox crop;                             ///< what lies outside is dropped first
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();  ///< against gravity, base frame, unit
  double plane_tolerance = 0.006;                 ///< points of the table lie this close to its plane [m]
  double plane_tilt = 0.2;                        ///< largest angle of its normal against `up` [rad]
  double plane_fraction = 0.05;                   ///< least share of the points that make a table
  double table_clearance = 0.008;                 ///< cloth is kept from this height above the table [m]
  double cluster_gap =
      0.015;  ///< points closer than this, or than three times their usual way, belong together [m]
  int cluster_points = 50;      ///< smaller clusters are never the cloth
  double cluster_share = 0.2;   ///< clusters of at least this share of the largest are kept too
  int outlier_neighbours = 20;  ///< 0: no outlier filter
  double outlier_sigmas =
      2.5;               ///< drop where the mean distance to the neighbours exceeds mean + this many sigmas
  double voxel = 0.003;  ///< one point a cell of this edge [m]; 0: keep every point
};

/// A cube of 5 cm.
using StillCell = std::array<std::int64_t, 3>;
StillCell still_cell(const Eigen::Vector3d& point);

enum class PointLabel { outside, table, arm, clutter, outlier, cloth };
inline constexpr int point_label_count = 6;
const char* to_string(PointLabel label);

struct Segmentation {
  data::Points cloth;              ///< centroids of the voxels [m]; empty where no cluster is large enough
  std::vector<PointLabel> labels;  ///< one a point of the input
  std::array<int, point_label_count> counts{};  ///< points by label
};

struct FoundTable {
  TablePlane plane;
  double tilt = 0;   ///< angle of its normal against `up` [rad]
  int frames = 0;    ///< that hold points
  int agreeing = 0;  ///< that show at least half of what any of them shows of it
};

/// The table of a recording: the largest plane across `up` that stands still, by RANSAC over all frames, then
/// refined to its points (Fischler and Bolles 1981). A crop may cut the table off: points above and below the
/// crop box count too. Planes that fewer than two thirds of the frames show are cloth. Throws
/// data::InputError where no plane that holds `plane_fraction` of the points stands still.
FoundTable find_table(const std::vector<data::Points>& frames, const SegmentSettings& settings);

/// Cuts the cloth out of one frame: crop box, table (all that is not `table_clearance` above it, where there
/// is one), arm, then Euclidean clusters, statistical outliers and a voxel grid. Points that are not finite
/// count as outside. A cluster half of whose points are in `still` cells is no cloth where it is far from the
/// arm's tip; without an arm, where there is another cluster.
Segmentation segment_cloth(const data::Points& points, const std::optional<TablePlane>& table,
                           const ArmCylinder& arm, const SegmentSettings& settings,
                           const std::set<StillCell>& still = {});

}  // namespace flash::sysid
