#include "data/files/json_reader.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>

#include "data/files/atomic_file.h"

namespace flash::data {
namespace {

std::size_t edit_distance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t substituted = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({substituted, row[j] + 1, row[j - 1] + 1});
    }
  }
  return row.back();
}

std::string shortened(const nlohmann::json& value) {
  std::string text = value.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  if (text.size() > 60) text = text.substr(0, 57) + "...";
  return text;
}

/// Values are copied, printed and destroyed by recursion, whose depth the stack bounds.
void check_depth(const std::string& text, const std::string& source) {
  constexpr int deepest = 256;
  int depth = 0, line = 1;
  bool quoted = false, escaped = false;
  for (const char c : text) {
    if (c == '"' && !escaped) quoted = !quoted;
    escaped = quoted && c == '\\' && !escaped;
    if (c == '\n') ++line;
    if (quoted) continue;
    if (c == '[' || c == '{') ++depth;
    if (c == ']' || c == '}') --depth;
    if (depth > deepest)
      throw input_error(source, "line " + std::to_string(line),
                        "found more than " + std::to_string(deepest) + " levels of nesting");
  }
}

/// Refuses a name that one object gives twice: a plain parser keeps the last without a word.
class NamesOnce {
 public:
  explicit NamesOnce(std::string source) : source_(std::move(source)) {}

  bool operator()(int /*depth*/, nlohmann::json::parse_event_t event, nlohmann::json& parsed) {
    if (event == nlohmann::json::parse_event_t::object_start) open_.emplace_back();
    if (event == nlohmann::json::parse_event_t::object_end) open_.pop_back();
    if (event != nlohmann::json::parse_event_t::key) return true;
    open_.back().last = parsed.get<std::string>();
    if (open_.back().names.insert(open_.back().last).second) return true;
    std::string field;
    for (const Object& object : open_) field += (field.empty() ? "" : ".") + object.last;
    throw input_error(source_, field, "given twice, expected once");
  }

 private:
  struct Object {
    std::set<std::string> names;
    std::string last;
  };
  std::string source_;
  std::vector<Object> open_;  // from the outermost to the one being read
};

constexpr std::size_t kLine = 110;

/// What is no UTF-8, as a path may have it, is replaced.
std::string text_of(const nlohmann::ordered_json& value) {
  return value.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

void format(const nlohmann::ordered_json& value, std::size_t indent, std::size_t used, std::string& text) {
  const bool nested = (value.is_object() || value.is_array()) && !value.empty();
  const std::string flat = text_of(value);
  if (!nested || indent + used + flat.size() + flat.size() / 10 < kLine) {
    // One line, with a blank after each comma and colon outside of strings.
    bool quoted = false, escaped = false;
    for (const char c : flat) {
      text += c;
      if (c == '"' && !escaped) quoted = !quoted;
      escaped = c == '\\' && !escaped;
      if (!quoted && (c == ',' || c == ':')) text += ' ';
    }
    return;
  }
  const std::string margin(indent + 2, ' ');
  text += value.is_object() ? "{\n" : "[\n";
  for (auto item = value.begin(); item != value.end(); ++item) {
    if (item != value.begin()) text += ",\n";
    text += margin;
    std::size_t name_width = 0;
    if (value.is_object()) {
      const std::string name = text_of(nlohmann::ordered_json(item.key())) + ": ";
      text += name;
      name_width = name.size();
    }
    format(item.value(), indent + 2, name_width, text);
  }
  text += '\n' + std::string(indent, ' ') + (value.is_object() ? '}' : ']');
}

/// "line 3, column 1: found }, which nothing before it allows". byte: counted from 1, that is not understood.
std::string wrong_at(const std::string& text, std::size_t byte) {
  if (text.find_first_not_of(" \t\r\n") == std::string::npos) return "it is empty";
  const std::size_t at = std::min(byte, text.size() + 1) - (byte > 0 ? 1 : 0);
  const std::string_view before = std::string_view(text).substr(0, at);
  const std::size_t line_begin = before.rfind('\n') + 1;  // 0 in the first line
  const std::string place = "line " + std::to_string(1 + std::count(before.begin(), before.end(), '\n')) +
                            ", column " + std::to_string(at - line_begin + 1);
  if (at >= text.size()) return place + ": it ends within a value";
  return place + ": found " + text.substr(at, 1) + ", which nothing before it allows";
}

}  // namespace

