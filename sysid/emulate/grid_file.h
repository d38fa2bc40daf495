#pragma once
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "sysid/emulate/parameter_grid.h"

namespace flash::sysid {

/// What decides the results of a search, by name; see sysid/emulate/fingerprint.h.
using Fingerprint = std::map<std::string, std::string>;

/// grid.json of a search: what its folder holds the results of.
struct GridFile {
  std::vector<Axis> axes;
  std::vector<std::string> recordings;     ///< names
  std::optional<Fingerprint> fingerprint;  ///< of inputs and settings; earlier programs wrote none
};

/// SHA-256 of all that grid.json says: what a search is told from others by.
std::string search_digest(const GridFile& grid);

void save_grid_file(const GridFile& grid, const std::string& path);

/// Throws data::InputError naming the file and what it lacks.
GridFile load_grid_file(const std::string& path);

/// Folders of the shares of a search beside the first, shards/NUMBER, as far as they are there.
std::vector<std::string> share_folders(const std::string& folder);

/// The grid.json of a search and those of its shares (sysid/replay/shard.h), as far as they are there.
std::vector<std::string> grid_files(const std::string& folder);

}  // namespace flash::sysid
