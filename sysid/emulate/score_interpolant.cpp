#include "sysid/emulate/score_interpolant.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace flash::sysid {
namespace {

constexpr double kLeastSquare = 1e-18;  // a nanometre squared: keeps the root's derivative finite

}  // namespace

ScoreInterpolant::ScoreInterpolant(const GridResults& results) {
  for (const Axis& axis : results.axes) {
    logarithmic_.push_back(axis.logarithmic);
    Eigen::VectorXd knots(static_cast<Eigen::Index>(axis.values.size()));
    for (std::size_t i = 0; i < axis.values.size(); ++i)
      knots[static_cast<Eigen::Index>(i)] = axis.logarithmic ? std::log(axis.values[i]) : axis.values[i];
    splines_.emplace_back(std::move(knots));
  }
  const auto candidates = static_cast<Eigen::Index>(results.candidates.size());
  const auto scored = std::find_if(results.candidates.begin(), results.candidates.end(),
                                   [](const CandidateResult& c) { return std::isfinite(c.score); });
  if (scored == results.candidates.end()) return;
  std::vector<double> weights;
  std::vector<std::size_t> keyframes;
  for (std::size_t r = 0; r < scored->recordings.size(); ++r) {
    double total = 0;
    for (const KeyframeScore& keyframe : scored->recordings[r].keyframes)
      total += keyframe.points > 0 ? keyframe.weight : 0;
    for (std::size_t k = 0; k < scored->recordings[r].keyframes.size(); ++k) {
      const KeyframeScore& keyframe = scored->recordings[r].keyframes[k];
      if (keyframe.points == 0 || keyframe.weight <= 0) continue;
      weights.push_back(keyframe.weight / total / static_cast<double>(scored->recordings.size()));
      recordings_.push_back(static_cast<int>(r));
      keyframes.push_back(k);
    }
  }
  weights_ = Eigen::Map<Eigen::VectorXd>(weights.data(), static_cast<Eigen::Index>(weights.size()));
  squares_.resize(candidates * weights_.size());
  for (Eigen::Index sample = 0; sample < weights_.size(); ++sample) {
    const auto r = static_cast<std::size_t>(recordings_[static_cast<std::size_t>(sample)]);
    const std::size_t k = keyframes[static_cast<std::size_t>(sample)];
    auto squares = squares_.segment(sample * candidates, candidates);
    double worst = 0;
    for (Eigen::Index c = 0; c < candidates; ++c) {
      const CandidateResult& candidate = results.candidates[static_cast<std::size_t>(c)];
      const bool finite = std::isfinite(candidate.score);
      squares[c] = finite ? std::pow(candidate.recordings[r].keyframes[k].score, 2) : -1;
      worst = std::max(worst, squares[c]);
    }
    for (double& square : squares)
      if (square < 0) square = worst;
  }
}

double ScoreInterpolant::coordinate(std::size_t k, double value) const {
  return logarithmic_[k] ? std::log(value) : value;
}
Eigen::VectorXd ScoreInterpolant::coordinates(const std::vector<double>& values) const {
  Eigen::VectorXd x(parameters());
  for (std::size_t k = 0; k < values.size(); ++k) x[static_cast<Eigen::Index>(k)] = coordinate(k, values[k]);
  return x;
}
double ScoreInterpolant::value(std::size_t k, double coordinate) const {
  return logarithmic_[k] ? std::exp(coordinate) : coordinate;
}

Eigen::VectorXd ScoreInterpolant::contract(const Eigen::VectorXd& x,
                                           const std::vector<int>& derivatives) const {
  Eigen::VectorXd tensor = squares_;
  for (std::size_t k = splines_.size(); k-- > 0;) {
    const Eigen::Index size = splines_[k].knots().size();
    const Eigen::RowVectorXd weights = splines_[k].weights(x[static_cast<Eigen::Index>(k)], derivatives[k]);
    tensor = (weights * Eigen::Map<const Eigen::MatrixXd>(tensor.data(), size, tensor.size() / size))
                 .transpose()
                 .eval();
  }
  return tensor;
}

Eigen::VectorXd ScoreInterpolant::scores(const Eigen::VectorXd& x) const {
  const std::vector<int> none(splines_.size(), 0);
  return contract(x, none).cwiseMax(0).cwiseSqrt();
}

