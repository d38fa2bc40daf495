#pragma once
#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <array>
#include <memory>
#include <vector>

#include "data/asset/material.h"
#include "sim/plan/sheet_plan.h"

namespace flash::sim {

/// The matrix of a ProjectiveSystem, and its masses [kg].
struct ProjectiveMatrix {
  Eigen::VectorXd mass;
  Eigen::SparseMatrix<double> matrix;
};
ProjectiveMatrix projective_matrix(const SheetPlan& plan, const std::vector<data::SheetMaterial>& materials,
                                   double time_step);

/// The constant system matrix of projective dynamics, one scalar matrix for the three coordinates,
///
///     A = M (1 + h air_drag) + (h^2 + h stiffness_damping) (sum_e w a_e G_e^T G_e + K_b)   [kg],
///
/// with w = 2 mu + 2 max(lambda, 0), which bounds the corotational stress from above. K_b is a sparse
/// stand-in for the bending stiffness: the plate's without its small entries, or the isometric one for
/// hinges. Factored once a material; everything else here follows from it.
class ProjectiveSystem {
 public:
  /// `materials`: of each body of the plan.
  ProjectiveSystem(const SheetPlan& plan, const std::vector<data::SheetMaterial>& materials,
                   double time_step);
  ~ProjectiveSystem();
  ProjectiveSystem(ProjectiveSystem&&) noexcept;

  const Eigen::VectorXd& mass() const { return mass_; }  ///< [kg], one a vertex
  const Eigen::SparseMatrix<double>& matrix() const { return matrix_; }

  /// Holds the listed vertices still along each axis until the next call: A^-1 below is then the inverse on
  /// what stays free, A^-1 - A^-1 B^T (B A^-1 B^T)^-1 B A^-1.
  void hold(const std::array<std::vector<int>, 3>& held);

  /// A^-1 b with the held coordinates still; b and the result are vertices x 3.
  data::Points solve(const data::Points& b) const;

  /// (A^-1)_{ij} along each axis, with the held coordinates still [1/kg]. Costs one solve for a vertex not
  /// asked before.
  Eigen::Vector3d inverse(int i, int j) const;

 private:
  struct Factor;
  struct Held {
    std::vector<int> vertices;
    Eigen::MatrixXd response;  ///< (B A^-1 B^T)^-1 B A^-1, held x vertices
  };
  const Eigen::VectorXd& column(int vertex) const;

  Eigen::VectorXd mass_;
  Eigen::SparseMatrix<double> matrix_;
  std::unique_ptr<Factor> factor_;
  std::array<Held, 3> held_;
  mutable std::vector<Eigen::VectorXd> columns_;  ///< columns of A^-1, as far as asked for
};

}  // namespace flash::sim
