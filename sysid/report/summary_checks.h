#pragma once
#include <string>

#include "sysid/report/summary.h"

namespace flash::sysid {

/// Throws data::InputError naming the file and the field of a value that no search can find: no parameter or
/// beyond what is possible, an interval that the verdict asks for and that is missing, a number below zero.
void check_values(const Summary& summary, const std::string& path);

}  // namespace flash::sysid
