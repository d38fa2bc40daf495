#pragma once
#include <optional>
#include <string>
#include <vector>

#include "data/asset/asset.h"
#include "sysid/report/searched_mesh.h"

namespace flash::sysid {

/// What a tuned asset says of a recording that it was identified from.
struct IdentifiedRecording {
  std::optional<double> horizon_s;      ///< keyframes from here on carried no weight [s]
  std::optional<double> score;          ///< of the estimate on the mesh that was searched [m]
  std::optional<double> grasp_size;     ///< that the estimate has [m]
  SearchedMesh mesh{};                  ///< on which the answer was simulated
  std::vector<std::string> not_told{};  ///< searched parameters of which the asset has not the estimate
};

/// `sha256`: of the recording (data::recording_sha256). Empty where the asset was not identified from it.
/// Throws data::InputError where the scale of its cells is none.
std::optional<IdentifiedRecording> identified_recording(const data::Asset& asset, const std::string& sha256);

/// Why a score is not that of the search, in a line; empty where both are one, up to rounding, or the
/// search's is not known.
std::string unlike_its_score(const IdentifiedRecording& recording, double score);

}  // namespace flash::sysid
