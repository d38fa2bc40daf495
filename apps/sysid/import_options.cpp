#include "apps/sysid/import_options.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <string_view>
#include <vector>

#include "apps/sysid/frame_times.h"
#include "data/camera/depth_map.h"
#include "data/files/error.h"
#include "data/files/text.h"
#include "data/mesh/mesh_io.h"
#include "data/mesh/procedural_mesh.h"
#include "data/motion/trajectory.h"
#include "data/recording/bag_file.h"
#include "data/recording/frame_files.h"
#include "sysid/capture/import_cut.h"
#include "sysid/capture/segmented_cell.h"

namespace flash {
namespace {

constexpr double kLargestSheet = 20;  // above it, millimetres were given for metres [m]

data::InputError option_error(const char* option, const std::string& found, const std::string& expected) {
  return data::InputError("--" + std::string(option) + ": found \"" + found + "\", expected " + expected);
}

std::vector<std::string> files_in(const std::string& folder, const std::vector<std::string>& extensions,
                                  const char* what) {
  data::expect_no_bag(folder, "segment");
  std::vector<std::string> files = data::files_in_order(folder, extensions);
  if (!files.empty()) return files;
  namespace fs = std::filesystem;
  std::error_code unknown;
  std::string hint;
  for (const char* name : {"frames", "clouds", "depth"})
    if (fs::is_directory(fs::path(folder) / name, unknown))
      hint = ": is it " + (fs::path(folder) / name).string() + "?";
  throw data::InputError(folder + ": found no " + what + ", expected a folder of " + extensions.front() +
                         " or " + extensions.back() + " files" + hint);
}

void parse_range(const std::string& range, const char* option, int axis, data::CropBox& crop) {
  if (range.empty()) return;
  const std::vector<std::string_view> ends = data::split(range, ":");
  const auto parse = [&](std::string_view end, double& bound) {
    if (end.empty()) return;
    const std::optional<double> value = data::parse_number(end);
    if (!value) throw option_error(option, range, "LOW:HIGH in metres, either side may be empty");
    bound = *value;
  };
  if (ends.size() != 2) throw option_error(option, range, "LOW:HIGH in metres, either side may be empty");
  parse(ends[0], crop.min[axis]);
  parse(ends[1], crop.max[axis]);
  if (!(crop.min[axis] < crop.max[axis])) throw option_error(option, range, "a low end below the high one");
}

data::TriangleMesh load_mesh(const std::string& spec) {
  const data::TriangleMesh mesh =
      data::is_mesh_spec(spec) ? data::parse_mesh_spec(spec, "--mesh", "") : data::load_triangle_mesh(spec);
  const Eigen::RowVector3d size = mesh.vertices.colwise().maxCoeff() - mesh.vertices.colwise().minCoeff();
  if (size.norm() > kLargestSheet) throw option_error("mesh", spec, "metres (millimetres read as metres?)");
  return mesh;
}

data::Trajectory load_gripper(const std::string& path) {
  data::Trajectory trajectory = data::load_trajectory(path);
  if (trajectory.poses.size() < 2)
    throw data::InputError("--trajectory: " + path + ": found one pose, expected two or more");
  return trajectory;
}

bool are_equal(const data::Trajectory& a, const data::Trajectory& b) {
  if (a.times.size() != b.times.size()) return false;
  for (std::size_t k = 0; k < a.times.size(); ++k)
    if (std::abs(a.times[k] - b.times[k]) > 1e-6 ||
        !a.poses[k].translation().isApprox(b.poses[k].translation(), 1e-6))
      return false;
  return true;
}

bool are_equal(const std::vector<double>& a, const std::vector<double>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](double x, double y) { return std::abs(x - y) < 1e-6; });
}

/// Takes what `segment` knows of the cell for what is not given, and compares it with what is.
void take_segmented(const std::string& file, sysid::ImportSettings& settings) {
  constexpr double kTable = 0.005;  // to which depth cameras and robots know the height of a table [m]
  const sysid::SegmentedCell cell = sysid::load_segmented_cell(file);
  const auto differs = [&](const char* option, const std::string& how) {
    const std::string text = std::string(option) + ": " + how + " " + file;
    if (!settings.accept_unusable)
      throw data::InputError(text +
                             ", with which the clouds were segmented; --despite-doubts takes it as it is");
    settings.taken.push_back("warning: " + text);
  };
  std::vector<std::string> taken;
  if (settings.trajectory.poses.empty()) {
    if (cell.trajectory.empty())
      throw data::InputError("import: expected --trajectory: " + file + " has none");
    settings.trajectory = load_gripper(cell.trajectory);
    settings.trajectory_path = cell.trajectory;
    taken.emplace_back("the trajectory");
  } else if (!cell.trajectory.empty() && !are_equal(settings.trajectory, load_gripper(cell.trajectory))) {
    differs("--trajectory", "found " + settings.trajectory_path + ", which is another than that of");
  }
  if (settings.times.empty() && cell.times.size() > 0 && cell.times.size() != settings.clouds.size())
    throw data::InputError(file + ": times: found " + std::to_string(cell.times.size()) + ", expected " +
                           std::to_string(settings.clouds.size()) + ", one a cloud beside it");
  if (settings.times.empty() && !cell.times.empty()) {
    settings.times = cell.times;
    taken.emplace_back("the times");
  } else if (cell.times.size() == settings.times.size() && !are_equal(settings.times, cell.times)) {
    differs("--times", "found others than those of");
  }
  if (cell.table) {
    const double height = sysid::height_under(*cell.table, settings.trajectory.poses.front().translation());
    if (!settings.table_height) {
      settings.table_height = height;
      taken.push_back("the table's height, " + data::format_short(std::round(1e4 * height) / 1e4) + " m,");
    } else if (const double off = std::abs(*settings.table_height - height); off > kTable) {
      const std::string how = "found " + data::format_short(*settings.table_height) + " m, expected " +
                              data::format_short(std::round(1e4 * height) / 1e4) + " m, as in";
      // The camera, by which it was found, may be off the robot by so much.
      const double allowed = kTable + settings.nuisance.offset.z() + settings.nuisance.table_height;
      if (off > allowed)
        differs("--table-z", how);
      else
        settings.taken.push_back("warning: --table-z: " + how + " " + file +
                                 ": the bounds on offset and table allow it");
    }
  }
  settings.cameras = cell.cameras;
  if (taken.empty()) return;
  std::string list = taken[0];
  for (std::size_t k = 1; k < taken.size(); ++k) list += (k + 1 == taken.size() ? " and " : ", ") + taken[k];
  settings.taken.push_back(list + (taken.size() == 1 ? " is" : " are") + " from " + file);
}

}  // namespace

