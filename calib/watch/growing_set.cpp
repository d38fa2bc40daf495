#include "calib/watch/growing_set.h"

#include <algorithm>
#include <chrono>
#include <fstream>
#include <set>
#include <system_error>

#include "calib/detect/detect.h"
#include "data/files/error.h"

namespace flash::calib {
namespace {

namespace fs = std::filesystem;

/// Whether more of the last line may come: writers that keep a buffer end anywhere in it.
bool lacks_end_of_line(const std::string& path) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  if (!file || file.tellg() <= 0) return false;
  file.seekg(-1, std::ios::end);
  return file.get() != '\n';
}

bool is_list_of_lines(const fs::path& path) {
  const std::string ending = path.extension().string();
  return ending == ".csv" || ending == ".tum" || ending == ".txt";
}

/// The first list of poses that is not whole, or empty.
std::string unfinished_list(const std::string& folder, const DatasetOptions& options, double settled) {
  const auto now = fs::file_time_type::clock::now();
  std::vector<fs::path> lists;
  if (!options.poses.empty()) lists.emplace_back(options.poses);
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) lists.push_back(entry.path());
  for (const fs::path& list : lists) {
    if (!fs::is_regular_file(list, error) || !is_list_of_lines(list)) continue;
    const std::chrono::duration<double> age = now - stamp_of(list.string()).time;
    if (age.count() < settled && lacks_end_of_line(list.string())) return list.filename().string();
  }
  return {};
}

/// Without the name of the folder, which the reader knows.
std::string within(const std::string& folder, std::string sentence) {
  const std::string start = (fs::path(folder).lexically_normal() / "").string();
  for (std::size_t at = sentence.find(start); at != std::string::npos; at = sentence.find(start))
    sentence.erase(at, start.size());
  const std::string own = fs::path(folder).lexically_normal().string() + ": ";
  return sentence.starts_with(own) ? sentence.substr(own.size()) : sentence;
}

/// Pictures alone. False where there is nothing to look at yet.
bool read_pictures(const std::string& folder, const DatasetOptions& options, GrowingSet& set) {
  DatasetOptions alone = options;
  alone.poses.clear();
  alone.robot.clear();
  alone.angles.clear();
  alone.needs_poses = alone.needs_camera = false;
  try {
    set.pictures = load_dataset(folder, alone);
    if (std::any_of(set.pictures.frames.begin(), set.pictures.frames.end(),
                    [](const Frame& frame) { return frame.image.empty(); })) {
      set.pictures.frames.clear();
      set.waiting.emplace_back("found pairs of poses, expected pictures of the target");
      return false;
    }
    take_picture_size(set.pictures);
  } catch (const data::InputError& error) {
    set.waiting.push_back(within(folder, error.what()));
    return false;
  }
  if (!set.pictures.camera)
    set.waiting.emplace_back(
        "no intrinsics yet: camera_info.yaml or another file that handeye reads, or --camera");
  return true;
}

}  // namespace

FileStamp stamp_of(const std::string& path) {
  FileStamp stamp;
  std::error_code error;
  const std::uintmax_t size = fs::file_size(path, error);
  if (error) return {};
  stamp.size = size;
  stamp.time = fs::last_write_time(path, error);
  return error ? FileStamp{} : stamp;
}

std::map<std::string, FileStamp> files_of(const std::string& folder, const DatasetOptions& options) {
  std::map<std::string, FileStamp> files;
  const auto add = [&](const std::string& place, const auto& deeper) -> void {
    std::error_code error;
    for (fs::directory_iterator entry(place, error), end; !error && entry != end; entry.increment(error)) {
      std::error_code unknown;
      if (entry->is_directory(unknown)) {
        if (place == folder) deeper(entry->path().string(), deeper);
      } else {
        files[entry->path().string()] = stamp_of(entry->path().string());
      }
    }
  };
  add(folder, add);
  for (const std::string& path : {options.poses, options.camera, options.robot}) {
    if (path.empty()) continue;
    files[path] = stamp_of(path);
    if (fs::is_directory(path)) add(path, add);
  }
  return files;
}

void read_growing(const std::string& folder, const DatasetOptions& options, double settled, GrowingSet& set) {
  if (!fs::is_directory(folder)) throw data::InputError(folder + ": no such folder");
  set.waiting.clear();
  set.pictures = {};
  set.unfinished = false;
  if (!read_pictures(folder, options, set)) return;
  if (const std::string list = unfinished_list(folder, options, settled); !list.empty()) {
    set.unfinished = true;
    set.waiting.push_back(list + ": its last line is still being written");
  } else {
    try {
      DatasetOptions all = options;
      all.needs_camera = false;
      set.posed = load_dataset(folder, all);
    } catch (const data::InputError& error) {
      set.waiting.push_back(within(folder, error.what()));
    }
  }
  // Poses of the last reading may be of pictures that are gone.
  std::set<std::string> there;
  for (const Frame& frame : set.pictures.frames) there.insert(frame.name);
  std::erase_if(set.posed.frames, [&](const Frame& frame) { return !there.contains(frame.name); });
  set.posed.camera = set.pictures.camera;
  set.posed.camera_path = set.pictures.camera_path;
  set.posed.lens_covariance = set.pictures.lens_covariance;
}

}  // namespace flash::calib
