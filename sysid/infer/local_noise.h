#pragma once
#include <Eigen/Core>

#include "sysid/infer/discrepancy.h"

namespace flash::sysid {

/// Standard deviation of the noise of residuals [m] by what neighbours on the sheet differ in, whatever the
/// model misses of both: of the differences to the nearest row of the same keyframe and channel the median,
/// over that of a normal distribution of unit noise (Rice 1984). Zero where no keyframe has neighbours.
double noise_between_neighbours(const ObservedRows& rows, const Eigen::VectorXd& residuals, int threads = 1);

}  // namespace flash::sysid
