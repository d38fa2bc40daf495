#include "tests/validation/motion_hypotheses.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "calib/uncertainty/motion_evidence.h"

namespace flash::calib {
namespace {

constexpr double kDegree = M_PI / 180;
constexpr std::array<double, 7> kSizes{0.0005, 0.001, 0.002, 0.004, 0.008, 0.016, 0.032};  // of motions [m]
constexpr std::array<double, 4> kRotations{0.003, 0.012, 0.05, 0.2};                       // [deg]
constexpr std::array<double, 4> kTranslations{0.03, 0.12, 0.5, 2};                         // [mm]
constexpr std::array<double, 3> kFields{4e-4, 8e-4, 1.6e-3};                               // [rad]
constexpr std::array<double, 2> kReaches{0.5, 2};
constexpr double kWrongSize = 0.01, kWrongOdds = 50;  // of a view that is wrong by itself [m]
constexpr double kNegligible = 8;                     // of a log likelihood, below the largest

double log_sum(const std::vector<double>& values) {
  double largest = -std::numeric_limits<double>::infinity(), sum = 0;
  for (const double value : values) largest = std::max(largest, value);
  if (!std::isfinite(largest)) return largest;
  for (const double value : values) sum += std::exp(value - largest);
  return largest + std::log(sum);
}

struct Level {
  ArmErrorLevel errors;
  double prior = 0;
};

std::vector<Level> levels() {
  std::vector<Level> list;
  const auto unusual = [](double value, double usual, double spread) {
    return -0.5 * std::pow(std::log(value / usual) / spread, 2);
  };
  for (const double rotation : kRotations)
    for (const double translation : kTranslations) {
      const double noise = unusual(rotation, 0.03, 1.5) + unusual(translation, 0.3, 1.5);
      list.push_back({{rotation * kDegree, 1e-3 * translation, 0, 1}, noise});
      for (const double field : kFields)
        for (const double reach : kReaches)
          list.push_back({{rotation * kDegree, 1e-3 * translation, field, reach},
                          noise + unusual(field, 0.1 * kDegree, 1) -
                              std::log(static_cast<double>(kFields.size() * kReaches.size()))});
    }
  return list;
}

using Block = Eigen::Matrix<double, 6, 6>;

/// One motion by certain shares of all poses, scaled by how far they reach.
struct Reduced {
  Block information = Block::Zero();
  Vector6d pull = Vector6d::Zero();
};

/// Log of the likelihood with a motion that is normal about none over that without. sd: an axis.
double log_evidence(const Reduced& reduced, const Vector6d& sd) {
  Block scaled = sd.asDiagonal() * reduced.information * sd.asDiagonal();
  scaled.diagonal().array() += 1;
  const Eigen::LLT<Block> llt(scaled);
  const Vector6d y = llt.matrixL().solve(sd.cwiseProduct(reduced.pull));
  return 0.5 * y.squaredNorm() - llt.matrixLLT().diagonal().array().log().sum();
}

/// The same terms where some poses have motions of their own as well; adds their evidence.
struct Terms {
  Eigen::MatrixXd information;
  Eigen::VectorXd pull;
  double evidence = 0;
};

Terms with_own_motions(const MotionTerms& terms, int mover, const std::vector<std::size_t>& own,
                       const Vector6d& sd) {
  Terms result{terms.information[mover], terms.pull[mover]};
  for (const std::size_t pose : own) {
    const auto at = 6 * static_cast<Eigen::Index>(pose);
    const Eigen::MatrixXd columns = result.information.middleCols<6>(at);
    const Reduced one{columns.middleRows<6>(at), result.pull.segment<6>(at)};
    result.evidence += log_evidence(one, sd);
    Block inner = one.information;
    inner.diagonal() += sd.cwiseAbs2().cwiseInverse();
    const Eigen::LDLT<Block> ldlt(inner);
    result.pull -= columns * ldlt.solve(one.pull);
    result.information -= columns * ldlt.solve(columns.transpose());
  }
  return result;
}

Reduced reduced(const Terms& terms, const std::vector<double>& shape) {
  Reduced result;
  const auto n = static_cast<Eigen::Index>(shape.size());
  Eigen::MatrixXd T = Eigen::MatrixXd::Zero(6 * n, 6);
  for (Eigen::Index i = 0; i < n; ++i)
    if (const double share = shape[static_cast<std::size_t>(i)]; share != 0) {
      T += share * terms.information.middleCols<6>(6 * i);
      result.pull += share * terms.pull.segment<6>(6 * i);
    }
  for (Eigen::Index i = 0; i < n; ++i)
    result.information += shape[static_cast<std::size_t>(i)] * T.middleRows<6>(6 * i);
  return result;
}

/// Of all borders in that order: poses from each on have moved.
std::vector<Reduced> borders(const Terms& terms, const std::vector<std::size_t>& order) {
  std::vector<Reduced> list;
  Reduced sum;
  Eigen::MatrixXd T = Eigen::MatrixXd::Zero(terms.information.rows(), 6);
  for (std::size_t k = order.size() - 1; k > 0; --k) {
    const auto at = 6 * static_cast<Eigen::Index>(order[k]);
    const Block before = T.middleRows<6>(at);
    sum.information += before + before.transpose() + terms.information.block<6, 6>(at, at);
    sum.pull += terms.pull.segment<6>(at);
    T += terms.information.middleCols<6>(at);
    list.push_back(sum);
  }
  return list;
}

/// Orders of poses by how far they are from each of them, in attitude and in place and attitude.
std::vector<std::vector<std::size_t>> configuration_orders(const Bundle& bundle) {
  const std::size_t n = bundle.poses.size();
  const auto distances = [&](double place, double attitude) {
    Eigen::MatrixXd squared(n, n);
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t j = 0; j < n; ++j) {
        const Eigen::Isometry3d &a = bundle.poses[i].T_base_gripper, &b = bundle.poses[j].T_base_gripper;
        squared(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) =
            place * (a.translation() - b.translation()).squaredNorm() +
            attitude * (a.linear() - b.linear()).squaredNorm();
      }
    return squared;
  };
  const Eigen::MatrixXd place = distances(1, 0), attitude = distances(0, 1);
  const Eigen::MatrixXd both =
      place / std::max(place.mean(), 1e-12) + attitude / std::max(attitude.mean(), 1e-12);
  std::vector<std::vector<std::size_t>> orders;
  for (const Eigen::MatrixXd* squared : {&attitude, &both}) {
    for (Eigen::Index i = 0; i < squared->rows(); ++i) {
      std::vector<std::size_t> order(n);
      std::iota(order.begin(), order.end(), 0);
      std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
        return (*squared)(i, static_cast<Eigen::Index>(a)) < (*squared)(i, static_cast<Eigen::Index>(b));
      });
      orders.push_back(std::move(order));
    }
  }
  return orders;
}

