#pragma once
#include <Eigen/Geometry>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "sim/tensor.h"

namespace flash::sim {

/// The numbers of a tensor that has an entry of `shape_of_each` for each environment of `chosen`, in their
/// order. Throws data::InputError, which begins with `what`, unless they are dense and finite float64 of that
/// shape in the memory of the processor.
const double* entries_of(const std::string& what, std::span<const int> chosen, const Tensor& numbers,
                         const std::vector<std::int64_t>& shape_of_each);

/// Poses of the chosen environments, x y z [m] and the quaternion x y z w of each, as numbers that
/// entries_of takes. Throws data::InputError likewise, for a quaternion that is not of length 1 too, and for
/// places farther than files may have them.
std::vector<Eigen::Isometry3d> poses_of(const std::string& what, std::span<const int> chosen,
                                        const Tensor& poses);

}  // namespace flash::sim
