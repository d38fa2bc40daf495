#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace flash::data {

/// Words between separators; with a space among them, runs count as one.
std::vector<std::string_view> split(std::string_view line, std::string_view separators = " \t\r");

/// The whole word as a number, independent of the locale ("1E+10", "+1.5", "nan", "inf"); empty if it is
/// none.
std::optional<double> parse_number(std::string_view word);
std::optional<long> parse_integer(std::string_view word);

/// The value as an index; -1 where it is negative, no whole number, or too large.
int to_index(double value);

/// Shortest text that reads back as the same double.
std::string format_number(double value);

/// Text that a person reads: four significant digits.
std::string format_short(double value);

/// A time in seconds that a person reads, to the millisecond: "0.033", "1764000000.04".
std::string format_clock(double seconds);

/// "2,113".
std::string format_count(std::size_t count);

/// The next word of a text, between blanks and ends of lines, which is taken off it; empty at the end.
std::string_view take_word(std::string_view& rest);

/// Lines of a text, by number from 1, without a trailing carriage return or a byte order mark before all.
class LineReader {
 public:
  explicit LineReader(std::string_view text) : rest_(text) {}
  bool next(std::string_view& line);
  int number() const { return number_; }
  std::size_t offset() const { return offset_; }  ///< of the first byte after the last line read

 private:
  std::string_view rest_;
  int number_ = 0;
  std::size_t offset_ = 0;
};

/// Ending of a file name in lower case, with its dot.
std::string lower_extension(const std::string& path);

}  // namespace flash::data
