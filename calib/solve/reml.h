#pragma once
#include <Eigen/Core>
#include <vector>

namespace flash::calib {

/// Residuals of one component of variance within one group, linear in the group's own unknowns d and the
/// shared ones s:  r = r_0 + J_d d + J_s s  with independent errors of one standard deviation.
struct GramBlock {
  int group = 0, component = 0;
  double count = 0;      ///< residuals, robust weights taken into account
  Eigen::MatrixXd gram;  ///< [J_d J_s r_0]^T [J_d J_s r_0]
};

/// What is known beforehand of how one standard deviation compares with another: log-normal about `usual`,
/// `spread` of the logarithm.
struct NoiseRatio {
  std::size_t over = 0, under = 0;  ///< components
  double usual = 1, spread = 1;
};

/// What is known of standard deviations beforehand: log-normal about `usual`, `spread` of the logarithm; 0:
/// nothing.
struct NoisePrior {
  std::vector<double> usual = {};  ///< of each component
  double spread = 0;
  std::vector<NoiseRatio> ratios = {};
};

/// A mixed linear model in the form that any standard deviations can be put to.
struct LinearModel {
  int groups = 0, components = 0;
  int own = 0;     ///< unknowns of a group
  int shared = 0;  ///< unknowns of all
  std::vector<GramBlock> blocks;
  Eigen::MatrixXd prior = {};  ///< of the shared unknowns: [J_s r_0]^T [J_s r_0] of unit variance, or empty
  NoisePrior noise = {};
};

/// The least squares solution for given standard deviations, group unknowns eliminated.
struct LinearSolution {
  Eigen::MatrixXd information;  ///< of the shared unknowns, group unknowns marginalised
  Eigen::VectorXd shared;
  std::vector<Eigen::VectorXd> own;
  Eigen::VectorXd squares;     ///< of each component: sum of squared residuals, unweighted
  Eigen::VectorXd redundancy;  ///< of each component: residuals minus the unknowns they pay for
  double deviance = 0;         ///< -2 log restricted likelihood, and prior of the noise, up to a constant
};
LinearSolution solve_linear(const LinearModel& model, const std::vector<double>& sigmas);

struct VarianceComponents {
  std::vector<double> sigmas;
  Eigen::MatrixXd log_covariance;  ///< of log sigma; wide where a component cannot be told from 0
  double gain = 0;                 ///< fall of the deviance from the start
  int iterations = 0;
  bool converged = false;
};

/// Restricted maximum likelihood (Patterson and Thompson 1971). Its equations, squares = redundancy sigma^2
/// for each component, are also the fixed point of Helmert's and Foerstner's iterations; here Newton's method
/// on log sigma. Components without residuals and without a ratio keep their start; none falls below `floor`.
VarianceComponents estimate_variance_components(const LinearModel& model, const std::vector<double>& start,
                                                const std::vector<double>& floor);

/// Covariance of the shared unknowns that knows that the noise levels are estimates: the mean of Phi(sigma)
/// and the spread of the solution over the likelihood of log sigma, along each of its principal axes. For one
/// component the variance of Student's distribution; to second order what Kackar and Harville 1984 and
/// Kenward and Roger 1997 give in closed form.
Eigen::MatrixXd adjusted_covariance(const LinearModel& model, const VarianceComponents& components);

/// Student's distribution of six numbers has longer tails than the normal one of its covariance: the factor
/// by which that has to grow for chi-square's 99 % region to hold 99 % of it. dof: degrees of freedom,
/// above 2.
double tail_growth(double dof);

}  // namespace flash::calib
