#include "data/staged_folder.h"

#include <unistd.h>

#include <filesystem>
#include <regex>
#include <vector>

namespace flash::data {
namespace {

namespace fs = std::filesystem;

/// Frames of an earlier, longer recording would follow those of this one.
void remove_numbered_frames(const fs::path& folder) {
  static const std::regex name(R"(\d{6}\.(ply|png))");
  std::vector<fs::path> old;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.is_regular_file() && std::regex_match(entry.path().filename().string(), name))
      old.push_back(entry.path());
  for (const fs::path& path : old) fs::remove(path);
}

std::vector<fs::path> names_in(const fs::path& folder) {
  std::vector<fs::path> names;
  for (const auto& entry : fs::directory_iterator(folder)) names.push_back(entry.path().filename());
  return names;
}

void move_over(const fs::path& from, const fs::path& to) {
  if (!fs::is_directory(from) || !fs::is_directory(to)) return fs::rename(from, to);
  remove_numbered_frames(to);
  for (const fs::path& name : names_in(from)) move_over(from / name, to / name);
}

}  // namespace

StagedFolder::StagedFolder(const std::string& path) {
  fs::path place = fs::weakly_canonical(fs::absolute(path));
  if (!place.has_filename()) place = place.parent_path();  // "lift/"
  const std::string name = '.' + std::to_string(::getpid()) + "-0.tmp";
  final_ = place.string();
  staged_ = fs::exists(place) ? (place / name).string() : final_ + name;
  for (fs::path parent = place.parent_path(); !fs::exists(parent); parent = parent.parent_path())
    made_ = parent.string();
}

StagedFolder::~StagedFolder() {
  std::error_code ignored;
  fs::remove_all(staged_, ignored);
  // Folders on the way that are still empty: nothing was published.
  for (fs::path parent = fs::path(final_).parent_path();
       !made_.empty() && fs::remove(parent, ignored) && parent != made_;)
    parent = parent.parent_path();
}

void StagedFolder::publish(const std::string& last) {
  const fs::path from = staged_, to = final_;
  if (!fs::exists(to)) return fs::rename(from, to);
  fs::remove(to / last);
  for (const fs::path& name : names_in(from))
    if (name != last) move_over(from / name, to / name);
  fs::rename(from / last, to / last);
}

}  // namespace flash::data
