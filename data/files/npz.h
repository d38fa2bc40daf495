#pragma once
#include <cstddef>
#include <map>
#include <string>
#include <vector>

namespace flash::data {

/// An array of real numbers as numpy writes it, row by row; without values where it is of other things, or
/// column by column in more than two dimensions.
struct NumpyArray {
  std::vector<std::size_t> shape;
  std::vector<double> values;
  bool whole = false;  ///< of integers
  std::string type;    ///< as numpy writes it: "<f8", "|O"; empty of records
};

/// Throws InputError of an array that holds no real numbers: "pairs.npz: robot: found objects (|O), ...".
void expect_numbers(const NumpyArray& array, const std::string& path, const std::string& name);

/// The arrays of an .npz as numpy.savez writes it (not compressed), by name. Throws InputError.
std::map<std::string, NumpyArray> load_npz(const std::string& path);

/// One array, as numpy.save writes it. Throws InputError where the file holds none of real numbers, or not as
/// many as its shape says.
NumpyArray load_npy(const std::string& path);

}  // namespace flash::data
