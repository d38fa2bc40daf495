#pragma once
#include <string>
#include <vector>

namespace flash::data {

/// A TIFF of one channel, row by row from the upper left.
struct GreyTiff {
  int width = 0, height = 0;
  bool whole = false;  ///< of integers
  std::vector<double> values;
};

/// Floats of 32 or 64 bits, or unsigned integers of 16, in strips of any compression that libtiff knows.
/// Throws InputError naming the path where it is anything else, is cut off, or promises more than 256
/// megapixels. Nothing is said on the terminal.
GreyTiff read_tiff(const std::string& path);

}  // namespace flash::data
