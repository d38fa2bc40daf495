#include "data/files/yaml_file.h"

#include <cmath>
#include <optional>

#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "data/files/text.h"

namespace flash::data {

YAML::Node load_yaml(const std::string& path) {
  std::string text = read_file(path);
  if (text.starts_with("%YAML:")) text.erase(0, text.find('\n'));  // OpenCV's own first line is no YAML
  try {
    return YAML::Load(text);
  } catch (const YAML::Exception& error) {
    throw InputError(path + ": not valid YAML: line " + std::to_string(error.mark.line + 1));
  }
}

double yaml_number(const YAML::Node& node, const std::string& path, const std::string& field) {
  const std::optional<double> value =
      node.IsDefined() && node.IsScalar() ? parse_number(node.Scalar()) : std::nullopt;
  if (!value || !std::isfinite(*value)) throw input_error(path, field, "missing, expected a finite number");
  return *value;
}

namespace {

void add_numbers(const YAML::Node& node, const std::string& path, const std::string& field, int depth,
                 std::vector<double>& values) {
  constexpr int kDeepest = 8;  // an alias may hold itself
  if (depth > kDeepest) throw input_error(path, field, "lists within lists, expected numbers");
  if (node.IsScalar()) {
    values.push_back(yaml_number(node, path, field));
    return;
  }
  for (const YAML::Node& item : node) add_numbers(item, path, field, depth + 1, values);
}

}  // namespace

std::vector<double> yaml_numbers(const YAML::Node& node, const std::string& path, const std::string& field) {
  std::vector<double> values;
  add_numbers(node, path, field, 0, values);
  return values;
}

}  // namespace flash::data
