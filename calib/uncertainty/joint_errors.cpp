#include "calib/uncertainty/joint_errors.h"

#include <algorithm>
#include <cmath>

#include "calib/solve/linearization.h"
#include "data/files/text.h"

namespace flash::calib {

Eigen::Vector2d JointErrors::interval(Eigen::Index i) const {
  constexpr double k95 = 1.96;
  return {estimate[i] - k95 * sd[i], estimate[i] + k95 * sd[i]};
}

bool JointErrors::told(Eigen::Index i) const {
  constexpr double kTold = 0.5;
  return sd[i] <= kTold * prior_sd[i];
}

std::optional<JointErrors> joint_errors(const Bundle& bundle, const Unknowns& unknowns,
                                        const Eigen::MatrixXd& covariance) {
  const SharedColumns columns = shared_columns(bundle, unknowns);
  if (columns.joint_errors.empty() || columns.joint_errors.front() < 0) return std::nullopt;
  const Eigen::VectorXd& errors = bundle.joint_errors.front();
  return JointErrors{errors,
                     covariance.diagonal().segment(columns.joint_errors.front(), errors.size()).cwiseSqrt(),
                     bundle.joint_error_sd.front()};
}

double second_order(const JointErrors& errors, const ArmModel& arm, double distance) {
  double squares = 0;
  Eigen::Index next = 0;
  for (const Joint& joint : arm.chain.joints)
    if (joint.kind != Joint::Kind::fixed) {
      if (joint.kind == Joint::Kind::revolute) squares += std::pow(errors.estimate[next], 2);
      ++next;
    }
  return 0.5 * squares * distance;
}

std::string direction_name(const Eigen::Vector3d& direction) {
  constexpr double kAlong = 0.9999;
  for (Eigen::Index i = 0; i < 3; ++i)
    if (direction[i] > kAlong) return std::string(1, "xyz"[i]);
  std::string name;
  for (const double d : direction)
    name += (name.empty() ? "(" : ", ") + data::format_short(std::round(100 * d) / 100);
  return name + ")";
}

std::vector<std::string> joints_far_off(const JointErrors& errors, const ArmModel& arm) {
  constexpr double kFar =
      4;  // deviations: of twenty errors that are as known, one in a thousand sets has any
  std::vector<std::pair<double, std::string>> found;
  Eigen::Index next = 0;
  const auto judge = [&](const std::string& joint, const std::string& how, bool turns) {
    const double unit = turns ? 180 / M_PI : 1e3, estimate = errors.estimate[next],
                 sd = errors.prior_sd[next];
    ++next;
    if (!(std::abs(estimate) > kFar * sd)) return;
    const char* const name = turns ? " deg" : " mm";
    found.emplace_back(std::abs(estimate) / sd, "joint " + joint + " is farther " + how + " by " +
                                                    data::format_short(unit * estimate) + name + ", where " +
                                                    data::format_short(unit * sd) + name +
                                                    " were to be expected: is the URDF that of this arm?");
  };
  for (const Joint& joint : arm.chain.joints)
    if (joint.kind != Joint::Kind::fixed)
      judge(joint.name, "than it says", joint.kind == Joint::Kind::revolute);
  for (const LinkLength& length : arm.lengths)
    judge(arm.chain.joints[length.joint].name,
          "along " + direction_name(length.direction) + " than the URDF says", false);
  std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<std::string> sentences;
  for (auto& [ratio, sentence] : found) sentences.push_back(std::move(sentence));
  return sentences;
}

}  // namespace flash::calib
