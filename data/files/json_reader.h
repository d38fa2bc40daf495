#pragma once
#include <Eigen/Core>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "data/files/error.h"

namespace flash::data {

/// Parses a file or text. Throws InputError with line and column, beyond 256 levels of nesting too, or naming
/// a field that an object gives twice.
nlohmann::json load_json(const std::string& path);
nlohmann::json parse_json(const std::string& text, const std::string& source);

/// The name in `known` with the fewest edits to `name`; empty where even that is far off.
std::string nearest_name(const std::string& name, const std::vector<std::string>& known);

/// Strict view of a JSON object: every message names file and field ("towel.json: mechanical_props.young:
/// found "soft", expected a number"). Null counts as absent.
class JsonObject {
 public:
  /// Throws InputError unless `value` is an object. `field` is its own name in messages, empty for the whole
  /// file.
  JsonObject(const nlohmann::json& value, std::string source, std::string field = "");

  /// Throws InputError on any other field, naming the nearest known one. Call it first: a misspelt name is
  /// the better message than a missing field.
  void expect_fields(std::initializer_list<const char*> known) const;

  bool has(const char* key) const;
  const nlohmann::json& raw(const char* key) const;

  double number(const char* key) const;
  int integer(const char* key) const;
  std::string string(const char* key) const;
  Eigen::VectorXd vector(const char* key, int size) const;  ///< finite numbers; size -1: any
  std::vector<int> indices(const char* key) const;          ///< whole numbers from 0

  double number(const char* key, double fallback) const { return has(key) ? number(key) : fallback; }
  int integer(const char* key, int fallback) const { return has(key) ? integer(key) : fallback; }
  bool boolean(const char* key, bool fallback) const;
  std::string string(const char* key, const std::string& fallback) const {
    return has(key) ? string(key) : fallback;
  }
  std::string choice(const char* key, const std::string& fallback,
                     const std::vector<std::string>& known) const;  ///< one of `known`
  Eigen::Vector3d vector3(const char* key, const Eigen::Vector3d& fallback) const;
  std::optional<double> optional_number(const char* key) const;

  double positive(const char* key) const;      ///< above 0
  double not_negative(const char* key) const;  ///< 0 or above
  double positive(const char* key, double fallback) const { return has(key) ? positive(key) : fallback; }
  double not_negative(const char* key, double fallback) const {
    return has(key) ? not_negative(key) : fallback;
  }
  Eigen::Vector3d direction(const char* key, const Eigen::Vector3d& fallback) const;  ///< normalised

  JsonObject object(const char* key) const;
  std::vector<JsonObject> objects(const char* key) const;  ///< of a list; empty where absent
  /// Members of an object of objects, in order of name; empty where absent.
  std::vector<std::pair<std::string, JsonObject>> members(const char* key) const;

  /// "file: field.key: found ..., expected ..."; "missing" where there is none.
  InputError error(const char* key, const std::string& expected) const;
  std::string name_of(const char* key) const;  ///< "mechanical_props.young"
  const std::string& source() const { return source_; }
  const nlohmann::json& value() const { return *value_; }

 private:
  const nlohmann::json* value_;
  std::string source_, field_;
};

/// JSON as people like to read it: what fits into a line stands in one. What is no UTF-8 is replaced.
std::string format_json(const nlohmann::ordered_json& value);

}  // namespace flash::data
