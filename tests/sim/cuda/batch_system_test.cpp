// What the kernels of a device compute, against those of the processor.
#ifdef FLASH_HAVE_CUDA
#include "sim/cuda/batch_system.h"
#include "sim/cuda/devices.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "sim/newton/newton_matrix.h"
#include "sim/step/elastic_energy.h"
#include "tests/sim/cuda/meshes.h"

namespace flash::sim::cuda {
namespace {

using data::Points;

constexpr double single_epsilon = std::numeric_limits<float>::epsilon(),
                 double_epsilon = std::numeric_limits<double>::epsilon();
constexpr double time_step = 0.01;

#define SKIP_WITHOUT_DEVICE() \
  if (const std::string why = why_no_device(); !why.empty()) GTEST_SKIP() << why

data::SheetMaterial material_of(int e) {
  data::SheetMaterial material;
  material.areal_density = 0.2;
  material.membrane_stiffness = 20.0 * (e + 1);
  material.bending_rigidity = 2e-5 * (e + 2);
  const data::Constitutive laws[] = {data::Constitutive::tri_corotated, data::Constitutive::tri_stvk,
                                     data::Constitutive::tri_neohookean, data::Constitutive::tri_arap};
  material.constitutive = laws[e % 4];
  return material;
}

EnvironmentNumbers numbers_of(const data::SheetMaterial& material) {
  const Membrane membrane =
      membrane_of(material.constitutive, sheet_lame(material.membrane_stiffness, material.poissons_ratio));
  return {membrane.law, membrane.lame, material.bending_rigidity,
          material.areal_density / (time_step * time_step)};
}

/// A sheet in mid-air, bent and a few percent out of its shape.
Points crumpled(const SheetPlan& plan, int e) {
  std::mt19937 random(17 + e);
  std::uniform_real_distribution<double> noise(-2e-4, 2e-4);
  Points positions = 1.01 * plan.sheet.rest.vertices;
  for (int i = 0; i < positions.rows(); ++i) {
    positions(i, 2) = 0.02 * std::sin(25 * positions(i, 0) + e) * std::cos(18 * positions(i, 1));
    for (int c = 0; c < 3; ++c) positions(i, c) += noise(random);
  }
  return positions;
}

Points random_points(int rows, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> entry(-1, 1);
  return Points::NullaryExpr(rows, 3, [&] { return static_cast<double>(static_cast<float>(entry(random))); });
}

/// The batch and, beside it, the processor's own numbers.
struct Bench {
  std::shared_ptr<const SheetPlan> plan;
  std::vector<data::SheetMaterial> materials;
  std::vector<Points> positions;
  BatchSystem batch;

  Bench(std::shared_ptr<const SheetPlan> sheet, int count,
        FactorPrecision precision = FactorPrecision::single, int first = 0, int most_groups = block_warps)
      : plan(std::move(sheet)), batch(make_batch(count, precision, first, most_groups)) {
    for (int e = 0; e < count; ++e) {
      positions.push_back(crumpled(*plan, first + e));
      batch.set_positions(e, positions[e]);
      batch.set_vector(e, random_points(plan->pattern.size, 100 + first + e));
    }
  }

  BatchSystem make_batch(int count, FactorPrecision precision, int first, int most_groups) {
    std::vector<EnvironmentNumbers> numbers;
    for (int e = 0; e < count; ++e) {
      materials.push_back(material_of(first + e));
      numbers.push_back(numbers_of(materials.back()));
    }
    return BatchSystem(*plan, bending(), numbers, precision,
                       {.leaf_size = 6, .panel_capacity = 12 * 1024, .most_groups = most_groups});
  }

  const BendingOperator& bending() const { return bending_operator(*plan, data::BendingModel::plate, 0.3); }
  BodyLaw law(int e) const { return {plan->bodies[0], materials[e], bending()}; }

  /// Hessian of membrane and inertia; `positive` with the stand-in for bending.
  BlockValues<double> values(int e, bool positive) const {
    BlockValues<double> values(9 * (plan->pattern.size + plan->pattern.pairs.size()), 0.0);
    add_elastic_hessian(*plan, law(e), positions[e], 1.0, positive ? Curvature::positive : Curvature::exact,
                        values);
    if (positive) add_bending_stand_in(bending(), materials[e].bending_rigidity, values);
    for (int i = 0; i < plan->pattern.size; ++i)
      for (int c = 0; c < 3; ++c)
        values[9L * i + 4 * c] += numbers_of(materials[e]).inertia_density * plan->sheet.vertex_area[i];
    return values;
  }

