#pragma once
#include <Eigen/Core>
#include <functional>

namespace flash::sysid {

struct EnsembleSettings {
  int burn_in = 200;  ///< sweeps that are thrown away
  int sweeps = 800;   ///< of all walkers; each keeps its walkers' places
  int keep_every = 4;
  unsigned seed = 1;
};

/// Draws from exp(log_density) by the affine-invariant ensemble of Goodman and Weare 2010, stretch moves with
/// a = 2. `start`: a walker a row, at finite densities and not all in one plane, twice as many as there are
/// coordinates at least. Returns a draw a row. The same seed gives the same ones.
Eigen::MatrixXd sample_ensemble(const std::function<double(const Eigen::VectorXd&)>& log_density,
                                const Eigen::MatrixXd& start, const EnsembleSettings& settings = {});

}  // namespace flash::sysid
