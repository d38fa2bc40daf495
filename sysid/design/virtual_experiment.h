#pragma once
#include <array>
#include <optional>
#include <string>

#include "sysid/replay/replay.h"

namespace flash::sysid {

/// Experiments that no recording is needed for, in the words of synthesize.
inline constexpr std::array<const char*, 5> virtual_experiments = {"corner_lift", "hang", "bar_pull",
                                                                   "bias_pull", "drag"};

/// What the longest of them takes [s]. Work: for the check of a step.
inline constexpr double longest_virtual_experiment = 3.0;

struct VirtualExperimentSettings {
  sim::SolverSettings solver;
  int threads = 1;                                 ///< of the replay
  unsigned seed = 1;                               ///< of what is recorded
  bool clamp_slopes = false;                       ///< the grasped patch does not bend
  std::optional<sim::SelfContact> self_contact{};  ///< as in ReplaySettings
};

/// The experiment `kind` with the sheet of the recording `like`, simulated and seen by two cameras without
/// noise, as a recording made ready; forces are recorded where the sheet is pulled. Registration is as
/// unknown as that of `like`. Its files stand in a folder of their own and are gone afterwards. Throws
/// data::InputError on an unknown kind, std::system_error where there is no place for the folder.
Replay virtual_experiment(const std::string& kind, const data::Recording& like,
                          const data::SheetMaterial& material, const VirtualExperimentSettings& settings);

}  // namespace flash::sysid
