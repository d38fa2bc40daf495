#pragma once
#include <optional>
#include <string>
#include <vector>

#include "calib/dataset/lens_file.h"
#include "calib/dataset/observation.h"
#include "calib/geometry/arm_model.h"
#include "data/camera/camera.h"
#include "data/motion/trajectory.h"

namespace flash::calib {

/// One view: a picture and where the robot was.
struct Frame {
  std::string name;   ///< file name of the picture, for messages; "sample 3" of a set of pairs
  std::string image;  ///< path; empty in a set of pairs
  std::string depth;  ///< path of the picture of depth; empty where there is none
  double stamp = 0;   ///< number of the picture, or its time [s]
  Eigen::Isometry3d T_base_gripper = Eigen::Isometry3d::Identity();
  std::optional<Eigen::Vector3d> angles;  ///< the rotation as written, where it came as angles [rad]
  std::optional<Eigen::Isometry3d> T_camera_target;             ///< in a set of pairs
  Eigen::Matrix<double, 6, Eigen::Dynamic> joint_motions = {};  ///< as in Observation
  Eigen::VectorXd joint_sd = {};                                ///< likewise
};

struct Dataset {
  std::string source;                             ///< the folder or file
  std::string poses_path;                         ///< where the poses come from; empty without poses
  std::string camera_path;                        ///< where the intrinsics come from; empty without
  std::vector<std::string> files;                 ///< all that it was read from, pictures of no pose too
  std::optional<data::CameraIntrinsics> camera;   ///< as the file says it
  std::optional<LensCovariance> lens_covariance;  ///< where the file states one
  std::vector<Frame> frames;                      ///< in order of stamp
  std::optional<data::Trajectory> stream;         ///< poses over time, where pictures fall between them
  std::optional<ArmModel> arm;                    ///< whose joints the poses came as
  double depth_scale = 0.001;                     ///< [m] a count of the depth pictures
  std::optional<Setup> setup;                     ///< as target.json says it
  std::string target;                             ///< as target.json says it, for parse_target; or empty
  std::vector<std::string> guesses;  ///< how what has no name was read, and what was left out: a warning each
  std::vector<std::string> notices;  ///< what a reader may want to know
};

struct DatasetOptions {
  std::string poses = {};   ///< file or folder; empty: found by name in the dataset
  std::string camera = {};  ///< intrinsics file; empty: found by name in the dataset
  std::string robot = {};   ///< URDF: the poses are joints of this robot; empty: they are poses
  std::string base_link = {}, tip_link = {};  ///< of the robot, as load_urdf
  double link_length_sd = 0;  ///< of each link of the robot, an unknown [m]; 0: links are as described
  std::string angles = {};    ///< what three angles of a pose mean, see rotation_from_angles; empty: "xyz"
  bool needs_poses = true;    ///< without: pictures alone, as for intrinsics
  bool needs_camera = true;   ///< of sets with pictures
  double depth_scale = 0.001;
  bool depth = true;  ///< look for depth pictures
};

/// A folder with images/ (or rgb/, color/, img/, or the pictures themselves; jpg, png or bmp, sorted), poses
/// as a list (poses.tum, .csv, .txt, .json) or one a file (poses/*.yaml or *.txt, pose*.yaml or *.txt),
/// intrinsics (load_intrinsics), target.json, and depth/ with pictures of depth of the same names
/// (data::load_depth). Or a set of pairs: a .samples, pose_samples.json or .npz file, or a folder with one of
/// the first two; beside pictures its robot poses count. Pictures pair with poses by file name, by the last
/// number in it, by their order where poses have neither, or by time: where stamps are times, the pose is
/// interpolated within `stream`. A picture without a pose is left out. Throws InputError: nothing found, two
/// sources of poses, no picture with a pose, a bag (data::expect_no_bag).
Dataset load_dataset(const std::string& path, const DatasetOptions& options = {});

/// Observations of a set of pairs: poses, no points.
std::vector<Observation> pair_observations(const Dataset& dataset);

}  // namespace flash::calib
