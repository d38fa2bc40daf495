// Whether hand-eye calibration claims motions of camera or target that did not happen, and finds those that
// did: random subsets of views of real recordings, in order, as they are and with a motion put in, and the
// same of simulated recordings. Beside what is found stands what could be: by a test at 1 % that knows the
// covariance of all errors and the motion, and by one that knows its kind and time.
//   motion_study [CASES [FIRST_SEED [DATA [CACHE]]]]
// CASES of each row; DATA: a folder of recordings, each a dataset of flash-calib; without it drawn ones
// alone. CACHE: folder that keeps the corners.
// A motion is put into the poses that the robot reports: a camera that moved by m, right of X, and one of the
// robot are the same: G X m = (G X m X^-1) X.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "calib/calibrate/calibrate.h"
#include "calib/detect/detect.h"
#include "calib/uncertainty/motion_evidence.h"
#include "data/files/error.h"
#include "data/machine/parallel.h"
#include "tests/calib/arm_scene.h"
#include "tests/validation/motion_hypotheses.h"

namespace flash::calib {
namespace {

constexpr double kDegree = M_PI / 180;
constexpr std::size_t kCounts[] = {12, 17, 25};  // of views
constexpr std::size_t kFewViews = 4;             // on the short side of a step near an end

struct Recording {
  std::string name;
  Setup setup = Setup::eye_in_hand;
  data::CameraIntrinsics camera;
  Eigen::Matrix3Xd points;
  std::vector<Symmetry> symmetries;
  HandEyePoses poses;  ///< near the truth, for motions that are put in
  std::vector<Observation> views;
};

struct PutIn {
  bool any = false, camera = false, turns = false, drifts = false;
  std::size_t first = 0;  ///< view after a step
  Vector6d motion = Vector6d::Zero();
};

struct Outcome {
  bool lost = false, claimed = false;
  std::string sentence;
  std::optional<Calibration> still;  ///< the solution with all taken to have stood still
  std::optional<WeighedMotions> weighed;
};

/// A motion of 3 mm or 0.4 deg in a random direction, of camera or target, as a step or all the time.
PutIn random_motion(std::size_t views, std::mt19937& random) {
  const auto coin = [&] { return random() % 2 == 0; };
  std::normal_distribution<double> normal;
  PutIn put{.any = true, .camera = coin(), .turns = coin(), .drifts = coin()};
  put.first = 2 + random() % (views - 3);
  Eigen::Vector3d direction(normal(random), normal(random), normal(random));
  direction.normalize();
  if (put.turns)
    put.motion.tail<3>() = 0.4 * kDegree * direction;
  else
    put.motion.head<3>() = 0.003 * direction;
  return put;
}

/// How far the motion has gone at a view.
double share_of(const PutIn& put, std::size_t view, std::size_t views) {
  return put.drifts ? static_cast<double>(view) / static_cast<double>(views - 1)
                    : static_cast<double>(view >= put.first);
}

/// As the robot would have reported the views had that moved. A turn is about the frame's own origin.
void put_in(Recording& recording, const PutIn& put) {
  const Eigen::Isometry3d& T = put.camera ? recording.poses.X : recording.poses.Z;
  const bool of_gripper = put.camera == (recording.setup == Setup::eye_in_hand);
  for (std::size_t i = 0; i < recording.views.size(); ++i) {
    const double share = share_of(put, i, recording.views.size());
    const Eigen::Isometry3d motion =
        T * moved(Eigen::Isometry3d::Identity(), share * put.motion) * T.inverse();
    Eigen::Isometry3d& G = recording.views[i].T_base_gripper;
    G = of_gripper ? G * motion.inverse() : motion * G;
  }
}

/// The same set with `count` of its views, in order.
Recording subset(const Recording& all, std::size_t count, std::mt19937& random) {
  Recording some = all;
  while (some.views.size() > count)
    some.views.erase(some.views.begin() + static_cast<std::ptrdiff_t>(random() % some.views.size()));
  return some;
}

/// The solution's poses and, after them, those of views that do not fit.
TimedPoses timed_poses(const Calibration& still, const Eigen::Matrix3Xd& points) {
  TimedPoses poses;
  poses.refined = still.refined;
  poses.used = still.used.size();
  poses.time = still.used;
  poses.left_out.assign(poses.used, 0);
  for (std::size_t i = 0; i < still.selection.views.size(); ++i) {
    if (!still.selection.views[i].misfit) continue;
    append_view(poses.refined.bundle, points, still.selection.observations[i]);
    poses.time.push_back(static_cast<int>(i));
    poses.left_out.push_back(1);
  }
  return poses;
}

Outcome outcome_of(const Recording& recording) {
  CalibrateSettings settings;
  settings.folds = 2;
  Outcome outcome;
  try {
    const Calibration result = calibrate(recording.setup, recording.camera, recording.points,
                                         recording.symmetries, recording.views, settings);
    outcome.lost = !result.usable;
    for (const std::string& warning : result.warnings)
      for (const char* word : {"moved by", "moved all the time", "moved slowly", "views do not close"})
        if (outcome.sentence.empty() && warning.find(word) != std::string::npos) outcome.sentence = warning;
    outcome.claimed = !outcome.sentence.empty();
    settings.motions = false;
    outcome.still = calibrate(recording.setup, recording.camera, recording.points, recording.symmetries,
                              recording.views, settings);
    outcome.weighed =
        weigh_motions(timed_poses(*outcome.still, recording.points), {.unknowns = outcome.still->unknowns});
  } catch (const data::InputError& error) {
    outcome.lost = true;
    outcome.sentence = error.what();
  }
  return outcome;
}

/// The likeliest level of the arm's errors among those of arms in use.
ArmErrorLevel likeliest_level(const MotionEvidence& evidence) {
  ArmErrorLevel best;
  double least = std::numeric_limits<double>::infinity();
  for (const double rotation : {0.003, 0.012, 0.05, 0.2})  // [deg]
    for (const double translation : {3e-5, 1.2e-4, 5e-4, 2e-3})
      for (const double smooth : {0.0, 4e-4, 8e-4, 1.6e-3, 3.2e-3})
        for (const double reach : {0.5, 2.0}) {
          if (smooth == 0 && reach > 1) continue;
          const ArmErrorLevel level{rotation * kDegree, translation, smooth, reach};
          const double deviance = evidence.at(level).deviance;
          if (!(deviance < least)) continue;
          least = deviance;
          best = level;
        }
  return best;
}

/// What could be found of a motion, of 1.
struct Ceiling {
  double motion_known = 0, time_known = 0;
};

/// Chances that a test at 1 % tells a motion whose squared length in its own standard deviations is
/// `squared`: along it, and of any with six degrees of freedom (noncentral chi-square as a sum over Poisson's
/// numbers).
Ceiling ceiling_of(double squared) {
  squared = std::clamp(squared, 1e-9, 1e3);
  constexpr double kNormal99 = 2.326, kChiSquare99 = 16.812;
  Ceiling ceiling{0.5 * std::erfc((kNormal99 - std::sqrt(squared)) / std::sqrt(2.0)), 0};
  const double x = 0.5 * kChiSquare99;
  double outside = 0, term = std::exp(-x);  // of chi-square with 6 + 2 j degrees of freedom
  for (int i = 1; i <= 3; term *= x / i, ++i) outside += term;
  for (int j = 0; j < 2000; ++j) {
    ceiling.time_known +=
        outside * std::exp(j * std::log(0.5 * squared) - 0.5 * squared - std::lgamma(j + 1.0));
    outside += term;
    term *= x / (4 + j);
  }
  return ceiling;
}

/// Of a motion put into a recording.
std::optional<Ceiling> ceiling_of(const Outcome& still, const PutIn& put, std::size_t views) {
  if (!still.still) return std::nullopt;
  const Calibration& answer = *still.still;
  const BundleSettings settings{.unknowns = answer.unknowns};
  const MotionEvidence evidence(answer.refined, settings);
  const MotionTerms terms = evidence.at(likeliest_level(evidence));
  Eigen::VectorXd motion(6 * evidence.poses());
  for (std::size_t i = 0; i < answer.used.size(); ++i)
    motion.segment<6>(6 * static_cast<Eigen::Index>(i)) =
        share_of(put, static_cast<std::size_t>(answer.used[i]), views) * put.motion;
  return ceiling_of(motion.dot(terms.information[put.camera ? 0 : 1] * motion));
}

std::vector<Recording> real_recordings(const std::string& folder, const std::string& cache) {
  std::vector<std::string> paths;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder))
    if (entry.path().filename() == "target.json") paths.push_back(entry.path().parent_path().string());
  std::sort(paths.begin(), paths.end());
  std::vector<Recording> recordings;
  for (const std::string& path : paths) {
    try {
      Dataset dataset = load_dataset(path);
      const Target target = parse_target(dataset.target);
      const std::vector<Detection> detections = detect(dataset, target, {.cache = cache});
      Recording recording{.name = std::filesystem::relative(path, folder).string(),
                          .setup = *dataset.setup,
                          .camera = *dataset.camera,
                          .points = target_points(target),
                          .symmetries = confusable_symmetries(target),
                          .poses = {},
                          .views = observations_of(detections, rank_refiners(detections).front().refiner)};
      if (recording.views.size() < kCounts[0]) continue;
      recording.poses = calibrate(recording.setup, recording.camera, recording.points, recording.symmetries,
                                  recording.views)
                            .poses;
      recordings.push_back(std::move(recording));
    } catch (const data::InputError& error) {
      std::fprintf(stderr, "%s: %s\n", path.c_str(), error.what());
    }
  }
  return recordings;
}

