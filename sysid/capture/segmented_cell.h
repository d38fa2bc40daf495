#pragma once
#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

namespace flash::sysid {

/// What `segment` knows of the cell beside the clouds that it writes. It stands as segment.json beside
/// frames/, and `import` takes from it what it is not told.
struct SegmentedCell {
  struct Table {
    Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< base frame [m]
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  };
  std::optional<Table> table;
  std::vector<double> times;             ///< one a frame, by the clock of the trajectory [s]; may be empty
  std::string trajectory;                ///< T_base_gripper, TUM; empty without a gripper
  std::vector<Eigen::Vector3d> cameras;  ///< where they are, base frame [m]; of clouds none
};

/// The trajectory is named as from the file.
void save_segmented_cell(const SegmentedCell& cell, const std::string& path);

/// Throws data::InputError naming file, field, what was found and what was expected.
SegmentedCell load_segmented_cell(const std::string& path);

/// The segment.json of a folder of clouds; empty where there is none.
std::string segmented_cell_of(const std::string& clouds);

/// Height of the table under a point [m].
double height_under(const SegmentedCell::Table& table, const Eigen::Vector3d& point);

}  // namespace flash::sysid
