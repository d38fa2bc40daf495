#include "sysid/capture/segment/cell_check.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "data/files/text.h"

namespace flash::sysid {
namespace {

double height_over(const TablePlane& table, const Eigen::Vector3d& point) {
  return (point - table.point).dot(table.normal);
}

std::string metres(double length) { return data::format_short(std::round(1000 * length) / 1000) + " m"; }

double nearest_to(const Eigen::Vector3d& place, const data::Points& points) {
  return std::sqrt((points.rowwise() - place.transpose()).rowwise().squaredNorm().minCoeff());
}

}  // namespace

std::string cell_fault(const std::vector<CellFrame>& frames, const std::optional<TablePlane>& table,
                       const std::vector<Eigen::Vector3d>& cameras, const SegmentSettings& settings) {
  constexpr double kBelow = 0.06, kOff = 0.1, kFar = 0.15;  // [m]
  if (table)
    for (const Eigen::Vector3d& camera : cameras)
      if (const double height = height_over(*table, camera); height < 0)
        return "a camera is " + metres(-height) + " below the table that it sees";
  std::vector<double> distances;
  for (const CellFrame& frame : frames) {
    if (!frame.tool) continue;
    const double height = table ? height_over(*table, *frame.tool) : INFINITY;
    if (height < -kBelow)
      return "the gripper goes " + metres(-height) + " below the table, through " +
             metres(table->point.dot(settings.up)) + " of height";
    if (height > kOff && frame.points.rows() > 0) distances.push_back(nearest_to(*frame.tool, frame.points));
  }
  // What lies on the table, or was let go of, is in few frames.
  std::sort(distances.rbegin(), distances.rend());
  const std::size_t most = (3 * frames.size() + 3) / 4;
  if (most == 0 || distances.size() < most || distances[most - 1] < kFar) return "";
  return "the gripper is " + metres(distances[most - 1]) +
         " or more from the nearest point that is seen in three of four frames, and cloth hangs on it (or "
         "does the "
         "recording hold more than the lift?)";
}

std::set<StillCell> still_cells(const std::vector<CellFrame>& frames, const std::optional<TablePlane>& table,
                                const SegmentSettings& settings) {
  constexpr std::size_t kFewest = 4;
  constexpr double kMoved = 0.03;  // by the gripper, and cloth with it [m]
  std::vector<const CellFrame*> apart;
  for (const CellFrame& frame : frames)
    if (std::all_of(apart.begin(), apart.end(), [&](const CellFrame* other) {
          return !frame.tool || (*frame.tool - *other->tool).norm() > kMoved;
        }))
      apart.push_back(&frame);
  if (apart.size() < kFewest) return {};
  std::map<StillCell, std::size_t> seen;
  for (const CellFrame* frame : apart) {
    std::set<StillCell> cells;
    for (const auto point : frame->points.rowwise()) {
      const Eigen::Vector3d place = point.transpose();
      if (!place.allFinite() || !settings.crop.contains(place)) continue;
      if (!table || height_over(*table, place) >= settings.table_clearance) cells.insert(still_cell(place));
    }
    for (const StillCell& cell : cells) ++seen[cell];
  }
  std::set<StillCell> still;
  for (const auto& [cell, count] : seen)
    if (4 * count >= 3 * apart.size()) still.insert(cell);
  return still;
}

}  // namespace flash::sysid
