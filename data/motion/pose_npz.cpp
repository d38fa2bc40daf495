#include "data/motion/pose_npz.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cctype>
#include <cmath>

#include "data/files/error.h"
#include "data/files/npz.h"
#include "data/files/text.h"
#include "data/motion/pose_numbers.h"

namespace flash::data {
namespace {

using Arrays = std::map<std::string, NumpyArray>;
using Names = std::initializer_list<const char*>;

/// As plain() writes them.
constexpr Names kRobot = {"robot",        "gripper",      "effector",      "hand",
                          "tbasegripper", "gripper2base", "tgripper2base", "tbaseee",
                          "tbasetool",    "tbaseflange",  "tbasehand"};
constexpr Names kTarget = {"target",     "tracking",  "object",  "board",      "marker",     "tcameratarget",
                           "target2cam", "tcamboard", "tcamtag", "tcammarker", "tcamtarget", "tcameraboard"};

std::string plain(const std::string& name) {
  std::string text;
  for (const char c : name)
    if (std::isalnum(static_cast<unsigned char>(c)))
      text += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  for (const char* ending : {"poses", "pose"})
    if (text.ends_with(ending)) text.resize(text.size() - std::string(ending).size());
  return text;
}

const NumpyArray* find(const Arrays& arrays, Names names) {
  for (const char* name : names)
    if (const auto found = arrays.find(name); found != arrays.end()) return &found->second;
  return nullptr;
}

/// "robot 12 x 4 x 4, K 3 x 3"
std::string described(const std::map<std::string, NumpyArray>& arrays) {
  std::string text;
  for (const auto& [name, array] : arrays) {
    text += (text.empty() ? "" : ", ") + name;
    for (std::size_t i = 0; i < array.shape.size(); ++i)
      text += (i > 0 ? " x " : " ") + std::to_string(array.shape[i]);
  }
  return text.empty() ? "no arrays" : text;
}

/// The numbers of each row of a stack, `width` of them; empty where the array is no such stack.
std::vector<std::vector<double>> rows_of(const NumpyArray& array, std::size_t width) {
  const std::size_t count = array.shape.empty() ? 0 : array.shape.front();
  if (count == 0 || array.values.size() != count * width) return {};
  std::vector<std::vector<double>> rows;
  for (std::size_t i = 0; i < count; ++i) {
    const auto first = array.values.begin() + static_cast<std::ptrdiff_t>(i * width);
    rows.emplace_back(first, first + static_cast<std::ptrdiff_t>(width));
  }
  return rows;
}

/// Rows of 3 x 4 from rotations and places.
std::vector<std::vector<double>> joined(const std::vector<std::vector<double>>& rotations,
                                        const std::vector<std::vector<double>>& places) {
  if (rotations.size() != places.size()) return {};
  std::vector<std::vector<double>> rows;
  for (std::size_t i = 0; i < rotations.size(); ++i) {
    std::vector<double>& row = rows.emplace_back();
    for (std::size_t k = 0; k < 3; ++k) {
      const auto first = rotations[i].begin() + static_cast<std::ptrdiff_t>(3 * k);
      row.insert(row.end(), first, first + 3);
      row.push_back(places[i][k]);
    }
  }
  return rows;
}

/// Rotations as matrices or, as OpenCV has them too, as vectors along their axes, of their angles' lengths.
std::vector<std::vector<double>> rotations_in(const NumpyArray& array, const char* name,
                                              const std::string& path) {
  constexpr double longest = 4 * M_PI;  // a full turn, and what a driver counts on
  if (std::vector<std::vector<double>> matrices = rows_of(array, 9); !matrices.empty()) return matrices;
  std::vector<std::vector<double>> rows = rows_of(array, 3);
  for (std::vector<double>& row : rows) {
    const Eigen::Vector3d vector(row[0], row[1], row[2]);
    const double angle = vector.stableNorm();
    if (!vector.allFinite() || angle > longest)
      throw input_error(
          path, "R_" + std::string(name + 1),
          "found a rotation vector of length " + format_short(vector.norm()) + ", expected radians");
    const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> R =
        angle > 0 ? Eigen::AngleAxisd(angle, vector / angle).toRotationMatrix() : Eigen::Matrix3d::Identity();
    row.assign(R.data(), R.data() + 9);
  }
  return rows;
}

/// The poses of a stack, as numbers; empty where it is none.
std::vector<std::vector<double>> poses_in(const NumpyArray& array) {
  for (const std::size_t width : {16, 12, 7})
    if (std::vector<std::vector<double>> rows = rows_of(array, width); !rows.empty()) return rows;
  return {};
}

/// The poses of one of the two stacks, as numbers; empty where there is none.
std::vector<std::vector<double>> stack_of(const Arrays& arrays, Names names, const char* rotation,
                                          const char* place, const std::string& path) {
  if (const NumpyArray* whole = find(arrays, names))
    if (std::vector<std::vector<double>> rows = poses_in(*whole); !rows.empty()) return rows;
  const NumpyArray *R = find(arrays, {rotation}), *t = find(arrays, {place});
  if (R == nullptr || t == nullptr) return {};
  return joined(rotations_in(*R, rotation, path), rows_of(*t, 3));
}

bool is_of_poses(const std::string& name) {
  const Names parts = {"rgripper2base", "tgripper2base", "rtarget2cam", "ttarget2cam"};
  const auto holds = [&](Names names) { return std::find(names.begin(), names.end(), name) != names.end(); };
  return holds(kRobot) || holds(kTarget) || holds(parts);
}

/// By the names that plain() gives them.
Arrays renamed(const Arrays& named, const std::string& path) {
  Arrays arrays;
  for (const auto& [name, array] : named)
    if (!arrays.emplace(plain(name), array).second)
      throw InputError(path + ": " + name +
                       ": found another array of this name but for capitals and signs, "
                       "expected each once");
  for (const auto& [name, array] : named)
    if (is_of_poses(plain(name))) expect_numbers(array, path, name);
  return arrays;
}

PoseList in_order(const std::vector<std::vector<double>>& rows, const std::string& path) {
  PoseList list;
  list.in_order = true;
  list.guess = path + ": its poses are taken to be in the order of the pictures";
  std::vector<double> distances;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    list.poses.push_back(
        {"", static_cast<double>(i), pose_of_numbers(rows[i], path, "pose " + std::to_string(i))});
    distances.push_back(list.poses.back().pose.translation().stableNorm());
  }
  expect_metres(distances, path);
  return list;
}

}  // namespace

