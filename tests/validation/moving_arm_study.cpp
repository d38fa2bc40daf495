// Whether hand-eye calibration finds how far the clocks of camera and robot are apart while the arm moves,
// and whether the camera's pose is then where it says: drawn recordings, pictures blurred by their exposure,
// 30 ms later than their names say.
//   moving_arm_study [RUNS [FIRST_SEED]]
// RUNS of each exposure and setup. The truth is that of the renderer.
#include <unistd.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>

#include "calib/calibrate/calibrate_images.h"
#include "calib/detect/detect.h"
#include "data/files/error.h"
#include "tests/calib/rendered_set.h"

namespace flash::calib {
namespace {

constexpr double kOffset = 0.03;         // [s]
constexpr double kNear = 0.002;          // that is close enough [s]
constexpr double kChiSquare95 = 12.592;  // six degrees of freedom

struct Tally {
  int runs = 0, found = 0, near = 0, inside = 0, offset_inside = 0;
  double squares = 0;      // of the offset's error over its deviation
  double worst = 0;        // offset [s]
  double millimetres = 0;  // error of X, squared
};

/// What one recording says; false where nothing was determined.
void run(Setup setup, double exposure, unsigned seed, Tally& tally) {
  const std::string folder =
      (std::filesystem::temp_directory_path() / ("moving_arm_study_" + std::to_string(getpid()))).string();
  std::filesystem::remove_all(folder);
  RenderedSetSettings drawn{.setup = setup, .views = 20};
  drawn.width = 640;
  drawn.height = 480;
  drawn.robot_deg = 0.02;
  drawn.robot_mm = 0.2;
  drawn.seed = seed;
  drawn.motion = RobotMotion::stream;
  drawn.time_offset = kOffset;
  drawn.exposure = exposure;
  const HandEyePoses truth = write_rendered_set(drawn, folder);
  ++tally.runs;
  const Dataset dataset = load_dataset(folder);
  const Target target = parse_target(dataset.target);
  try {
    const std::vector<Detection> detections = detect(dataset, target);
    const ImageCalibration result =
        calibrate_images(*dataset.setup, dataset, target, detections, std::nullopt);
    const Calibration& found = result.calibration;
    const double error = result.time_offset->estimate - kOffset, sd = result.time_offset->sd;
    const Vector6d away = motion_between(found.poses.X, truth.X);
    const double chi_square = away.dot(found.covariance.ldlt().solve(away));
    ++tally.found;
    tally.near += std::abs(error) <= kNear;
    tally.offset_inside += std::abs(error) <= 1.96 * sd;
    tally.inside += chi_square <= kChiSquare95;
    tally.squares += error * error / (sd * sd);
    tally.worst = std::max(tally.worst, std::abs(error));
    tally.millimetres += 1e6 * away.head<3>().squaredNorm();
    std::printf(
        "  seed %u: %zu views, %+.2f +- %.2f ms, X off by %.2f mm, %.3f deg, chi-square %.1f, corners %.3f "
        "px\n",
        seed, found.used.size(), 1e3 * error, 1e3 * sd, 1e3 * away.head<3>().norm(),
        away.tail<3>().norm() * 180 / M_PI, chi_square, found.corner_rms);
    for (const std::string& warning : found.warnings) std::printf("    %s\n", warning.c_str());
  } catch (const data::InputError& refusal) {
    std::printf("  seed %u: %s\n", seed, refusal.what());
  }
  std::fflush(stdout);
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace flash::calib

int main(int argc, char** argv) {
  using namespace flash::calib;
  const int runs = argc > 1 ? std::atoi(argv[1]) : 10;
  const unsigned first = argc > 2 ? static_cast<unsigned>(std::atoi(argv[2])) : 6000001;
  std::map<std::pair<double, Setup>, Tally> tallies;
  for (const double exposure : {0.0, 0.02, 0.06})
    for (const Setup setup : {Setup::eye_in_hand, Setup::eye_to_hand}) {
      std::printf("%s, exposure %.0f ms\n", to_string(setup), 1e3 * exposure);
      for (int k = 0; k < runs; ++k)
        run(setup, exposure, first + static_cast<unsigned>(k), tallies[{exposure, setup}]);
    }
  std::printf(
      "\n| exposure [ms] | setup | found | offset to 2 ms | offset inside 95 %% | X inside 95 %% | worst "
      "offset [ms] | X off, rms [mm] |\n"
      "|---|---|---|---|---|---|---|---|\n");
  for (const auto& [key, tally] : tallies)
    std::printf("| %.0f | %s | %d of %d | %d | %d | %d | %.2f | %.2f |\n", 1e3 * key.first,
                to_string(key.second), tally.found, tally.runs, tally.near, tally.offset_inside, tally.inside,
                1e3 * tally.worst, std::sqrt(tally.millimetres / std::max(1, tally.found)));
}
