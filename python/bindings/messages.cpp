#include "python/bindings/messages.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <string_view>

#include "sysid/emulate/parameter.h"

namespace flash::python {
namespace {

/// Of functions of the module that have such an argument.
constexpr std::array<std::string_view, 14> kArguments = {
    "device",         "mesh",         "time_step",  "iterations",   "tolerance",
    "grasp_shape",    "grasp_within", "grasp_cell", "clamp_slopes", "self_contact",
    "layer_friction", "distance",     "asset",      "two_sided"};

bool is_argument(const std::string& name) {
  return std::find(kArguments.begin(), kArguments.end(), name) != kArguments.end() ||
         sysid::find_parameter(name) != nullptr;
}

}  // namespace

std::string as_arguments(std::string line) {
  const std::string dashes = "--", hold = "--hold ";
  for (std::size_t at = line.find(hold); at != std::string::npos; at = line.find(hold, at))
    line.erase(at, hold.size());
  for (std::size_t at = line.find(dashes); at != std::string::npos; at = line.find(dashes, at)) {
    std::size_t end = at + dashes.size();
    while (end < line.size() && (std::islower(static_cast<unsigned char>(line[end])) || line[end] == '-'))
      ++end;
    std::string name = line.substr(at + dashes.size(), end - at - dashes.size());
    std::replace(name.begin(), name.end(), '-', '_');
    if (is_argument(name)) line.replace(at, end - at, name);
    at += dashes.size();
  }
  return line;
}

}  // namespace flash::python
