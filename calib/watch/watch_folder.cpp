#include "calib/watch/watch_folder.h"

#include <algorithm>
#include <chrono>
#include <future>
#include <map>
#include <thread>
#include <utility>

#include "calib/detect/grey_image.h"
#include "calib/watch/growing_set.h"
#include "data/files/atomic_file.h"
#include "data/files/error.h"

namespace flash::calib {
namespace {

using Clock = std::chrono::steady_clock;

template <class T>
bool is_ready(const std::future<T>& future) {
  return future.valid() && future.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
}

/// What a picture showed when its file was as `stamp` says.
struct Look {
  FileStamp stamp;
  Detection detection;
  bool whole = true;  ///< else it could not be read: maybe it is still being written
};

Look look_at(const Frame& frame, const Dataset& dataset, const Target& target,
             const DetectSettings& settings) {
  const FileStamp stamp = stamp_of(frame.image);
  try {
    static_cast<void>(load_grey_image(frame.image));
  } catch (const data::InputError& error) {
    return {stamp, {.image = frame.name, .reason = error.what(), .readings = {}}, false};
  }
  return {stamp, detect_one(frame, dataset, target, settings)};
}

/// What an answer is of: names of the pictures, their stamps and poses.
struct Views {
  std::vector<std::string> names;
  std::vector<FileStamp> stamps;
  std::vector<Eigen::Matrix4d> poses;
  bool operator==(const Views&) const = default;
};

/// One recording, followed. A detection and a solution run beside the loop, one of each at a time.
class Follower {
 public:
  Follower(const WatchSettings& settings, const std::function<void(WatchMoment)>& tell)
      : settings_(settings), tell_(tell) {}

  void step() {
    bool changed = read_folder();
    changed = take_look() || changed;
    changed = take_answer() || changed;
    changed = begin_look() || changed;
    changed = begin_answer() || changed;
    if (changed || !told_) tell();
    told_ = true;
  }

 private:
  bool read_folder() {
    std::map<std::string, FileStamp> files = files_of(settings_.folder, settings_.dataset);
    if (told_ && files == files_ && !set_.unfinished) return false;
    files_ = std::move(files);
    read_growing(settings_.folder, settings_.dataset, settings_.settled, set_);
    set_.posed.source = settings_.folder;
    read_target();
    const auto& now = set_.pictures.camera;
    const bool same_camera = !now == !camera_ && (!now || same_lens(*now, *camera_));
    if (!same_camera) looks_.clear();
    camera_ = now;
    std::erase_if(looks_, [&](const auto& look) {
      const auto file = files_.find(look.first);
      return file == files_.end() || file->second != look.second.stamp;
    });
    find_last();
    return true;
  }

  static bool same_lens(const data::CameraIntrinsics& a, const data::CameraIntrinsics& b) {
    return a.width == b.width && a.height == b.height && a.fx == b.fx && a.fy == b.fy && a.cx == b.cx &&
           a.cy == b.cy && a.model == b.model && a.distortion == b.distortion;
  }

  void read_target() {
    setup_ = settings_.setup ? settings_.setup : set_.pictures.setup;
    const std::optional<Target> before = std::exchange(target_, settings_.target);
    try {
      if (!target_ && !set_.pictures.target.empty()) target_ = parse_target(set_.pictures.target);
    } catch (const data::InputError& error) {
      set_.waiting.emplace_back(std::string("target.json: ") + error.what());
    }
    if (before && (!target_ || to_words(*before) != to_words(*target_))) looks_.clear();
    if (set_.pictures.frames.empty()) return;
    if (!target_) set_.waiting.emplace_back("no target yet: start again with --target, or add target.json");
    if (!setup_) set_.waiting.emplace_back("no setup yet: start again with --setup, or add target.json");
  }

  /// The picture whose file was written last.
  void find_last() {
    const Frame* last = nullptr;
    for (const Frame& frame : set_.pictures.frames)
      if (last == nullptr || files_[frame.image].time >= files_[last->image].time) last = &frame;
    const std::string path = last == nullptr ? "" : last->image;
    const FileStamp stamp = path.empty() ? FileStamp{} : files_[path];
    if (path == last_path_ && stamp == last_stamp_) return;
    last_path_ = path;
    last_stamp_ = stamp;
    last_name_ = last == nullptr ? "" : last->name;
    picture_.reset();
    try {
      if (!path.empty()) picture_ = std::make_shared<const std::string>(data::read_file(path));
    } catch (const data::InputError&) {
      picture_.reset();  // gone again; the next look says so
    }
  }

  bool take_look() {
    if (!is_ready(looking_)) return false;
    Look look = looking_.get();
    // Of a file that changed meanwhile nothing is known.
    const auto file = files_.find(looking_at_);
    if (file != files_.end() && file->second == look.stamp && look_is_of_ == revision())
      looks_[looking_at_] = std::move(look);
    looking_at_.clear();
    return true;
  }

  /// The last picture first: it is what people wait for.
  bool begin_look() {
    if (looking_.valid() || !target_) return false;
    const Frame* next = nullptr;
    for (const Frame& frame : set_.pictures.frames)
      if (!looks_.contains(frame.image) && (next == nullptr || frame.image == last_path_)) next = &frame;
    if (next == nullptr) return false;
    looking_at_ = next->image;
    look_is_of_ = revision();
    looking_ = std::async(std::launch::async,
                          [this, frame = *next, dataset = without_frames(set_.pictures), target = *target_] {
                            return look_at(frame, dataset, target, settings_.detect);
                          });
    return true;
  }

