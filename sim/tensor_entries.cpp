#include "sim/tensor_entries.h"

#include <cmath>
#include <cstddef>
#include <functional>
#include <iterator>
#include <numeric>

#include "data/files/error.h"
#include "data/files/text.h"
#include "data/motion/trajectory.h"

namespace flash::sim {
namespace {

using Shape = std::vector<std::int64_t>;

std::string name_of(const Shape& shape) {
  std::string name;
  for (const std::int64_t length : shape) name += (name.empty() ? "" : " x ") + std::to_string(length);
  return name.empty() ? "a number" : name;
}

bool is_dense(const Tensor& numbers) {
  if (numbers.strides.empty()) return true;
  if (numbers.strides.size() != numbers.shape.size()) return false;
  std::int64_t stride = 1;
  for (std::size_t k = numbers.shape.size(); k-- > 0; stride *= numbers.shape[k])
    if (numbers.shape[k] != 1 && numbers.strides[k] != stride) return false;
  return true;
}

}  // namespace

const double* entries_of(const std::string& what, std::span<const int> chosen, const Tensor& numbers,
                         const Shape& shape_of_each) {
  Shape shape = {std::ssize(chosen)};
  shape.insert(shape.end(), shape_of_each.begin(), shape_of_each.end());
  const auto expect = [&](bool met, const std::string& why) {
    if (!met) throw data::InputError(what + ": " + why);
  };
  expect(numbers.device == Device::cpu, "found numbers on a CUDA device, expected the CPU's");
  expect(numbers.type == NumberType::float64, "found float32, expected float64");
  expect(numbers.shape == shape, "found " + name_of(numbers.shape) + " numbers, expected " + name_of(shape));
  expect(is_dense(numbers), "found strides with gaps, expected dense numbers");
  expect(!numbers.empty() || chosen.empty(), "found no numbers, expected " + name_of(shape));
  const auto* first = static_cast<const double*>(numbers.data);
  const std::int64_t each =
      std::accumulate(shape_of_each.begin(), shape_of_each.end(), std::int64_t{1}, std::multiplies<>());
  for (std::size_t i = 0; i < chosen.size(); ++i)
    for (std::int64_t k = 0; k < each; ++k) {
      const double value = first[static_cast<std::int64_t>(i) * each + k];
      if (!std::isfinite(value))
        throw data::InputError(what + ": environment " + std::to_string(chosen[i]) + ": found " +
                               data::format_short(value) + " at " + std::to_string(k) +
                               ", expected finite numbers");
    }
  return first;
}

std::vector<Eigen::Isometry3d> poses_of(const std::string& what, std::span<const int> chosen,
                                        const Tensor& poses) {
  constexpr double unit_tolerance = 1e-3;  // as of files of trajectories
  constexpr double farthest_place = 1e5;   // as of files of scenes [m]
  const double* numbers = entries_of(what, chosen, poses, {7});
  std::vector<Eigen::Isometry3d> all;
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    const Eigen::Map<const Eigen::Matrix<double, 7, 1>> pose(numbers + 7 * i);
    const auto expect = [&](bool met, const std::string& found) {
      if (!met)
        throw data::InputError(what + ": environment " + std::to_string(chosen[i]) + ": found " + found);
    };
    const double length = pose.tail<4>().norm(), farthest = pose.head<3>().cwiseAbs().maxCoeff();
    expect(std::abs(length - 1) <= unit_tolerance,
           "a quaternion of length " + data::format_short(length) + ", expected 1");
    expect(farthest <= farthest_place, data::format_short(farthest) + " m, expected at most " +
                                           data::format_short(farthest_place) + " m");
    all.push_back(data::from_vector(pose));
  }
  return all;
}

}  // namespace flash::sim
