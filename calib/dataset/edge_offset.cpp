#include "calib/dataset/edge_offset.h"

#include <Eigen/Geometry>
#include <cmath>
#include <cstdio>

namespace flash::calib {

bool EdgeOffset::far_off() const {
  constexpr double kFar = 3;  // standard deviations
  return sd > 0 && std::abs(estimate) > kFar * std::hypot(sd, kUsualEdgeOffset);
}

Eigen::Matrix2Xd outward_motion(TargetKind kind, const Eigen::Matrix2Xd& pixels) {
  const bool has_edges = kind == TargetKind::aruco || kind == TargetKind::aruco_grid ||
                         kind == TargetKind::apriltag || kind == TargetKind::aprilgrid;
  if (!has_edges) return {};
  Eigen::Matrix2Xd motion(2, pixels.cols());
  for (Eigen::Index i = 0; i < pixels.cols(); ++i) {
    const Eigen::Index first = i - i % 4;
    const auto towards = [&](Eigen::Index corner) -> Eigen::Vector2d {
      return (pixels.col(first + corner % 4) - pixels.col(i)).normalized();
    };
    const Eigen::Vector2d a = towards(i + 1), b = towards(i + 3);
    motion.col(i) = -(a + b) / std::abs(a.x() * b.y() - a.y() * b.x());
  }
  return motion;
}

std::string describe(const EdgeOffset& edges) {
  char text[80];
  std::snprintf(text, sizeof text, "edges of the target stand %.3f +- %.3f px %s", std::abs(edges.estimate),
                edges.sd, edges.estimate < 0 ? "inwards" : "outwards");
  return text;
}

std::string edge_sentence(const EdgeOffset& edges) {
  return describe(edges) +
         ", more than a blurred picture makes: its brightness is not linear by far, or the size of the "
         "target's "
         "dark part is not as stated; the answer takes it into account, a chessboard does not have it";
}

}  // namespace flash::calib
