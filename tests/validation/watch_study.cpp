// How many views a hand-eye calibration takes from who follows the next pose of `plan`, beside a person who
// takes views at random: until the camera is known as well as by 20 random views. Simulated cells, SEEDS of
// each kind from FIRST_SEED on.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <random>
#include <vector>

#include "calib/calibrate/next_poses.h"
#include "data/files/error.h"
#include "data/machine/parallel.h"
#include "tests/calib/hand_eye_scene.h"

namespace flash::calib {
namespace {

constexpr double kDegree = M_PI / 180;
constexpr std::size_t kRandom = 20;  ///< views of the person
constexpr std::size_t kLast = 14;    ///< of the follower
constexpr std::size_t kFirst = 4;    ///< that both have in common

/// Where the arm goes: a box around the places from which the target is seen, and how far it turns.
struct Cell {
  HandEyeScene scene;
  PlanSettings plan;
};

bool sees_all(const HandEyeScene& scene, const Eigen::Isometry3d& T_camera_target) {
  constexpr double kMargin = 5;  // [px]
  for (const auto& point : scene.points.colwise()) {
    const Eigen::Vector3d q = T_camera_target * Eigen::Vector3d(point);
    if (!(q.z() > 0.05)) return false;
    const Eigen::Vector2d px = project(to_vector(scene.camera), q);
    if (px.minCoeff() < kMargin || px.x() > scene.camera.width - kMargin ||
        px.y() > scene.camera.height - kMargin)
      return false;
  }
  return true;
}

Eigen::Isometry3d target_in_camera(const HandEyeScene& scene, const Eigen::Isometry3d& T_base_gripper) {
  const PoseLoop loop = pose_loop(scene.settings.setup, T_base_gripper, Eigen::Isometry3d::Identity());
  return scene.truth.X.inverse() * loop.G.inverse() * scene.truth.Z;
}

/// The robot says that it is at `reported`, which is wrong by its noise. Empty where the target is cut off.
std::optional<Observation> view_from(const HandEyeScene& scene, const Eigen::Isometry3d& reported,
                                     std::size_t number, std::mt19937& random) {
  std::normal_distribution<double> normal;
  Vector6d error;
  for (Eigen::Index k = 0; k < 6; ++k)
    error[k] = normal(random) * (k < 3 ? 1e-3 * scene.settings.robot_mm : kDegree * scene.settings.robot_deg);
  const Eigen::Isometry3d T_camera_target = target_in_camera(scene, moved(reported, error));
  Observation view;
  view.T_base_gripper = reported;
  view.image = std::to_string(number);
  view.pixels.resize(2, scene.points.cols());
  for (Eigen::Index k = 0; k < scene.points.cols(); ++k) {
    view.points.push_back(static_cast<int>(k));
    view.pixels.col(k) = project(to_vector(scene.camera), T_camera_target * scene.points.col(k)) +
                         scene.settings.corner_px * Eigen::Vector2d(normal(random), normal(random));
  }
  if (!sees_all(scene, T_camera_target)) return std::nullopt;
  view.T_camera_target = {fitted_pose(scene.camera, scene.points, view.pixels, T_camera_target)};
  return view;
}

/// Views at random, of which the target is seen whole; and the box of their places.
Cell make_cell(const SceneSettings& settings, const Eigen::Matrix3Xd& points, unsigned seed) {
  SceneSettings many = settings;
  many.views = 400;
  Cell cell{.scene = make_scene(many, points, seed), .plan = {}};
  HandEyeScene& scene = cell.scene;
  std::vector<Observation> seen;
  cell.plan.poses = 1;
  cell.plan.reach = 10;  // the box alone bounds it
  cell.plan.lower.setConstant(1e9);
  cell.plan.upper = -cell.plan.lower;
  for (std::size_t i = 0; i < scene.observations.size(); ++i) {
    if (!sees_all(scene, target_in_camera(scene, scene.true_poses[i]))) continue;
    scene.observations[i].image = std::to_string(seen.size());
    seen.push_back(scene.observations[i]);
    cell.plan.lower = cell.plan.lower.cwiseMin(scene.true_poses[i].translation());
    cell.plan.upper = cell.plan.upper.cwiseMax(scene.true_poses[i].translation());
  }
  scene.observations = std::move(seen);
  return cell;
}

struct Answer {
  std::size_t views = 0;
  double mm = 0, deg = 0;                  ///< stated, rms of three axes
  double place_mm = 0;                     ///< of a place as far away as the target
  double scatter_mm = 0, scatter_deg = 0;  ///< of these, what another recording in such poses differs by
  Eigen::Vector3d away_mm, away_deg, away_place_mm;  ///< from the truth
};

std::optional<Calibration> solve(const HandEyeScene& scene, const std::vector<Observation>& views) {
  try {
    return calibrate(scene.settings.setup, scene.camera, scene.points, grid_symmetries(scene.points), views);
  } catch (const data::InputError&) {
    return std::nullopt;
  }
}

Answer answer_of(const HandEyeScene& scene, const Calibration& result, std::size_t views) {
  const Vector6d away = motion_between(result.poses.X, scene.truth.X);
  const auto mm = [](const Matrix6d& c) { return 1e3 * std::sqrt(c.topLeftCorner<3, 3>().trace() / 3); };
  const auto deg = [](const Matrix6d& c) {
    return std::sqrt(c.bottomRightCorner<3, 3>().trace() / 3) / kDegree;
  };
  const Eigen::Vector3d place(0, 0, scene.settings.distance);
  Eigen::Matrix<double, 3, 6> at_place;
  at_place << Eigen::Matrix3d::Identity(), -skew(place);
  return {views,
          mm(result.covariance),
          deg(result.covariance),
          1e3 * std::sqrt((at_place * result.covariance * at_place.transpose()).trace() / 3),
          mm(result.repeatable),
          deg(result.repeatable),
          1e3 * away.head<3>(),
          away.tail<3>() / kDegree,
          1e3 * (at_place * away)};
}

/// Of one cell: the person after 20 views, and the follower after each.
struct Course {
  std::optional<Answer> person;
  std::vector<Answer> follower;
  int wasted = 0;  ///< views of the follower that did not show the whole target
};

Course run(const Cell& cell, bool determinant, unsigned seed) {
  const HandEyeScene& scene = cell.scene;
  std::mt19937 random(seed + 31);
  std::normal_distribution<double> normal;
  Course course;
  std::vector<Observation> views(scene.observations.begin(), scene.observations.begin() + kRandom);
  if (const auto result = solve(scene, views)) course.person = answer_of(scene, *result, kRandom);
  views.resize(kFirst);
  std::size_t drawn = kFirst;
  for (std::size_t taken = kFirst; taken <= kLast; ++taken) {
    const std::optional<Calibration> result = solve(scene, views);
    if (result) course.follower.push_back(answer_of(scene, *result, taken));
    std::optional<Observation> next;
    if (result) {
      PlanSettings settings = cell.plan;
      settings.seed = static_cast<unsigned>(taken);
      if (determinant) settings.criterion = PlanCriterion::determinant;
      const Plan plan = plan_poses(*result, scene.points, settings);
      // People come near to a pose: 5 mm and 1 degree an axis.
      Vector6d off;
      for (Eigen::Index k = 0; k < 6; ++k) off[k] = normal(random) * (k < 3 ? 5e-3 : 1 * kDegree);
      next = view_from(scene, moved(plan.poses.front().T_base_gripper, off), taken, random);
    } else {
      next = scene.observations.at(drawn++);
    }
    course.wasted += !next;
    if (next) views.push_back(*next);
  }
  return course;
}

/// Of the follower, the first view from which on `good` holds; one more than were taken where it never does.
template <class Good>
std::size_t first_view(const std::vector<Answer>& answers, const Good& good) {
  std::size_t views = kLast + 1;
  for (auto answer = answers.rbegin(); answer != answers.rend() && good(*answer); ++answer)
    views = answer->views;
  return views;
}

double rms(const std::vector<Eigen::Vector3d>& all) {
  double squares = 0;
  for (const Eigen::Vector3d& one : all) squares += one.squaredNorm();
  return std::sqrt(squares / (3 * static_cast<double>(std::max<std::size_t>(1, all.size()))));
}

double median(std::vector<std::size_t> values) {
  std::sort(values.begin(), values.end());
  const std::size_t half = values.size() / 2;
  return values.size() % 2 == 1 ? static_cast<double>(values[half])
                                : 0.5 * static_cast<double>(values[half - 1] + values[half]);
}

void study(Setup setup, bool determinant, double deg, double mm, std::size_t seeds, unsigned first_seed) {
  SceneSettings settings;
  settings.setup = setup;
  settings.robot_deg = deg;
  settings.robot_mm = mm;
  const Eigen::Matrix3Xd points = board_points();
  std::vector<Course> courses(seeds);
  data::for_each_in_parallel(seeds, 0, [&](std::size_t i) {
    const unsigned seed = first_seed + static_cast<unsigned>(i);
    courses[i] = run(make_cell(settings, points, seed), determinant, seed);
  });
  int wasted = 0;
  for (const Course& course : courses) wasted += course.wasted;
  std::printf("%s, %s, robot %.2f deg %.1f mm, %zu seeds, %d views wasted\n", to_string(setup),
              determinant ? "determinant" : "trace", deg, mm, seeds, wasted);
  const auto tell = [&](const char* what, double Answer::*number) {
    std::vector<std::size_t> needed;
    std::printf("  views until known as by %zu random ones, %s:", kRandom, what);
    for (const Course& course : courses) {
      if (!course.person) continue;
      const double wanted = (*course.person).*number;
      needed.push_back(first_view(course.follower, [&](const Answer& a) { return a.*number <= wanted; }));
      std::printf(" %zu", needed.back());
    }
    std::printf("; median %.1f, %.0f %%\n", median(needed),
                100 * median(needed) / static_cast<double>(kRandom));
  };
  tell("stated mm", &Answer::mm);
  tell("stated deg", &Answer::deg);
  tell("stated mm at the target", &Answer::place_mm);
  tell("scatter mm", &Answer::scatter_mm);
  tell("scatter deg", &Answer::scatter_deg);
  // Stated and true, over all seeds.
  const auto row = [](const char* who, std::size_t views, const std::vector<Answer>& answers) {
    std::vector<Eigen::Vector3d> away_mm, away_deg, away_place_mm;
    const auto mean = [&](double Answer::*number) {
      double squares = 0;
      for (const Answer& answer : answers) squares += answer.*number * (answer.*number);
      return std::sqrt(squares / static_cast<double>(std::max<std::size_t>(1, answers.size())));
    };
    for (const Answer& answer : answers) {
      away_mm.push_back(answer.away_mm);
      away_deg.push_back(answer.away_deg);
      away_place_mm.push_back(answer.away_place_mm);
    }
    std::printf(
        "  %-9s %2zu views: stated %.3f mm %.4f deg, at the target %.3f mm; scatter %.3f mm %.4f deg; true "
        "%.3f "
        "mm %.4f deg, at the target %.3f mm (%zu)\n",
        who, views, mean(&Answer::mm), mean(&Answer::deg), mean(&Answer::place_mm), mean(&Answer::scatter_mm),
        mean(&Answer::scatter_deg), rms(away_mm), rms(away_deg), rms(away_place_mm), answers.size());
  };
  std::vector<Answer> persons;
  for (const Course& course : courses)
    if (course.person) persons.push_back(*course.person);
  row("random", kRandom, persons);
  for (const std::size_t views : {6U, 8U, 10U, 11U, 12U, 13U, 14U}) {
    std::vector<Answer> answers;
    for (const Course& course : courses)
      for (const Answer& answer : course.follower)
        if (answer.views == views) answers.push_back(answer);
    row("following", views, answers);
  }
  std::fflush(stdout);
}

}  // namespace
}  // namespace flash::calib

int main(int argc, char** argv) {
  const std::size_t seeds = argc > 1 ? std::strtoul(argv[1], nullptr, 10) : 10;
  const unsigned first_seed = argc > 2 ? static_cast<unsigned>(std::atoi(argv[2])) : 1700001;
  using flash::calib::Setup;
  for (const Setup setup : {Setup::eye_in_hand, Setup::eye_to_hand})
    for (const bool determinant : {false, true})
      flash::calib::study(setup, determinant, 0.05, 0.5, seeds, first_seed);
}
