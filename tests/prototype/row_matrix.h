#pragma once
#include <memory>
#include <vector>

#include "sim/cpu/block_cholesky.h"
#include "sim/cpu/sheet_product.h"
#include "sim/newton/newton_matrix.h"

namespace flash::sim {

/// A row of the linear problem: the vertices of a touch are to part by `gap` less `compliance` times the
/// force that it adds.
struct ContactRow {
  const LayerTouch& touch;
  Vector3<double> push;  ///< what a newton of the row does to the first feature: n less its friction
  double gap;            ///< t - d [m]
  double compliance;     ///< [m/N]
};

/// The linear problem of an iteration with rows on multipliers, in the motion u of the vertices and the
/// forces q that the rows add:
///
///   P A u - P F q = -P gradient,   G u + E q = gap
///
/// over the free directions P. GMRES solves it, preconditioned by the factor B of the sheet alone, whose
/// pattern stays, and by the diagonal of the Schur complement G D^-1 G^T + E with the diagonal blocks D of B.
class RowMatrix {
 public:
  explicit RowMatrix(std::shared_ptr<const SheetPlan> plan);

  /// Factorizes the preconditioner. Returns false where it is not positive definite.
  bool factorize(const BlockValues<double>& positive);

  /// The matrix: as in NewtonMatrix, with the `friction` of layers; and the rows.
  void assign(const BlockValues<double>& blocks, bool sparse, const std::vector<ScaledBending>& bending,
              const std::vector<TouchStiffness>& friction, std::vector<ContactRow> rows);

  /// Solves to a share of the first residual, as NewtonMatrix::solve_coupled. Fills in the forces of the
  /// rows.
  int solve(const ContactSet& contacts, const std::vector<Eigen::Matrix3d>& couplings,
            const data::Points& gradient, data::Points& direction, Eigen::VectorXd& forces,
            data::Points& force);

 private:
  Eigen::VectorXd image(const Eigen::VectorXd& motion);          ///< A u
  Eigen::VectorXd solved(const Eigen::VectorXd& right);          ///< B^-1
  Eigen::VectorXd push_of(const Eigen::VectorXd& forces) const;  ///< F q
  Eigen::VectorXd parting(const Eigen::VectorXd& motion) const;  ///< G u

  std::shared_ptr<const SheetPlan> plan_;
  BlockCholesky<float> factor_;
  SheetProduct<double> product_;
  std::vector<Eigen::Matrix3d> diagonal_;  ///< D^-1
  std::vector<ContactRow> rows_;
};

}  // namespace flash::sim
