#pragma once
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "calib/dataset/dataset.h"

namespace flash::calib {

/// Size and time of a file: while both stay, it holds what it held.
struct FileStamp {
  std::uintmax_t size = 0;
  std::filesystem::file_time_type time = {};
  bool operator==(const FileStamp&) const = default;
};

/// Of a file that is not there: nothing.
FileStamp stamp_of(const std::string& path);

/// A dataset that is still recorded. What is not there yet, or not whole, is waited for.
struct GrowingSet {
  Dataset pictures = {};  ///< a frame for each picture that is there, of no pose
  Dataset posed = {};     ///< of the pictures whose pose is known, as poses were last read
  /// What is waited for, or stands in the way, a sentence each.
  std::vector<std::string> waiting = {};
  bool unfinished = false;  ///< a list of poses lacks the end of its last line: read again soon
};

/// Files below the folder, two folders deep, and those that `options` names: what a change is seen by.
std::map<std::string, FileStamp> files_of(const std::string& folder, const DatasetOptions& options);

/// Reads the folder anew. Poses whose file lacks the end of its last line are read `settled` seconds after
/// its last change: before, and where they cannot be read, those of the last call stay. Throws
/// data::InputError where there is no such folder.
void read_growing(const std::string& folder, const DatasetOptions& options, double settled, GrowingSet& set);

}  // namespace flash::calib
