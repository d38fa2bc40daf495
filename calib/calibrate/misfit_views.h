#pragma once
#include <string>

#include "calib/calibrate/calibrate.h"

namespace flash::calib {

/// Drops the view whose correction no longer looks like those of most views from `result` and `observations`;
/// false where there is none. surprise: CalibrateSettings::surprise. The median of few views is rough, and
/// near views tell more of their correction than far ones: see `readmit`.
bool drop_worst(Calibration& result, std::vector<Observation>& observations, double surprise);

/// Takes views back that were left out as misfits and belong to the rest after all: against the solution
/// without them. Each view that it leaves out has residuals that chance gives less than once in 200 such
/// recordings, views that were tried and the noise levels being estimates taken into account (F-test with six
/// numbers, Bonferroni). False where there is none.
bool readmit(Calibration& result, std::vector<Observation>& observations, const Eigen::Matrix3Xd& points,
             const BundleSettings& settings);

/// What it means that so many views do not fit: empty where they are few enough for slips, one in ten. Views
/// that are off by more than any arm errs (ArmNoise) show the target from other poses; the rest may be good
/// views, lost by an arm whose model is wrong.
std::string misfit_sentence(const ViewSelection& selection);

}  // namespace flash::calib
