#pragma once

namespace flash::data {

// Points of chi-square: of six degrees of freedom it is below chi_square_95_of_6 with a chance of 95 %.
inline constexpr double chi_square_95_of_1 = 3.841459;
inline constexpr double chi_square_95_of_3 = 7.814728;
inline constexpr double chi_square_50_of_6 = 5.348121;
inline constexpr double chi_square_95_of_6 = 12.591587;
inline constexpr double chi_square_9875_of_6 =
    16.244520;  ///< 98.75 %: any of four is above it once in twenty
inline constexpr double chi_square_99_of_6 = 16.811894;
inline constexpr double chi_square_999_of_6 = 22.46;

}  // namespace flash::data
