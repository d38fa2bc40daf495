#pragma once
#include <string>

namespace flash::calib {

/// That of chi square beyond x (Abramowitz and Stegun 26.4.4 and 26.4.5).
double chance_beyond(double x, int degrees_of_freedom);

/// "1.3 %", "less than 0.0001 %".
std::string chance_text(double chance);

}  // namespace flash::calib
