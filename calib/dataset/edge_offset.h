#pragma once
#include <Eigen/Core>
#include <string>

#include "calib/dataset/target.h"

namespace flash::calib {

/// By how much the edges of dark marks stand outwards in a camera's pictures [px]. A lens blurs light;
/// pictures keep a power of it (gamma, 1/2.2 as a rule), so the bright side of an edge reaches over it by a
/// share of the blur. All edges move by the same, whatever the distance: corners of markers and tags move
/// with them, the crossings of a chessboard, where dark meets dark, do not, nor do centres of dots.
struct EdgeOffset {
  double estimate = 0, sd = 0;

  /// More than pictures usually have, by three deviations of both together.
  bool far_off() const;
};

/// Its usual size [px], about zero. An edge from 5 to 90 % of light, halfway between both after a power of
/// 1/2.2, lies at 33 % of the step: 0.44 of the blur's sigma inwards. Sharp pictures have 0.5 to 0.7 px of
/// blur, linear ones nothing, and a print's ink runs outwards by as much.
constexpr double kUsualEdgeOffset = 0.25;

/// By how much what is seen of a target moves per pixel by which edges stand outwards, 2 x N; empty of
/// targets without corners of edges. A corner whose edges leave it along the unit vectors a and b of the
/// picture moves by
/// -(a + b) / |a x b|: so both its edges move outwards by one. pixels: of all points in order, four to a
/// marker.
Eigen::Matrix2Xd outward_motion(TargetKind kind, const Eigen::Matrix2Xd& pixels);

/// "edges of the target stand 0.21 +- 0.03 px inwards".
std::string describe(const EdgeOffset& edges);
std::string edge_sentence(const EdgeOffset& edges);

}  // namespace flash::calib
