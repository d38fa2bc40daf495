#include "calib/solve/robust_seed.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>

#include "calib/geometry/pose.h"
#include "data/numbers/median.h"

namespace flash::calib {
namespace {

constexpr double kParallel = 0.03;  // sine between axes that are taken for one

using Candidates = std::vector<std::vector<Eigen::Isometry3d>>;

class Search {
 public:
  Search(const std::vector<Eigen::Isometry3d>& robot, const Candidates& candidates,
         const RobustSeedSettings& settings)
      : robot_(robot), candidates_(candidates), settings_(settings) {
    std::vector<double> distances;
    for (std::size_t i = 0; i < candidates.size(); ++i) {
      if (candidates[i].empty()) continue;
      views_.push_back(i);
      distances.push_back(candidates[i].front().translation().norm());
    }
    distance_ = std::max(data::median(distances), 1e-9);
    majority_ = std::max<std::size_t>(
        3, static_cast<std::size_t>(std::ceil(settings.majority * static_cast<double>(views_.size()))));
    one_axis_ = turns_about_one_axis();
  }

  std::size_t size() const { return views_.size(); }

  RobustSeed judge(const HandEyePoses& poses) const {
    RobustSeed result{.poses = poses, .choice = {}, .errors = {}};
    result.choice.assign(robot_.size(), 0);
    result.errors.assign(robot_.size(), {});
    for (const std::size_t i : views_) {
      double least = std::numeric_limits<double>::infinity();
      for (std::size_t c = 0; c < candidates_[i].size(); ++c) {
        const ClosingError error = closing_error({robot_[i], candidates_[i][c]}, poses);
        if (combined(error) >= least) continue;
        least = combined(error);
        result.choice[i] = static_cast<int>(c);
        result.errors[i] = error;
      }
    }
    for (const std::size_t i : best_views(result)) {
      const ClosingError& error = result.errors[i];
      result.rotation += error.rotation * error.rotation / static_cast<double>(majority_);
      result.translation += error.translation * error.translation / static_cast<double>(majority_);
    }
    result.score = std::sqrt(result.rotation + result.translation / (distance_ * distance_));
    result.rotation = std::sqrt(result.rotation);
    result.translation = std::sqrt(result.translation);
    result.found = true;
    return result;
  }

  /// Concentration steps: never raise the score, so they end.
  RobustSeed concentrate(RobustSeed result) const {
    for (int step = 0; step < 20; ++step) {
      std::vector<PoseLoop> loops;
      for (const std::size_t i : best_views(result))
        loops.push_back({robot_[i], candidates_[i][static_cast<std::size_t>(result.choice[i])]});
      RobustSeed next = judge(shah(loops));
      if (one_axis_) {
        RobustSeed other = judge(of_one_axis(loops));
        if (other.score < next.score) next = std::move(other);
      }
      if (!(next.score < result.score)) break;
      result = next;
    }
    return result;
  }

  /// All sets of candidates of three views whose motions turn by the same angles as the robot's. The first
  /// view keeps to its own family of a symmetric target: turning it in all views changes Z alone.
  void try_triple(const std::array<std::size_t, 3>& views, std::vector<RobustSeed>& best) const {
    const auto [a, b, c] = views;
    const Eigen::Matrix3d A_ab = relative(robot_[b].inverse(), robot_[a]);
    const Eigen::Matrix3d A_ac = relative(robot_[c].inverse(), robot_[a]);
    const Eigen::Vector3d axis_ab = rotation_log(A_ab), axis_ac = rotation_log(A_ac);
    // Motions that turn little, or about one axis, determine little.
    const bool parallel =
        axis_ab.cross(axis_ac).norm() < kParallel * std::max(axis_ab.norm(), axis_ac.norm());
    if (parallel && !one_axis_) return;
    for (const Eigen::Isometry3d& C_a : candidates_[a]) {
      for (const Eigen::Isometry3d& C_b : candidates_[b]) {
        const Eigen::Vector3d log_ab = rotation_log(relative(C_b, C_a.inverse()));
        if (std::abs(log_ab.norm() - axis_ab.norm()) > settings_.angle_slack) continue;
        for (const Eigen::Isometry3d& C_c : candidates_[c]) {
          const Eigen::Vector3d log_ac = rotation_log(relative(C_c, C_a.inverse()));
          if (std::abs(log_ac.norm() - axis_ac.norm()) > settings_.angle_slack) continue;
          const std::vector<PoseLoop> loops = {{robot_[a], C_a}, {robot_[b], C_b}, {robot_[c], C_c}};
          if (one_axis_) keep(judge(of_one_axis(loops)), best);
          if (parallel) continue;
          keep(judge(park(loops)), best);
          if (M_PI - std::max(axis_ab.norm(), axis_ac.norm()) < settings_.angle_slack)
            keep(judge(half_turns(loops)), best);
        }
      }
    }
  }

