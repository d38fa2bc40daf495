#pragma once
#include <Eigen/Geometry>
#include <vector>

#include "data/mesh/mesh.h"
#include "data/picture/picture.h"
#include "sysid/report/overlay.h"

namespace flash::sysid {

struct OverlayImageSettings {
  int panel_width = 640;      ///< of each of the two views [px]
  int panel_height = 520;     ///< [px]
  double elevation = 0.2;     ///< the eye stands this high above the horizon [rad]
  double point_radius = 1.3;  ///< of an observed point [px]
  double tolerance = 0.004;   ///< points deeper than this behind the surface are drawn pale [m]
};

/// Simulated surface (red, shaded) under the observed cloud (blue), seen from the side (x to the right) and
/// from the front (y to the right), z up, side by side. `bounds` [m] decides the frame: the same for all
/// pictures of a motion keeps them comparable. The bar in the corner is 100 mm long.
data::Picture draw_overlay(const data::TriangleMesh& simulated, const data::Points& observed,
                           const Eigen::AlignedBox3d& bounds, const OverlayImageSettings& settings = {});

/// Of what is simulated and observed in frames of an overlay, named by their index.
Eigen::AlignedBox3d bounds_of(const Overlay& overlay, const std::vector<int>& frames);

/// Small pictures side by side, a column a frame: from the side above, from the front below.
data::Picture draw_sequence(const Overlay& overlay, const std::vector<int>& frames,
                            const Eigen::AlignedBox3d& bounds);

}  // namespace flash::sysid
