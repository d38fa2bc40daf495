#include "sim/named.h"

#include <algorithm>

#include "data/files/error.h"

namespace flash::sim {

std::string listed(const std::vector<std::string>& names) {
  std::string list;
  for (const std::string& name : names) list += (list.empty() ? "" : ", ") + name;
  return list.empty() ? "no name, as there is none" : "one of " + list;
}

std::size_t number_of(const std::string& what, const std::string& name,
                      const std::vector<std::string>& names) {
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end())
    throw data::InputError(what + ": found \"" + name + "\", expected " + listed(names));
  return static_cast<std::size_t>(found - names.begin());
}

}  // namespace flash::sim
