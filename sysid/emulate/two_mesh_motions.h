#pragma once
#include <Eigen/SparseCore>
#include <functional>
#include <memory>
#include <optional>

#include "sysid/emulate/motion_interpolant.h"
#include "sysid/emulate/sensitivity.h"
#include "sysid/replay/motion_store.h"
#include "sysid/replay/replay.h"

namespace flash::sysid {

/// The steps of a motion whose positions a keyframe reads; all where the clock is fitted.
std::vector<bool> steps_read(const Replay& replay, double start, double step, std::size_t count);

/// a += share b, at the steps that a keeps.
void add(Motion& a, double share, const Motion& b);

/// Maps positions on one mesh of a sheet to those that its triangles give the vertices of another, by where
/// these lie at rest.
Eigen::SparseMatrix<double> prolongation(const data::TriangleMesh& from, const data::TriangleMesh& to);

/// The motions of one recording at any values between those simulated, without simulating: those of the
/// search's mesh, and what they lack of those of a finer one. With P the prolongation to the finer mesh,
///
///     x(p) = P x_coarse(p) + share (x_fine(p) - P x_coarse(p))
///
/// the difference being far smaller and smoother than the motions, so that fewer values do for it, one at
/// least (an additive correction between models of two fidelities). share 0 leaves the search's own motions,
/// 1 gives the finer ones, 4/3 extrapolates to cells of no size: the error of linear triangles is of second
/// order (Richardson 1911).
class TwoMeshMotions {
 public:
  explicit TwoMeshMotions(MotionInterpolant coarse) : coarse_(std::move(coarse)) {}
  TwoMeshMotions(MotionInterpolant coarse, MotionInterpolant difference,
                 std::shared_ptr<const Eigen::SparseMatrix<double>> prolongation)
      : coarse_(std::move(coarse)),
        difference_(std::move(difference)),
        prolongation_(std::move(prolongation)) {}

  /// The motion at `values`, one an axis, or motions at several points; the steps on up to `threads` threads.
  Motion at(const std::vector<double>& values, double share, int threads = 1) const;
  std::vector<Motion> at_points(const std::vector<std::vector<double>>& points, double share,
                                int threads = 1) const;

  /// Those of the search's mesh alone, on it.
  TwoMeshMotions on_own_mesh() const { return TwoMeshMotions(coarse_); }

  /// A motion of the search's mesh on the mesh of the model.
  Motion on_its_mesh(const Motion& motion) const;

 private:
  friend class TwoMeshSlice;

  MotionInterpolant coarse_;
  std::optional<MotionInterpolant> difference_;
  std::shared_ptr<const Eigen::SparseMatrix<double>> prolongation_;
};

/// Every other value of each axis of more than three, and the last.
std::vector<Axis> thinned(const std::vector<Axis>& axes);

/// What stands in for the simulation of one recording.
struct ModelledReplay {
  Replay replay;  ///< on the mesh that the model's motions are of
  TwoMeshMotions model;
};

/// The models as a source of motions.
MotionsAt motions_of(const std::vector<ModelledReplay>& models, double share);

/// The motions at every point of `grid.axes`, from the store where it has them. Empty where one diverged.
std::optional<MotionInterpolant> motion_interpolant(const Replay& replay, const GridSettings& grid,
                                                    const MotionStore& store,
                                                    const std::function<void()>& told = {});

/// `motions` with what they lack of a finer mesh, that of `fine`, which is simulated at the points of `axes`.
/// Empty where one diverged.
std::optional<ModelledReplay> with_finer_mesh(const Replay& replay, const Replay& fine,
                                              const MotionInterpolant& motions, const std::vector<Axis>& axes,
                                              const GridSettings& grid, const MotionStore& store,
                                              const std::function<void()>& told = {});

}  // namespace flash::sysid
