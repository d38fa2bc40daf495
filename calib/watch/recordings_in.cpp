#include "calib/watch/recordings_in.h"

#include <algorithm>
#include <filesystem>

#include "calib/dataset/dataset.h"
#include "data/files/error.h"

namespace flash::calib {
namespace {

bool has_pictures(const std::string& folder) {
  DatasetOptions alone;
  alone.needs_poses = alone.needs_camera = false;
  try {
    const Dataset dataset = load_dataset(folder, alone);
    return !dataset.frames.empty() && !dataset.frames.front().image.empty();
  } catch (const data::InputError&) {
    return false;
  }
}

}  // namespace

std::vector<std::string> recordings_in(const std::string& folder) {
  std::vector<std::string> names;
  if (has_pictures(folder)) return names;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error))
    if (entry.is_directory(error) && entry.path().filename() != "depth" &&
        has_pictures(entry.path().string()))
      names.push_back(entry.path().filename().string());
  if (names.size() < 2) return {};
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace flash::calib
