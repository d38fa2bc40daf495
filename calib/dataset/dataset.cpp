#include "calib/dataset/dataset.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>

#include "calib/dataset/joint_list.h"
#include "calib/dataset/picture_names.h"
#include "calib/dataset/urdf_file.h"
#include "data/camera/depth_map.h"
#include "data/camera/intrinsics_file.h"
#include "data/files/error.h"
#include "data/files/json_reader.h"
#include "data/files/text.h"
#include "data/motion/bare_poses.h"
#include "data/motion/pose_file.h"
#include "data/motion/pose_numbers.h"
#include "data/motion/rotation_angles.h"
#include "data/recording/bag_file.h"
#include "data/recording/frame_files.h"

namespace flash::calib {
namespace {

namespace fs = std::filesystem;
using data::input_error;
using data::InputError;

constexpr double kLargestGap = 0.5;  // between poses of a stream that are interpolated [s]

std::vector<fs::path> files_in(const fs::path& folder, const std::vector<std::string>& endings,
                               const std::string& beginning = "") {
  std::vector<fs::path> files;
  if (!fs::is_directory(folder)) return files;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    if (!entry.path().filename().string().starts_with(beginning)) continue;
    if (std::find(endings.begin(), endings.end(), data::lower_extension(entry.path().string())) ==
        endings.end())
      continue;
    // What may never end is no input; a link to nothing is none either.
    if (fs::is_other(entry.status()))
      throw InputError(entry.path().string() + ": is a device, a pipe or a socket, expected a file");
    if (entry.is_regular_file()) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

/// The folders of that name, whatever its capitals.
std::vector<fs::path> folders_named(const fs::path& folder, const std::string& name) {
  std::vector<fs::path> found;
  if (!fs::is_directory(folder)) return found;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    std::string lower = entry.path().filename().string();
    std::transform(lower.begin(), lower.end(), lower.begin(),
                   [](unsigned char c) { return std::tolower(c); });
    if (entry.is_directory() && lower == name) found.push_back(entry.path());
  }
  std::sort(found.begin(), found.end());
  return found;
}

std::vector<fs::path> find_images(const fs::path& folder) {
  const std::vector<std::string> endings = {".png", ".jpg", ".jpeg", ".bmp"};
  for (const char* name : {"images", "rgb", "color", "image", "img", "imgs", "pictures"})
    for (const fs::path& place : folders_named(folder, name)) {
      std::vector<fs::path> images = files_in(place, endings);
      if (!images.empty()) return images;
    }
  return files_in(folder, endings);
}

std::vector<fs::path> pair_files(const fs::path& folder) {
  std::vector<fs::path> files = files_in(folder, {".samples"});
  if (fs::exists(folder / "pose_samples.json")) files.push_back(folder / "pose_samples.json");
  return files;
}

/// Files of one pose each: the last number in their names is that of the picture.
std::vector<fs::path> pose_files(const fs::path& folder, const std::string& beginning = "") {
  for (const std::vector<std::string>& endings :
       {std::vector<std::string>{".yaml", ".yml"}, std::vector<std::string>{".txt"}}) {
    std::vector<fs::path> files = files_in(folder, endings, beginning);
    std::erase_if(files, [](const fs::path& file) { return !data::number_in_name(file.string()); });
    if (!files.empty()) return files;
  }
  return {};
}

/// Lists of poses beside the pictures, and folders of one pose a file.
std::vector<fs::path> pose_sources(const fs::path& folder) {
  std::vector<fs::path> sources;
  for (const char* name : {"poses", "pose", "robot_poses", "gripper"})
    for (const char* ending : {".tum", ".csv", ".txt", ".json", ".npz", ".npy"})
      if (fs::exists(folder / (std::string(name) + ending)))
        sources.push_back(folder / (std::string(name) + ending));
  for (const fs::path& place : folders_named(folder, "poses"))
    if (!pose_files(place).empty()) sources.push_back(place);
  if (!pose_files(folder, "pose").empty()) sources.push_back(folder);
  return sources;
}

/// Of a source of poses: itself, or the files in it.
std::vector<fs::path> files_of_poses(const fs::path& source) {
  if (!fs::is_directory(source)) return {source};
  const std::vector<fs::path> files = pose_files(source, "pose");
  return files.empty() ? pose_files(source) : files;
}

data::PoseList load_poses(const fs::path& source) {
  if (!fs::is_directory(source)) return data::load_pose_list(source.string());
  const std::vector<fs::path> files = files_of_poses(source);
  if (files.empty())
    throw InputError(source.string() + ": found no poses, expected a YAML or text file for each");
  if (data::lower_extension(files.front().string()) == ".txt") {
    std::vector<std::string> names;
    for (const fs::path& file : files) names.push_back(file.string());
    return data::load_bare_pose_files(names, source.string());
  }
  data::PoseList list;
  for (const fs::path& file : files) list.poses.push_back(data::load_pose_yaml(file.string()));
  return list;
}

std::string find_camera(const fs::path& folder) {
  for (const fs::path& place : {folder, folder.parent_path()}) {
    for (const char* name :
         {"camera_info", "camera", "intrinsics", "calibration", "calib", "camera_matrix", "camera_params"})
      for (const char* ending : {".yaml", ".yml", ".json", ".npz"})
        if (fs::exists(place / (std::string(name) + ending)))
          return (place / (std::string(name) + ending)).string();
    for (const fs::path& file : files_in(place, {".yaml", ".yml"}))
      if (file.filename().string().find("camchain") != std::string::npos) return file.string();
  }
  return "";
}

/// Pairs pictures with poses, by the poses' own word.
class PosePairing {
 public:
  PosePairing(data::PoseList list, std::string source)
      : poses_(std::move(list.poses)), source_(std::move(source)), in_order_(list.in_order) {
    bool whole = true;
    for (std::size_t i = 0; i < poses_.size(); ++i) {
      const data::RecordedPose& pose = poses_[i];
      named_ = named_ || !pose.image.empty();
      whole = whole && pose.stamp == std::floor(pose.stamp) && std::abs(pose.stamp) < 1e8;
      const bool fresh = pose.image.empty()
                             ? by_stamp_.emplace(pose.stamp, i).second
                             : by_name_.emplace(fs::path(pose.image).filename().string(), i).second;
      if (!fresh)
        throw InputError(source_ + ": two poses for " +
                         (pose.image.empty() ? "stamp " + data::format_number(pose.stamp) : pose.image));
    }
    by_time_ = !named_ && !whole && !in_order_;
  }

