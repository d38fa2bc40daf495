#pragma once
#include <CLI/CLI.hpp>

namespace flash {

/// Checks of the values of options, for CLI::Option::check. Each refuses with 'found "-1", expected a whole
/// number from 1 to 1,024'; CLI11 puts the name of the option before it.
CLI::Validator whole_number(long low, long high);
CLI::Validator any_number();       ///< finite
CLI::Validator positive_number();  ///< finite and above 0
CLI::Validator number_from(double low);
CLI::Validator number_between(double low, double high);

/// Of --time-step: above 0, at most data::max_time_step [s].
CLI::Validator time_step();

/// Of --threads: 0 means one a processor.
CLI::Validator thread_number();

}  // namespace flash
