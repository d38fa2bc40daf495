#include "sim/plan/morley.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/SparseCholesky>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "data/files/error.h"
#include "data/mesh/procedural_mesh.h"

namespace flash::sim {
namespace {

using data::DiagonalPattern;
using Sparse = Eigen::SparseMatrix<double>;

constexpr double strip_length = 0.2, strip_width = 0.02;

struct NamedMesh {
  const char* name;
  data::TriangleMesh mesh;
};

// Forty cells along the strip.
std::vector<NamedMesh> strips() {
  const auto cut = [](DiagonalPattern pattern) {
    return data::rectangle({strip_length, strip_width, 40, 4, pattern, 0.25, 1});
  };
  return {{"one_way", cut(DiagonalPattern::one_way)},
          {"alternating", cut(DiagonalPattern::alternating)},
          {"alternating_by_row", cut(DiagonalPattern::alternating_by_row)},
          {"jittered", cut(DiagonalPattern::jittered)},
          {"delaunay", data::delaunay_rectangle(strip_length, strip_width, 0.005, 1)}};
}

// Out-of-plane deflections under a transverse force a vertex; fixed vertices stay at zero.
Eigen::VectorXd deflection(const Sparse& stiffness, const Eigen::VectorXd& force,
                           const std::vector<bool>& fixed) {
  std::vector<Eigen::Triplet<double>> entries;
  int free = 0;
  for (int i = 0; i < int(fixed.size()); ++i)
    if (!fixed[i]) entries.emplace_back(i, free++, 1.0);
  Sparse P(Eigen::Index(fixed.size()), free);
  P.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Sparse> factor(Sparse(P.transpose() * stiffness * P));
  return P * factor.solve(Eigen::VectorXd(P.transpose() * force));
}

std::vector<ClampedEdge> clamps_at_left_end(const Sheet& sheet) {
  std::vector<ClampedEdge> clamps;
  for (const Edge& e : sheet_edges(sheet))
    if (e.right < 0 && sheet.rest.vertices(e.a, 0) < 1e-9 && sheet.rest.vertices(e.b, 0) < 1e-9)
      clamps.push_back({e.a, e.b, -Eigen::Vector3d::UnitX()});
  return clamps;
}

double tip_over_beam_theory(const data::TriangleMesh& mesh, double drop_tolerance) {
  const Sheet sheet = make_sheet(mesh);
  const CondensedPlate plate = condensed_plate(sheet, 0.0, clamps_at_left_end(sheet), drop_tolerance);
  const auto n = mesh.vertices.rows();
  std::vector<bool> fixed(n);
  for (int i = 0; i < n; ++i) fixed[i] = mesh.vertices(i, 0) < 1e-9;
  const double load = 1.0;  // [N/m^2] over D = 1
  const Eigen::VectorXd w = deflection(plate.stiffness, plate.force.col(2) + load * sheet.vertex_area, fixed);
  double tip = 0;
  int count = 0;
  for (int i = 0; i < n; ++i)
    if (mesh.vertices(i, 0) > strip_length - 1e-9) tip += w[i], ++count;
  return tip / count / (load * std::pow(strip_length, 4) / 8);
}

TEST(Morley, CantileverBendsAsTheBeamOnEveryMesh) {
  for (const NamedMesh& strip : strips()) {
    SCOPED_TRACE(strip.name);
    EXPECT_NEAR(tip_over_beam_theory(strip.mesh, 0.0), 1.0,
                0.003);  // h^2 of 40 cells, and lumping of the load
    EXPECT_NEAR(tip_over_beam_theory(strip.mesh, 1e-6), 1.0, 0.005);
  }
}

/// The energy of a plate whose deflection w = x k x / 2 has its exact slopes, and how far rounding may move
/// it: what is left of terms of either sign that are larger by far.
struct BentEnergy {
  double energy, rounding;
};

BentEnergy bent_energy(const data::TriangleMesh& mesh, const MorleyPlate& plate, const Eigen::Matrix2d& k) {
  Eigen::VectorXd w(mesh.vertices.rows()), slope(Eigen::Index(plate.edges.size()));
  const auto at = [&](int i) -> Eigen::Vector2d { return mesh.vertices.row(i).head<2>(); };
  for (int i = 0; i < w.size(); ++i) w[i] = 0.5 * at(i).dot(k * at(i));
  for (int i = 0; i < slope.size(); ++i) {
    const Edge& e = plate.edges[i];
    const Eigen::Vector2d t = (at(e.b) - at(e.a)).normalized();
    slope[i] = Eigen::Vector2d(t.y(), -t.x()).dot(k * 0.5 * (at(e.a) + at(e.b)));
  }
  const Eigen::VectorXd a = w.cwiseAbs(), b = slope.cwiseAbs();
  const double terms = 0.5 * a.dot(plate.xx.cwiseAbs() * a) + a.dot(plate.xe.cwiseAbs() * b) +
                       0.5 * b.dot(plate.ee.cwiseAbs() * b);
  return {0.5 * w.dot(plate.xx * w) + w.dot(plate.xe * slope) + 0.5 * slope.dot(plate.ee * slope),
          std::numeric_limits<double>::epsilon() * terms};
}

// w = kappa x^2/2 with its exact slopes has the plate energy exactly, on any mesh.
TEST(Morley, CylinderAndSaddleAndBowlHaveTheEnergyOfTheContinuousPlate) {
  const double nu = 0.3;
  for (const NamedMesh& strip : strips()) {
    const Sheet sheet = make_sheet(strip.mesh);
    const MorleyPlate plate = morley_plate(sheet, nu);
    const double area = strip_length * strip_width;
    for (const auto& [k11, k22, k12] :
         {std::array{0.7, 0.0, 0.0}, {0.7, -0.7, 0.0}, {0.5, 0.5, 0.0}, {0.3, 0.1, 0.4}}) {
      Eigen::Matrix2d k;
      k << k11, k12, k12, k22;
      const BentEnergy found = bent_energy(strip.mesh, plate, k);
      const double expected = 0.5 * area * (nu * k.trace() * k.trace() + (1 - nu) * k.squaredNorm());
      EXPECT_NEAR(found.energy, expected, found.rounding) << strip.name;
    }
  }
}

// The same of a woven sheet, whose curvatures count along warp and weft.
TEST(Morley, AWovenSheetHasTheEnergyOfHubersPlate) {
  const double nu = 0.3, degree = std::acos(-1.0) / 180;
  for (const NamedMesh& strip : strips())
    for (const data::Weave& weave : {data::Weave{3, 1, 0}, {0.2, 1.7, 25 * degree}, {2, 0.4, -70 * degree}}) {
      const Sheet sheet = make_sheet(strip.mesh);
      const MorleyPlate plate = morley_plate(sheet, nu, weave);
      Eigen::Matrix2d k;
      k << 0.3, 0.4, 0.4, -0.1;
      const Eigen::Vector2d warp(std::cos(weave.warp_direction), std::sin(weave.warp_direction)),
          weft(-warp.y(), warp.x());
      const double along = warp.dot(k * warp), across = weft.dot(k * weft), twist = warp.dot(k * weft),
                   mean = std::sqrt(weave.bending_ratio);
      const double expected =
          0.5 * strip_length * strip_width *
          (along * along + weave.bending_ratio * across * across + 2 * nu * mean * along * across +
           2 * (1 - nu) * weave.twisting_ratio * mean * twist * twist);
      const BentEnergy found = bent_energy(strip.mesh, plate, k);
      EXPECT_NEAR(found.energy, expected, found.rounding) << strip.name;
    }
}

// Warp and weft change places, and the sheet may be turned with them.
TEST(Morley, AWeaveTurnsWithItsDirection) {
  const double right = std::acos(0.0);
  const data::TriangleMesh mesh = data::rectangle({0.2, 0.1, 8, 4, DiagonalPattern::jittered, 0.25, 3});
  const Sheet sheet = make_sheet(mesh);
  const Sparse turned = plate_bending_stiffness(sheet, 0.3, 0.0, {3, 1.2, right}),
               exchanged = 3 * plate_bending_stiffness(sheet, 0.3, 0.0, {1.0 / 3, 1.2, 0});
  EXPECT_LT((turned - exchanged).norm(), 1e-10 * turned.norm());
  data::TriangleMesh other = mesh;
  other.vertices =
      mesh.vertices * Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitZ()).toRotationMatrix().transpose();
  EXPECT_LT((plate_bending_stiffness(make_sheet(other), 0.3, 0.0, {3, 1.2, right + 0.5}) - turned).norm(),
            1e-10 * turned.norm());
  // Upside down the normals look down, and the direction counts the other way.
  other.vertices = mesh.vertices;
  other.triangles.col(1).swap(other.triangles.col(2));
  const Sparse seen = plate_bending_stiffness(sheet, 0.3, 0.0, {3, 1.2, 0.4});
  EXPECT_LT((plate_bending_stiffness(make_sheet(other), 0.3, 0.0, {3, 1.2, -0.4}) - seen).norm(),
            1e-10 * seen.norm());
}

// A strip bent by end moments curves by -nu of its curvature across: then, and not as a cylinder, it needs no
// force away from its ends.
TEST(Morley, FreeStripBendsAnticlastically) {
  const double nu = 0.4;
  const Sheet sheet = make_sheet(data::rectangle({0.2, 0.1, 20, 10, DiagonalPattern::jittered, 0.25, 2}));
  const Sparse S = plate_bending_stiffness(sheet, nu, 0.0);
  const Eigen::ArrayXd x = sheet.rest.vertices.col(0).array() - 0.1,
                       y = sheet.rest.vertices.col(1).array() - 0.05;
  const auto inner_force = [&](double across) {
    const Eigen::VectorXd w = 0.5 * (x.square() + across * y.square());
    const Eigen::ArrayXd force = (S * w).array().abs();
    return (x.abs() < 0.05).select(force, 0.0).maxCoeff();
  };
  EXPECT_LT(inner_force(-nu), 0.01 * inner_force(0.0));  // the ends' edge unknowns decay over five cells
}

TEST(Morley, AffinePositionsCostNothingAndTurningTheSheetChangesNothing) {
  const data::TriangleMesh mesh = data::delaunay_rectangle(0.1, 0.1, 0.01, 5);
  const Sparse S = plate_bending_stiffness(make_sheet(mesh), 0.3);
  EXPECT_LT((S * mesh.vertices).cwiseAbs().maxCoeff(), 1e-12 * S.diagonal().maxCoeff());
  EXPECT_LT((S * Eigen::VectorXd::Ones(S.rows())).cwiseAbs().maxCoeff(), 1e-12 * S.diagonal().maxCoeff());
  EXPECT_LT((S - Sparse(S.transpose())).norm(), 1e-13 * S.norm());
  data::TriangleMesh turned = mesh;
  turned.vertices = mesh.vertices * Eigen::Quaterniond(0.3, -0.5, 0.7, 0.2).normalized().toRotationMatrix();
  turned.vertices.rowwise() += Eigen::RowVector3d(0.4, -2.0, 1.0);
  EXPECT_LT((plate_bending_stiffness(make_sheet(turned), 0.3, 0.0) -
             plate_bending_stiffness(make_sheet(mesh), 0.3, 0.0))
                .norm(),
            1e-10 * S.norm());
}

TEST(Morley, DroppingSmallWeightsOnlyStiffensAndBarely) {
  for (const NamedMesh& strip : strips()) {
    const Sheet sheet = make_sheet(strip.mesh);
    const Sparse exact = plate_bending_stiffness(sheet, 0.3, 0.0),
                 sparse = plate_bending_stiffness(sheet, 0.3);
    EXPECT_LT(sparse.nonZeros(), exact.nonZeros());
    for (unsigned seed = 0; seed < 50; ++seed) {
      // Waves of all lengths.
      const Eigen::ArrayXd phase = (7.0 + 9.0 * seed) * strip.mesh.vertices.col(0).array() +
                                   (3.0 + 5.0 * seed) * strip.mesh.vertices.col(1).array() + 0.3 * seed;
      const Eigen::VectorXd w = phase.sin();
      const double ratio = w.dot(sparse * w) / w.dot(exact * w);
      EXPECT_GE(ratio, 1 - 1e-9) << strip.name;
      EXPECT_LE(ratio, 1.005) << strip.name;  // the worst mode, see the header
    }
  }
}

// Weights decay slowly along long cells, and where a sheet twists easily.
TEST(Morley, LongCellsAndEasyTwistsKeepTheWeightsThatTheyNeed) {
  const auto grid = [](int x, int y) {
    return data::rectangle({0.2, 0.2, x, y, DiagonalPattern::one_way, 0.25, 1});
  };
  int rough = 0;
  for (const NamedMesh& of : {NamedMesh{"cells of like sides", grid(20, 20)}, {"long cells", grid(8, 40)}})
    for (const data::Weave& weave : {data::Weave{}, {3, 1.2, 0.4}, {20, 0.1, 0}}) {
      SCOPED_TRACE(of.name + (", twisting ratio " + std::to_string(weave.twisting_ratio)));
      const Sheet sheet = make_sheet(of.mesh);
      const CondensedPlate dropped = condensed_plate(sheet, 0.45, {}, 1e-6, weave);
      const Sparse exact = condensed_plate(sheet, 0.45, {}, 0, weave).stiffness,
                   kept = plate_bending_stiffness(sheet, 0.45, 1e-6, weave);
      const Eigen::ArrayXd x = sheet.rest.vertices.col(0).array() - 0.1,
                           y = sheet.rest.vertices.col(1).array() - 0.1;
      Eigen::MatrixX3d bent(x.size(), 3);
      bent << x * x, x * y, y * y;
      const Eigen::Matrix3d least = bent.transpose() * exact * bent,
                            more = bent.transpose() * (dropped.stiffness * bent - exact * bent);
      const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::Matrix3d> excess(more, least);
      EXPECT_NEAR(dropped.excess, excess.eigenvalues().maxCoeff(), 1e-6 * (1 + dropped.excess));
      if (dropped.excess > 0.01)
        ++rough;
      else
        EXPECT_EQ((kept - dropped.stiffness).norm(), 0);
      for (unsigned seed = 0; seed < 12; ++seed) {
        const Eigen::VectorXd w = ((2.0 + 9.0 * seed) * x + (3.0 + 5.0 * (seed % 5)) * y + 0.3 * seed).sin();
        const double ratio = w.dot(kept * w) / w.dot(exact * w);
        EXPECT_GE(ratio, 1 - 1e-9);
        EXPECT_LE(ratio, 1.01);
      }
    }
  EXPECT_EQ(rough, 4);  // all but two of like sides
}

// On one row of cells y^2 is the same everywhere, and costs nothing but rounding.
TEST(Morley, OneRowOfCellsHasNoExcessWhereNothingIsDropped) {
  const Sheet sheet = make_sheet(data::rectangle({0.4, 0.01, 40, 1, DiagonalPattern::one_way, 0.25, 1}));
  EXPECT_LT(std::abs(condensed_plate(sheet, 0.3, {}, 0).excess), 1e-6);
  const CondensedPlate dropped = condensed_plate(sheet, 0.3, {});
  EXPECT_GT(dropped.excess, 0);
  EXPECT_LT(dropped.excess, 0.01);
  EXPECT_EQ((plate_bending_stiffness(sheet, 0.3) - dropped.stiffness).norm(), 0);
}

/// The least energy over the slopes of the edges, those of `clamps` at zero.
double least_energy(const MorleyPlate& plate, const std::vector<ClampedEdge>& clamps,
                    const Eigen::VectorXd& w) {
  std::vector<bool> held(plate.edges.size());
  for (std::size_t i = 0; i < held.size(); ++i)
    for (const ClampedEdge& clamp : clamps)
      if (plate.edges[i].a == clamp.vertex_a && plate.edges[i].b == clamp.vertex_b) held[i] = true;
  const Eigen::VectorXd slope = deflection(plate.ee, -(plate.xe.transpose() * w), held);
  return 0.5 * (w.dot(plate.xx * w) + w.dot(plate.xe * slope));
}

void expect_least_energy(const Sheet& sheet, double nu, const data::Weave& weave,
                         const std::vector<ClampedEdge>& clamps, double most) {
  const MorleyPlate plate = morley_plate(sheet, nu, weave);
  const Sparse S = condensed_plate(sheet, nu, clamps, 1e-6, weave).stiffness;
  const Eigen::ArrayXd x = sheet.rest.vertices.col(0), y = sheet.rest.vertices.col(1);
  for (unsigned seed = 0; seed < 4; ++seed) {
    const Eigen::VectorXd w = ((7.0 + 90.0 * seed) * x + (3.0 + 50.0 * seed) * y + 0.3 * seed).sin();
    const double ratio = 0.5 * w.dot(S * w) / least_energy(plate, clamps, w);
    EXPECT_GE(ratio, 1 - 1e-9);
    EXPECT_LE(ratio, most);
  }
  // Positions of a plane keep their slopes, and so have that energy without any more.
  const Eigen::VectorXd plane = 0.3 * x - 0.2 * y;
  const double energy = 0.5 * plane.dot(S * plane);
  EXPECT_NEAR(energy, least_energy(plate, clamps, plane),
              1e-12 * plane.squaredNorm() * S.diagonal().maxCoeff());
  EXPECT_EQ(energy > 1e-3, !clamps.empty());
}

// Sheets of several thousand edges, which are solved part by part.
TEST(Morley, ALargeSheetHasItsLeastEnergyAndBarelyMore) {
  const data::TriangleMesh grid = data::rectangle({0.2, 0.2, 32, 32, DiagonalPattern::one_way, 0.25, 1});
  data::TriangleMesh graded = grid;  // cells with sides of up to one to thirteen
  graded.vertices = grid.vertices.array() * (0.15 + 0.85 / 0.2 * grid.vertices.array());
  for (const NamedMesh& of : {NamedMesh{"grid", grid}, NamedMesh{"graded", graded},
                              NamedMesh{"delaunay", data::delaunay_rectangle(0.2, 0.2, 0.00625, 1)}}) {
    const Sheet sheet = make_sheet(of.mesh);
    const std::vector<ClampedEdge> clamps = clamps_at_left_end(sheet);
    ASSERT_GT(clamps.size(), 30U);
    const data::Weave woven{3, 1.2, 0.4};
    const double most = of.name == std::string("graded") ? 1.02 : 1.008;  // see the header
    for (const double nu : {0.0, 0.3, 0.45}) {
      SCOPED_TRACE(of.name + (", nu " + std::to_string(nu)));
      expect_least_energy(sheet, nu, {}, {}, 1.008);
      expect_least_energy(sheet, nu, {}, clamps, 1.008);
      expect_least_energy(sheet, nu, woven, {}, most);
      expect_least_energy(sheet, nu, woven, clamps, most);
    }
  }
}

TEST(Morley, CondensedEnergyIsTheMinimumOverTheEdgeUnknowns) {
  const Sheet sheet = make_sheet(data::rectangle({0.05, 0.03, 5, 3, DiagonalPattern::jittered, 0.25, 4}));
  std::vector<ClampedEdge> clamps = clamps_at_left_end(sheet);
  for (ClampedEdge& clamp : clamps) clamp.slope = Eigen::Vector3d(-0.8, 0.1, 0.5);
  const MorleyPlate plate = morley_plate(sheet, 0.25);
  const CondensedPlate condensed = condensed_plate(sheet, 0.25, clamps, 0.0);
  data::Points x = sheet.rest.vertices;
  x.col(2) = 0.01 * (100 * x.col(0).array() + 30 * x.col(1).array()).sin();
  // Minimum by brute force: a penalty holds the clamped slopes.
  const double penalty = 1e9 * plate.ee.diagonal().maxCoeff();
  Eigen::MatrixXd ee(plate.ee), slopes = Eigen::MatrixXd::Zero(ee.rows(), 3),
                                right = -(plate.xe.transpose() * x);
  for (std::size_t i = 0; i < plate.edges.size(); ++i)
    for (const ClampedEdge& clamp : clamps)
      if (plate.edges[i].a == clamp.vertex_a && plate.edges[i].b == clamp.vertex_b) {
        ee(Eigen::Index(i), Eigen::Index(i)) += penalty;
        right.row(Eigen::Index(i)) += penalty * clamp.slope;
      }
  const Eigen::MatrixXd theta = ee.llt().solve(right);
  const double minimum = 0.5 * x.cwiseProduct(plate.xx * x).sum() + x.cwiseProduct(plate.xe * theta).sum() +
                         0.5 * theta.cwiseProduct(plate.ee * theta).sum();
  const double energy = 0.5 * x.cwiseProduct(condensed.stiffness * x).sum() -
                        condensed.force.cwiseProduct(x).sum() + condensed.constant;
  EXPECT_NEAR(energy, minimum, 1e-6 * minimum);  // the penalty's 1e-9, of slopes that nearly cancel
}

TEST(Morley, RefusesWhatItCannotDescribe) {
  data::TriangleMesh mesh = data::rectangle({0.1, 0.1, 4, 4, DiagonalPattern::one_way, 0.25, 1});
  EXPECT_THROW(plate_bending_stiffness(make_sheet(mesh), 1.0), data::InputError);
  EXPECT_THROW(condensed_plate(make_sheet(mesh), 0.3, {{0, 24, Eigen::Vector3d::UnitX()}}), data::InputError);
  mesh.vertices(12, 2) = 0.01;
  EXPECT_THROW(plate_bending_stiffness(make_sheet(mesh), 0.3), data::InputError);
}

}  // namespace
}  // namespace flash::sim
