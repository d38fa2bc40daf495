#pragma once
#include <cstddef>
#include <string>
#include <vector>

#include "data/motion/trajectory.h"

namespace flash::data {

/// "frame2" before "frame10": runs of digits count as numbers.
bool natural_less(const std::string& a, const std::string& b);

/// The files of a folder whose names end in one of `extensions`, in order of name: 2 before 10. May be empty.
/// Throws InputError where there is no such folder, and where such a name is of a folder, a pipe, a device or
/// a broken link: without it the files after it would be counted wrongly.
std::vector<std::string> files_in_order(const std::string& folder,
                                        const std::vector<std::string>& extensions);

/// Where numbered names show that frames are missing: the widest gap between two numbers that follow each
/// other, where it is more than one and a half times the median one; "no frame between A and B". Empty where
/// there is none, and where names have no number. Digits that may be of a clock are read as that too.
std::string gap_in_names(const std::vector<std::string>& files);

/// One time a frame [s], strictly increasing, from a CSV file with a column t or t_s. Throws InputError that
/// names the file.
std::vector<double> load_frame_times(const std::string& path, std::size_t frames);

/// Jumps that no robot makes, faster than 5 m/s, for people to read; at most one line. Empty where there are
/// none.
std::vector<std::string> find_jumps(const Trajectory& trajectory, const std::string& path);

}  // namespace flash::data
