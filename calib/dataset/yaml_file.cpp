#include "calib/dataset/yaml_file.h"

#include <cmath>
#include <optional>

#include "data/atomic_file.h"
#include "data/error.h"
#include "data/text.h"

namespace flash::calib {

YAML::Node load_yaml(const std::string& path) {
  std::string text = data::read_file(path);
  if (text.starts_with("%YAML:")) text.erase(0, text.find('\n'));  // OpenCV's own first line is no YAML
  try {
    return YAML::Load(text);
  } catch (const YAML::Exception& error) {
    throw data::InputError(path + ": not valid YAML: line " + std::to_string(error.mark.line + 1) + ": " +
                           error.msg);
  }
}

double yaml_number(const YAML::Node& node, const std::string& path, const std::string& field) {
  const std::optional<double> value =
      node.IsDefined() && node.IsScalar() ? data::parse_number(node.Scalar()) : std::nullopt;
  if (!value || !std::isfinite(*value))
    throw data::input_error(path, field, "missing, expected a finite number");
  return *value;
}

std::vector<double> yaml_numbers(const YAML::Node& node, const std::string& path, const std::string& field) {
  if (node.IsScalar()) return {yaml_number(node, path, field)};
  std::vector<double> values;
  for (const YAML::Node& item : node)
    for (const double value : yaml_numbers(item, path, field)) values.push_back(value);
  return values;
}

}  // namespace flash::calib
