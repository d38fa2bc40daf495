#include "sim/plan/decaying_solution.h"

#include <gtest/gtest.h>

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "data/mesh/procedural_mesh.h"
#include "sim/plan/morley.h"

namespace flash::sim {
namespace {

using Sparse = Eigen::SparseMatrix<double>;

constexpr double length = 0.6, width = 0.1;

/// The slopes of a plate, whose decay is the slower the nearer nu is to one.
struct Slopes {
  std::string name;
  Sparse A, B;
  Eigen::VectorXd limits;
  Eigen::Matrix2Xd places;
};

Slopes slopes_of(const std::string& name, const data::TriangleMesh& mesh, double nu,
                 const data::Weave& weave = {}, bool clamped = false) {
  const Sheet sheet = make_sheet(mesh);
  const MorleyPlate plate = morley_plate(sheet, nu, weave);
  const Eigen::Matrix2Xd places = mesh.vertices.leftCols<2>().transpose();
  std::vector<Eigen::Triplet<double>> select;
  std::vector<double> limits;
  for (int i = 0; i < int(plate.edges.size()); ++i) {
    const Edge& e = plate.edges[i];
    if (clamped && e.right < 0 && std::max(places(0, e.a), places(0, e.b)) < 1e-9) continue;
    select.emplace_back(i, int(limits.size()), 1.0);
    const double area = sheet.triangles[e.left].area + (e.right >= 0 ? sheet.triangles[e.right].area : 0.0);
    limits.push_back(1e-3 * (places.col(e.a) - places.col(e.b)).norm() / area);
  }
  const auto free = Eigen::Index(limits.size());
  Sparse P(Eigen::Index(plate.edges.size()), free);
  P.setFromTriplets(select.begin(), select.end());
  return {name + ", nu " + std::to_string(nu), P.transpose() * plate.ee * P,
          -Sparse((plate.xe * P).transpose()), Eigen::Map<Eigen::VectorXd>(limits.data(), free), places};
}

// Strips along which a cluster of columns has others beyond its rows.
std::vector<Slopes> strips() {
  const data::TriangleMesh grid =
      data::rectangle({length, width, 54, 9, data::DiagonalPattern::alternating, 0.25, 1});
  const data::TriangleMesh irregular = data::delaunay_rectangle(length, width, 0.011, 1);
  data::TriangleMesh graded = grid;  // cells at one end a thirteenth as long as at the other
  graded.vertices.col(0) =
      grid.vertices.col(0).array() * (0.15 + 0.85 * grid.vertices.col(0).array() / length);
  std::vector<Slopes> all;
  for (const double nu : {0.0, 0.3, 0.45}) {
    all.push_back(slopes_of("grid", grid, nu));
    all.push_back(slopes_of("irregular", irregular, nu));
    all.push_back(slopes_of("graded", graded, nu));
  }
  all.push_back(slopes_of("woven", irregular, 0.3, {3, 1.2, 0.4}));
  all.push_back(slopes_of("clamped", irregular, 0.3, {}, true));
  all.push_back(slopes_of("irregular", irregular, 0.9));
  return all;
}

// Against the solution on all rows at once.
TEST(DecayingSolution, IsTheWholeSolutionWithinTheMovesOfRowsNotSolved) {
  for (const Slopes& s : strips()) {
    SCOPED_TRACE(s.name);
    const Eigen::SimplicialLDLT<Sparse> factor(s.A);
    const Eigen::MatrixXd whole = factor.solve(Eigen::MatrixXd(s.B));
    const Eigen::MatrixXd moves =
        factor.solve(Eigen::MatrixXd(Eigen::VectorXd(s.limits.cwiseProduct(s.A.diagonal())).asDiagonal()));
    const Eigen::VectorXd error = 1e-3 * moves.cwiseAbs().rowwise().sum();
    Eigen::MatrixXd left = whole;  // of what has no entry
    double worst = 0;
    const auto found = decaying_solution(s.A, s.B, s.limits, s.places);
    for (Eigen::Index i = 0; i < found.rows(); ++i)
      for (Eigen::SparseMatrix<double, Eigen::RowMajor>::InnerIterator it(found, i); it; ++it) {
        worst = std::max(worst, std::abs(it.value() - whole(i, it.col())) / error[i]);
        left(i, it.col()) = 0;
      }
    EXPECT_LE(worst, 1);
    EXPECT_LT(worst, 0.01);  // what moves lies away from what is kept
    EXPECT_LE((left.cwiseAbs().rowwise().maxCoeff() - s.limits - error).maxCoeff(), 0);
    EXPECT_LT(found.nonZeros(), whole.size() / 4);
    for (int c = 0; c < s.B.cols(); ++c)
      for (Sparse::InnerIterator it(s.B, c); it; ++it) ASSERT_EQ(left(it.row(), c), 0);
  }
}

TEST(DecayingSolution, LimitsOfZeroAreExact) {
  const Slopes s = slopes_of("irregular", data::delaunay_rectangle(length, width, 0.011, 1), 0.45);
  const Eigen::MatrixXd whole = Eigen::SimplicialLDLT<Sparse>(s.A).solve(Eigen::MatrixXd(s.B));
  const auto found = decaying_solution(s.A, s.B, Eigen::VectorXd::Zero(s.B.rows()), s.places);
  EXPECT_EQ(found.nonZeros(), whole.size());
  EXPECT_LT((Eigen::MatrixXd(found) - whole).cwiseAbs().maxCoeff(), 1e-12 * whole.cwiseAbs().maxCoeff());
}

// Rows that nothing joins to the columns are never reached, and columns may have none.
TEST(DecayingSolution, OfPartsThatAreNotJoinedIsThatOfEach) {
  Sparse A(4, 4), B(4, 3);
  const std::vector<Eigen::Triplet<double>> a = {{0, 0, 2.0}, {0, 1, 1.0}, {1, 0, 1.0},
                                                 {1, 1, 2.0}, {2, 2, 4.0}, {3, 3, 1.0}},
                                            b = {{0, 0, 3.0}, {2, 1, 1.0}};
  A.setFromTriplets(a.begin(), a.end());
  B.setFromTriplets(b.begin(), b.end());
  Eigen::MatrixXd expected = Eigen::MatrixXd::Zero(4, 3);
  expected.col(0) << 2, -1, 0, 0;
  expected(2, 1) = 0.25;
  for (const double limit : {0.0, 0.1}) {
    const auto found =
        decaying_solution(A, B, Eigen::VectorXd::Constant(4, limit), Eigen::Matrix2Xd::Zero(2, 3));
    EXPECT_LT((Eigen::MatrixXd(found) - expected).norm(), 1e-15) << limit;
  }
}

}  // namespace
}  // namespace flash::sim
