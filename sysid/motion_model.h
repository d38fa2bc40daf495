#pragma once
#include <Eigen/SparseCore>
#include <memory>
#include <optional>

#include "sysid/motion_surface.h"
#include "sysid/replay.h"
#include "sysid/rollout_store.h"
#include "sysid/sensitivity.h"

namespace flash::sysid {

/// a += share b, at the steps that a keeps.
void add(Motion& a, double share, const Motion& b);

/// Maps positions on one mesh of a sheet to those that its triangles give the vertices of another, by where
/// these lie at rest.
Eigen::SparseMatrix<double> prolongation(const data::TriangleMesh& from, const data::TriangleMesh& to);

/// The motions of one recording at any values in the searched range, without simulating: those of the
/// search's mesh, and what they lack of those of a finer one. With P the prolongation to the finer mesh,
///
///     x(p) = P x_coarse(p) + share (x_fine(p) - P x_coarse(p))
///
/// the difference being far smaller and smoother than the motions, so that three values an axis do for it
/// (an additive correction between models of two fidelities). share 0 leaves the search's
/// own motions, 1 gives the finer ones, 4/3 extrapolates to cells of no size: the error of linear triangles
/// is of second order (Richardson 1911).
class MotionModel {
 public:
  explicit MotionModel(MotionSurface coarse) : coarse_(std::move(coarse)) {}
  MotionModel(MotionSurface coarse, MotionSurface difference,
              std::shared_ptr<const Eigen::SparseMatrix<double>> prolongation)
      : coarse_(std::move(coarse)),
        difference_(std::move(difference)),
        prolongation_(std::move(prolongation)) {}

  /// At values, one an axis that is left.
  Motion at(const std::vector<double>& values, double share) const;

  /// With the first axis held.
  MotionModel slice(double value) const;

  /// Adds `difference`, on the mesh of the model, to every motion from now on: what a simulation at one point
  /// has beyond the model there makes it exact at that point and better around it.
  void correct(const Motion& difference);

  /// A motion of the search's mesh on the mesh of the model.
  Motion on_its_mesh(const Motion& motion) const;

 private:
  MotionSurface coarse_;
  std::optional<MotionSurface> difference_;
  std::shared_ptr<const Eigen::SparseMatrix<double>> prolongation_;
  std::shared_ptr<const Motion> correction_;
};

/// First, middle and last value of each axis.
std::vector<Axis> thinned(const std::vector<Axis>& axes);

/// What stands in for the simulation of one recording.
struct ModelledReplay {
  Replay replay;  ///< on the mesh that the model's motions are of
  MotionModel model;
};

/// As a source of motions.
MotionsAt motions_of(const std::vector<ModelledReplay>& models, double share);

/// The motions of all candidates, from the store where it has them. With `finer`, those of a mesh of half the
/// cell at the thinned axes too. Empty where a candidate diverged, or where the sheet cannot be meshed anew.
std::optional<ModelledReplay> model_motions(const Replay& replay, const GridSettings& grid,
                                            const RolloutStore& store, bool finer);

}  // namespace flash::sysid
