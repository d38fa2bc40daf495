#pragma once
#include <optional>
#include <string>

#include "calib/dataset/target_shape.h"
#include "calib/solve/bundle_adjustment.h"
#include "calib/solve/lens_prior.h"

namespace flash::calib {

/// What is known of a lens before a picture is taken.
enum class LensKnowledge {
  stated,  ///< it is what is stated, to the last digit
  near,    ///< it is near to what is stated: by the covariance that is stated, else as lenses usually are
  unknown  ///< nothing
};

/// A lens that was solved for.
struct LensEstimate {
  IntrinsicsVector stated = IntrinsicsVector::Zero(), estimate = stated, sd = stated;
  std::vector<int> far_off;  ///< unknowns that are not what was stated, by three deviations of both together
  Vector6d camera_shift = Vector6d::Zero();  ///< of the camera, were the lens as stated; (dt, dtheta)
};

/// fx, fy, cx, cy, k1, k2, p1, p2, k3.
const char* lens_unknown(int i);

/// Whether a motion of the camera at X exceeds its deviation along or about an axis of its parent.
bool exceeds_deviations(const Eigen::Isometry3d& X, const Vector6d& motion, const Matrix6d& covariance);

/// covariance: of all shared unknowns.
LensEstimate lens_estimate(const Bundle& bundle, const Unknowns& unknowns, const Eigen::MatrixXd& covariance,
                           std::size_t camera = 0);

/// "the lens is not as stated: fx 582.1 +- 1.2, stated 611.0; ...", of a lens that is far off.
std::string lens_differs(const LensEstimate& lens);

/// The same, and what follows for the answer.
std::string lens_sentence(const LensEstimate& lens);

WarpEstimate warp_estimate(const Bundle& bundle, const Unknowns& unknowns, const Eigen::MatrixXd& covariance,
                           std::size_t target = 0);

/// Of a camera that sees corners of edges; none of another.
std::optional<EdgeOffset> edge_estimate(const Bundle& bundle, const Unknowns& unknowns,
                                        const Eigen::MatrixXd& covariance, std::size_t camera = 0);

}  // namespace flash::calib
