#pragma once
#include <yaml-cpp/yaml.h>

#include <string>
#include <vector>

namespace flash::data {

/// YAML as ROS, Kalibr and OpenCV's FileStorage write it. Throws InputError naming file and line.
YAML::Node load_yaml(const std::string& path);

/// A finite number. Throws InputError naming file and field.
double yaml_number(const YAML::Node& node, const std::string& path, const std::string& field);

/// All numbers below a node, in order.
std::vector<double> yaml_numbers(const YAML::Node& node, const std::string& path, const std::string& field);

}  // namespace flash::data