  static Dataset without_frames(Dataset dataset) {
    dataset.frames.clear();
    return dataset;
  }

  /// What detections depend on beside the picture.
  std::string revision() const {
    return (target_ ? to_words(*target_) : "") + "|" + set_.pictures.camera_path + "|" +
           std::to_string(camera_ ? camera_->fx + 7 * camera_->cx + 31 * camera_->cy : 0);
  }

  /// Frames with a pose that were looked at, and their detections.
  std::pair<Dataset, std::vector<Detection>> posed_views() const {
    Dataset dataset = set_.posed;
    std::vector<Detection> detections;
    std::erase_if(dataset.frames, [&](const Frame& frame) {
      const auto look = looks_.find(frame.image);
      return look == looks_.end() || !look->second.whole;
    });
    for (const Frame& frame : dataset.frames) {
      detections.push_back(looks_.at(frame.image).detection);
      for (CornerReading& reading : detections.back().readings) {
        reading.observation.T_base_gripper = frame.T_base_gripper;
        reading.observation.joint_motions = frame.joint_motions;
        reading.observation.joint_sd = frame.joint_sd;
      }
    }
    drop_misfits(settings_.detect.fit, detections);
    return {std::move(dataset), std::move(detections)};
  }

  Views views_of(const Dataset& dataset) const {
    Views views;
    for (const Frame& frame : dataset.frames) {
      views.names.push_back(frame.name);
      views.stamps.push_back(looks_.at(frame.image).stamp);
      views.poses.push_back(frame.T_base_gripper.matrix());
    }
    return views;
  }

  bool begin_answer() {
    if (solving_.valid() || !setup_ || !target_ || !camera_) return false;
    auto [dataset, detections] = posed_views();
    Views views = views_of(dataset);
    if (views == solved_) return false;
    solved_ = std::move(views);
    solving_ = std::async(std::launch::async, [this, setup = *setup_, target = *target_,
                                               set = std::move(dataset), found = std::move(detections)] {
      CalibrateSettings calibrate = settings_.calibrate;
      if (set.lens_covariance) calibrate.lens_covariance = *set.lens_covariance;
      try {
        return watch_answer(setup, set, target, found, calibrate, settings_.plan);
      } catch (const std::exception& error) {  // a page is no place to end at
        return WatchAnswer{.views = set.frames.size(), .not_yet = error.what()};
      }
    });
    return true;
  }

  bool take_answer() {
    if (!is_ready(solving_)) return false;
    answer_ = solving_.get();
    std::erase_if(history_, [&](const KnownAfter& known) { return known.views >= answer_->views; });
    if (answer_->calibration) history_.push_back(known_after(*answer_));
    return true;
  }

  void tell() const {
    WatchInputs inputs;
    inputs.setup = setup_.value_or(Setup::eye_in_hand);
    inputs.camera = camera_;
    if (target_) inputs.points = target_points(*target_);
    std::map<std::string, Eigen::Isometry3d> poses;
    for (const Frame& frame : set_.posed.frames) poses[frame.name] = frame.T_base_gripper;
    inputs.waiting = set_.waiting;
    for (const Frame& frame : set_.pictures.frames) {
      WatchedPicture picture{.name = frame.name};
      if (const auto look = looks_.find(frame.image); look != looks_.end()) {
        picture.looked_at = true;
        picture.detection = look->second.detection;
        if (!look->second.whole) inputs.waiting.push_back(frame.name + ": not whole yet");
      }
      if (const auto pose = poses.find(frame.name); pose != poses.end())
        picture.T_base_gripper = pose->second;
      else if (set_.waiting.empty())
        inputs.waiting.push_back(frame.name + ": no pose yet");
      inputs.pictures.push_back(std::move(picture));
    }
    inputs.last = last_name_;
    for (const std::string& guess : set_.posed.guesses)
      if (!guess.ends_with("it is left out")) inputs.notes.push_back(guess);
    inputs.solving = solving_.valid();
    inputs.answer = answer_;
    inputs.history = history_;
    tell_({watch_state(inputs), picture_});
  }

  const WatchSettings& settings_;
  const std::function<void(WatchMoment)>& tell_;
  bool told_ = false;
  std::map<std::string, FileStamp> files_;
  GrowingSet set_;
  std::optional<data::CameraIntrinsics> camera_;
  std::optional<Setup> setup_;
  std::optional<Target> target_;
  std::map<std::string, Look> looks_;  // by path
  std::string last_name_, last_path_;
  FileStamp last_stamp_;
  std::shared_ptr<const std::string> picture_;
  std::string looking_at_, look_is_of_;
  Views solved_;
  std::optional<WatchAnswer> answer_;
  std::vector<KnownAfter> history_;
  // Last, so that they have ended before anything else goes.
  std::future<Look> looking_;
  std::future<WatchAnswer> solving_;
};

}  // namespace

void watch_folder(const WatchSettings& settings, const std::atomic<bool>& stop,
                  const std::function<void(WatchMoment)>& tell) {
  Follower follower(settings, tell);
  while (!stop) {
    follower.step();
    std::this_thread::sleep_for(std::chrono::duration<double>(settings.period));
  }
}

}  // namespace flash::calib
