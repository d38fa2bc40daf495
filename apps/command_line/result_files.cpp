#include "apps/command_line/result_files.h"

#include <sys/stat.h>

#include <map>
#include <optional>
#include <utility>

#include "apps/command_line/input_files.h"
#include "data/files/error.h"

namespace flash {
namespace {

using Identity = std::pair<dev_t, ino_t>;

/// What a file is, by whatever path it is reached; none where nothing is there.
std::optional<Identity> identity_of(const std::string& path) {
  struct stat status = {};
  if (::stat(whole_path(path).c_str(), &status) != 0) return std::nullopt;
  return Identity(status.st_dev, status.st_ino);
}

}  // namespace

void expect_own_files(const std::vector<std::string>& written, const std::vector<std::string>& read,
                      Replaced replaced) {
  std::map<Identity, std::string> inputs;
  for (const std::string& path : read)
    if (const std::optional<Identity> identity = identity_of(path)) inputs.emplace(*identity, path);
  std::map<std::string, std::string> outputs;
  std::map<Identity, std::string> existing;
  for (const std::string& path : written) {
    if (path.empty()) continue;
    const std::optional<Identity> identity = identity_of(path);
    if (!outputs.emplace(whole_path(path), path).second ||
        (identity && !existing.emplace(*identity, path).second))
      throw data::InputError(path + ": named twice, each result needs a file of its own");
    const auto input = identity ? inputs.find(*identity) : inputs.end();
    if (input != inputs.end())
      throw data::InputError(path + ": is read by this run" +
                             (input->second == path ? "" : ", as " + input->second) +
                             "; expected another file for the result");
    if (replaced == Replaced::anything) continue;
    const std::string there = input_there(path);
    if (!there.empty() && !(replaced == Replaced::assets && there == kIsAsset))
      throw data::InputError(path + ": " + there + ", expected another file for the result");
  }
}

void expect_folder_apart(const std::string& folder, const std::vector<std::string>& read) {
  if (folder.empty()) return;
  std::string within = whole_path(folder);
  if (!within.ends_with('/')) within += '/';
  for (const std::string& path : read)
    if (whole_path(path).starts_with(within))
      throw data::InputError(folder + ": holds " + path +
                             ", which is read by this run; expected another folder for the result");
}

}  // namespace flash
