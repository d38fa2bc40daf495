#pragma once
#include <string>

namespace flash::fuzz {

/// Writes one sound file of every format that the loaders read, small ones, below `folder`: a folder a
/// fuzzer with its seeds (folder/ply/sheet.ply, ...), and in folder/recording what recording.json refers to.
void write_good_files(const std::string& folder);

}  // namespace flash::fuzz
