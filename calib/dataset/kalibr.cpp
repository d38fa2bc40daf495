#include "calib/dataset/kalibr.h"

#include "data/files/error.h"
#include "data/files/yaml_file.h"

namespace flash::calib {

using data::input_error;

Target load_kalibr_target(const std::string& path) {
  const YAML::Node file = data::load_yaml(path);
  const auto word = [&](const char* name) {
    const YAML::Node node = file.IsMap() ? file[name] : YAML::Node();
    if (!node || !node.IsScalar()) throw input_error(path, name, "missing, expected Kalibr's target fields");
    return node.Scalar();
  };
  const std::string type = word("target_type");
  if (type == "aprilgrid")
    return parse_target("aprilgrid:" + word("tagCols") + 'x' + word("tagRows") + ':' + word("tagSize") + ':' +
                        word("tagSpacing"));
  if (type == "checkerboard") {
    if (word("rowSpacingMeters") != word("colSpacingMeters"))
      throw input_error(path, "colSpacingMeters", "differs from rowSpacingMeters, expected squares");
    return parse_target("chessboard:" + word("targetCols") + 'x' + word("targetRows") + ':' +
                        word("rowSpacingMeters"));
  }
  throw input_error(path, "target_type", "found \"" + type + "\", expected aprilgrid or checkerboard");
}

}  // namespace flash::calib
