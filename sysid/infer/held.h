#pragma once
#include <array>
#include <string>
#include <vector>

#include "sysid/emulate/grid_search.h"

namespace flash::sysid {

/// What moves the cloth and was neither searched nor measured, one standard deviation to both sides.
struct HeldParameter {
  std::string name;
  double at;                     ///< what the search holds it at, in the parameter's unit
  std::array<double, 2> values;  ///< low, high
  bool shared = true;            ///< one value for all recordings

  /// A part of the way from `at` to the low or the high value: by a factor where both are a factor away.
  double nearer(std::size_t side, double share) const;
};

/// What was stated with a standard deviation. Friction within a factor of 2 of the value that the search
/// holds it at: it competes with bending where a sheet is lifted off a table. So are stretching and bending
/// of a sheet of which the other is searched: a soft sheet is moved by both. The weight within 10 %:
/// stiffnesses are known as ratios to it. The bounds of a recording on start yaw and table height, over
/// sqrt(3), where it has any. Of a pinch its pitch, and its direction where the recording does not give one,
/// within 0.2 rad: fingers fold what they find. The other properties of the asset, the shape
/// of the grasp and what was fixed count as known. Of a clamped patch at a corner the size is known within
/// 3 mm, and its pads may give way, as soft ones do, or hardly.
/// `at`: values of the axes, for what follows these (bending of a plate of which young is searched).
std::vector<HeldParameter> held_parameters(const GridSettings& grid, const std::vector<Replay>& replays,
                                           const std::vector<double>& at);

/// At the first values of the axes.
std::vector<HeldParameter> held_parameters(const GridSettings& grid, const std::vector<Replay>& replays);

/// The candidate at `values`, with one parameter at another value than the search holds it at.
ReplayCandidate candidate_with(const std::vector<double>& values, const GridSettings& grid,
                               const std::string& name, double value);

}  // namespace flash::sysid
