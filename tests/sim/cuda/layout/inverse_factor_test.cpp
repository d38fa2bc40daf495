#include "sim/cuda/layout/inverse_factor.h"

#include <gtest/gtest.h>

#include "sim/oracle/projective_system.h"
#include "tests/sim/sheet_scene.h"

namespace flash::sim::cuda {
namespace {

using data::Points;

struct Matrices {
  std::shared_ptr<const SheetPlan> plan;
  ProjectiveSystem system;
  InverseTree tree;

  explicit Matrices(int cells, data::BendingModel bending = data::BendingModel::isometric)
      : plan(make_sheet_plan(small_sheet(cells, 0.4))),
        system(*plan, {material(bending)}, 0.01),
        tree(plan_inverse(pattern_of(system.matrix()), plan->sheet.rest.vertices)) {}

  static data::SheetMaterial material(data::BendingModel bending) {
    data::SheetMaterial material;
    material.membrane_stiffness = 100;
    material.bending_rigidity = 1e-4;
    material.areal_density = 0.2;
    material.bending_model = bending;
    return material;
  }
};

TEST(InverseTree, HasEachVertexOnceAndWhatIsBelowHigherUp) {
  for (const int cells : {2, 6, 31}) {
    const InverseTree tree = Matrices(cells).tree;
    std::vector<int> seen(tree.size, 0);
    for (const int vertex : tree.vertex_at)
      if (vertex >= 0) ++seen[vertex];
    EXPECT_EQ(seen, std::vector<int>(tree.size, 1));
    for (const InverseNode& node : tree.nodes)
      for (int k = 0; k < inverse_tile * node.below_tiles; ++k)
        EXPECT_GE(tree.below[node.first_below + k], inverse_tile * (node.first_block + node.column_tiles));
  }
}

TEST(InverseFactor, IsTheInverseOnWhatIsFree) {
  for (const auto bending : {data::BendingModel::isometric, data::BendingModel::plate})
    for (const int cells : {2, 6, 20}) {
      Matrices m(cells, bending);
      const int size = m.tree.size;
      std::vector<char> held(size, 0);
      std::vector<int> list;
      for (const int vertex : {0, 1, size / 2}) {
        held[vertex] = 1;
        list.push_back(vertex);
      }
      m.system.hold({list, list, list});
      srand(5);
      const Points b = Points::Random(size, 3), exact = m.system.solve(b);
      for (const auto precision : {InversePrecision::single, InversePrecision::half}) {
        const InverseFactor factor = factorize_inverse(m.tree, m.system.matrix(), held, precision);
        const Points x = apply_inverse(m.tree, factor, precision, b);
        // Parts of 22 and 11 bits; errors of hundreds of entries add up as a walk at random.
        const double bound = precision == InversePrecision::single ? 1e-5 : 5e-3;
        EXPECT_LE((x - exact).norm(), bound * exact.norm()) << cells;
        EXPECT_EQ(x.row(0).norm(), 0);
      }
    }
}

TEST(InverseFactor, AMatrixThatIsNotPositiveIsRefused) {
  const Matrices m(4);
  const Eigen::SparseMatrix<double> negative = -1.0 * m.system.matrix();
  EXPECT_THROW(factorize_inverse(m.tree, negative, std::vector<char>(m.tree.size, 0), InversePrecision::half),
               std::domain_error);
}

}  // namespace
}  // namespace flash::sim::cuda
