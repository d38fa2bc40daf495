#include "data/files/text.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <limits>

namespace flash::data {

std::vector<std::string_view> split(std::string_view line, std::string_view separators) {
  const bool merges = separators.find(' ') != std::string_view::npos;
  std::vector<std::string_view> words;
  std::size_t begin = 0;
  while (begin <= line.size()) {
    const std::size_t end = std::min(line.find_first_of(separators, begin), line.size());
    if (end > begin || !merges) words.push_back(line.substr(begin, end - begin));
    begin = end + 1;
  }
  return words;
}

std::string_view take_word(std::string_view& rest) {
  const std::size_t begin = rest.find_first_not_of(" \t\r\n");
  if (begin == std::string_view::npos) return {};
  rest.remove_prefix(begin);
  const std::string_view found = rest.substr(0, rest.find_first_of(" \t\r\n"));
  rest.remove_prefix(found.size());
  return found;
}

namespace {
std::string_view without_plus(std::string_view word) {
  return word.size() > 1 && word[0] == '+' && word[1] != '-' ? word.substr(1) : word;
}
}  // namespace

std::optional<double> parse_number(std::string_view word) {
  word = without_plus(word);
  double value;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size()) return std::nullopt;
  return value;
}

std::optional<long> parse_integer(std::string_view word) {
  word = without_plus(word);
  long value;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size()) return std::nullopt;
  return value;
}

int to_index(double value) {
  return value >= 0 && value <= std::numeric_limits<int>::max() && value == std::floor(value)
             ? static_cast<int>(value)
             : -1;
}

std::string format_number(double value) {
  char buffer[32];
  const auto [end, error] = std::to_chars(buffer, buffer + sizeof buffer, value);
  return std::string(buffer, end);
}

std::string format_short(double value) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.4g", value);
  return buffer;
}

std::string format_clock(double seconds) {
  if (!(std::abs(seconds) < 1e12)) return format_short(seconds);
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.3f", seconds);
  std::string text = buffer;
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text == "-0" ? "0" : text;
}

std::string format_count(std::size_t count) {
  std::string text = std::to_string(count);
  for (int i = static_cast<int>(text.size()) - 3; i > 0; i -= 3)
    text.insert(static_cast<std::size_t>(i), ",");
  return text;
}

bool LineReader::next(std::string_view& line) {
  constexpr std::string_view mark = "\xef\xbb\xbf";  // spreadsheets put it before all
  if (number_ == 0 && rest_.starts_with(mark)) {
    rest_.remove_prefix(mark.size());
    offset_ = mark.size();
  }
  if (rest_.empty()) return false;
  const std::size_t end = rest_.find('\n');
  line = rest_.substr(0, end);
  const std::size_t used = end == std::string_view::npos ? rest_.size() : end + 1;
  rest_.remove_prefix(used);
  offset_ += used;
  ++number_;
  if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  return true;
}

std::string lower_extension(const std::string& path) {
  std::string extension = std::filesystem::path(path).extension().string();
  for (char& c : extension) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return extension;
}

}  // namespace flash::data