  /// matrix * x in double precision, block by block: the matrix with its plate, or the preconditioner's.
  Points product(int e, bool positive, const Points& x) const {
    const BlockValues<double> blocks = values(e, positive);
    const auto block = [&](std::size_t k) {
      return Eigen::Map<const Eigen::Matrix3d>(blocks.data() + 9 * k);
    };
    Points y(x.rows(), 3);
    for (int i = 0; i < plan->pattern.size; ++i) y.row(i) = x.row(i) * block(i).transpose();
    for (std::size_t k = 0; k < plan->pattern.pairs.size(); ++k) {
      const auto& [row, column] = plan->pattern.pairs[k];
      y.row(row) += x.row(column) * block(plan->pattern.size + k).transpose();
      y.row(column) += x.row(row) * block(plan->pattern.size + k);
    }
    const RowGroups& stiffness = bending().stiffness;
    for (std::size_t g = 0; !positive && g < stiffness.rows.size(); ++g)
      for (int k = stiffness.starts[g]; k < stiffness.starts[g + 1]; ++k)
        for (int member = 0; member < 4; ++member)
          if (stiffness.rows[g][member] >= 0)
            y.row(stiffness.rows[g][member]) += materials[e].bending_rigidity *
                                                stiffness.values[4 * k + member] *
                                                x.row(stiffness.columns[k]);
    return y;
  }

