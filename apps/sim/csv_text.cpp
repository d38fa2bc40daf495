#include "apps/sim/csv_text.h"

#include <cstdio>

namespace flash::sim {

std::string time_text(double seconds) {
  char text[32];
  std::snprintf(text, sizeof text, "%.12g", seconds);
  return text;
}

std::string csv_field(const std::string& text) {
  if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + "\"";
}

}  // namespace flash::sim
