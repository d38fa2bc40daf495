#include "data/motion/pose_json.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "data/files/error.h"
#include "data/files/json_reader.h"
#include "data/motion/pose_numbers.h"

namespace flash::data {
namespace {

using Json = nlohmann::json;
using Names = std::initializer_list<const char*>;

/// The first of the names that the object has; null where it has none.
const Json* find(const Json& object, Names names) {
  if (!object.is_object()) return nullptr;
  for (const char* name : names)
    if (const auto found = object.find(name); found != object.end()) return &*found;
  return nullptr;
}

std::vector<double> flat(const Json& value, const std::string& path, const std::string& where) {
  if (value.is_number()) return {value.get<double>()};
  if (!value.is_array()) throw input_error(path, where, "expected numbers");
  std::vector<double> numbers;
  for (const Json& item : value)
    for (const double number : flat(item, path, where)) numbers.push_back(number);
  return numbers;
}

std::vector<double> parts(const Json& object, Names names, const std::string& path,
                          const std::string& where) {
  if (!object.is_object()) return flat(object, path, where);
  std::vector<double> numbers;
  for (const char* name : names) {
    const Json* part = find(object, {name});
    if (!part || !part->is_number())
      throw input_error(path, where + '.' + name, "missing, expected a number");
    numbers.push_back(part->get<double>());
  }
  return numbers;
}

Eigen::Isometry3d pose_of_json(const Json& value, const std::string& path, const std::string& where) {
  if (value.is_array()) return pose_of_numbers(flat(value, path, where), path, where);
  if (const Json* inner = find(value, {"pose", "matrix", "transform", "T_base_gripper"}))
    return pose_of_json(*inner, path, where);
  const Json* place = find(value, {"position", "translation", "t", "xyz"});
  const Json* turn = find(value, {"orientation", "rotation", "quaternion", "q", "R"});
  if (place && turn) {
    std::vector<double> numbers = parts(*place, {"x", "y", "z"}, path, where);
    const std::vector<double> rotation = parts(*turn, {"x", "y", "z", "w"}, path, where);
    if (numbers.size() != 3 || (rotation.size() != 4 && rotation.size() != 9))
      throw input_error(path, where, "expected a place of 3 numbers and a rotation of 4 (x y z w) or 9");
    if (rotation.size() == 4) {
      numbers.insert(numbers.end(), rotation.begin(), rotation.end());
    } else {
      const std::vector<double> t = numbers;
      numbers.clear();
      for (std::size_t row = 0; row < 3; ++row) {
        numbers.insert(numbers.end(), rotation.begin() + static_cast<std::ptrdiff_t>(3 * row),
                       rotation.begin() + static_cast<std::ptrdiff_t>(3 * row + 3));
        numbers.push_back(t[row]);
      }
    }
    return pose_of_numbers(numbers, path, where);
  }
  if (find(value, {"qw"}))
    return pose_of_numbers(parts(value, {"x", "y", "z", "qx", "qy", "qz", "qw"}, path, where), path, where);
  throw input_error(path, where,
                    "expected a pose: a 4 x 4 matrix, position and orientation, or x y z qx qy qz qw");
}

Json list_in(const std::string& path) {
  const Json file = load_json(path);
  const Json* list = file.is_array() ? &file : find(file, {"poses", "samples", "data", "frames"});
  if (!list || !list->is_array() || list->empty())
    throw InputError(path + ": expected a list of poses, or one below poses, samples, data or frames");
  return *list;
}

}  // namespace

PoseList load_json_poses(const std::string& path) {
  PoseList list;
  const Json items = list_in(path);
  std::vector<double> distances;
  std::size_t in_order = 0;
  for (std::size_t i = 0; i < items.size(); ++i) {
    RecordedPose& pose = list.poses.emplace_back();
    const std::string where = "pose " + std::to_string(i);
    pose.pose = pose_of_json(items[i], path, where);
    distances.push_back(pose.pose.translation().stableNorm());
    const Json* name = find(items[i], {"image", "file", "filename", "name"});
    const Json* number = find(items[i], {"index", "id", "frame", "t", "timestamp", "time", "stamp"});
    if (name && name->is_string())
      pose.image = name->get<std::string>();
    else if (number && number->is_number())
      pose.stamp = seconds_of(number->get<double>());
    else
      pose.stamp = static_cast<double>(in_order++);
  }
  if (in_order > 0 && in_order < items.size())
    throw InputError(path + ": " + std::to_string(in_order) +
                     " poses have neither name nor number of a picture, others have");
  list.in_order = in_order > 0;
  list.timed = std::all_of(items.begin(), items.end(), [](const Json& item) {
    return find(item, {"t", "timestamp", "time", "stamp"}) &&
           !find(item, {"image", "file", "filename", "name", "index", "id", "frame"});
  });
  if (list.in_order) list.guess = path + ": poses without names or numbers are in the order of the pictures";
  expect_metres(distances, path);
  return list;
}

std::vector<PosePair> load_json_pairs(const std::string& path) {
  std::vector<PosePair> pairs;
  const Json items = list_in(path);
  for (std::size_t i = 0; i < items.size(); ++i) {
    const Json& item = items[i];
    const std::string where = "pair " + std::to_string(i);
    const bool two = item.is_array() && item.size() == 2;
    const Json* first =
        two ? &item[0] : find(item, {"robot", "gripper", "effector", "hand", "T_base_gripper", "robot_pose"});
    const Json* second = two ? &item[1]
                             : find(item, {"tracking", "target", "object", "board", "marker",
                                           "T_camera_target", "target_pose"});
    if (!first || !second)
      throw input_error(path, where,
                        "expected two poses: of the gripper in the world (robot) and of the target in the "
                        "camera (target)");
    pairs.push_back({pose_of_json(*first, path, where), pose_of_json(*second, path, where)});
  }
  return pairs;
}

}  // namespace flash::data