PoseList load_npz_poses(const std::string& path) {
  const Arrays named = load_npz(path), arrays = renamed(named, path);
  std::vector<std::vector<double>> rows = stack_of(arrays, kRobot, "rgripper2base", "tgripper2base", path);
  if (rows.empty() && arrays.size() == 1) rows = poses_in(arrays.begin()->second);
  if (rows.empty())
    throw InputError(path + ": found " + described(named) +
                     ", expected poses of the gripper in the base (robot, poses), N x 4 x 4 or N x 7, or "
                     "R_gripper2base and t_gripper2base");
  return in_order(rows, path);
}

PoseList load_npy_poses(const std::string& path) {
  const NumpyArray array = load_npy(path);
  const std::vector<std::vector<double>> rows = poses_in(array);
  if (rows.empty())
    throw InputError(path + ": found " + described({{"an array", array}}) +
                     ", expected poses of the gripper in the base, N x 4 x 4 or N x 7");
  return in_order(rows, path);
}

std::vector<PosePair> load_npz_pairs(const std::string& path) {
  const Arrays named = load_npz(path), arrays = renamed(named, path);
  const auto robot = stack_of(arrays, kRobot, "rgripper2base", "tgripper2base", path),
             target = stack_of(arrays, kTarget, "rtarget2cam", "ttarget2cam", path);
  if (robot.empty() || robot.size() != target.size())
    throw InputError(
        path + ": found " + described(named) +
        ", expected as many poses of the gripper in the base (robot) as of the target in the camera "
        "(target), each N x 4 x 4, or R_gripper2base, t_gripper2base, R_target2cam, t_target2cam");
  std::vector<PosePair> pairs;
  for (std::size_t i = 0; i < robot.size(); ++i) {
    const std::string where = "pair " + std::to_string(i);
    pairs.push_back({pose_of_numbers(robot[i], path, where), pose_of_numbers(target[i], path, where)});
  }
  return pairs;
}

}  // namespace flash::data
