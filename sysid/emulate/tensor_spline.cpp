#include "sysid/emulate/tensor_spline.h"

#include <Eigen/Cholesky>
#include <algorithm>

namespace flash::sysid {

TensorSpline::TensorSpline(const std::vector<Eigen::VectorXd>& knots, Eigen::VectorXd values)
    : values_(std::move(values)) {
  for (const Eigen::VectorXd& each : knots) splines_.emplace_back(each);
}

double TensorSpline::contract(const Eigen::VectorXd& x, const std::vector<int>& derivatives) const {
  // A sampler asks hundreds of thousands of times: what it takes is kept by the thread.
  thread_local Eigen::VectorXd tensor, next;
  thread_local Eigen::RowVectorXd weights;
  tensor = values_;
  Eigen::Index count = values_.size();
  for (std::size_t k = 0; k < splines_.size(); ++k) {
    const Eigen::Index size = splines_[k].knots().size();
    count /= size;
    weights.resize(size);
    splines_[k].weights(x[static_cast<Eigen::Index>(k)], derivatives[k], weights);
    next.setZero(count);
    for (Eigen::Index i = 0; i < size; ++i) next += weights[i] * tensor.segment(i * count, count);
    tensor.swap(next);
  }
  return tensor[0];
}

double TensorSpline::operator()(const Eigen::VectorXd& x) const {
  return contract(x, std::vector<int>(splines_.size(), 0));
}

double TensorSpline::derivatives(const Eigen::VectorXd& x, Eigen::VectorXd& gradient,
                                 Eigen::MatrixXd& hessian) const {
  const Eigen::Index n = dimensions();
  std::vector<int> orders(splines_.size(), 0);
  gradient.resize(n);
  hessian.resize(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    orders[static_cast<std::size_t>(i)] = 1;
    gradient[i] = contract(x, orders);
    for (Eigen::Index j = 0; j <= i; ++j) {
      ++orders[static_cast<std::size_t>(j)];
      hessian(i, j) = hessian(j, i) = contract(x, orders);
      --orders[static_cast<std::size_t>(j)];
    }
    orders[static_cast<std::size_t>(i)] = 0;
  }
  return contract(x, orders);
}

double TensorSpline::minimize(Eigen::VectorXd& x) const {
  constexpr int kIterations = 60;
  constexpr double kEnough = 1e-9;  // gain that is not worth another step
  Eigen::VectorXd gradient, next_gradient;
  Eigen::MatrixXd hessian, next_hessian;
  double here = derivatives(x, gradient, hessian), damping = 0;
  for (int iteration = 0; iteration < kIterations && damping < 1e8; ++iteration) {
    std::vector<Eigen::Index> moving;
    for (Eigen::Index i = 0; i < x.size(); ++i) {
      const Eigen::Index last = knots(i).size() - 1;
      const bool held =
          (x[i] <= knots(i)[0] && gradient[i] > 0) || (x[i] >= knots(i)[last] && gradient[i] < 0);
      if (last > 0 && !held) moving.push_back(i);
    }
    if (moving.empty()) break;
    // Coordinates have units of their own: the damping follows the curvature of each.
    Eigen::MatrixXd matrix = hessian(moving, moving);
    matrix.diagonal() += damping * matrix.diagonal().cwiseAbs().cwiseMax(1e-12);
    const Eigen::LLT<Eigen::MatrixXd> factor(matrix);
    Eigen::VectorXd trial = x;
    double there = here;
    if (factor.info() == Eigen::Success) {
      const Eigen::VectorXd step = -factor.solve(Eigen::VectorXd(gradient(moving)));
      for (std::size_t m = 0; m < moving.size(); ++m) {
        const Eigen::VectorXd& range = knots(moving[m]);
        trial[moving[m]] =
            std::clamp(x[moving[m]] + step[static_cast<Eigen::Index>(m)], range[0], range[range.size() - 1]);
      }
      there = derivatives(trial, next_gradient, next_hessian);
    }
    if (!(there < here)) {
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