nlohmann::json parse_json(const std::string& text, const std::string& source) {
  if (text.starts_with("\xff\xfe") || text.starts_with("\xfe\xff"))
    throw InputError(source + ": found text in UTF-16, expected UTF-8: save it so");
  check_depth(text, source);
  try {
    return nlohmann::json::parse(text, NamesOnce(source));
  } catch (const nlohmann::json::parse_error& error) {
    throw InputError(source + ": not valid JSON: " + wrong_at(text, error.byte));
  } catch (const nlohmann::json::exception&) {
    throw InputError(source + ": not valid JSON: a number is too large");
  }
}

nlohmann::json load_json(const std::string& path) { return parse_json(read_file(path), path); }

std::string nearest_name(const std::string& name, const std::vector<std::string>& known) {
  std::string nearest;
  std::size_t least = std::max<std::size_t>(2, name.size() / 2) + 1;
  for (const std::string& candidate : known) {
    // A forgotten unit or qualifier ("yaw" for "yaw_rad") is nearer than any misspelling.
    const std::size_t distance = candidate.starts_with(name + '_') ? 1 : edit_distance(name, candidate);
    if (distance < least) {
      least = distance;
      nearest = candidate;
    }
  }
  return nearest;
}

JsonObject::JsonObject(const nlohmann::json& value, std::string source, std::string field)
    : value_(&value), source_(std::move(source)), field_(std::move(field)) {
  if (!value.is_object())
    throw InputError(source_ + ": " + (field_.empty() ? "" : field_ + ": ") + "found " + shortened(value) +
                     ", expected an object {...}");
}

std::string JsonObject::name_of(const char* key) const { return field_.empty() ? key : field_ + '.' + key; }

InputError JsonObject::error(const char* key, const std::string& expected) const {
  if (!has(key)) return input_error(source_, name_of(key), "missing, expected " + expected);
  return input_error(source_, name_of(key), "found " + shortened(raw(key)) + ", expected " + expected);
}

void JsonObject::expect_fields(std::initializer_list<const char*> known) const {
  for (const auto& [name, value] : value_->items()) {
    if (std::find(known.begin(), known.end(), name) != known.end()) continue;
    const std::string nearest = nearest_name(name, {known.begin(), known.end()});
    throw input_error(
        source_, name_of(name.c_str()),
        nearest.empty() ? "unknown field" : "unknown field (did you mean \"" + nearest + "\"?)");
  }
}

bool JsonObject::has(const char* key) const {
  const auto found = value_->find(key);
  return found != value_->end() && !found->is_null();
}

const nlohmann::json& JsonObject::raw(const char* key) const {
  static const nlohmann::json null;
  const auto found = value_->find(key);
  return found == value_->end() ? null : *found;
}

double JsonObject::number(const char* key) const {
  const nlohmann::json& value = raw(key);
  if (!value.is_number()) throw error(key, "a number");
  return value.get<double>();
}

int JsonObject::integer(const char* key) const {
  const double value = raw(key).is_number() ? raw(key).get<double>() : std::nan("");
  if (value != std::floor(value)) throw error(key, "a whole number");
  if (!(std::abs(value) <= std::numeric_limits<int>::max()))
    throw error(key, "a whole number of at most 2,147,483,647");
  return static_cast<int>(value);
}

std::string JsonObject::string(const char* key) const {
  if (!raw(key).is_string()) throw error(key, "a text in quotes");
  return raw(key).get<std::string>();
}

