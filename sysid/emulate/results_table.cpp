#include "sysid/emulate/results_table.h"

#include <algorithm>
#include <cmath>

#include "data/files/atomic_file.h"

namespace flash::sysid {
namespace {

std::vector<std::string> fields_of(std::string_view line) {
  std::vector<std::string> fields(1);
  bool quoted = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (c == '"' && quoted && i + 1 < line.size() && line[i + 1] == '"') {
      fields.back() += line[++i];
    } else if (c == '"') {
      quoted = !quoted;
    } else if (c == ',' && !quoted) {
      fields.emplace_back();
    } else {
      fields.back() += c;
    }
  }
  return fields;
}

/// Names the first column that differs.
void check_header(const std::string& path, const std::vector<std::string>& found,
                  const std::vector<std::string>& expected) {
  const auto name = [](const std::vector<std::string>& names, std::size_t k) {
    return k < names.size() ? '"' + names[k] + '"' : std::string("none");
  };
  for (std::size_t k = 0; k < std::max(found.size(), expected.size()); ++k)
    if (name(found, k) != name(expected, k))
      throw data::input_error(path, "header",
                              "column " + std::to_string(k + 1) + ": found " + name(found, k) +
                                  ", expected " + name(expected, k) + "; grid --force searches anew");
}

std::string whole_lines(const std::string& path, CutLine cut) {
  std::string text = data::read_file(path);
  const std::size_t whole = text.rfind('\n') + 1;
  if (cut == CutLine::refuse && whole < text.size())
    throw data::InputError(path + ": the last line is cut off; grid --resume finds its candidate again");
  text.resize(whole);
  return text;
}

}  // namespace

std::string quoted_field(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + "\"";
}

Row::Row(const std::vector<std::string>& names, std::string_view line, std::string place)
    : names_(&names), line_(line), fields_(fields_of(line)), place_(std::move(place)) {
  if (fields_.size() != names.size())
    throw data::InputError(place_ + ": found " + std::to_string(fields_.size()) + " fields, expected " +
                           std::to_string(names.size()));
}

const std::string& Row::text(const std::string& name) const {
  const auto found = std::find(names_->begin(), names_->end(), name);
  if (found == names_->end()) throw data::InputError(place_ + ": " + name + ": the column is missing");
  return fields_[static_cast<std::size_t>(found - names_->begin())];
}

double Row::number(const std::string& name) const {
  const std::optional<double> value = data::parse_number(text(name));
  if (!value) throw error(name, "a number");
  return *value;
}

double Row::finite(const std::string& name) const {
  const double value = number(name);
  if (!std::isfinite(value)) throw error(name, "a finite number");
  return value;
}

double Row::not_negative(const std::string& name) const {
  const double value = number(name);
  if (!(value >= 0)) throw error(name, "a number of 0 or above");
  return value;
}

double Row::score(const std::string& name) const {
  constexpr double kFarthest = 1e3;  // Of a score that can be meant [m]. Work: a refusal.
  const double value = not_negative(name);
  if (value > kFarthest && std::isfinite(value)) throw error(name, "0 to 1000 m");
  return value;
}

bool Row::boolean(const std::string& name) const {
  if (text(name) != "true" && text(name) != "false") throw error(name, "true or false");
  return text(name) == "true";
}

int Row::index(const std::string& name) const {
  const int value = data::to_index(number(name));
  if (value < 0) throw error(name, "a whole number from 0");
  return value;
}

data::InputError Row::error(const std::string& name, const std::string& expected) const {
  return data::InputError(place_ + ": " + name + ": found \"" + text(name) + "\", expected " + expected);
}

void Row::expect(const std::string& name, double value, const std::string& why) const {
  if (number(name) != value) throw error(name, data::format_number(value) + ", " + why);
}

void Row::expect(const std::string& name, const std::string& value, const std::string& why) const {
  if (text(name) != value) throw error(name, '"' + value + "\", " + why);
}

Table::Table(std::string path, std::vector<std::string> columns, CutLine cut)
    : path_(std::move(path)), text_(whole_lines(path_, cut)), lines_(text_), names_(std::move(columns)) {
  std::string_view header;
  if (!lines_.next(header)) {
    if (cut == CutLine::leave_out) return;
    throw data::input_error(
        path_, "header",
        "found an empty file, expected the names of the columns; grid --resume finds its lines again");
  }
  check_header(path_, fields_of(header), names_);
  next();
}

void Table::next() {
  row_.reset();
  std::string_view line;
  while (!row_ && lines_.next(line))
    if (!line.empty()) row_.emplace(names_, line, path_ + ":" + std::to_string(lines_.number()));
}

}  // namespace flash::sysid
