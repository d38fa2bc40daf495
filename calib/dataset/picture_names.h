#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace flash::calib {

/// Time in a file name that is nothing but a number: seconds, or nanoseconds.
std::optional<double> time_in_name(const std::filesystem::path& path);

/// Throws data::InputError where one of two times is of a wall clock, which counts from 1970, and the other
/// is of a clock that begins with a program, as a simulator's. picture: whose time it is; poses: where the
/// other stands.
void expect_one_clock(double time, double of_poses, const std::string& picture, const std::string& poses);

/// " (12 imageN, 12 resultN)" where pictures have several names but for their numbers; else empty.
std::string kinds_of_names(const std::vector<std::filesystem::path>& pictures);

/// Throws data::InputError where two pictures of different names have one number: what a program drew of its
/// pictures often lies beside them. Names both.
void expect_one_picture_a_number(const std::vector<std::filesystem::path>& pictures);

}  // namespace flash::calib
