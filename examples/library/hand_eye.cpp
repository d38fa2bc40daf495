#include <iostream>

#include "calib/calibrate/calibrate_pairs.h"
#include "calib/dataset/dataset.h"
#include "data/files/error.h"

// Where a camera is, from the poses of the robot and of what the camera sees: hand_eye samples.json
int main(int argc, char** argv) {
  using namespace flash;
  if (argc != 2) return 2;
  try {
    const calib::Dataset dataset = calib::load_dataset(argv[1]);
    const calib::Calibration result =
        calib::calibrate_pairs(calib::Setup::eye_to_hand, calib::pair_observations(dataset));
    std::cout << "base <- camera:\n" << result.poses.X.matrix() << '\n';
    std::cout << "one standard deviation [m, rad]: " << result.covariance.diagonal().cwiseSqrt().transpose()
              << '\n';
    for (const std::string& warning : result.warnings) std::cerr << warning << '\n';
    return result.usable ? 0 : 3;
  } catch (const data::InputError& error) {
    std::cerr << error.what() << '\n';
    return 2;
  }
}
