#include "calib/uncertainty/end_knock.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>

#include "calib/uncertainty/motion_in_time.h"

namespace flash::calib {
namespace {

constexpr int kFewest = 2;                         // views on the short side
constexpr int kRemaining = 8;                      // on the long side
constexpr double kOdds = 20;                       // against a knock, before any view is seen
constexpr double kWrongOdds = 50;                  // against a view that is wrong by itself
constexpr double kUsualError = 0.05 * M_PI / 180;  // of arms in use, shared by neighbouring views [rad]
constexpr double kLittle = 1e-4;                   // weight of a shift's square that does not count
constexpr double kShared = 1;  // errors that neighbouring poses share, over those that they do not
constexpr std::array<double, 4> kSizes{0.001, 0.003, 0.01, 0.03};  // of knocks [m]
constexpr std::array<double, 3> kWrongSizes{0.003, 0.01, 0.03};    // of what is wrong with a view [m]

/// Which views stand moved: the first or the last `count`.
struct Side {
  bool last = false;
  int count = 0;
  bool camera = false;
};

class EndKnocks {
 public:
  EndKnocks(const TimedPoses& poses, const BundleSettings& settings)
      : poses_(poses), motions_(poses.refined, settings) {
    views_ = 1 + *std::max_element(poses.time.begin(), poses.time.end());
    const Bundle& bundle = poses.refined.bundle;
    for (const BundleView& view : bundle.views)
      distance_ +=
          predicted_pose(bundle, view).translation().norm() / static_cast<double>(bundle.views.size());
  }

  int views() const { return views_; }

  std::vector<double> shape_of(const Side& side) const {
    std::vector<double> shape;
    for (const int time : poses_.time)
      shape.push_back(side.last ? time >= views_ - side.count : time < side.count);
    return shape;
  }

  /// -2 log likelihood where those few views stand moved, by a motion of that size [m].
  double moved(const Side& side, double size) const {
    const std::vector<double> shape = shape_of(side);
    return judged(side, shape, size, [&](std::size_t i) { return poses_.left_out[i] && shape[i] == 0; });
  }

  /// The same where nothing moved: none of those few views is wrong by itself, or one, or all.
  double still(const Side& side) const {
    const std::vector<double> shape = shape_of(side);
    double least = std::numeric_limits<double>::infinity();
    const auto outside = [&](std::size_t i) { return poses_.left_out[i] && shape[i] == 0; };
    const auto ask = [&](const std::function<bool(std::size_t)>& wrong) {
      least = std::min(least, judged(side, shape, 0, wrong));
    };
    ask(outside);
    ask([&](std::size_t i) { return outside(i) || shape[i] != 0; });
    for (std::size_t one = 0; one < shape.size(); ++one)
      if (shape[one] != 0) ask([&](std::size_t i) { return outside(i) || i == one; });
    return least;
  }

  /// The motion's likeliest value.
  Vector6d motion(const Side& side) const {
    std::vector<std::vector<double>> shapes{shape_of(side)};
    for (std::size_t i = 0; i < poses_.time.size(); ++i)
      if (poses_.left_out[i] && shapes.front()[i] == 0) shapes.push_back(alone(i));
    return motions_.fit(shapes, side.camera).motion.head<6>();
  }

 private:
  std::vector<double> alone(std::size_t pose) const {
    std::vector<double> shape(poses_.time.size(), 0);
    shape[pose] = 1;
    return shape;
  }

  /// wrong: the views that are so by themselves.
  double judged(const Side& side, const std::vector<double>& shape, double size,
                const std::function<bool(std::size_t)>& wrong) const {
    UncertainMotion shared = of_size(shape, size);
    shared.of_noise = kShared;
    const double turn = std::hypot(kUsualError, poses_.shared);
    shared.turn_sd = std::hypot(shared.turn_sd, turn);
    shared.shift_sd = std::hypot(shared.shift_sd, turn * distance_);
    double least = std::numeric_limits<double>::infinity();
    for (const double wrong_size : kWrongSizes) {
      std::vector<UncertainMotion> motions{shared};
      for (std::size_t i = 0; i < shape.size(); ++i)
        if (wrong(i)) motions.push_back(of_size(alone(i), wrong_size));
      const auto count = static_cast<double>(motions.size() - 1);
      const double price = 2 * count * std::log(kWrongOdds * static_cast<double>(kWrongSizes.size()));
      least = std::min(least, motions_.deviance(motions, side.camera) + price);
      if (count == 0) break;
    }
    return least;
  }

  UncertainMotion of_size(std::vector<double> shape, double size) const {
    return {std::move(shape), size / distance_, size};
  }

