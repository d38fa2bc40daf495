#include "tests/sim/properties/drawn_world.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "data/mesh/procedural_mesh.h"
#include "tests/sim/obstacle_depth.h"
#include "tests/sim/sheet_scene.h"

namespace flash::sim {

using Eigen::Isometry3d;
using Eigen::Translation3d;
using Eigen::Vector3d;

namespace {

data::Trajectory even_path(const Vector3d& start, const Vector3d& velocity) {
  const double seconds = 10;  // longer than any test
  return {{0, seconds},
          {Isometry3d(Translation3d(start)), Isometry3d(Translation3d(start + seconds * velocity))}};
}

Obstacle draw_obstacle(Environment& environment) {
  const Vector3d place(draw(0, 0.2), draw(0, 0.2), 0);
  std::vector<double> friction;
  if (draw_chance(0.3)) friction.push_back(draw(0, 1));
  const int kind = draw_below(4);
  if (kind == 0) {
    Vector3d normal = draw_direction();
    normal.z() = 0.4 + std::abs(normal.z());
    return {Plane{place, normal.normalized()}, friction};
  }
  if (kind == 1) return {Cylinder{place, draw_direction(), draw(0.01, 0.05)}, friction};
  if (kind == 2) {
    const double half_length = draw_chance(0.5) ? 0 : draw(0.01, 0.1);
    const Capsule finger{{}, draw_direction(), half_length, draw(0.01, 0.05)};
    return {.shape = finger,
            .friction = friction,
            .frame = add_frame(environment, even_path(place, draw(0, 0.5) * draw_direction()))};
  }
  Box box{.half_extents = {draw(0.01, 0.1), draw(0.01, 0.1), draw(0.005, 0.05)}};
  if (draw_chance(0.5))
    return {.shape = box,
            .friction = friction,
            .frame = add_frame(environment, even_path(place, draw(0, 0.5) * draw_direction()))};
  box.pose = Translation3d(place) * Eigen::AngleAxisd(draw(0, 3), draw_direction());
  return {box, friction};
}

}  // namespace

std::vector<int> draw_order(int count) {
  std::vector<int> order(static_cast<std::size_t>(count));
  std::iota(order.begin(), order.end(), 0);
  for (int left = count; left > 1; --left) std::swap(order[left - 1], order[draw_below(left)]);
  return order;
}

Sheet draw_sheet() {
  using data::DiagonalPattern;
  const double width = draw(0.1, 0.3), height = draw(0.1, 0.3);
  switch (draw_below(6)) {
    case 4:
      return make_sheet(data::disc(0.5 * width, width / (4 + draw_below(3))));
    case 5:
      return make_sheet(data::delaunay_rectangle(width, height, std::min(width, height) / (3 + draw_below(2)),
                                                 static_cast<unsigned>(draw_below(1000))));
    default:
      return make_sheet(data::rectangle(
          {.width = width,
           .height = height,
           .cells_x = 2 + draw_below(5),
           .cells_y = 2 + draw_below(5),
           .pattern = *rc::gen::element(DiagonalPattern::one_way, DiagonalPattern::alternating,
                                        DiagonalPattern::alternating_by_row, DiagonalPattern::jittered),
           .seed = static_cast<unsigned>(draw_below(1000))}));
  }
}

data::SheetMaterial draw_material() {
  using data::BendingModel;
  using data::Constitutive;
  data::SheetMaterial material;
  material.constitutive = *rc::gen::element(Constitutive::tri_corotated, Constitutive::tri_arap,
                                            Constitutive::tri_stvk, Constitutive::tri_neohookean);
  material.bending_model =
      *rc::gen::element(BendingModel::plate, BendingModel::isometric, BendingModel::hinge);
  material.membrane_stiffness = draw_log(10, 1e5);
  material.poissons_ratio = draw(0, 0.45);
  material.areal_density = draw_log(0.05, 1);
  // No stiffer than a solid plate of a centimetre.
  material.bending_rigidity = std::min(draw_log(1e-7, 1e-3), material.membrane_stiffness * 1e-4 / 12);
  material.friction = draw_chance(0.8) ? draw(0, 1) : 0;
  if (draw_chance(0.3)) material.air_drag = draw(0, 5);
  if (draw_chance(0.3)) material.stiffness_damping = draw_log(1e-4, 1e-2);
  return material;
}

Environment draw_flight(const Sheet& sheet) {
  Environment environment = environment_of(sheet);
  environment.materials[0] = draw_material();
  environment.gravity = (draw_chance(0.9) ? 9.81 : 0.0) * draw_direction();
  const double cell = std::sqrt(sheet.vertex_area.mean());
  data::Points& x = environment.state.positions;
  data::Points& v = environment.state.velocities;
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(draw(0, 3), draw_direction()).toRotationMatrix();
  x = (x + draw_noise(x.rows(), draw(0, 0.05) * cell)) * turn.transpose();
  const Vector3d velocity = draw(0, 1) * draw_direction(), spin = draw(0, 5) * draw_direction();
  v = draw_noise(x.rows(), draw(0, 0.1));
  for (Eigen::Index i = 0; i < x.rows(); ++i)
    v.row(i) += (velocity + spin.cross(Vector3d(x.row(i)))).transpose();
  return environment;
}

Environment draw_fall(const Sheet& sheet) {
  Environment environment = draw_flight(sheet);
  environment.gravity = Vector3d(draw(-2, 2), draw(-2, 2), -9.81);
  environment.state.velocities.col(2).array() -= draw(0, 2);
  const int count = 1 + draw_below(3);
  for (int k = 0; k < count; ++k) environment.obstacles.push_back(draw_obstacle(environment));
  const auto touches = [&] {
    for (const Obstacle& obstacle : environment.obstacles)
      for (const auto& x : environment.state.positions.rowwise())
        if (depth_in(environment, obstacle, x.transpose(), 0) > -1e-3) return true;
    return false;
  };
  // Not for ever: a cylinder may stand upright.
  for (int k = 0; k < 500 && touches(); ++k) environment.state.positions.col(2).array() += 0.002;
  RC_PRE(!touches());
  return environment;
}

Hold draw_grasp(Environment& environment) {
  const data::Points& x = environment.state.positions;
  const Vector3d middle = x.row(draw_below(static_cast<int>(x.rows())));
  std::vector<int> vertices;
  const double reach = draw(0.001, 0.06);
  for (int i = 0; i < static_cast<int>(x.rows()); ++i)
    if ((x.row(i).transpose() - middle).norm() <= reach) vertices.push_back(i);
  return gripped(environment, vertices, even_path(middle, draw(0, 1) * draw_direction()));
}

Environment draw_world(const Sheet& sheet) {
  Environment environment = draw_fall(sheet);
  const int rows = static_cast<int>(sheet.rest.vertices.rows()), grasps = draw_below(3);
  for (int k = 0; k < grasps; ++k) {
    const Hold grasp = draw_grasp(environment);
    if (k > 0 && std::ranges::any_of(grasp.vertices, [&](int i) {
          return std::ranges::count(environment.holds[0].vertices, i) > 0;
        }))
      continue;  // a vertex has one gripper
    environment.holds.push_back(grasp);
  }
  const auto held = [&](int i) {
    return std::ranges::any_of(environment.holds,
                               [&](const Hold& hold) { return std::ranges::count(hold.vertices, i) > 0; });
  };
  if (const int i = draw_below(rows); draw_chance(0.3) && !held(i))
    environment.holds.push_back(
        support(i, {draw_chance(0.5), draw_chance(0.5), true}, environment.state.positions.row(i)));
  if (draw_chance(0.3)) environment.loads.push_back({draw_below(rows), draw(0, 0.05) * draw_direction()});
  return environment;
}

Eigen::VectorXd masses_of(const Sheet& sheet, const data::SheetMaterial& material) {
  return material.areal_density * sheet.vertex_area;
}

double unbalanced_sum(const Environment& environment, const Eigen::VectorXd& mass, const StepReport& report) {
  const double g = environment.gravity.norm() > 0 ? environment.gravity.norm() : 9.81;
  const double rounding = 1e-9 * mass.sum() * g;
  return std::sqrt(static_cast<double>(mass.size())) * report.residual * mass.norm() * g + rounding;
}

}  // namespace flash::sim
