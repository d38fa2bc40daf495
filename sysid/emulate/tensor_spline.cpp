#include "sysid/emulate/tensor_spline.h"

#include <Eigen/Cholesky>
#include <algorithm>

namespace flash::sysid {

TensorSpline::TensorSpline(const std::vector<Eigen::VectorXd>& knots, Eigen::VectorXd values)
    : values_(std::move(values)) {
  for (const Eigen::VectorXd& each : knots) splines_.emplace_back(each);
  std::vector<Eigen::VectorXd> along = {values_};  // each set of axes
  Eigen::Index stride = values_.size();
  for (const Spline& spline : splines_) {
    const Eigen::Index size = spline.knots().size(), before = values_.size() / stride;
    stride /= size;
    for (std::size_t s = 0, count = along.size(); s < count; ++s) {
      Eigen::VectorXd& curved = along.emplace_back(values_.size());
      for (Eigen::Index i = 0; i < before; ++i) {
        const Eigen::Map<const Eigen::MatrixXd> from(along[s].data() + i * size * stride, stride, size);
        Eigen::Map<Eigen::MatrixXd>(curved.data() + i * size * stride, stride, size).noalias() =
            from * spline.curvatures().transpose();
      }
    }
  }
  curvatures_.resize(static_cast<Eigen::Index>(along.size()), values_.size());
  for (std::size_t s = 0; s < along.size(); ++s)
    curvatures_.row(static_cast<Eigen::Index>(s)) = along[s].transpose();
}

double TensorSpline::sum(const std::vector<Spline::Local>& at, std::size_t k, Eigen::Index node,
                         Eigen::Index along) const {
  const Spline::Local& here = at[k];
  const Eigen::Index with_k = along | Eigen::Index{1} << k;
  double sum = 0;
  for (const std::size_t side : {0, 1}) {
    const Eigen::Index there = node * splines_[k].knots().size() + here.knots[side];
    if (k + 1 == at.size()) {
      sum +=
          here.values[side] * curvatures_(along, there) + here.curvatures[side] * curvatures_(with_k, there);
      continue;
    }
    if (here.values[side] != 0) sum += here.values[side] * this->sum(at, k + 1, there, along);
    if (here.curvatures[side] != 0) sum += here.curvatures[side] * this->sum(at, k + 1, there, with_k);
  }
  return sum;
}

double TensorSpline::contract(const Eigen::VectorXd& x, Eigen::Index i, Eigen::Index j) const {
  // A sampler asks hundreds of thousands of times: what it takes is kept by the thread.
  thread_local std::vector<Spline::Local> at;
  at.clear();
  for (Eigen::Index k = 0; k < dimensions(); ++k)
    at.push_back(splines_[static_cast<std::size_t>(k)].local(x[k], (k == i ? 1 : 0) + (k == j ? 1 : 0)));
  return sum(at, 0, 0, 0);
}

double TensorSpline::operator()(const Eigen::VectorXd& x) const { return contract(x); }

double TensorSpline::derivatives(const Eigen::VectorXd& x, Eigen::VectorXd& gradient,
                                 Eigen::MatrixXd& hessian) const {
  const Eigen::Index n = dimensions();
  gradient.resize(n);
  hessian.resize(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    gradient[i] = contract(x, i);
    for (Eigen::Index j = 0; j <= i; ++j) hessian(i, j) = hessian(j, i) = contract(x, i, j);
  }
  return contract(x);
}

double TensorSpline::minimize(Eigen::VectorXd& x) const {
  constexpr int kIterations = 60;   // Work: a cap.
  constexpr double kEnough = 1e-9;  // Of a deviance: a gain that is not worth another step. Work.
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
