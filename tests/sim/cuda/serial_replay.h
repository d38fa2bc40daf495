#pragma once
#include <memory>
#include <vector>

#include "sim/cuda/batch_replay.h"
#include "sim/cuda/replay_numbers.h"

namespace flash::sim::cuda {

/// A point on the way to the end of the next step, vertices in the order of the mesh (Iterate).
struct SerialIterate {
  data::Points force, residual;  ///< [N]
  double potential;              ///< with springs and damping, without friction [J]
  ElasticEnergies elastic;
  double friction;       ///< [J]
  double residual_norm;  ///< [N]
  bool balanced;         ///< to the tolerance
};

/// Steps of one environment by the text that kernels run, by one thread of the processor
/// (sim/cuda/serial_team.h). Each piece of a team's memory is a block of its own, as long as it has to be, so
/// that sanitizers see what leaves it. Memory that nothing has written yet is no number.
class SerialReplay {
 public:
  /// `on_chip`: whether what has room on a device's chip is there, or in memory.
  SerialReplay(std::shared_ptr<const SheetPlan> plan, const ReplayEnvironment& environment,
               const ReplaySettings& settings, bool on_chip = true);
  ~SerialReplay();

  /// Takes the next steps, settings.steps of them in all.
  void advance(int steps);

  data::Points positions() const;   ///< [m]
  data::Points velocities() const;  ///< [m/s]
  data::Points bristles() const;    ///< as in State
  const std::vector<ReplayStats>& stats() const;
  std::vector<Eigen::Vector3d> hold_forces(int step) const;      ///< [N]
  std::vector<Eigen::Vector3d> obstacle_forces(int step) const;  ///< [N]

  // Of the next step as a whole, which it does not take.

  SerialIterate evaluate(const data::Points& positions);
  /// The matrix of the linear problem at `positions` times `x`, exact or `positive`.
  data::Points matrix_product(const data::Points& positions, bool positive, const data::Points& x);
  /// The inverse of the factorized matrix at `positions` times `b`.
  data::Points factor_solve(const data::Points& positions, const data::Points& b);

 private:
  struct Memory;
  std::unique_ptr<Memory> memory_;
};

}  // namespace flash::sim::cuda
