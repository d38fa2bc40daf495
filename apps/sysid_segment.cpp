#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "apps/command_line.h"
#include "apps/option_checks.h"
#include "apps/sysid_options.h"
#include "apps/sysid_verbs.h"
#include "data/error.h"
#include "data/text.h"
#include "sysid/segment_folder.h"

namespace flash {
namespace {

namespace fs = std::filesystem;

struct SegmentOptions {
  CommonOptions common;
  std::vector<std::string> views;
  std::string trajectory;
  double rate = 10;
  std::vector<double> low, high;
  bool no_table = false;
  sysid::SegmentFolderSettings settings;
  std::string out;
};

std::vector<double> even_times(std::size_t count, double rate) {
  std::vector<double> times(count);
  for (std::size_t i = 0; i < count; ++i) times[i] = static_cast<double>(i) / rate;
  return times;
}

int run_segment(SegmentOptions options) {
  std::vector<sysid::RawView> views;
  for (const std::string& folder : options.views)
    views.push_back(sysid::open_raw_view(folder, options.common.force));
  options.settings.find_table = !options.no_table;
  if (!options.trajectory.empty()) options.settings.gripper = data::load_tum(options.trajectory);
  if (!options.low.empty())
    options.settings.segment.crop.min = Eigen::Map<const Eigen::Vector3d>(options.low.data());
  if (!options.high.empty())
    options.settings.segment.crop.max = Eigen::Map<const Eigen::Vector3d>(options.high.data());
  check_output(options.out, options.common);
  const sysid::SegmentedFolder segmented = sysid::segment_folder(
      views, even_times(views.front().files.size(), options.rate), options.settings, options.out);

  std::size_t points = 0;
  for (const sysid::Segmentation& frame : segmented.frames)
    points += static_cast<std::size_t>(frame.cloth.rows());
  std::vector<std::string> warnings;
  for (const sysid::RawView& view : views)
    warnings.insert(warnings.end(), view.warnings.begin(), view.warnings.end());
  for (const std::string& warning : warnings) warn(warning);
  const std::string picture = (fs::path(options.out) / segmented.picture).string();
  if (options.common.json) {
    nlohmann::ordered_json json = {{"clouds", segmented.clouds},
                                   {"picture", picture},
                                   {"points", points},
                                   {"table", nullptr},
                                   {"warnings", warnings}};
    if (segmented.table) {
      const Eigen::Vector3d &p = segmented.table->point, &n = segmented.table->normal;
      json["table"] = {{"point", {p.x(), p.y(), p.z()}}, {"normal", {n.x(), n.y(), n.z()}}};
    }
    std::cout << json.dump(2) << '\n';
  } else {
    if (segmented.table)
      std::printf("table through %.4f %.4f %.4f m, normal %.4f %.4f %.4f\n", segmented.table->point.x(),
                  segmented.table->point.y(), segmented.table->point.z(), segmented.table->normal.x(),
                  segmented.table->normal.y(), segmented.table->normal.z());
    std::printf("%zu frames, %s points of cloth\n%s\n", segmented.clouds.size(),
                data::format_count(points).c_str(), picture.c_str());
  }
  return exit_done;
}

}  // namespace

void add_segment_verb(CLI::App& app, Action& action) {
  const auto options = std::make_shared<SegmentOptions>();
  CLI::App* verb = app.add_subcommand(
      "segment", "Cut the cloth out of raw depth images or clouds, and show what was kept");
  sysid::SegmentSettings& segment = options->settings.segment;
  verb->add_option(
          "views", options->views,
          "Folders of raw frames, one a camera: clouds, or depth/ with camera_info.yaml and extrinsics.json")
      ->required();
  verb->add_option("--trajectory", options->trajectory,
                   "T_base_gripper, TUM: the arm above the gripper is cut away");
  verb->add_option("--rate", options->rate, "Frames a second")
      ->check(positive_number())
      ->capture_default_str();
  verb->add_option("--crop-min", options->low, "x,y,z of the box to keep [m]")
      ->delimiter(',')
      ->expected(3)
      ->check(any_number());
  verb->add_option("--crop-max", options->high, "x,y,z of the box to keep [m]")
      ->delimiter(',')
      ->expected(3)
      ->check(any_number());
  verb->add_option("--arm-radius", options->settings.arm_radius, "[m]")
      ->check(number_from(0))
      ->capture_default_str();
  verb->add_option("--clearance", segment.table_clearance,
                   "Cloth is kept from this height above the table [m]")
      ->check(any_number())
      ->capture_default_str();
  verb->add_option("--cluster-gap", segment.cluster_gap, "Points closer than this belong together [m]")
      ->check(positive_number())
      ->capture_default_str();
  verb->add_option("--voxel", segment.voxel, "One point a cell of this edge [m]; 0: every point")
      ->check(number_from(0))
      ->capture_default_str();
  verb->add_flag("--no-table", options->no_table, "There is no table in view");
  verb->add_option("-o,--out", options->out, "Folder for frames/ and segment.png")->required();
  add_common_options(*verb, options->common, force_covers_calibrations);
  verb->footer("Example:\n  flash-sysid segment raw/camera --trajectory gripper.tum --rate 10 -o segmented");
  verb->callback([options, &action] { action = [options] { return run_segment(*options); }; });
}

}  // namespace flash
