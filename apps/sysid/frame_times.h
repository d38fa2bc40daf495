#pragma once
#include <cstddef>
#include <string>
#include <vector>

namespace flash {

/// One time a frame [s], strictly increasing, from the text of --times: "rate:HZ", "rate:HZ:START" or a CSV
/// file with a column t or t_s. Throws data::InputError that names --times or the file, also where a rate is
/// given and the files' names show that frames are missing.
std::vector<double> frame_times(const std::string& times, const std::vector<std::string>& files);

}  // namespace flash
