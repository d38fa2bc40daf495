#pragma once
#include <string>

namespace flash::python {

/// A line in which options of the programs are arguments of functions: "--time-step: found ..." becomes
/// "time_step: found ...", "--hold bending" and "--bending" become "bending". Other options stay.
std::string as_arguments(std::string line);

}  // namespace flash::python
