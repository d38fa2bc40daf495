#include "sim/cuda/replay_records.h"

#include "sim/law/membrane.h"
#include "sim/newton/step_numbers.h"
#include "sim/step/body_law.h"
#include "sim/step/moving_obstacles.h"

namespace flash::sim::cuda {

using data::Points;

ReplayMaterial material_of(const SheetPlan& plan, const ReplayEnvironment& environment) {
  const data::SheetMaterial& m = environment.material;
  const SheetLame lame = sheet_lame(m.membrane_stiffness, m.poissons_ratio);
  const Membrane membrane = membrane_of(m.constitutive, lame);
  const BendingOperator& bending = bending_operator(plan, m);
  const double gravity = environment.gravity.norm(),
               weight_factor = gravity > 0 ? gravity : weight_of_nothing;
  return {.law = membrane.law,
          .lame = membrane.lame,
          .damping = {lame.mu, m.constitutive == data::Constitutive::tri_arap ? 0 : lame.lambda},
          .membrane_stiffness = m.membrane_stiffness,
          .rigidity = m.bending_rigidity,
          .areal_density = m.areal_density,
          .air_drag = m.air_drag,
          .stiffness_damping = m.stiffness_damping,
          .gravity = {environment.gravity.x(), environment.gravity.y(), environment.gravity.z()},
          .weight_factor = weight_factor,
          .force_scale = m.areal_density * plan.sheet.vertex_area.norm() * weight_factor,
          .largest_stiffness = largest_stiffness(plan.bodies.front(), m, bending),
          .bending_rounding = 2 * m.bending_rigidity * bending.flat_energy,
          .obstacle_count = static_cast<int>(environment.obstacles.size()),
          .several = stand_beside(environment.obstacles)};
}

std::vector<PlacedObstacle> placed_obstacles(const ReplayEnvironment& environment) {
  std::vector<PlacedObstacle> placed;
  for (const Obstacle& obstacle : environment.obstacles)
    placed.push_back({obstacle_in_frame(obstacle, environment.material.friction), obstacle.frame});
  return placed;
}

void put_in_order(const Points& points, Eigen::Index first, const std::vector<int>& order, Point* to) {
  for (const int vertex : order) {
    const Eigen::Index row = first + vertex;
    *to++ = row < points.rows() ? Point{points(row, 0), points(row, 1), points(row, 2), 0} : Point{};
  }
}

void put_points(const Point* points, const std::vector<int>& order, Eigen::Ref<Points> to) {
  for (std::size_t i = 0; i < order.size(); ++i) to.row(order[i]) << points[i].x, points[i].y, points[i].z;
}

}  // namespace flash::sim::cuda
