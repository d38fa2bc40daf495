#pragma once
#include <array>
#include <string>
#include <vector>

#include "sysid/emulate/results_store.h"
#include "sysid/report/overlay.h"
#include "sysid/report/summary.h"

namespace flash::sysid {

struct ReportSettings {
  std::array<std::string, 2> map_axes;  ///< parameters across and up in the score map; empty: the first two
  int max_cloud_points = 3000;          ///< shown a keyframe, evenly thinned
};

/// One HTML file that opens offline, with the plotting library inside: the answer, how sure it is, what is
/// not known and what to do next; the replay over the observation; score map, profiles, residuals, offsets,
/// solver check. Throws data::InputError when a map axis was not searched.
std::string render_report(const Summary& summary, const GridResults& results,
                          const std::vector<Overlay>& overlays, const ReportSettings& settings = {});

/// Renders to a file, atomically.
void write_report(const Summary& summary, const GridResults& results, const std::vector<Overlay>& overlays,
                  const ReportSettings& settings, const std::string& path);

}  // namespace flash::sysid