  bool by_time() const { return by_time_; }
  bool by_number() const { return !by_time_ && !named_ && !in_order_; }

  /// place: of the picture among all, in order. Throws InputError where it has no pose.
  /// arm: whose joints the poses came as, or none.
  void pair(Frame& frame, const fs::path& image, std::size_t place,
            const std::optional<ArmModel>& arm) const {
    const data::RecordedPose* found = nullptr;
    if (in_order_) {
      found = &poses_.at(place);
    } else if (named_) {
      const auto entry = by_name_.find(image.filename().string());
      if (entry == by_name_.end())
        throw InputError(image.string() + ": no pose names this picture in " + source_);
      found = &poses_[entry->second];
    } else if (by_time_) {
      pair_by_time(frame, image);
      return;
    } else {
      const std::optional<long> number = data::number_in_name(image.string());
      if (!number)
        throw InputError(image.string() + ": found no number in the file name, expected that of its pose");
      const auto entry = by_stamp_.find(static_cast<double>(*number));
      if (const auto time = time_in_name(image); entry == by_stamp_.end() && time)
        expect_one_clock(*time, by_stamp_.begin()->first, image.string(), source_);
      if (entry == by_stamp_.end())
        throw InputError(image.string() + ": no pose with number " + std::to_string(*number) + " in " +
                         source_ + " (" + std::to_string(poses_.size()) + " poses, " +
                         data::format_number(by_stamp_.begin()->first) + " to " +
                         data::format_number(by_stamp_.rbegin()->first) + ')');
      frame.stamp = static_cast<double>(*number);
      found = &poses_[entry->second];
    }
    frame.T_base_gripper = found->pose;
    frame.angles = found->angles;
    if (!arm || found->joints.size() == 0) return;
    frame.joint_motions = error_motions(*arm, found->joints);
    frame.joint_sd = prior_deviations(*arm);
  }

