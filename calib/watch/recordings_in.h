#pragma once
#include <string>
#include <vector>

namespace flash::calib {

/// Names of the folders in `folder` that are recordings of a camera each, two or more: sorted, and none where
/// `folder` has pictures of its own.
std::vector<std::string> recordings_in(const std::string& folder);

}  // namespace flash::calib
