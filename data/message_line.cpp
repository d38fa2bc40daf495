#include "data/message_line.h"

#include <algorithm>

namespace flash::data {
namespace {

bool goes_on_a_letter(char c) { return (static_cast<unsigned char>(c) & 0xc0) == 0x80; }  // UTF-8

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
  for (char& c : line)
    if (static_cast<unsigned char>(c) < ' ' || c == '\x7f') c = '?';
  return line;
}

}  // namespace flash::data