  data::Trajectory stream() const {
    data::Trajectory trajectory;
    for (const auto& [stamp, i] : by_stamp_) {
      trajectory.times.push_back(stamp);
      trajectory.poses.push_back(poses_[i].pose);
    }
    return trajectory;
  }

 private:
  void pair_by_time(Frame& frame, const fs::path& image) const {
    const std::optional<double> time = time_in_name(image);
    if (!time) throw InputError(image.string() + ": expected a time as the file name, as in " + source_);
    frame.stamp = *time;
    const auto after = by_stamp_.lower_bound(*time - 1e-6);
    const bool exact = after != by_stamp_.end() && std::abs(after->first - *time) < 1e-6;
    if (exact) {
      frame.T_base_gripper = poses_[after->second].pose;
      return;
    }
    expect_one_clock(*time, by_stamp_.begin()->first, image.string(), source_);
    if (after == by_stamp_.begin() || after == by_stamp_.end())
      throw InputError(image.string() + ": time " + data::format_number(*time) + " s lies outside of " +
                       source_ + " (" + data::format_number(by_stamp_.begin()->first) + " to " +
                       data::format_number(by_stamp_.rbegin()->first) + " s)");
    const double gap = after->first - std::prev(after)->first;
    if (gap > kLargestGap)
      throw InputError(image.string() + ": falls into a gap of " + data::format_short(gap) + " s in " +
                       source_);
    frame.T_base_gripper =
        data::pose_at({{std::prev(after)->first, after->first},
                       {poses_[std::prev(after)->second].pose, poses_[after->second].pose}},
                      *time);
  }