struct Errors {
  const char* name;
  double robot_deg, robot_mm;  ///< noise of each pose: of arms, how well they repeat
  ArmErrors model;             ///< none: no arm
};
constexpr Errors kErrors[] = {{"white noise", 0.05, 0.5, {}},
                              {"wrong kinematics", 0.005, 0.03, {.zero_deg = 0.1, .length_mm = 0.5}},
                              {"both", 0.03, 0.2, {.zero_deg = 0.05, .length_mm = 0.3}}};

Recording drawn(const Errors& errors, Setup setup, std::size_t views, unsigned seed) {
  SceneSettings settings = protocol_settings(setup);
  settings.views = static_cast<int>(views);
  settings.robot_deg = errors.robot_deg;
  settings.robot_mm = errors.robot_mm;
  const Eigen::Matrix3Xd points = protocol_points(setup);
  const double reach = setup == Setup::eye_in_hand ? 0.4 : 0.6;
  HandEyeScene scene = errors.model.zero_deg > 0 ? make_arm_scene(settings, errors.model, reach, points, seed)
                                                 : make_scene(settings, points, seed);
  return {errors.name,
          setup,
          scene.camera,
          scene.points,
          grid_symmetries(scene.points),
          scene.truth,
          std::move(scene.observations)};
}

struct Case {
  Recording recording;
  PutIn put;
  Outcome outcome = {};
  std::optional<Ceiling> ceiling = {};
};