  std::array<std::size_t, 3> draw(std::mt19937& random) const {
    std::array<std::size_t, 3> views{};
    std::sample(views_.begin(), views_.end(), views.begin(), 3, random);
    return views;
  }

 private:
  bool turns_about_one_axis() const {
    Eigen::Matrix3d moment = Eigen::Matrix3d::Zero();
    for (const std::size_t i : views_) {
      const Eigen::Vector3d turn =
          rotation_log(robot_[views_.front()].linear().transpose() * robot_[i].linear());
      moment += turn * turn.transpose();
    }
    const Eigen::Vector3d squares =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(moment, Eigen::EigenvaluesOnly).eigenvalues();
    return squares[1] < kParallel * kParallel * squares[2];
  }

  static Eigen::Matrix3d relative(const Eigen::Isometry3d& left, const Eigen::Isometry3d& right) {
    return left.linear() * right.linear();
  }

  double combined(const ClosingError& error) const {
    return std::hypot(error.rotation, error.translation / distance_);
  }

  std::vector<std::size_t> best_views(const RobustSeed& result) const {
    std::vector<std::size_t> order = views_;
    const auto nth = order.begin() + static_cast<std::ptrdiff_t>(std::min(majority_, order.size()) - 1);
    std::nth_element(order.begin(), nth, order.end(), [&](std::size_t i, std::size_t j) {
      return combined(result.errors[i]) < combined(result.errors[j]);
    });
    order.resize(std::min(majority_, order.size()));
    return order;
  }

  void keep(RobustSeed found, std::vector<RobustSeed>& best) const {
    const auto place =
        std::upper_bound(best.begin(), best.end(), found,
                         [](const RobustSeed& x, const RobustSeed& y) { return x.score < y.score; });
    best.insert(place, std::move(found));
    if (best.size() > static_cast<std::size_t>(settings_.kept)) best.pop_back();
  }

  const std::vector<Eigen::Isometry3d>& robot_;
  const Candidates& candidates_;
  const RobustSeedSettings& settings_;
  std::vector<std::size_t> views_;  // that have candidates
  std::size_t majority_ = 3;
  double distance_ = 1;
  bool one_axis_ = false;
};

}  // namespace

RobustSeed find_robust_seed(const std::vector<Eigen::Isometry3d>& robot,
                            const std::vector<std::vector<Eigen::Isometry3d>>& candidates,
                            const RobustSeedSettings& settings) {
  const Search search(robot, candidates, settings);
  if (search.size() < 3) return {};
  std::mt19937 random(settings.seed);
  std::vector<RobustSeed> best;
  for (int i = 0; i < settings.triples; ++i) search.try_triple(search.draw(random), best);
  RobustSeed result;
  for (const RobustSeed& candidate : best) {
    RobustSeed refined = search.concentrate(candidate);
    if (!result.found || refined.score < result.score) result = std::move(refined);
  }
  return result;
}

}  // namespace flash::calib