  std::vector<data::RecordedPose> poses_;
  std::string source_;
  std::map<double, std::size_t> by_stamp_;
  std::map<std::string, std::size_t> by_name_;
  bool in_order_ = false, named_ = false, by_time_ = false;
};

/// The rotations anew, as `order` reads the angles of the poses.
void read_angles(const std::string& order, Dataset& dataset) {
  const std::vector<std::string>& orders = data::angle_orders();
  if (std::find(orders.begin(), orders.end(), order) == orders.end())
    throw InputError("angles: found \"" + order +
                     "\", expected an order as xyz (fixed axes), XYZ (turning axes) or rotvec");
  for (Frame& frame : dataset.frames) {
    if (!frame.angles)
      throw InputError(dataset.poses_path + ": found no angles, expected three a pose to read as " + order);
    frame.T_base_gripper.linear() = data::rotation_from_angles(*frame.angles, order);
  }
}

void read_target(const fs::path& folder, Dataset& dataset) {
  const fs::path file = folder / "target.json";
  if (!fs::exists(file)) return;
  const nlohmann::json json = data::load_json(file.string());
  const data::JsonObject object(json, file.string());
  object.expect_fields({"setup", "target"});
  dataset.files.push_back(file.string());
  dataset.target = object.string("target", "");
  const std::string setup = object.string("setup", "");
  if (setup == "eye-in-hand")
    dataset.setup = Setup::eye_in_hand;
  else if (setup == "eye-to-hand")
    dataset.setup = Setup::eye_to_hand;
  else if (!setup.empty())
    throw object.error("setup", "eye-in-hand or eye-to-hand");
}

void read_pairs(const fs::path& file, Dataset& dataset) {
  dataset.poses_path = file.string();
  dataset.files.push_back(dataset.poses_path);
  for (const data::PosePair& pair : data::load_pose_pairs(file.string())) {
    Frame frame;
    frame.stamp = static_cast<double>(dataset.frames.size());
    frame.name = "sample " + std::to_string(dataset.frames.size());
    frame.T_base_gripper = pair.T_base_gripper;
    frame.T_camera_target = pair.T_camera_target;
    dataset.frames.push_back(std::move(frame));
  }
}

/// The one source of poses, or none where none is asked for.
std::string choose_poses(const fs::path& folder, const DatasetOptions& options) {
  if (!options.poses.empty() || !options.needs_poses) return options.poses;
  const std::vector<fs::path> sources = pose_sources(folder);
  const std::vector<fs::path> pairs = pair_files(folder);
  if (sources.empty() && pairs.size() == 1) return pairs.front().string();
  if (sources.empty()) {
    std::string instead;
    for (const char* name : {"poses.yaml", "poses.yml"})
      if (fs::exists(folder / name)) instead = std::string(": found ") + name + ", which is not read";
    throw InputError(
        folder.string() + (instead.empty() ? std::string(": found no poses") : instead) +
        ", expected poses.tum, .csv, .txt, .json, .npz or .npy, or poses/*.yaml or *.txt, one pose a file "
        "(or name them)");
  }
  if (sources.size() > 1)
    throw InputError(folder.string() + ": found poses in " + sources[0].filename().string() + " and in " +
                     sources[1].filename().string() + ", expected one (name it)");
  return sources.front().string();
}

/// By the last number in their names where all have one of their own, else by name, 2 before 10.
void order_by_number(std::vector<fs::path>& images) {
  std::sort(images.begin(), images.end(),
            [](const fs::path& a, const fs::path& b) { return data::natural_less(a.string(), b.string()); });
  std::map<long, fs::path> numbered;
  for (const fs::path& image : images)
    if (const std::optional<long> number = data::number_in_name(image.string()))
      numbered.emplace(*number, image);
  if (numbered.size() != images.size()) return;
  std::transform(numbered.begin(), numbered.end(), images.begin(),
                 [](const auto& entry) { return entry.second; });
}

void read_pictures(const fs::path& folder, const DatasetOptions& options, Dataset& dataset) {
  std::vector<fs::path> images = find_images(folder);
  if (images.empty())
    throw InputError(folder.string() + ": found no pictures, expected images/*.png or *.jpg");
  dataset.camera_path = options.camera.empty() ? find_camera(folder) : options.camera;
  if (!dataset.camera_path.empty()) {
    dataset.files.push_back(dataset.camera_path);
    dataset.camera = data::load_intrinsics(dataset.camera_path);
    dataset.lens_covariance = load_lens_covariance(dataset.camera_path);
  }
  if (!dataset.camera && options.needs_camera)
    throw InputError(
        folder.string() +
        ": found no intrinsics, expected camera_info.yaml (ROS), calibration.yml (OpenCV), "
        "camchain.yaml (Kalibr), intrinsics.json or .npz; flash-calib intrinsics estimates them from "
        "such pictures");
  dataset.poses_path = choose_poses(folder, options);
  std::optional<PosePairing> pairing;
  std::size_t poses = 0;
  if (!dataset.poses_path.empty()) {
    if (!options.robot.empty()) {
      ArmModel& arm = dataset.arm.emplace();
      arm.chain = load_urdf(options.robot, options.base_link, options.tip_link);
      if (options.link_length_sd > 0) {
        arm.lengths = link_lengths(arm.chain);
        arm.length_sd = options.link_length_sd;
      }
      dataset.files.push_back(options.robot);
    }
    for (const fs::path& file : files_of_poses(dataset.poses_path)) dataset.files.push_back(file.string());
    data::PoseList list = dataset.arm ? load_joint_list(dataset.poses_path, dataset.arm->chain)
                                      : load_poses(dataset.poses_path);
    poses = list.poses.size();
    if (list.in_order && poses != images.size())
      throw InputError(dataset.poses_path + ": found " + std::to_string(poses) +
                       " poses without names or numbers for " + std::to_string(images.size()) + " pictures" +
                       kinds_of_names(images) + ", expected one for each");
    if (list.in_order) order_by_number(images);
    if (!list.guess.empty()) dataset.guesses.push_back(list.guess);
    pairing.emplace(std::move(list), dataset.poses_path);
    if (pairing->by_number()) expect_one_picture_a_number(images);
  }
  std::vector<std::string> unpaired;
  for (std::size_t place = 0; place < images.size(); ++place) {
    const fs::path& image = images[place];
    Frame frame;
    frame.name = image.filename().string();
    frame.image = image.string();
    dataset.files.push_back(frame.image);
    frame.stamp = static_cast<double>(
        data::number_in_name(frame.image).value_or(static_cast<long>(dataset.frames.size())));
    for (const std::string& ending : data::depth_endings()) {
      const fs::path depth = folder / "depth" / (image.stem().string() + ending);
      if (options.depth && frame.depth.empty() && fs::exists(depth))
        dataset.files.push_back(frame.depth = depth.string());
    }
    try {
      if (pairing) pairing->pair(frame, image, place, dataset.arm);
      dataset.frames.push_back(std::move(frame));
    } catch (const InputError& error) {
      unpaired.emplace_back(error.what());
    }
  }
  if (dataset.frames.empty()) throw InputError(unpaired.front());
  for (const std::string& reason : unpaired) dataset.guesses.push_back(reason + "; it is left out");
  std::stable_sort(dataset.frames.begin(), dataset.frames.end(),
                   [](const Frame& a, const Frame& b) { return a.stamp < b.stamp; });
  if (dataset.arm && pairing->by_time())
    throw InputError(dataset.poses_path +
                     ": found joints over time, expected one line a picture, by its number or name");
  if (pairing && pairing->by_time()) dataset.stream = pairing->stream();
  if (pairing && !pairing->by_time() && poses > dataset.frames.size())
    dataset.notices.push_back(std::to_string(poses - dataset.frames.size()) + " of " + std::to_string(poses) +
                              " poses in " + dataset.poses_path + " have no picture");
}

/// Refuses places that no robot and no camera has, which sums of squares would not survive.
void expect_places(const Dataset& dataset) {
  constexpr double kFarthest = 1e4;  // [m]
  for (const Frame& frame : dataset.frames) {
    double farthest = frame.T_base_gripper.translation().stableNorm();
    if (frame.T_camera_target)
      farthest = std::max(farthest, frame.T_camera_target->translation().stableNorm());
    if (!(farthest < kFarthest))
      throw data::input_error(dataset.source, frame.name,
                              "found a pose " + data::format_short(farthest) + " m away, expected metres");
  }
}

Dataset read_dataset(const std::string& path, const DatasetOptions& options) {
  Dataset dataset;
  dataset.source = path;
  dataset.depth_scale = options.depth_scale;
  if (!fs::exists(path)) throw InputError(path + ": no such folder or file");
  data::expect_no_bag(path, "handeye");
  if (!fs::is_directory(path)) {
    read_pairs(path, dataset);
    return dataset;
  }
  const fs::path folder = fs::path(path).lexically_normal();
  read_target(folder, dataset);
  const std::vector<fs::path> pairs = pair_files(folder);
  if (find_images(folder).empty() && pairs.size() == 1) {
    read_pairs(pairs.front(), dataset);
    return dataset;
  }
  read_pictures(folder, options, dataset);
  if (!options.angles.empty()) read_angles(options.angles, dataset);
  return dataset;
}

}  // namespace

Dataset load_dataset(const std::string& path, const DatasetOptions& options) {
  Dataset dataset = read_dataset(path, options);
  expect_places(dataset);
  return dataset;
}

std::vector<Observation> pair_observations(const Dataset& dataset) {
  std::vector<Observation> observations;
  for (const Frame& frame : dataset.frames) {
    if (!frame.T_camera_target) continue;
    Observation observation;
    observation.image = frame.name;
    observation.T_base_gripper = frame.T_base_gripper;
    observation.pixels.resize(2, 0);
    observation.T_camera_target = {*frame.T_camera_target};
    observations.push_back(std::move(observation));
  }
  return observations;
}

}  // namespace flash::calib