data::Selection parse_grasp(const std::string& text) {
  data::Selection grasp;
  const std::size_t colon = std::min(text.find(':'), text.size());
  const std::string kind = text.substr(0, colon);
  std::vector<int> indices;
  if (colon < text.size())
    for (const std::string_view word : data::split(std::string_view(text).substr(colon + 1), ",")) {
      const std::optional<long> index = data::parse_integer(word);
      if (!index || *index < 0) throw option_error("grasp", text, "whole numbers from 0 after the colon");
      if (*index > std::numeric_limits<int>::max())
        throw option_error("grasp", text,
                           "numbers of vertices of the mesh, none above " +
                               data::format_count(std::numeric_limits<int>::max()));
      if (kind == "vertices" && std::find(indices.begin(), indices.end(), *index) != indices.end())
        throw option_error("grasp", text, "each vertex once");
      indices.push_back(static_cast<int>(*index));
    }
  if (kind == "corner" && (indices.empty() || (indices.size() == 2 && indices[0] <= 1 && indices[1] <= 1))) {
    grasp.corner = indices.empty() ? std::array<int, 2>{0, 0} : std::array<int, 2>{indices[0], indices[1]};
  } else if (kind == "vertices" && !indices.empty()) {
    grasp.vertices = indices;
  } else if (text == "position") {
    grasp.position = Eigen::Vector3d::Zero();
  } else {
    throw option_error("grasp", text, "corner, corner:I,J with I and J 0 or 1, vertices:A,B,... or position");
  }
  return grasp;
}

data::CropBox parse_box(const std::array<std::string, 3>& ranges, const std::string& name) {
  data::CropBox box;
  for (const int axis : {0, 1, 2})
    parse_range(ranges[static_cast<std::size_t>(axis)], (name + "-" + "xyz"[axis]).c_str(), axis, box);
  return box;
}

data::CropBox parse_crop(const std::array<std::string, 3>& ranges) { return parse_box(ranges, "crop"); }

void read_options(const ImportOptions& options, sysid::ImportSettings& settings) {
  const std::string segmented =
      options.clouds.empty() ? std::string() : sysid::segmented_cell_of(options.clouds);
  if (!options.clouds.empty()) settings.clouds = files_in(options.clouds, {".ply", ".pcd"}, "clouds");
  if (!options.depth.empty()) settings.depth = files_in(options.depth, data::depth_endings(), "depth images");
  if (options.trajectory.empty() && segmented.empty())
    throw data::InputError("import: expected --trajectory, or --markers in place of clouds");
  if (options.mesh.empty()) throw data::InputError("import: expected --mesh, as sheet:0.3x0.24:0.01");
  settings.mesh_spec = options.mesh;
  settings.mesh = load_mesh(options.mesh);
  settings.grasp = parse_grasp(options.grasp);
  settings.grasp.within = options.within.value_or(data::Selection().within);
  settings.crop = parse_crop(options.crop);
  if (options.clouds.empty() == options.depth.empty())
    throw data::InputError("import: expected either a folder of clouds or --depth");
  if (!options.trajectory.empty()) {
    settings.trajectory = load_gripper(options.trajectory);
    settings.trajectory_path = options.trajectory;
  }
  if (!options.times.empty())
    settings.times = frame_times(options.times, options.depth.empty() ? settings.clouds : settings.depth);
  if (!segmented.empty()) take_segmented(segmented, settings);
  if (settings.times.empty())
    if (const std::string gap = data::gap_in_names(options.depth.empty() ? settings.clouds : settings.depth);
        !gap.empty())
      throw data::InputError("--times: found none, but " + gap +
                             ": expected a CSV file with the time of each frame that is there");
  sysid::cut(options.from, options.until, settings);
  if (!options.depth.empty() && settings.extrinsics.empty())
    throw data::InputError("import: --depth needs --extrinsics, and --intrinsics where these hold no lens");
  std::string own;
  settings.lens = data::parse_lens_choice(options.lens, own);
  if (!own.empty() && !settings.intrinsics.empty())
    throw data::InputError("--lens: found " + own + ", expected stated or solved beside --intrinsics");
  if (!own.empty()) settings.intrinsics = own;
}

}  // namespace flash
