#pragma once
#include <array>
#include <string>
#include <vector>

#include "data/mesh.h"
#include "sysid/grid_results.h"
#include "sysid/summary.h"

namespace flash::sysid {

/// One keyframe of the best candidate, simulation and observation in the same frame.
struct OverlayFrame {
  double t = 0;           ///< [s]
  data::Points vertices;  ///< simulated [m]
  data::Points cloud;     ///< observed, moved by the fitted offset into the frame of the simulation [m]
  double score = 0;       ///< [m]
};

/// A recording replayed with one set of parameters.
struct Overlay {
  std::string name;
  data::Triangles triangles;
  std::vector<OverlayFrame> frames;
};

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
