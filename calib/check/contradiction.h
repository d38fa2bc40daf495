#pragma once
#include <string>

#include "calib/calibrate/extrinsics.h"
#include "calib/check/projection_check.h"

namespace flash::calib {

/// How far views that took no part may lie from where a calibration puts them: rms of the target's middle
/// [mm] and of its orientation [deg]. distance: of the target [m].
struct StatedError {
  double mm = 0, deg = 0;
};

/// Of independent parts: what the calibration found on views that it left out, and its own covariance at the
/// target. A file that does not say the first is taken to be of an arm in use: 2 mm and 0.2 deg.
StatedError stated_error(const Extrinsics& extrinsics, double distance);

/// What recorded views say against a calibration.
struct Contradiction {
  double ratio = 0;      ///< of their rms to the stated error, the larger of mm and deg
  std::string sentence;  ///< empty where there is nothing to say
};

/// Views contradict a calibration that they miss by three times the stated error: noise does so in less than
/// one of 1,000 recordings of four views. Then the target, in its own or another size, the camera or both are
/// put where these views want them, to say what has moved or is of another size. observations: with poses of
/// a target of that shape through that lens. poses: X, and Z as it is validated; `target_is_refitted`: from
/// these views.
Contradiction contradiction(const Extrinsics& extrinsics, const HandEyePoses& poses, bool target_is_refitted,
                            const data::CameraIntrinsics& lens, const Target& target,
                            const std::vector<Observation>& observations, const ProjectionCheck& check);

}  // namespace flash::calib
