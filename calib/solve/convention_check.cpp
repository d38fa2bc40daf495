#include "calib/solve/convention_check.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>

#include "calib/geometry/pose.h"
#include "data/motion/rotation_angles.h"
#include "data/numbers/median.h"

namespace flash::calib {
namespace {

using Poses = std::vector<Eigen::Isometry3d>;

Poses inverted(Poses poses) {
  for (Eigen::Isometry3d& pose : poses) pose = pose.inverse();
  return poses;
}

Poses scaled(Poses poses, double factor) {
  for (Eigen::Isometry3d& pose : poses) pose.translation() *= factor;
  return poses;
}

/// x y z w read from what was w x y z.
Poses reordered_quaternions(Poses poses) {
  for (Eigen::Isometry3d& pose : poses) {
    const Eigen::Quaterniond q(pose.linear());
    pose.linear() = Eigen::Quaterniond(q.x(), q.y(), q.z(), q.w()).toRotationMatrix();
  }
  return poses;
}

bool same_poses(const Poses& a, const Poses& b) {
  constexpr double kSame = 1e-6;
  for (std::size_t i = 0; i < a.size(); ++i)
    if (!(motion_between(a[i], b[i]).cwiseAbs().maxCoeff() < kSame)) return false;
  return true;
}

Reading as_it_is_stated(Setup setup, const std::vector<Observation>& observations) {
  Reading reading{.sentence = {}, .setup = setup, .T_base_gripper = {}, .known = {}};
  for (const Observation& observation : observations)
    reading.T_base_gripper.push_back(observation.T_base_gripper);
  reading.known.assign(observations.size(), true);
  return reading;
}

void add_pairings(const Reading& as_stated, std::vector<Reading>& readings) {
  const auto count = static_cast<int>(as_stated.T_base_gripper.size());
  for (const int shift : {-1, 1, -2, 2}) {
    Reading reading = as_stated;
    for (int i = 0; i < count; ++i) {
      const int from = i + shift;
      reading.known[static_cast<std::size_t>(i)] = from >= 0 && from < count;
      if (from >= 0 && from < count)
        reading.T_base_gripper[static_cast<std::size_t>(i)] =
            as_stated.T_base_gripper[static_cast<std::size_t>(from)];
    }
    const std::string distance = std::abs(shift) == 1 ? "one" : "two";
    reading.sentence = "images and poses are paired off by " + distance +
                       ": each image belongs to the pose " + distance + (shift > 0 ? " after" : " before") +
                       " its own";
    readings.push_back(std::move(reading));
  }
  Reading backwards = as_stated;
  std::reverse(backwards.T_base_gripper.begin(), backwards.T_base_gripper.end());
  backwards.sentence = "the poses are in reverse order: the first image belongs to the last pose";
  readings.push_back(std::move(backwards));
}

Poses with_angles(Poses poses, const std::vector<Eigen::Vector3d>& angles, const std::string& order,
                  double factor) {
  for (std::size_t i = 0; i < poses.size(); ++i)
    poses[i].linear() = data::rotation_from_angles(factor * angles[i], order);
  return poses;
}

std::string sentence_of(const std::string& order) {
  const std::string option = " (--angles " + order + ")";
  if (order == data::kRotationVector)
    return "the three angles are a rotation vector, not roll, pitch, yaw" + option;
  if (order.front() >= 'x') return "the three angles turn about fixed " + order + ", not fixed xyz" + option;
  const std::string whose = order == "ZYX"   ? ", as KUKA's A B C"
                            : order == "XYZ" ? ", as Staubli's rx ry rz"
                            : order == "ZYZ" ? ", as Kawasaki's O A T"
                                             : "";
  return "the three angles turn about turning " + order + whose + ", not fixed xyz" + option;
}

/// The units that the numbers allow: no angle is beyond a full turn.
void add_angle_readings(const Reading& as_stated, const std::vector<Eigen::Vector3d>& angles,
                        std::vector<Reading>& readings) {
  struct Unit {
    double factor;
    const char* text;
  };
  constexpr double kDegree = M_PI / 180, kTurn = 2 * M_PI + 1e-6;
  const std::array<Unit, 3> units{{{1, ""},
                                   {kDegree, "angles are degrees where radians were expected"},
                                   {1 / kDegree, "angles are radians where degrees were expected"}}};
  double largest = 0;
  for (const Eigen::Vector3d& a : angles) largest = std::max(largest, a.cwiseAbs().maxCoeff());
  for (const Unit& unit : units) {
    if (unit.factor > 1 && unit.factor * largest > kTurn) continue;
    const std::string prefix = unit.text[0] == 0 ? "" : std::string(unit.text) + ", and ";
    for (const std::string& order : data::angle_orders()) {
      if (unit.factor == 1 && order == "xyz") continue;
      Reading reading = as_stated;
      reading.T_base_gripper = with_angles(as_stated.T_base_gripper, angles, order, unit.factor);
      reading.sentence = order == "xyz" ? unit.text : prefix + sentence_of(order);
      readings.push_back(std::move(reading));
    }
  }
}

RobustSeed robust_seed_of(const Reading& reading, const std::vector<Observation>& observations,
                          const std::vector<Symmetry>& symmetries, const RobustSeedSettings& settings) {
  std::vector<Eigen::Isometry3d> robot;
  std::vector<std::vector<Eigen::Isometry3d>> candidates(observations.size());
  for (std::size_t i = 0; i < observations.size(); ++i) {
    robot.push_back(pose_loop(reading.setup, reading.T_base_gripper[i], Eigen::Isometry3d::Identity()).G);
    if (!reading.known[i]) continue;
    for (const Symmetry& symmetry : symmetries)
      for (const Eigen::Isometry3d& T : observations[i].T_camera_target)
        candidates[i].push_back((reading.target_inverted ? T.inverse() : T) * symmetry.turn.inverse());
  }
  return find_robust_seed(robot, candidates, settings);
}

/// Pairs of poses, which no picture shows.
bool are_pairs(const std::vector<Observation>& observations) {
  return std::none_of(observations.begin(), observations.end(),
                      [](const Observation& observation) { return observation.pixels.cols() > 0; });
}

/// No camera sees what is behind it: such poses of pairs are T_target_camera. They are the same equations as
/// the robot's poses inverted, X and Z exchanged.
bool targets_behind(const std::vector<Observation>& observations) {
  if (!are_pairs(observations)) return false;
  const auto behind =
      std::count_if(observations.begin(), observations.end(), [](const Observation& observation) {
        return !observation.T_camera_target.empty() &&
               observation.T_camera_target.front().translation().z() < 0;
      });
  return 2 * static_cast<std::size_t>(behind) > observations.size();
}

/// Eye-to-hand with its poses is eye-in-hand with their inverses: the same equations. What tells them apart
/// is which of the two constant transforms is short enough for a mount.
void name_setup(Setup stated, bool pairs, const RobustSeed& found, std::string& sentence) {
  const bool stated_in_hand = stated == Setup::eye_in_hand;
  const double camera = found.poses.X.translation().norm(), target = found.poses.Z.translation().norm();
  // In the found reading X is base <- camera if the camera stands still, gripper <- camera if it rides.
  const bool camera_rides = camera < target;
  if (camera_rides != stated_in_hand)
    sentence =
        std::string(stated_in_hand
                        ? "the setup is eye-to-hand, not eye-in-hand (or the poses are T_gripper_base"
                        : "the setup is eye-in-hand, not eye-to-hand (or the poses are T_gripper_base") +
        (pairs ? ", or those of the target T_target_camera)" : ")");
  else
    sentence =
        "the poses are inverted: they are T_gripper_base where T_base_gripper is expected (or the setup is " +
        std::string(stated_in_hand ? "eye-to-hand)" : "eye-in-hand)");
}

std::string closing_text(const RobustSeed& robust_seed) {
  char text[80];
  std::snprintf(text, sizeof text, "%.2f deg and %.1f mm", robust_seed.rotation * 180 / M_PI,
                1e3 * robust_seed.translation);
  return text;
}

bool closes_better(const RobustSeed& stated, const RobustSeed& found, const ConventionSettings& settings) {
  return found.found && found.score <= settings.plausible &&
         (!stated.found || found.score * settings.better <= stated.score);
}

/// True over stated size of the target by the views on which most agree.
double size_of_target(const Reading& reading, const std::vector<Observation>& observations,
                      const std::vector<Symmetry>& symmetries, const RobustSeed& seed) {
  std::vector<double> errors;
  for (std::size_t i = 0; i < observations.size(); ++i)
    if (!observations[i].T_camera_target.empty()) errors.push_back(seed.errors[i].translation);
  const double usual = data::median(errors);
  std::vector<PoseLoop> loops;
  for (std::size_t i = 0; i < observations.size(); ++i) {
    const std::vector<Eigen::Isometry3d>& poses = observations[i].T_camera_target;
    if (poses.empty() || seed.errors[i].translation > usual) continue;
    const auto choice = static_cast<std::size_t>(seed.choice[i]);
    loops.push_back(
        pose_loop(reading.setup, reading.T_base_gripper[i],
                  poses[choice % poses.size()] * symmetries[choice / poses.size()].turn.inverse()));
  }
  return translation_scale(loops, seed.poses);
}

}  // namespace

std::vector<Reading> alternative_readings(Setup setup, const std::vector<Observation>& observations,
                                          const std::vector<Eigen::Vector3d>& angles) {
  const Reading as_stated = as_it_is_stated(setup, observations);
  const auto with = [&](std::string sentence, Poses poses) {
    Reading reading = as_stated;
    reading.sentence = std::move(sentence);
    reading.T_base_gripper = std::move(poses);
    return reading;
  };
  const Poses& poses = as_stated.T_base_gripper;
  std::vector<Reading> readings;
  if (targets_behind(observations)) {
    readings.push_back(
        with("the target's poses are inverted: they are T_target_camera where T_camera_target is expected, "
             "and put "
             "it behind the camera",
             poses));
    readings.back().target_inverted = true;
  } else {
    readings.push_back(with("", inverted(poses)));  // named by what it finds
  }
  add_pairings(as_stated, readings);
  readings.push_back(
      with("translations of the robot are millimetres where metres were expected", scaled(poses, 1e-3)));
  readings.push_back(
      with("translations of the robot are inches where metres were expected", scaled(poses, 0.0254)));
  readings.push_back(
      with("translations of the robot are metres where millimetres were expected", scaled(poses, 1e3)));
  readings.push_back(
      with("quaternions are w x y z where x y z w was expected", reordered_quaternions(poses)));
  if (angles.size() == observations.size()) add_angle_readings(as_stated, angles, readings);
  // Two mistakes at once, the second being the direction of the poses or the setup.
  const std::size_t single = readings.size();
  for (std::size_t i = 1; i < single; ++i) {
    Reading reading = readings[i];
    reading.T_base_gripper = inverted(reading.T_base_gripper);
    reading.sentence += "; and the poses are inverted, or the setup is the other one";
    readings.push_back(std::move(reading));
  }
  return readings;
}

std::optional<Finding> check_convention(Setup setup, const std::vector<Observation>& observations,
                                        const std::vector<Symmetry>& symmetries, const RobustSeed& stated,
                                        const std::vector<Eigen::Vector3d>& angles,
                                        const ConventionSettings& settings) {
  if (stated.found && stated.score < settings.suspicious) return std::nullopt;
  const std::vector<Reading> readings = alternative_readings(setup, observations, angles);
  std::vector<RobustSeed> seeds;
  double least = std::numeric_limits<double>::infinity();
  for (const Reading& reading : readings) {
    seeds.push_back(robust_seed_of(reading, observations, symmetries, settings.robust_seed));
    if (seeds.back().found) least = std::min(least, seeds.back().score);
  }
  // Of those that close alike the simplest, which comes first.
  const auto chosen = static_cast<std::size_t>(
      std::find_if(seeds.begin(), seeds.end(),
                   [&](const RobustSeed& seed) { return seed.found && 0.7 * seed.score <= least; }) -
      seeds.begin());
  if (chosen == seeds.size()) return std::nullopt;
  if (!closes_better(stated, seeds[chosen], settings)) return std::nullopt;
  const double score = seeds[chosen].score;
  for (std::size_t i = 0; i < seeds.size(); ++i)
    if (seeds[i].found && seeds[i].score < settings.runner_up * score &&
        !(readings[i].target_inverted == readings[chosen].target_inverted &&
          same_poses(readings[i].T_base_gripper, readings[chosen].T_base_gripper)))
      return std::nullopt;
  Finding best{.sentence = readings[chosen].sentence, .stated = stated, .found = seeds[chosen]};
  if (best.sentence.empty()) name_setup(setup, are_pairs(observations), best.found, best.sentence);
  best.sentence += ": so the chain closes to " + closing_text(best.found) + ", as stated to " +
                   (stated.found ? closing_text(stated) : std::string("nothing consistent"));
  return best;
}

namespace {

/// How many times better a reading of so many views has to close than the stated one, beyond what chance
/// does: the logarithm of the ratio of two deviations, of d degrees of freedom each, has about the deviation
/// 1 / sqrt(d) (Fisher 1924). The majority has six for each view, and two poses are fitted to it. Three views
/// that fit are found among any few.
double least_ratio(std::size_t views, double majority) {
  constexpr double kDeviations = 3.5;  // 1 in 4,000, for five readings
  const double agreeing = std::ceil(majority * static_cast<double>(views));
  if (agreeing < 4) return std::numeric_limits<double>::infinity();
  return std::exp(kDeviations / std::sqrt(6 * agreeing - 12));
}

}  // namespace

std::optional<Finding> check_pairing(Setup setup, const std::vector<Observation>& observations,
                                     const std::vector<Symmetry>& symmetries, const RobustSeed& stated,
                                     const ConventionSettings& settings) {
  if (!stated.found) return std::nullopt;
  const Reading as_stated = as_it_is_stated(setup, observations);
  std::vector<Reading> readings;
  add_pairings(as_stated, readings);
  std::optional<Finding> best;
  for (const Reading& reading : readings) {
    const RobustSeed seed = robust_seed_of(reading, observations, symmetries, settings.robust_seed);
    const auto views = static_cast<std::size_t>(std::count(reading.known.begin(), reading.known.end(), true));
    const double better = std::max(settings.paired, least_ratio(views, settings.robust_seed.majority));
    if (!seed.found || !(better * seed.score < stated.score)) continue;
    if (best && !(seed.score < best->found.score)) continue;
    best = Finding{reading.sentence, stated, seed};
  }
  if (best)
    best->sentence +=
        ": so the chain closes to " + closing_text(best->found) + ", as stated to " + closing_text(stated);
  return best;
}

std::optional<Finding> check_size(Setup setup, const std::vector<Observation>& observations,
                                  const std::vector<Symmetry>& symmetries, const RobustSeed& stated,
                                  const ConventionSettings& settings) {
  if (!stated.found || stated.score < settings.suspicious) return std::nullopt;
  Reading reading = as_it_is_stated(setup, observations);
  // A robot in units of the target: views that are wrong have less of a say each time.
  double size = 1;
  RobustSeed found = stated;
  for (int round = 0; round < 3; ++round) {
    const double left = size_of_target(reading, observations, symmetries, found);
    if (!(left > 1e-6 && left < 1e6)) return std::nullopt;
    size *= left;
    reading.T_base_gripper = scaled(std::move(reading.T_base_gripper), 1 / left);
    found = robust_seed_of(reading, observations, symmetries, settings.robust_seed);
    if (!found.found) return std::nullopt;
  }
  if (!closes_better(stated, found, settings)) return std::nullopt;
  found.translation *= size;
  char text[240];
  std::snprintf(text, sizeof text,
                "the target is %.4g times as large as stated, or the robot's translations are not in metres: "
                "measure a square: so the chain closes to ",
                size);
  return Finding{text + closing_text(found) + ", as stated to " + closing_text(stated), stated, found, size};
}

}  // namespace flash::calib