  const TimedPoses& poses_;
  MotionInTime motions_;
  int views_ = 0;
  double distance_ = 0;
};

struct Hypothesis {
  Side side;
  double evidence = 0;  ///< odds against no knock
  double deviance = std::numeric_limits<double>::infinity();
};

/// Odds say at which end and of what; how many views stand moved is what all views say, as odds of few of
/// them and of more are against nulls of their own.
Side likeliest_of(const std::vector<Hypothesis>& all) {
  const Side kind = std::max_element(all.begin(), all.end(), [](const Hypothesis& a, const Hypothesis& b) {
                      return a.evidence < b.evidence;
                    })->side;
  const Hypothesis* best = nullptr;
  for (const Hypothesis& one : all)
    if (one.side.last == kind.last && one.side.camera == kind.camera &&
        (best == nullptr || one.deviance < best->deviance))
      best = &one;
  return best->side;
}

/// The weight of a shift's square that a normal distribution needs for its regions up to that of 99.9 % to
/// hold what the shift has moved, where it took place with that probability: beyond its share of the
/// variance, a region that holds all but so much reaches it.
double weight_of(double probability) {
  constexpr double kOutermost = 1e-3;  // outside of the widest region that is asked for
  const double outside = std::max(probability, kOutermost);
  double x = 6;  // half of chi-square with six degrees of freedom: exp(-x) (1 + x + x^2 / 2) = outside
  for (int i = 0; i < 20; ++i) x = std::log((1 + x + 0.5 * x * x) / outside);
  const double reaching = std::min(1.0, probability / kOutermost) / (2 * std::max(x, 0.5));
  return std::max(probability, reaching);
}

/// Of X against where the camera is at the last view, had a motion of that shape taken place and the solution
/// not known of it.
Matrix6d left_by(const Side& side, const Vector6d& motion, const TimedPoses& poses, const EndKnocks& knocks,
                 const BundleSettings& settings) {
  TimedPoses known = poses;  // the solution knows of those views alone that it used
  known.refined.bundle.poses.resize(poses.used);
  known.refined.bundle.views.resize(poses.used);
  std::vector<double> shape = knocks.shape_of(side);
  shape.resize(poses.used);
  Matrix6d gain = MotionInTime(known.refined, settings).shift_of_camera(shape, {}, side.camera);
  if (side.last && side.camera) gain -= Matrix6d::Identity();
  const Vector6d shift = gain * motion;
  return shift * shift.transpose();
}

}  // namespace

EndKnock find_end_knock(const TimedPoses& poses, const BundleSettings& settings) {
  EndKnock result;
  if (poses.time.empty() || !MotionInTime::applies(poses.refined.bundle, settings)) return result;
  const EndKnocks knocks(poses, settings);
  const double places = 2.0 * (knocks.views() - 1);
  double odds = 0, best_of_kind[2] = {0, 0};
  double of_kind[2][2] = {{0, 0}, {0, 0}};  // odds of the last or the first views, of camera or target
  std::vector<Hypothesis> all;
  for (const bool last : {true, false})
    for (int count = kFewest; count <= kEndViews && knocks.views() - count >= kRemaining; ++count) {
      const double still = std::min(knocks.still({last, count, true}), knocks.still({last, count, false}));
      for (const bool camera : {true, false}) {
        const Side side{last, count, camera};
        Hypothesis& knock = all.emplace_back(Hypothesis{side});
        for (const double size : kSizes) {
          const double deviance = knocks.moved(side, size);
          knock.evidence += std::exp(std::min(300.0, 0.5 * (still - deviance))) /
                            (static_cast<double>(kSizes.size()) * kOdds * places);
          knock.deviance = std::min(knock.deviance, deviance);
        }
        odds += knock.evidence;
        of_kind[last][camera] += knock.evidence;
        best_of_kind[camera] = std::max(best_of_kind[camera], knock.evidence);
      }
    }
  if (all.empty()) return result;
  const Side likeliest = likeliest_of(all);
  result.probability = odds / (1 + odds);
  result.last = likeliest.last;
  if (odds > 1) {
    Knock& knock = result.knock.emplace();
    knock.pose =
        static_cast<std::size_t>(likeliest.last ? knocks.views() - likeliest.count : likeliest.count);
    knock.camera = likeliest.camera;
    knock.motion = (likeliest.last ? 1 : -1) * knocks.motion(likeliest);
    knock.told = best_of_kind[likeliest.camera] > kOdds * best_of_kind[!likeliest.camera];
    knock.gain = knock.second = 2 * std::log(odds);
    return result;
  }
  for (const auto& [side, evidence, deviance] : all) {
    const double kind = of_kind[side.last][side.camera];
    const double weight = kind > 0 ? weight_of(kind / (1 + odds)) * evidence / kind : 0;
    if (weight > kLittle)
      result.covariance += weight * left_by(side, knocks.motion(side), poses, knocks, settings);
  }
  return result;
}

}  // namespace flash::calib
