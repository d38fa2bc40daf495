#include "data/picture/html_page.h"

#include <algorithm>
#include <cstdint>

namespace flash::data {

std::string fill_page(std::string_view page,
                      const std::vector<std::pair<std::string_view, std::string_view>>& values) {
  std::string filled;
  for (const auto& [key, value] : values) {
    const std::size_t at = page.find(key);
    filled.append(page.substr(0, at)).append(value);
    page.remove_prefix(at + key.size());
  }
  return filled.append(page);
}

std::string inside_script(std::string json) {
  // In JSON it stands in strings alone. "</" ends a script, "<!--" hides its end.
  constexpr std::string_view kEscaped = "\\u003c";
  for (std::size_t at = json.find('<'); at != std::string::npos; at = json.find('<', at + kEscaped.size()))
    json.replace(at, 1, kEscaped);
  return json;
}

std::string base64(std::string_view bytes) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k)
      group = group << 8 | (k < count ? static_cast<unsigned char>(bytes[i + k]) : 0U);
    for (std::size_t k = 0; k < 4; ++k)
      text.push_back(k <= count ? kDigits[group >> (18 - 6 * k) & 63] : '=');
  }
  return text;
}

}  // namespace flash::data