std::string kind(const Case& one) {
  if (!one.put.any) return "none";
  const std::size_t n = one.recording.views.size(), side = std::min(one.put.first, n - one.put.first);
  std::string text = one.put.camera ? "camera " : "target ";
  text += one.put.turns ? ".4 deg " : "3 mm ";
  return text + (one.put.drifts ? "drift" : side <= kFewViews ? "step near an end" : "step");
}

void run(std::vector<Case>& cases) {
  data::for_each_in_parallel(cases.size(), 0, [&](std::size_t i) {
    Case& one = cases[i];
    one.outcome = outcome_of(one.recording);
    std::printf("%-32s %2zu views, %-30s view %2zu: %s %s\n", one.recording.name.c_str(),
                one.recording.views.size(), kind(one).c_str(), one.put.first,
                one.outcome.claimed ? "CLAIMED"
                : one.outcome.lost  ? "LOST"
                                    : "-",
                one.outcome.sentence.substr(0, 160).c_str());
    std::fflush(stdout);
  });
}

using Key = std::function<std::string(const Case&)>;

void tally(const char* title, const std::vector<Case>& cases, const Key& key) {
  struct Row {
    int all = 0, claimed = 0, lost = 0, judged = 0;
    Ceiling ceiling;
  };
  std::map<std::string, Row> rows;
  for (const Case& one : cases) {
    Row& row = rows[key(one)];
    ++row.all;
    row.claimed += one.outcome.claimed;
    row.lost += one.outcome.lost && !one.outcome.claimed;
    if (!one.ceiling) continue;
    ++row.judged;
    row.ceiling.motion_known += one.ceiling->motion_known;
    row.ceiling.time_known += one.ceiling->time_known;
  }
  std::printf("\n%s\n", title);
  for (const auto& [name, row] : rows) {
    std::printf("  %-44s of %4d: claimed %3d (%5.1f %%), lost %d", name.c_str(), row.all, row.claimed,
                100.0 * row.claimed / row.all, row.lost);
    if (row.judged > 0)
      std::printf("; could be, motion known %5.1f %%, kind and time known %5.1f %%",
                  100 * row.ceiling.motion_known / row.judged, 100 * row.ceiling.time_known / row.judged);
    std::printf("\n");
  }
}