std::string JsonObject::choice(const char* key, const std::string& fallback,
                               const std::vector<std::string>& known) const {
  const std::string value = string(key, fallback);
  if (std::find(known.begin(), known.end(), value) != known.end()) return value;
  std::string expected;
  for (const std::string& name : known) expected += (expected.empty() ? "" : ", ") + name;
  throw error(key, "one of " + expected);
}

bool JsonObject::boolean(const char* key, bool fallback) const {
  if (!has(key)) return fallback;
  if (!raw(key).is_boolean()) throw error(key, "true or false");
  return raw(key).get<bool>();
}

Eigen::VectorXd JsonObject::vector(const char* key, int size) const {
  const nlohmann::json& value = raw(key);
  const std::string expected = "a list of " + (size < 0 ? "numbers" : std::to_string(size) + " numbers");
  if (!value.is_array() || (size >= 0 && value.size() != static_cast<std::size_t>(size)))
    throw error(key, expected);
  Eigen::VectorXd result(static_cast<Eigen::Index>(value.size()));
  for (std::size_t i = 0; i < value.size(); ++i) {
    if (!value[i].is_number()) throw error(key, expected);
    result[static_cast<Eigen::Index>(i)] = value[i].get<double>();
  }
  return result;
}

std::vector<int> JsonObject::indices(const char* key) const {
  const nlohmann::json& value = raw(key);
  std::vector<int> result;
  if (!value.is_array()) throw error(key, "a list of indices");
  for (const nlohmann::json& item : value) {
    if (!item.is_number_integer() || item.get<double>() < 0 ||
        item.get<double>() > std::numeric_limits<int>::max())
      throw error(key, "indices, whole numbers from 0");
    result.push_back(item.get<int>());
  }
  return result;
}

Eigen::Vector3d JsonObject::vector3(const char* key, const Eigen::Vector3d& fallback) const {
  return has(key) ? Eigen::Vector3d(vector(key, 3)) : fallback;
}

std::optional<double> JsonObject::optional_number(const char* key) const {
  return has(key) ? std::optional<double>(number(key)) : std::nullopt;
}

double JsonObject::positive(const char* key) const {
  const double value = number(key);
  if (!(value > 0)) throw error(key, "a number above 0");
  return value;
}

double JsonObject::not_negative(const char* key) const {
  const double value = number(key);
  if (!(value >= 0)) throw error(key, "a number of 0 or above");
  return value;
}

Eigen::Vector3d JsonObject::direction(const char* key, const Eigen::Vector3d& fallback) const {
  const Eigen::Vector3d value = vector3(key, fallback);
  // The length itself may be too large for a number.
  const double largest = value.cwiseAbs().maxCoeff();
  if (!(largest > 0 && largest * (value / largest).norm() > 1e-9))
    throw error(key, "a direction that is not zero");
  return (value / largest).normalized();
}

JsonObject JsonObject::object(const char* key) const {
  if (!raw(key).is_object()) throw error(key, "an object {...}");
  return JsonObject(raw(key), source_, name_of(key));
}

std::vector<JsonObject> JsonObject::objects(const char* key) const {
  std::vector<JsonObject> result;
  if (!has(key)) return result;
  if (!raw(key).is_array()) throw error(key, "a list of objects [{...}, ...]");
  for (std::size_t i = 0; i < raw(key).size(); ++i)
    result.emplace_back(raw(key)[i], source_, name_of(key) + '[' + std::to_string(i) + ']');
  return result;
}

std::vector<std::pair<std::string, JsonObject>> JsonObject::members(const char* key) const {
  std::vector<std::pair<std::string, JsonObject>> result;
  if (!has(key)) return result;
  for (const auto& [name, value] : object(key).value_->items())
    result.emplace_back(name, JsonObject(value, source_, name_of(key) + '.' + name));
  return result;
}

std::string format_json(const nlohmann::ordered_json& value) {
  std::string text;
  format(value, 0, 0, text);
  return text + '\n';
}

}  // namespace flash::data
