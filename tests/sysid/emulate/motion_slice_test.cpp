#include "sysid/emulate/motion_slice.h"

#include <gtest/gtest.h>

#include <thread>

namespace flash::sysid {
namespace {

constexpr int kSteps = 3, kVertices = 4;

std::vector<Axis> axes() {
  return {parse_axis("friction", "0.1,0.3,0.5"), parse_axis("bending", "1e-5:1e-3:5:log"),
          parse_axis("poisson", "0,0.2,0.4")};
}

/// Numbers without any order in them, so that no two points of a grid can be mistaken for each other.
std::vector<Motion> motions_of(unsigned seed, int vertices) {
  std::srand(seed);
  std::vector<Motion> motions(cartesian_product(axes()).size());
  for (Motion& motion : motions) {
    motion = {0.1, 0.02, {}, {Eigen::Vector3d::Random(), Eigen::Vector3d::Random()}};
    for (int i = 0; i < kSteps; ++i)
      motion.positions.push_back(i == 1 ? data::Points(0, 3)
                                        : data::Points(data::Points::Random(vertices, 3)));
  }
  return motions;
}

/// Two thirds of each vertex and a third of the next.
std::shared_ptr<const Eigen::SparseMatrix<double>> to_finer() {
  Eigen::SparseMatrix<double> matrix(2 * kVertices, kVertices);
  for (int i = 0; i < 2 * kVertices; ++i) {
    matrix.coeffRef(i, i / 2) += 2.0 / 3;
    matrix.coeffRef(i, (i / 2 + 1) % kVertices) += 1.0 / 3;
  }
  return std::make_shared<const Eigen::SparseMatrix<double>>(matrix);
}

void expect_point(const TwoMeshMotions& whole, const std::vector<double>& point, const TwoMeshSlice& slice,
                  double share) {
  const Motion expected = whole.at(point, share);
  for (std::size_t i = 0; i < kSteps; ++i) {
    data::Points positions;
    slice.positions(i, share, positions);
    ASSERT_EQ(positions.rows(), expected.positions[i].rows());
    EXPECT_LT((positions - expected.positions[i]).norm(), 1e-12);  // rounding of numbers of order one
  }
  std::vector<Eigen::Vector3d> forces;
  slice.forces(share, forces);
  ASSERT_EQ(forces.size(), expected.forces.size());
  for (std::size_t i = 0; i < forces.size(); ++i) EXPECT_LT((forces[i] - expected.forces[i]).norm(), 1e-12);
}

TEST(MotionSlice, IsTheWholeInterpolantAtEveryPointWhateverItsMemoryHeldBefore) {
  const TwoMeshMotions whole(MotionInterpolant(axes(), motions_of(1, kVertices)),
                             MotionInterpolant(axes(), motions_of(2, 2 * kVertices)), to_finer());
  TwoMeshSlice root, first, second, third;
  root.take(whole);
  for (const double friction : {0.1, 0.27, 0.5}) {
    first.hold(root, friction);
    for (const double bending : {2e-5, 7e-4}) {
      second.hold(first, bending);
      for (const double poisson : {0.0, 0.11}) {
        third.hold(second, poisson);
        for (const double share : {0.0, 1.0, 4.0 / 3})
          expect_point(whole, {friction, bending, poisson}, third, share);
      }
    }
  }
}

TEST(MotionSlice, WithoutAFinerMeshIsTheSearchsOwn) {
  const TwoMeshMotions whole{MotionInterpolant(axes(), motions_of(3, kVertices))};
  TwoMeshSlice root, first, second, third;
  root.take(whole);
  first.hold(root, 0.2);
  second.hold(first, 1e-4);
  third.hold(second, 0.3);
  expect_point(whole, {0.2, 1e-4, 0.3}, third, 0);
}

TEST(MotionSlice, ThreadsShareOne) {
  const TwoMeshMotions whole{MotionInterpolant(axes(), motions_of(4, kVertices))};
  for (int round = 0; round < 20; ++round) {
    TwoMeshSlice root, shared;
    root.take(whole);
    shared.hold(root, 0.2);
    std::vector<std::jthread> threads;
    for (const double bending : {2e-5, 3e-4, 7e-4})
      threads.emplace_back([&shared, &whole, bending] {
        TwoMeshSlice second, third;
        second.hold(shared, bending);
        third.hold(second, 0.1);
        expect_point(whole, {0.2, bending, 0.1}, third, 0);
      });
  }
}

}  // namespace
}  // namespace flash::sysid
