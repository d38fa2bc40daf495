#pragma once
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace flash::data {

/// A page with each key (as "@DATA@") replaced once by its value; keys in the order in which they stand.
std::string fill_page(std::string_view page,
                      const std::vector<std::pair<std::string_view, std::string_view>>& values);

/// JSON as it may stand in a script element, which only "</" could end: written as "<\/".
std::string inside_script(std::string json);

/// RFC 4648, for pictures inside of a page.
std::string base64(std::string_view bytes);

}  // namespace flash::data
