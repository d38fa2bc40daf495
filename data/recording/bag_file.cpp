#include "data/recording/bag_file.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>

#include "data/files/error.h"
#include "data/files/text.h"

namespace flash::data {
namespace {

namespace fs = std::filesystem;

bool is_bag(const fs::path& path) {
  static const std::array<std::string, 3> endings = {".bag", ".db3", ".mcap"};
  std::error_code unknown;
  if (fs::is_regular_file(path, unknown))
    return std::find(endings.begin(), endings.end(), lower_extension(path.string())) != endings.end();
  const fs::path metadata = path / "metadata.yaml";
  if (!fs::is_regular_file(metadata, unknown)) return false;
  std::ifstream file(metadata);
  std::string line;
  return std::getline(file, line) && line.starts_with("rosbag2_bagfile_information");
}

}  // namespace

void expect_no_bag(const std::string& path, const std::string& reader) {
  if (!is_bag(path)) return;
  throw InputError(path +
                   ": is a recording of ROS or of a camera, expected a folder; python -m flash_sim.bag " +
                   path + " --for " + reader + " -o FOLDER makes one of it");
}

}  // namespace flash::data
