#pragma once
#include <map>
#include <string>
#include <vector>

namespace flash::calib {

/// The arrays of real numbers of an .npz as numpy.savez writes it (not compressed), row by row, by name.
/// Throws data::InputError.
std::map<std::string, std::vector<double>> load_npz(const std::string& path);

}  // namespace flash::calib
