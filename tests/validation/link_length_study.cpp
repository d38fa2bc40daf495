// Whether zeros of joints and lengths of links are found, and intervals hold, over seeded recordings of a
// simulated UR5 whose zeros are off by 0.1 deg and whose lengths by as much as told (one standard deviation).
//   link_length_study [RECORDINGS [FIRST_SEED]]
#include <Eigen/Cholesky>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "calib/calibrate/calibrate.h"
#include "calib/uncertainty/joint_errors.h"
#include "data/files/text.h"
#include "data/machine/parallel.h"
#include "tests/calib/joint_scene.h"

namespace flash::calib {
namespace {

struct Kind {
  double off;    ///< of each length [m]
  double prior;  ///< as it is said to be; 0: links are taken as described [m]
};
constexpr Kind kKinds[] = {{0, 0}, {0, 0.5e-3}, {0.3e-3, 0}, {0.3e-3, 0.3e-3}, {1e-3, 0}, {1e-3, 1e-3}};

/// Of one recording.
struct Outcome {
  double camera_squared = 0;  ///< error of the camera's place [m^2]
  double closing = 0;         ///< reprojection through the corrected arm, rms [px]
  bool camera_inside = false;
  int zeros_inside = 0, lengths_inside = 0, told = 0, told_inside = 0, claimed = 0;
};

Outcome outcome_of(const Kind& kind, unsigned seed) {
  constexpr double kChiSquare95 = 12.592;
  const bool solved = kind.prior > 0;
  const WrongArm wrong = draw_wrong_arm(seed, kind.off);
  const HandEyeScene scene = recorded(wrong, solved ? Known::joints_and_lengths : Known::joints, seed,
                                      Setup::eye_in_hand, kind.prior);
  CalibrateSettings settings;
  settings.folds = 2;
  const Calibration result = calibrate(scene.settings.setup, scene.camera, scene.points,
                                       grid_symmetries(scene.points), scene.observations, settings);
  Outcome outcome;
  const Vector6d error = motion_between(result.poses.X, scene.truth.X);
  outcome.camera_squared = error.head<3>().squaredNorm();
  outcome.camera_inside = error.dot(result.covariance.ldlt().solve(error)) < kChiSquare95;
  outcome.closing = result.chain_rms;
  const JointErrors found =
      joint_errors(result.refined.bundle, result.unknowns, result.shared_covariance).value();
  for (Eigen::Index i = 0; i < found.estimate.size(); ++i) {
    const bool zero = i < wrong.zeros.size();
    const double truth = zero ? wrong.zeros[i] : wrong.lengths[i - wrong.zeros.size()];
    const Eigen::Vector2d interval = found.interval(i);
    const bool inside = interval[0] < truth && truth < interval[1];
    (zero ? outcome.zeros_inside : outcome.lengths_inside) += inside;
    if (zero) continue;
    outcome.claimed += interval[0] > 0 || interval[1] < 0;
    outcome.told += found.told(i);
    outcome.told_inside += found.told(i) && inside;
  }
  return outcome;
}

void print_row(const Kind& kind, int recordings, unsigned first_seed) {
  std::vector<Outcome> outcomes(static_cast<std::size_t>(recordings));
  data::for_each_in_parallel(outcomes.size(), 0, [&](std::size_t i) {
    outcomes[i] = outcome_of(kind, first_seed + static_cast<unsigned>(i));
  });
  Outcome sum;
  int camera_inside = 0;
  for (const Outcome& o : outcomes) {
    sum.camera_squared += o.camera_squared;
    sum.closing += o.closing * o.closing;
    camera_inside += o.camera_inside;
    sum.zeros_inside += o.zeros_inside;
    sum.lengths_inside += o.lengths_inside;
    sum.told += o.told;
    sum.told_inside += o.told_inside;
    sum.claimed += o.claimed;
  }
  const auto percent = [](int part, int whole) { return whole > 0 ? 100.0 * part / whole : 0.0; };
  const int lengths = kind.prior > 0 ? 15 * recordings : 0;
  const std::string prior = lengths > 0 ? data::format_short(1e3 * kind.prior) : std::string("as described");
  std::printf("| %.1f | %s | %.2f | %.2f | %.0f | %.0f | ", 1e3 * kind.off, prior.c_str(),
              1e3 * std::sqrt(sum.camera_squared / recordings), std::sqrt(sum.closing / recordings),
              percent(camera_inside, recordings), percent(sum.zeros_inside, 6 * recordings));
  if (lengths == 0)
    std::printf("- | - | - | - |\n");
  else
    std::printf("%.0f | %.1f of 15 | %.0f | %.1f |\n", percent(sum.lengths_inside, lengths),
                static_cast<double>(sum.told) / recordings, percent(sum.told_inside, sum.told),
                static_cast<double>(sum.claimed) / recordings);
  std::fflush(stdout);
}

}  // namespace
}  // namespace flash::calib

int main(int argc, char** argv) {
  using namespace flash::calib;
  const int recordings = argc > 1 ? std::atoi(argv[1]) : 30;
  const unsigned first_seed = argc > 2 ? static_cast<unsigned>(std::atoi(argv[2])) : 510001;
  std::printf(
      "| lengths off mm | prior mm | camera off mm | closing px | camera inside %% | zeros inside %% | "
      "lengths "
      "inside %% | told | of them inside %% | said to differ |\n"
      "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n");
  for (const Kind& kind : kKinds) print_row(kind, recordings, first_seed);
}
