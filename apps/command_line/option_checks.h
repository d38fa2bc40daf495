#pragma once
#include <CLI/CLI.hpp>
#include <cstddef>
#include <string>
#include <vector>

namespace flash {

/// Checks of the values of options, for CLI::Option::check. Each refuses with 'found "-1", expected a whole
/// number from 1 to 1,024'; CLI11 puts the name of the option before it.
CLI::Validator whole_number(long low, long high);
CLI::Validator any_number();       ///< finite
CLI::Validator positive_number();  ///< finite and above 0
CLI::Validator number_from(double low);
CLI::Validator number_between(double low, double high);

/// Of --time-step: from data::min_time_step to data::max_time_step [s].
CLI::Validator time_step();

/// A point or a vector "x,y,z": the one way to write three numbers.
CLI::Option* add_vector_option(CLI::App& verb, const std::string& name, std::vector<double>& value,
                               const std::string& meaning);

/// Values with commas between them, each of which `check` takes; `count` of them, 0: any number. None is
/// empty: CLI11's own delimiter would leave such out without a word. None is given twice.
CLI::Option* add_list_option(CLI::App& verb, const std::string& name, std::vector<std::string>& values,
                             const std::string& meaning, const CLI::Validator& check = {},
                             std::size_t count = 0);
/// The same of whole numbers, to which `check` has to keep.
CLI::Option* add_list_option(CLI::App& verb, const std::string& name, std::vector<int>& values,
                             const std::string& meaning, const CLI::Validator& check);

/// Throws data::InputError where two of the words are alike, or lead to the same file or folder: what is
/// given twice would count twice.
void expect_each_once(const std::string& name, const std::vector<std::string>& words);

/// Throws data::InputError where a file has an ending, and none of `endings`, as ".json": what is written is
/// of these kinds alone. Of a file that is not asked for, or without an ending, nothing is said.
void expect_ending(const std::string& name, const std::string& file, const std::vector<std::string>& endings);

/// Of --threads: 0 means one a processor.
CLI::Validator thread_number();

/// Of --device where no device does the work: auto or cpu. `why` goes into the refusal, as "scenes run on the
/// CPU alone".
CLI::Validator cpu_alone(const std::string& why);

}  // namespace flash