  /// Largest stiffness between two corners of each triangle, times |x| of the corners, summed at each vertex;
  /// the moduli of a response near the rest shape are below twice mu + lambda. And |D S| |x|.
  Eigen::VectorXd stiffness_bound(int e, const Points& x) const {
    const SheetLame lame = numbers_of(materials[e]).lame;
    Eigen::VectorXd bound = Eigen::VectorXd::Zero(x.rows());
    for (const TriangleGroup& group : plan->triangle_groups)
      for (int lane = 0; lane < group.count; ++lane) {
        double slope = 0, size = 0;
        for (const auto& gradient : group.gradients) slope += std::abs(gradient[lane]);
        for (const auto& vertices : group.vertices) size += x.row(vertices[lane]).norm();
        for (const auto& vertices : group.vertices)
          bound[vertices[lane]] += 4 * (lame.mu + lame.lambda) * group.area[lane] * slope * slope * size;
      }
    const RowGroups& stiffness = bending().stiffness;
    for (std::size_t g = 0; g < stiffness.rows.size(); ++g)
      for (int k = stiffness.starts[g]; k < stiffness.starts[g + 1]; ++k)
        for (int member = 0; member < 4; ++member)
          if (stiffness.rows[g][member] >= 0)
            bound[stiffness.rows[g][member]] += materials[e].bending_rigidity *
                                                std::abs(stiffness.values[4 * k + member]) *
                                                x.row(stiffness.columns[k]).norm();
    return bound;
  }
};

void expect_within(const Points& actual, const Points& expected, const Eigen::VectorXd& bound) {
  ASSERT_EQ(actual.rows(), expected.rows());
  const Eigen::VectorXd error = (actual - expected).rowwise().norm();
  EXPECT_TRUE((error.array() <= bound.array()).all())
      << "error over bound " << (error.array() / bound.array()).maxCoeff();
}

TEST(BatchSystem, EnergiesAndGradientsAreThoseOfTheProcessor) {
  SKIP_WITHOUT_DEVICE();
  for (const auto& [name, plan] : small_plans()) {
    SCOPED_TRACE(name);
    Bench bench(plan, 5);
    bench.batch.evaluate();
    const std::vector<ElasticEnergies> energies = bench.batch.energies();
    for (int e = 0; e < bench.batch.size(); ++e) {
      Points expected = Points::Zero(plan->pattern.size, 3);
      const ElasticEnergy energy = add_elastic_gradient(*plan, bench.law(e), bench.positions[e], expected);
      // Places of order one, rounded a few dozen times on the way to a stress.
      const Eigen::VectorXd bound = 32 * double_epsilon * bench.stiffness_bound(e, bench.positions[e]);
      expect_within(bench.batch.gradient(e), expected, bound);
      // A change of the places by their rounding changes the energy by the gradient times that; its own
      // terms are all positive.
      const double rounding =
          32 * double_epsilon *
          (bench.positions[e].rowwise().norm().dot(bench.stiffness_bound(e, bench.positions[e])));
      EXPECT_NEAR(energies[e].membrane, energy.membrane, rounding);
      EXPECT_NEAR(energies[e].bending, energy.bending, rounding);
    }
  }
}

TEST(BatchSystem, ProductsAreThoseOfTheProcessor) {
  SKIP_WITHOUT_DEVICE();
  for (const auto& [name, plan] : small_plans()) {
    SCOPED_TRACE(name);
    Bench bench(plan, 5);
    bench.batch.assemble_matrix();
    bench.batch.multiply();
    for (int e = 0; e < bench.batch.size(); ++e) {
      const Points x = random_points(plan->pattern.size, 100 + e);
      const Eigen::VectorXd inertia = numbers_of(bench.materials[e]).inertia_density *
                                      plan->sheet.vertex_area.cwiseProduct(x.rowwise().norm());
      // Rounded as a triangle's block, in the sum of a block, as a product and in the sum of a row.
      const Eigen::VectorXd bound = 8 * single_epsilon * (bench.stiffness_bound(e, x) + inertia);
      expect_within(bench.batch.result(e), bench.product(e, false, x), bound);
    }
  }
}

TEST(BatchSystem, SolvesToTheRoundingOfItsFactor) {
  SKIP_WITHOUT_DEVICE();
  for (const auto& [name, plan] : small_plans()) {
    SCOPED_TRACE(name);
    Bench bench(plan, 5);
    bench.batch.assemble_preconditioner();
    bench.batch.factorize();
    bench.batch.solve();
    for (const bool positive : bench.batch.factorized()) EXPECT_TRUE(positive);
    for (int e = 0; e < bench.batch.size(); ++e) {
      const Points x = bench.batch.result(e), right = random_points(plan->pattern.size, 100 + e);
      // Higham 2002, theorem 10.4, as in the test of the processor's factor: (|L| |L|^T)_ij <= sqrt(a_ii
      // a_jj).
      const BlockValues<double> values = bench.values(e, true);
      const double n = 3.0 * plan->pattern.size;
      Points root(plan->pattern.size, 3);
      for (int i = 0; i < root.rows(); ++i)
        for (int c = 0; c < 3; ++c) root(i, c) = std::sqrt(values[9L * i + 4 * c]);
      const double size = root.cwiseProduct(x.cwiseAbs()).sum();
      const Eigen::VectorXd bound = (3 * n + 1) * single_epsilon * size * root.rowwise().norm();
      expect_within(bench.product(e, true, x), right, bound);
    }
  }
}

TEST(BatchSystem, TheSolveIsSymmetricAndPositiveWhateverTheRounding) {
  SKIP_WITHOUT_DEVICE();
  for (const auto& [name, plan] : small_plans()) {
    SCOPED_TRACE(name);
    for (const FactorPrecision precision : {FactorPrecision::single, FactorPrecision::half}) {
      Bench bench(plan, 2, precision);
      bench.batch.assemble_preconditioner();
      bench.batch.factorize();
      for (int e = 0; e < 2; ++e) {
        const Points u = random_points(plan->pattern.size, 1), v = random_points(plan->pattern.size, 2);
        const auto solved = [&](const Points& right) {
          bench.batch.set_vector(e, right);
          bench.batch.solve();
          return bench.batch.result(e);
        };
        const Points pu = solved(u), pv = solved(v);
        const double uu = u.cwiseProduct(pu).sum(), vv = v.cwiseProduct(pv).sum();
        EXPECT_GT(uu, 0);
        EXPECT_GT(vv, 0);
        // |F u| |F v| bounds the product, and its rounding with the depth of the tree and the rows of a
        // front.
        EXPECT_NEAR(u.cwiseProduct(pv).sum(), v.cwiseProduct(pu).sum(),
                    300 * single_epsilon * std::sqrt(uu * vv));
      }
    }
  }
}

/// Directions and numbers of solves by the processor, with an exact factor of its own.
struct Direction {
  Points direction, change;
  int solves;
};
Direction processors_direction(const Bench& bench, int e, const ContactSet& contacts, double tolerance) {
  NewtonMatrix matrix(bench.plan);
  EXPECT_TRUE(matrix.factorize(bench.values(e, true)));
  matrix.assign(bench.values(e, false), true, {{bench.bending(), bench.materials[e].bending_rigidity}},
                numbers_of(bench.materials[e]).inertia_density * bench.plan->sheet.vertex_area.minCoeff());
  Direction result;
  result.change = Points::Zero(bench.plan->pattern.size, 3);
  result.solves = matrix.solve(contacts, random_points(bench.plan->pattern.size, 100 + e), tolerance, false,
                               result.direction, result.change);
  return result;
}

TEST(BatchSystem, DirectionsSolveTheLinearProblemInAsManySolvesAsTheProcessors) {
  SKIP_WITHOUT_DEVICE();
  for (const auto& [name, plan] : small_plans()) {
    SCOPED_TRACE(name);
    for (const FactorPrecision precision : {FactorPrecision::single, FactorPrecision::half}) {
      Bench bench(plan, 4, precision);
      bench.batch.assemble_preconditioner();
      bench.batch.factorize();
      bench.batch.assemble_matrix();
      bench.batch.find_directions(0);
      const std::vector<int> solves = bench.batch.solves();
      for (int e = 0; e < bench.batch.size(); ++e) {
        const Direction expected = processors_direction(bench, e, {}, 0);
        EXPECT_NEAR(solves[e], expected.solves, 1);  // at the threshold rounding decides
        if (solves[e] >= 20) continue;
        const Points direction = bench.batch.result(e), right = -random_points(plan->pattern.size, 100 + e);
        const Points image = bench.product(e, false, direction);
        const double rounding = 8 * single_epsilon * solves[e] * bench.stiffness_bound(e, direction).norm();
        EXPECT_LE((image - right).norm(), 0.1 * right.norm() + rounding);
        EXPECT_LE((image - bench.batch.change(e)).norm(), rounding);
      }
    }
  }
}

TEST(BatchSystem, HeldVerticesMoveAsTheyAreTold) {
  SKIP_WITHOUT_DEVICE();
  const auto plan = small_plans()[2].second;
  // As a whole team, whose barriers compute-sanitizer's racecheck knows.
  Bench bench(plan, 3, FactorPrecision::single, 0, 1);
  const Eigen::Vector3d normal = Eigen::Vector3d(1, 2, 3).normalized(), correction(1e-3, -2e-3, 5e-4);
  const Symmetric3 along = identity3() - square(vector3(normal));
  ContactSet contacts;
  std::vector<VertexRestriction> restrictions;
  const auto restrict = [&](int vertex, Freedom freedom, const Symmetric3& free,
                            const Eigen::Vector3d& move) {
    VertexConstraint constraint;
    constraint.vertex = vertex;
    constraint.freedom = freedom;
    constraint.free = free;
    constraint.correction = vector3(move);
    contacts.constraints.push_back(constraint);
    VertexRestriction restriction{bench.batch.fronts().position[vertex], {}, {}};
    for (int k = 0; k < 9; ++k) restriction.free[k] = static_cast<float>(free.at(k % 3, k / 3));
    for (int c = 0; c < 3; ++c) restriction.correction[c] = static_cast<float>(move[c]);
    restrictions.push_back(restriction);
  };
  restrict(3, Freedom::held, {}, correction);
  restrict(40, Freedom::slip, along, 1e-3 * normal);
  restrict(77, Freedom::slip, along, Eigen::Vector3d::Zero());
  bench.batch.set_restrictions(1, restrictions);
  bench.batch.assemble_preconditioner();
  bench.batch.factorize();
  bench.batch.assemble_matrix();
  bench.batch.find_directions(0);
  for (int e = 0; e < 3; ++e) {
    const Direction expected = processors_direction(bench, e, e == 1 ? contacts : ContactSet{}, 0);
    EXPECT_NEAR(bench.batch.solves()[e], expected.solves, 1);
  }
  const Points direction = bench.batch.result(1);
  EXPECT_LE((direction.row(3).transpose() - correction).norm(), single_epsilon * correction.norm());
  const double rounding =
      8 * single_epsilon * direction.row(40).norm();  // of a projector, in each of the solves
  EXPECT_NEAR(normal.dot(direction.row(40)), 1e-3, rounding);
  EXPECT_NEAR(normal.dot(direction.row(77)), 0, 8 * single_epsilon * direction.row(77).norm());
}

TEST(BatchSystem, ABadPivotIsThatOfItsEnvironment) {
  SKIP_WITHOUT_DEVICE();
  const auto plan = small_plans()[2].second;
  std::vector<EnvironmentNumbers> numbers;
  for (int e = 0; e < 6; ++e) numbers.push_back(numbers_of(material_of(e)));
  numbers[4].inertia_density *= -1;
  BatchSystem batch(*plan, bending_operator(*plan, data::BendingModel::plate, 0.3), numbers,
                    FactorPrecision::single, {.most_groups = 1});
  for (int e = 0; e < 6; ++e) batch.set_positions(e, plan->sheet.rest.vertices);
  batch.assemble_preconditioner();
  batch.factorize();
  EXPECT_EQ(batch.factorized(), (std::vector<bool>{true, true, true, true, false, true}));
}

// By the way the only test of the factorization that racecheck can follow: it does not know barriers of some
// warps.
TEST(BatchSystem, TheFactorDoesNotDependOnHowATeamIsDivided) {
  SKIP_WITHOUT_DEVICE();
  const auto plan = small_plans()[3].second;
  const BendingOperator& bending = bending_operator(*plan, data::BendingModel::plate, 0.3);
  std::vector<Points> solutions;
  for (const int most_groups : {1, 4, block_warps}) {
    BatchSystem batch(*plan, bending, {numbers_of(material_of(0))}, FactorPrecision::single,
                      {.leaf_size = 6, .panel_capacity = 12 * 1024, .most_groups = most_groups});
    batch.set_positions(0, crumpled(*plan, 0));
    batch.set_vector(0, random_points(plan->pattern.size, 100));
    batch.assemble_preconditioner();
    batch.factorize();
    batch.solve();
    solutions.push_back(batch.result(0));
  }
  EXPECT_EQ(solutions[0], solutions[1]);
  EXPECT_EQ(solutions[0], solutions[2]);
}

/// All results of a batch, one environment after the other.
std::vector<Points> all_results(Bench& bench) {
  BatchSystem& batch = bench.batch;
  batch.evaluate();
  batch.assemble_preconditioner();
  batch.factorize();
  batch.assemble_matrix();
  std::vector<Points> results;
  const auto keep = [&] {
    for (int e = 0; e < batch.size(); ++e) results.push_back(batch.result(e));
  };
  batch.multiply();
  keep();
  batch.solve();
  keep();
  batch.find_directions(0);
  keep();
  for (int e = 0; e < batch.size(); ++e) results.push_back(batch.gradient(e));
  return results;
}

TEST(BatchSystem, ABatchEqualsAloneBitwiseRunAfterRun) {
  SKIP_WITHOUT_DEVICE();
  const auto plan = small_plans()[3].second;
  constexpr int count = 7;
  Bench together(plan, count), again(plan, count);
  const std::vector<Points> results = all_results(together);
  EXPECT_EQ(results, all_results(again));
  const std::vector<ElasticEnergies> energies = together.batch.energies();
  for (int e = 0; e < count; ++e) {
    Bench alone(plan, 1, FactorPrecision::single, e);
    const std::vector<Points> own = all_results(alone);
    for (std::size_t k = 0; k < own.size(); ++k) EXPECT_EQ(own[k], results[k * count + e]) << e << " " << k;
    EXPECT_EQ(alone.batch.energies()[0].membrane, energies[e].membrane);
    EXPECT_EQ(alone.batch.energies()[0].bending, energies[e].bending);
  }
}

// More environments than the device has teams for, which then take one after the other.
TEST(BatchSystem, ManyEnvironmentsAreEvaluatedAsEachAlone) {
  SKIP_WITHOUT_DEVICE();
  const auto plan = small_plans()[1].second;
  constexpr int count = 2401, step = 300;
  Bench together(plan, count);
  together.batch.evaluate();
  const std::vector<ElasticEnergies> energies = together.batch.energies();
  for (int e = 0; e < count; e += step) {
    Bench alone(plan, 1, FactorPrecision::single, e);
    alone.batch.evaluate();
    EXPECT_EQ(alone.batch.gradient(0), together.batch.gradient(e));
    EXPECT_EQ(alone.batch.energies()[0].membrane, energies[e].membrane);
    EXPECT_EQ(alone.batch.energies()[0].bending, energies[e].bending);
  }
}

}  // namespace
}  // namespace flash::sim::cuda
#endif
