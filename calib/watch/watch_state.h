#pragma once
#include <Eigen/Geometry>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "calib/watch/watch_answer.h"

namespace flash::calib {

/// A picture of a recording as far as it was looked at.
struct WatchedPicture {
  std::string name = {};
  bool looked_at = false;                                ///< else the target is being looked for
  Detection detection = {};                              ///< once it was
  std::optional<Eigen::Isometry3d> T_base_gripper = {};  ///< none: no pose yet
};

/// How well X was known after so many views: rms of three axes, of what is told [m, rad].
struct KnownAfter {
  std::size_t views = 0;
  double translation_sd = 0, rotation_sd = 0;
};
KnownAfter known_after(const WatchAnswer& answer);

/// What is known while pictures arrive.
struct WatchInputs {
  Setup setup = Setup::eye_in_hand;
  std::optional<data::CameraIntrinsics> camera = {};
  Eigen::Matrix3Xd points = {};               ///< of the target [m]; empty: it is not known yet
  std::vector<WatchedPicture> pictures = {};  ///< in the order of the recording
  std::string last = {};                      ///< name of the picture that came last
  std::vector<std::string> waiting = {};      ///< what is waited for, a sentence each
  std::vector<std::string> notes = {};        ///< how the files were read
  bool solving = false;                       ///< the answer of the views that are there now is on its way
  std::optional<WatchAnswer> answer = {};     ///< of views so far, maybe not of the last
  std::vector<KnownAfter> history = {};       ///< of the answers before it, and of it
};

struct LastPicture {
  std::string name;
  bool looked_at = false, has_pose = false;
  int found = 0, expected = 0;  ///< corners or dots
  std::string reason;           ///< why it shows nothing, or is of no use
  Eigen::Matrix2Xd corners;     ///< [px]
};

/// Which parts of the picture the target was in: counts of corners in a grid of cells.
struct ImageCoverage {
  static constexpr int kColumns = 8, kRows = 6;
  Eigen::Matrix<int, kRows, kColumns> counts = Eigen::Matrix<int, kRows, kColumns>::Zero();
  double share = 0;  ///< of the cells that hold any
};

/// How the gripper was turned: what a hand-eye calibration lives on.
struct TurnCoverage {
  Eigen::Vector3d spread_deg = Eigen::Vector3d::Zero();  ///< rms about its principal axes, largest first
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();    ///< in the gripper frame, columns
  std::vector<Eigen::Vector3d> turns_deg;                ///< of each view from their mean, rotation vectors
  std::string sentence;                                  ///< what is missing, or that nothing is
};

struct NextPose {
  Eigen::Isometry3d T_base_gripper = Eigen::Isometry3d::Identity();
  std::string move, view;    ///< from the last pose; where the target then is, in words
  Eigen::Matrix2Xd outline;  ///< of the target in the picture [px], 2 x 4
  Eigen::Vector3d turn_deg = Eigen::Vector3d::Zero();  ///< as TurnCoverage::turns_deg
  double translation_sd = 0, rotation_sd = 0;          ///< of X afterwards, rms of three axes [m, rad]
};

/// One moment of a recording: what a page shows.
struct WatchState {
  std::string parent, child = "camera";
  int width = 0, height = 0;  ///< of the pictures [px]; 0: not known yet
  std::size_t pictures = 0, with_target = 0, with_pose = 0, looking = 0;
  std::optional<LastPicture> last;
  ImageCoverage image;
  TurnCoverage turns;
  std::string weakest;           ///< the direction that is known least, in words; empty: nothing is known yet
  std::optional<NextPose> next;  ///< once there is an answer
  std::string advice;            ///< what to do before there is a next pose
  bool solving = false;
  std::optional<WatchAnswer> answer;
  std::vector<KnownAfter> history;
  std::vector<std::string> waiting, notes;
};

/// The state of a recording, a function of what is known alone.
WatchState watch_state(const WatchInputs& inputs);

/// "flash-watch/1", see formats.md.
nlohmann::ordered_json to_json(const WatchState& state);

}  // namespace flash::calib