Eigen::MatrixXd ScoreInterpolant::gradients(const Eigen::VectorXd& x) const {
  std::vector<int> derivatives(splines_.size(), 0);
  const Eigen::ArrayXd twice = 2 * contract(x, derivatives).cwiseMax(kLeastSquare).array().sqrt();
  Eigen::MatrixXd rows(weights_.size(), parameters());
  for (Eigen::Index i = 0; i < parameters(); ++i) {
    derivatives[static_cast<std::size_t>(i)] = 1;
    rows.col(i) = contract(x, derivatives).array() / twice;
    derivatives[static_cast<std::size_t>(i)] = 0;
  }
  return rows;
}

double ScoreInterpolant::score(const Eigen::VectorXd& x, Eigen::VectorXd& gradient,
                               Eigen::MatrixXd& hessian) const {
  const Eigen::Index n = parameters();
  std::vector<int> derivatives(splines_.size(), 0);
  const Eigen::ArrayXd squares = contract(x, derivatives).cwiseMax(kLeastSquare).array();
  const Eigen::ArrayXd roots = squares.sqrt();
  const Eigen::ArrayXd slope = 0.5 * weights_.array() / roots;
  std::vector<Eigen::ArrayXd> first;
  gradient.resize(n);
  hessian.resize(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    derivatives[static_cast<std::size_t>(i)] = 1;
    first.push_back(contract(x, derivatives).array());
    derivatives[static_cast<std::size_t>(i)] = 0;
    gradient[i] = (slope * first.back()).sum();
  }
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j <= i; ++j) {
      ++derivatives[static_cast<std::size_t>(i)];
      ++derivatives[static_cast<std::size_t>(j)];
      const Eigen::ArrayXd mixed = contract(x, derivatives).array();
      derivatives.assign(splines_.size(), 0);
      const auto a = static_cast<std::size_t>(i), b = static_cast<std::size_t>(j);
      hessian(i, j) = hessian(j, i) = (slope * (mixed - 0.5 * first[a] * first[b] / squares)).sum();
    }
  return (weights_.array() * roots).sum();
}

double ScoreInterpolant::minimize(const std::vector<bool>& free, Eigen::VectorXd& x) const {
  constexpr int kIterations = 40;
  constexpr double kEnough = 1e-12;  // gain [m] that is not worth another step
  Eigen::VectorXd gradient;
  Eigen::MatrixXd hessian;
  double here = score(x, gradient, hessian);
  double damping = 0;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    std::vector<Eigen::Index> moving;
    for (Eigen::Index i = 0; i < x.size(); ++i) {
      const Eigen::VectorXd& knots = this->knots(static_cast<std::size_t>(i));
      const bool held =
          (x[i] <= knots[0] && gradient[i] > 0) || (x[i] >= knots[knots.size() - 1] && gradient[i] < 0);
      if (free[static_cast<std::size_t>(i)] && knots.size() > 1 && !held) moving.push_back(i);
    }
    if (moving.empty()) break;
    Eigen::MatrixXd matrix = hessian(moving, moving);
    const double scale = matrix.diagonal().cwiseAbs().maxCoeff();
    Eigen::LLT<Eigen::MatrixXd> factor(matrix + damping * scale *
                                                    Eigen::MatrixXd::Identity(matrix.rows(), matrix.cols()));
    if (factor.info() != Eigen::Success) {
      if (damping > 1e6) break;
      damping = std::max(10 * damping, 1e-3);
      continue;
    }
    const Eigen::VectorXd step = -factor.solve(Eigen::VectorXd(gradient(moving)));
    Eigen::VectorXd trial = x;
    for (std::size_t m = 0; m < moving.size(); ++m) {
      const Eigen::VectorXd& knots = this->knots(static_cast<std::size_t>(moving[m]));
      trial[moving[m]] =
          std::clamp(x[moving[m]] + step[static_cast<Eigen::Index>(m)], knots[0], knots[knots.size() - 1]);
    }
    Eigen::VectorXd next_gradient;
    Eigen::MatrixXd next_hessian;
    const double there = score(trial, next_gradient, next_hessian);
    if (!(there < here)) {
      if (damping > 1e6) break;
      damping = std::max(10 * damping, 1e-3);
      continue;
    }
    const double gain = here - there;
    x = trial;
    here = there;
    gradient = next_gradient;
    hessian = next_hessian;
    damping = damping < 1e-6 ? 0 : 0.1 * damping;
    if (gain < kEnough) break;
  }
  return here;
}

}  // namespace flash::sysid
