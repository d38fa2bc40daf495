#pragma once
#include <string>

namespace flash::calib {

/// The page of a recording, one HTML file without anything from outside: it asks its own address for
/// /state?after=N and /picture.
std::string watch_page(const std::string& folder);

}  // namespace flash::calib
