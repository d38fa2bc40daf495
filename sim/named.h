#pragma once
#include <cstddef>
#include <string>
#include <vector>

namespace flash::sim {

/// "one of a, b"; of no names that there is none.
std::string listed(const std::vector<std::string>& names);

/// Number of what has a name among those that are there. Throws data::InputError, which begins with `what`.
std::size_t number_of(const std::string& what, const std::string& name,
                      const std::vector<std::string>& names);

template <class Things>
std::vector<std::string> names_of(const Things& things) {
  std::vector<std::string> names;
  for (const auto& thing : things) names.push_back(thing.name);
  return names;
}

}  // namespace flash::sim
