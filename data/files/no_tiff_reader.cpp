#include "data/files/error.h"
#include "data/files/tiff_reader.h"

namespace flash::data {

GreyTiff read_tiff(const std::string& path) {
  throw InputError(path +
                   ": is named as a TIFF, which this build does not read; expected .png or .npy, or a "
                   "build of flash from its sources");
}

}  // namespace flash::data
