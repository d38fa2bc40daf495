#pragma once
#include <optional>
#include <string>

#include "data/recording/recording.h"
#include "sysid/replay/replay.h"
#include "sysid/report/summary.h"

namespace flash::sysid {

/// On which an answer simulates an object.
struct SearchedMesh {
  std::string mesh;       ///< specification or file; empty: the recording's own
  double cell_scale = 1;  ///< as in ReplaySettings
  std::string digest{};   ///< mesh_digest of a file as it was searched; empty: not known
};

/// A specification as it is; a file by its absolute path.
std::string named_mesh(const std::string& mesh);

/// That of a replay before its cells are scaled.
std::string named_mesh(const Replay& replay);

/// SHA-256 of the contents of a file; empty of a specification.
std::string mesh_digest(const std::string& mesh);

/// Throws data::InputError where `mesh` cannot be read, or its file is not what was searched. `source`,
/// `field`: what names it.
void expect_as_searched(const SearchedMesh& mesh, const std::string& source, const std::string& field);

/// What `settings` of a summary or an asset say of the scale; 1 where they do not. `source`: names the file.
/// Throws data::InputError where that is no number from 1/16 to 1.
double cell_scale_of(const std::optional<std::string>& text, const std::string& source);

/// The mesh on which the search in the folder `run` simulated `recording`, or else the first object as large
/// as its own. Throws data::InputError where there is none, or where its file has changed since.
SearchedMesh searched_mesh(const Summary& summary, const std::string& run, const data::Recording& recording);

}  // namespace flash::sysid