std::vector<double> shape_of(const MotionHypothesis& motion, const std::vector<int>& time, int last) {
  std::vector<double> shape;
  for (const int t : time)
    shape.push_back(motion.drift ? static_cast<double>(t) / last
                                 : static_cast<double>(t >= static_cast<int>(motion.first)));
  return shape;
}

/// Views that were left out are wrong by themselves, but for those on a step's short side.
std::vector<std::size_t> wrong_beside(const MotionHypothesis& motion, const TimedPoses& poses, int last) {
  const auto first = static_cast<int>(motion.first);
  const bool at_end = 2 * first > last;
  std::vector<std::size_t> views;
  for (std::size_t i = 0; i < poses.time.size(); ++i)
    if (poses.left_out[i] && (motion.drift || (poses.time[i] >= first) != at_end)) views.push_back(i);
  return views;
}

}  // namespace

WeighedMotions weigh_motions(const TimedPoses& poses, const BundleSettings& settings) {
  const MotionEvidence evidence(poses.refined, settings);
  const Bundle& bundle = poses.refined.bundle;
  const std::size_t n = bundle.poses.size();
  const int last = *std::max_element(poses.time.begin(), poses.time.end());
  double distance = 0;
  for (const BundleView& view : bundle.views)
    distance += predicted_pose(bundle, view).translation().norm() / static_cast<double>(bundle.views.size());
  const auto deviations = [&](double size) {
    Vector6d sd;
    sd << Eigen::Vector3d::Constant(size), Eigen::Vector3d::Constant(size / distance);
    return sd;
  };
  std::vector<std::size_t> left_out;
  for (std::size_t i = 0; i < n; ++i)
    if (poses.left_out[i]) left_out.push_back(i);
  WeighedMotions result;
  for (const bool camera : {true, false}) {
    for (int first = 1; first <= last; ++first)
      result.motions.push_back({camera, false, static_cast<std::size_t>(first)});
    result.motions.push_back({camera, true});
  }
  const std::vector<std::vector<std::size_t>> orders = configuration_orders(bundle);
  const double of_size = -std::log(static_cast<double>(kSizes.size()));
  const double of_border = of_size - std::log(2.0 * static_cast<double>(orders.size() * (n - 1)));
  const auto price = [](const std::vector<std::size_t>& wrong) {
    return -static_cast<double>(wrong.size()) * std::log(kWrongOdds);
  };
  constexpr double kNone = -std::numeric_limits<double>::infinity();
  std::vector<double> none, arm{kNone}, best(result.motions.size(), kNone);
  std::vector<std::vector<double>> logs(result.motions.size());
  double likeliest = kNone;
  for (const Level& level : levels()) {
    const MotionTerms terms = evidence.at(level.errors);
    const double all = level.prior - 0.5 * terms.deviance;
    const Terms still[2] = {with_own_motions(terms, 0, left_out, deviations(kWrongSize)),
                            with_own_motions(terms, 1, left_out, deviations(kWrongSize))};
    none.push_back(all + price(left_out) + still[0].evidence);
    double top = none.back();
    for (std::size_t h = 0; h < logs.size(); ++h) {
      MotionHypothesis& motion = result.motions[h];
      const int mover = motion.camera ? 0 : 1;
      const std::vector<std::size_t> wrong = wrong_beside(motion, poses, last);
      const Terms partly =
          wrong == left_out ? Terms{} : with_own_motions(terms, mover, wrong, deviations(kWrongSize));
      const Terms& beside = wrong == left_out ? still[mover] : partly;
      const Reduced one = reduced(beside, shape_of(motion, poses.time, last));
      for (const double size : kSizes) {
        const Vector6d sd = deviations(size);
        const double value = all + price(wrong) + beside.evidence + of_size + log_evidence(one, sd);
        logs[h].push_back(value);
        top = std::max(top, value);
        if (value <= best[h]) continue;
        best[h] = value;
        Block information = one.information;
        information.diagonal() += sd.cwiseAbs2().cwiseInverse();
        const Vector6d likely = information.ldlt().solve(one.pull);
        motion.size = std::hypot(likely.head<3>().norm() / distance, likely.tail<3>().norm());
      }
    }
    likeliest = std::max(likeliest, top);
    if (top < likeliest - kNegligible) continue;
    for (const std::vector<std::size_t>& order : orders)
      for (const Terms& of_mover : still)
        for (const Reduced& one : borders(of_mover, order))
          for (const double size : kSizes)
            arm.push_back(all + price(left_out) + of_mover.evidence + of_border +
                          log_evidence(one, deviations(size)));
  }
  const double nothing = log_sum(none);
  for (std::size_t h = 0; h < logs.size(); ++h) result.motions[h].evidence = log_sum(logs[h]) - nothing;
  result.arm = log_sum(arm) - nothing;
  return result;
}

double log_odds(const WeighedMotions& weighed, double size) {
  constexpr double kOdds = 20;  // against a motion
  std::vector<double> large, other{0, weighed.arm};
  const auto steps = static_cast<double>(weighed.motions.size() - 2);
  for (const MotionHypothesis& motion : weighed.motions)
    (motion.size > size ? large : other)
        .push_back(motion.evidence - std::log(2 * kOdds * (motion.drift ? 2 : steps)));
  return log_sum(large) - log_sum(other);
}

}  // namespace flash::calib
