#pragma once
#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "calib/calibrate/next_poses.h"
#include "calib/dataset/dataset.h"
#include "calib/dataset/detection.h"
#include "calib/dataset/target.h"
#include "calib/detect/detect.h"
#include "calib/uncertainty/lens_estimate.h"
#include "calib/uncertainty/target_size.h"

namespace flash {

/// Options that every verb of flash-calib has.
struct CalibCommonOptions {
  bool json = false;
  bool quiet = false;
  bool verbose = false;
  bool force = false;
  int threads = 0;                      ///< 0: one a processor
  const CLI::Option* config = nullptr;  ///< that names a file of options
};
void add_calib_common_options(CLI::App& verb, CalibCommonOptions& options);

/// Which pictures, poses and intrinsics, and what is to be seen in them.
struct DatasetChoice {
  std::string path;
  std::string target;  ///< text or file; empty: as the dataset says
  std::string poses;
  std::string camera;
  std::string angles;
  std::string robot, base_link, tip_link;
  double link_length_sd = 0;  ///< [m]; 0: links are as the URDF has them
  std::string cache;
  double depth_scale = 0.001;
  bool no_depth = false;
};
void add_dataset_options(CLI::App& verb, DatasetChoice& choice);
/// --link-lengths, of verbs that have --robot and solve for it.
void add_link_option(CLI::App& verb, DatasetChoice& choice);
/// Those of a URDF alone, which the former have.
void add_robot_options(CLI::App& group, DatasetChoice& choice);

/// --target-size-sd, --target-size stated|solved
void add_target_size_options(CLI::App& verb, std::optional<double>& sd, bool& as_stated);

/// --lens: what is known of the lens, and a file of one's own in place of the dataset's; else empty.
struct LensOption {
  calib::LensKnowledge knowledge = calib::LensKnowledge::near;
  std::string own = {};
};
void add_lens_option(CLI::App& verb, LensOption& lens);

/// Throws data::InputError where --lens and --camera both name a file.
void expect_no_camera(const LensOption& lens, const std::string& camera);

/// --setup, for datasets that do not say it.
void add_setup_option(CLI::App& verb, std::string& setup);

/// --lower, --upper, --reach: where the robot may go.
struct PlanBounds {
  std::vector<double> lower = {}, upper = {};
  double reach = calib::PlanSettings{}.reach;
  bool four_axes = false;  ///< see calib::PlanSettings::one_axis
};
void add_plan_bounds(CLI::App& verb, PlanBounds& bounds);
/// Throws data::InputError where --lower is above --upper.
calib::PlanSettings plan_settings(const PlanBounds& bounds);

calib::DatasetOptions dataset_options(const DatasetChoice& choice);
calib::Dataset load_dataset(const DatasetChoice& choice, bool needs_poses = true, bool needs_camera = true);

/// The file of options, empty where there is none.
std::string options_file(const CalibCommonOptions& options);

/// Files that a run on the dataset reads.
std::vector<std::string> files_read(const DatasetChoice& choice, const calib::Dataset& dataset,
                                    const CalibCommonOptions& options);

/// Throws data::InputError where the dataset is pairs of poses, and the verb was given an option of pictures.
void expect_no_picture_options(const CLI::App& verb, const calib::Dataset& dataset);

/// Throws data::InputError where the dataset is pairs of poses.
void expect_pictures(const calib::Dataset& dataset);

/// The target that a file or a text of --target says.
calib::Target target_named(const std::string& text);

/// The target of the command line or, without one, of the dataset. Throws data::InputError where neither
/// names one.
calib::Target target_of(const DatasetChoice& choice, const calib::Dataset& dataset);

/// Detections of the whole set, with a line of progress and, unless the caller does so later, a warning for
/// each view left out.
enum class LeftOut { told, told_later };
std::vector<calib::Detection> detect_all(const calib::Dataset& dataset, const calib::Target& target,
                                         const DatasetChoice& choice, const CalibCommonOptions& options,
                                         LeftOut left_out = LeftOut::told);
void warn_of_left_out(const std::vector<calib::Detection>& detections);

/// The last line of a verb that ends with exit code 3.
void say_unusable(const std::string& reason, const std::string& verdict = "the answer cannot be used");

/// What a verb says to people, on stderr, unless --quiet.
void say(const CalibCommonOptions& options, const std::string& line);
void warn_calib(const std::string& line);

/// One line on a terminal's stderr that says what a long run is at; taken away at its end.
class Progress {
 public:
  Progress(const std::string& line, const CalibCommonOptions& options);
  ~Progress() { end(); }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  void say(const std::string& line) const;
  void end();

 private:
  bool visible_;
};

/// Of --parent-frame and --child-frame: throws data::InputError unless they are two names as ROS has them.
void expect_frame_names(const std::string& parent, const std::string& child);

}  // namespace flash
