#pragma once
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace flash::data {

/// Whether a file is on the disk once it is written, or when the system takes it there: a power cut before
/// may leave anything of it.
enum class Sync { now, later };

/// Writes `contents` to a temporary file beside `path`, syncs it and renames it: readers see the old file or
/// the new one, never half. Missing folders are made. Throws std::system_error naming the path, and
/// InputError where a device, a pipe or a socket is there.
void write_atomically(const std::string& path, std::string_view contents, Sync sync = Sync::now);

/// A file that is to be.
struct FileText {
  std::string path, text;
};

/// Several files likewise, those without a path left out: none of them where the disk does not hold all.
void write_together(const std::vector<FileText>& files);

/// Removes from `folder` the temporary files of writers that were killed. Only while nobody writes there, but
/// to the folders in it that are `spared`, by their names.
void remove_leftovers(const std::string& folder, const std::set<std::string>& spared = {});

/// Where others may write to `folder` too, and it may hold other things: removes those temporary files of
/// files with this extension, as ".rollout", that nothing was written to for a day. No writer takes as long.
void remove_old_leftovers(const std::string& folder, const std::string& extension);

/// The whole file as bytes. Throws InputError naming the path: a device or a pipe, which may never end, is no
/// input, and neither is a file above 1 GB.
std::string read_file(const std::string& path);

/// `path` itself if absolute, else relative to the folder of `referring_file`, the file that names it.
std::string resolve_path(const std::string& path, const std::string& referring_file);

/// The inverse: how `referring_file` names `path`, relative where both have a common root.
std::string relative_path(const std::string& path, const std::string& referring_file);

}  // namespace flash::data
