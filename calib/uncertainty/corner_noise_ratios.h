#pragma once
#include <vector>

#include "calib/solve/bundle.h"

namespace flash::calib {

/// Noise of the corners of each pose's views over that of most, from their residuals with the pose's own
/// correction, as blurred pictures have more. The logarithms of the variances scatter by what as few corners
/// make of one variance, by 2 / n for n degrees of freedom; what they scatter beyond that is taken for
/// differences between views, and each is drawn to their mean by its share of both (empirical Bayes: Efron
/// and Morris 1973, on logarithms). Where nothing is beyond, all are 1. Bundle::views may have such ratios
/// already.
std::vector<double> corner_noise_ratios(const Bundle& bundle);

}  // namespace flash::calib
