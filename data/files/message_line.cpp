#include "data/files/message_line.h"

#include <algorithm>

namespace flash::data {
namespace {

bool goes_on_a_letter(char c) { return (static_cast<unsigned char>(c) & 0xc0) == 0x80; }  // UTF-8

/// Bytes of the letter that begins there, or 0 where it is none in UTF-8.
std::size_t letter_at(const std::string& text, std::size_t begin) {
  const auto first = static_cast<unsigned char>(text[begin]);
  const std::size_t length = first < 0x80                    ? 1
                             : first >= 0xc2 && first < 0xe0 ? 2
                             : first >= 0xe0 && first < 0xf0 ? 3
                             : first >= 0xf0 && first < 0xf5 ? 4
                                                             : 0;
  if (begin + length > text.size()) return 0;
  for (std::size_t i = 1; i < length; ++i)
    if (!goes_on_a_letter(text[begin + i])) return 0;
  return length;
}

/// The ends of the text, with no letter cut in two.
std::string without_middle(const std::string& text, std::size_t most) {
  if (text.size() <= most) return text;
  std::size_t first = 2 * most / 3, last = text.size() - most / 4;
  while (first > 0 && goes_on_a_letter(text[first])) --first;
  while (last < text.size() && goes_on_a_letter(text[last])) ++last;
  return text.substr(0, first) + "..." + text.substr(last);
}

}  // namespace

std::string message_line(const std::string& text) {
  constexpr std::size_t kLongestWord = 400, kLongestLine = 2000;
  std::string line;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find(' ', begin), text.size());
    line += without_middle(text.substr(begin, end - begin), kLongestWord);
    begin = end + 1;
    if (end < text.size()) line += ' ';
  }
  line = without_middle(line, kLongestLine);
  for (std::size_t i = 0; i < line.size();) {
    const std::size_t length = letter_at(line, i);
    if (length == 0 || static_cast<unsigned char>(line[i]) < ' ' || line[i] == '\x7f') line[i] = '?';
    i += std::max<std::size_t>(length, 1);
  }
  return line;
}

}  // namespace flash::data
