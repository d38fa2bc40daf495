#pragma once
#include <string>

namespace flash::data {

/// Throws InputError, with the command that makes a folder of it for the program `reader` ("handeye" or
/// "segment"), where `path` is a recording of ROS or of a camera: a file .bag, .db3 or .mcap, or the folder
/// of a rosbag2, whose metadata.yaml says so.
void expect_no_bag(const std::string& path, const std::string& reader);

}  // namespace flash::data