/// What weighed hypotheses claim and find beyond certain odds and sizes.
void tally_weighed(const char* title, const std::vector<Case>& cases,
                   const std::function<bool(const Case&)>& counts) {
  std::printf("\nweighed hypotheses, %s: claimed of nothing put in, found of what was [%%]\n", title);
  for (const double degrees : {0.0, 0.05, 0.1, 0.2, 0.3}) {
    std::printf("  beyond %.2f deg at log odds", degrees);
    for (const double least : {0.0, 3.0, 6.0, 9.0, 12.0}) {
      double all[2] = {0, 0}, told[2] = {0, 0};
      for (const Case& one : cases) {
        if (!one.outcome.weighed || !counts(one)) continue;
        ++all[one.put.any];
        told[one.put.any] += log_odds(*one.outcome.weighed, degrees * kDegree) > least;
      }
      std::printf("  %2.0f: %5.1f %5.1f", least, 100 * told[0] / all[0], 100 * told[1] / all[1]);
    }
    std::printf("\n");
  }
}

void study(int cases_a_row, unsigned first_seed, const std::string& data, const std::string& cache) {
  std::vector<Case> cases;
  unsigned seed = first_seed;
  const auto add = [&](const Recording& recording) {
    std::mt19937 random(seed);
    cases.push_back({recording, {}});
    cases.push_back({recording, random_motion(recording.views.size(), random)});
    put_in(cases.back().recording, cases.back().put);
  };
  if (!data.empty())
    for (const Recording& all : real_recordings(data, cache))
      for (const std::size_t count : kCounts)
        for (int i = 0; i < cases_a_row && all.views.size() >= count; ++i, ++seed) {
          if (all.views.size() == count && i > 0) continue;
          std::mt19937 random(seed + 500'000'000);
          add(subset(all, count, random));
        }
  for (const Errors& errors : kErrors)
    for (const Setup setup : {Setup::eye_in_hand, Setup::eye_to_hand})
      for (const std::size_t count : kCounts)
        for (int i = 0; i < cases_a_row; ++i, ++seed) add(drawn(errors, setup, count, seed));
  run(cases);
  data::for_each_in_parallel(cases.size(), 0, [&](std::size_t i) {
    if (cases[i].put.any)
      cases[i].ceiling = ceiling_of(cases[i - 1].outcome, cases[i].put, cases[i].recording.views.size());
  });
  const auto source = [](const Case& one) {
    return one.recording.name + (one.put.any ? ", put in" : ", none");
  };
  tally("by recording", cases, source);
  tally("by number of views", cases, [](const Case& one) {
    return std::to_string(one.recording.views.size()) + (one.put.any ? ", put in" : ", none");
  });
  tally("by motion", cases, kind);
  const auto is_drawn = [](const Case& one) {
    return std::any_of(std::begin(kErrors), std::end(kErrors),
                       [&](const Errors& errors) { return one.recording.name == errors.name; });
  };
  // Both replay one list of taught poses, and differ from each other by the same from view to view.
  const auto replayed = [](const Case& one) {
    return one.recording.name == "eih_ur_chessboard_2" || one.recording.name == "eih_ur_chessboard_3";
  };
  tally_weighed("real", cases, [&](const Case& one) { return !is_drawn(one); });
  tally_weighed("real, without UR 2 and 3", cases,
                [&](const Case& one) { return !is_drawn(one) && !replayed(one); });
  tally_weighed("drawn", cases, is_drawn);
}

}  // namespace
}  // namespace flash::calib

int main(int argc, char** argv) {
  const int cases = argc > 1 ? std::atoi(argv[1]) : 10;
  const unsigned seed = argc > 2 ? static_cast<unsigned>(std::atoi(argv[2])) : 4000001;
  flash::calib::study(cases, seed, argc > 3 ? argv[3] : "", argc > 4 ? argv[4] : "");
}
