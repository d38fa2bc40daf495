#pragma once
#include <string>

namespace flash::sim {

/// A time in seconds without the last digits that adding up steps leaves.
std::string time_text(double seconds);

/// In quotes where a comma, a quote or a line break would end it.
std::string csv_field(const std::string& text);

}  // namespace flash::sim
