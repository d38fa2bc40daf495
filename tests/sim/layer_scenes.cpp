#include "tests/sim/layer_scenes.h"

#include <cmath>
#include <numbers>

#include "tests/sim/sheet_scene.h"
#include "tests/sim/solid_scene.h"

namespace flash::sim {

using data::Points;
using Eigen::Isometry3d;
using Eigen::Vector3d;

namespace {

constexpr double start_share = 1.02;  ///< of the thickness: how far apart layers start

Sheet square(double side, int cells_x, int cells_y,
             data::DiagonalPattern pattern = data::DiagonalPattern::alternating) {
  return make_sheet(data::rectangle(
      {.width = side, .height = side, .cells_x = cells_x, .cells_y = cells_y, .pattern = pattern}));
}

LayerScene scene_of(Sheet sheet, const SelfContact& contact) {
  LayerScene scene{std::move(sheet), {}};
  scene.environment = environment_of(scene.sheet);
  data::SheetMaterial cloth;
  cloth.bending_model = data::BendingModel::hinge;
  scene.environment.materials.assign(scene.sheet.bodies.size(), cloth);
  scene.environment.self_contact = contact;
  return scene;
}

void tilt(double slope, Environment& environment) {
  const double angle = std::atan(slope);
  environment.gravity = 9.81 * Vector3d(std::sin(angle), 0, -std::cos(angle));
}

Obstacle rough(const Obstacle& obstacle, std::size_t bodies, double friction) {
  Obstacle with = obstacle;
  with.friction.assign(bodies, friction);
  return with;
}

void shift(LayerScene& scene, std::size_t body, const Vector3d& by) {
  rows_of(scene.sheet.bodies[body], scene.environment.state.positions).rowwise() += by.transpose();
}

/// Where a straight line of length `along` from the middle of a half circle of `radius` comes to: the
/// half circle, then two parallel legs. First along the legs, then across.
Eigen::Vector2d on_hairpin(double along, double radius) {
  const double half = 0.5 * std::numbers::pi * radius;
  if (std::abs(along) < half) return {radius * std::cos(along / radius), radius * std::sin(along / radius)};
  return {half - std::abs(along), along > 0 ? radius : -radius};
}

}  // namespace

void bend_to_hairpin(double radius, data::Points& x) {
  const double middle = 0.5 * x.col(0).maxCoeff(), half = 0.5 * std::numbers::pi * radius;
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    const double from = x(i, 0) - middle;
    if (std::abs(from) < half)
      x.row(i) << radius * std::cos(from / radius), x(i, 1), radius * std::sin(from / radius);
    else
      x.row(i) << half - std::abs(from), x(i, 1), from > 0 ? radius : -radius;
  }
}

LayerScene pile(int count, const SelfContact& contact, double side, int cells) {
  std::vector<Sheet> sheets;
  for (int k = 0; k < count; ++k) sheets.push_back(square(side, cells + k % 2, cells));
  LayerScene scene = scene_of(joined(sheets), contact);
  scene.environment.obstacles = {rough({.shape = Plane{}}, sheets.size(), 5)};
  for (std::size_t k = 0; k < sheets.size(); ++k)
    shift(scene, k, {0, 0, start_share * contact.thickness * static_cast<double>(k)});
  return scene;
}

LayerScene layer_on_incline(double slope, const SelfContact& contact) {
  const std::vector<Sheet> sheets = {square(0.1, 6, 6), square(0.08, 6, 6)};
  LayerScene scene = scene_of(joined(sheets), contact);
  tilt(slope, scene.environment);
  scene.environment.obstacles = {rough({.shape = Plane{}}, 2, 5)};
  shift(scene, 1, {0, 0.01, start_share * contact.thickness});
  return scene;
}

LayerScene block_on_incline(double slope, const SelfContact& contact, bool sheet_between,
                            const BlockMeshes& meshes) {
  const Vector3d size(0.06, 0.06, 0.02), upper_size(0.03, 0.03, 0.015);
  std::vector<Sheet> bodies = {solid_box(size, {meshes.lower, meshes.lower, 2})};
  if (sheet_between) bodies.push_back(square(0.05, 5, 5));
  bodies.push_back(solid_box(upper_size, {meshes.upper, meshes.upper, 2}));
  const std::size_t last = bodies.size() - 1;
  LayerScene scene = scene_of(joined(bodies), contact);
  data::SolidMaterial soft;
  soft.youngs_modulus = 1e5;
  soft.density = 500;
  scene.environment.solids = {{0, soft}, {static_cast<int>(last), soft}};
  tilt(slope, scene.environment);
  scene.environment.holds = {{.vertices = face_of(bodies[0], 2, 0)}};
  auto upper = rows_of(scene.sheet.bodies[last], scene.environment.state.positions);
  const Eigen::RowVector3d middle = 0.5 * upper_size.transpose();
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(meshes.turn, Vector3d::UnitZ()).matrix();
  if (meshes.turn != 0) upper = ((upper.rowwise() - middle) * turn.transpose()).eval().rowwise() + middle;
  const double apart = start_share * contact.thickness;
  if (sheet_between) shift(scene, 1, {0.002, 0.004, size.z() + apart});
  shift(scene, last, {0.007, 0.013, size.z() + static_cast<double>(last) * apart});
  return scene;
}

LayerScene thrown(const SelfContact& contact, double speed) {
  constexpr double side = 0.16, radius = 0.012;
  LayerScene scene = scene_of(square(side, 12, 12, data::DiagonalPattern::jittered), contact);
  State& state = scene.environment.state;
  for (int i = 0; i < state.positions.rows(); ++i) {
    const double from = state.positions(i, 0) - 0.5 * side;
    const Eigen::Vector2d at = on_hairpin(from, radius);
    const bool leg = std::abs(from) >= 0.5 * std::numbers::pi * radius;
    // One leg is narrower, so that edges do not lie on edges.
    state.positions.row(i) << at.x(), state.positions(i, 1) * (leg && from > 0 ? 0.96 : 1), at.y();
    state.velocities(i, 2) = from > 0 ? -0.5 * speed : 0.5 * speed;
  }
  return scene;
}

LayerScene fold(const SelfContact& contact) {
  LayerScene scene = scene_of(square(0.2, 16, 16), contact);
  Environment& environment = scene.environment;
  const Points& rest = scene.sheet.rest.vertices;
  const double right = rest.col(0).maxCoeff();
  std::vector<int> edge;
  for (int i = 0; i < rest.rows(); ++i)
    if (rest(i, 0) > right - 1e-9) edge.push_back(i);
  data::Trajectory path;
  for (int k = 0; k <= 100; ++k) {
    const double angle = std::numbers::pi * k / 100;
    path.times.push_back(0.01 * k);
    path.poses.push_back(
        Isometry3d(Eigen::Translation3d(right - 0.1 * (1 - std::cos(angle)) * 0.9, 0,
                                        0.1 * std::sin(angle) + (k > 50 ? 2e-3 * (k - 50) / 50 : 0))));
  }
  environment.obstacles = {{.shape = Plane{}}};
  environment.holds = {gripped(environment, edge, path)};
  environment.holds[0].to = 1.0;
  return scene;
}

LayerScene folded_twice_and_pressed(const SelfContact& contact, double plate_height) {
  constexpr double side = 0.16, inner = 0.004, outer = 0.012, seconds = 0.7, thick = 0.01;
  LayerScene scene = scene_of(square(side, 12, 12), contact);
  Points& x = scene.environment.state.positions;
  for (int i = 0; i < x.rows(); ++i) {
    const Eigen::Vector2d first = on_hairpin(x(i, 0) - 0.5 * side, inner);
    const Eigen::Vector2d second = on_hairpin(x(i, 1) - 0.5 * side, outer + first.y());
    x.row(i) << first.x(), second.x(), second.y() + outer + inner + 1e-4;
  }
  const Vector3d above(-0.25 * side, -0.25 * side, 2 * (outer + inner) + thick + 1e-3);
  const Vector3d down(above.x(), above.y(), plate_height + thick);
  const int frame = add_frame(scene.environment, straight_path(above, down, seconds));
  scene.environment.obstacles = {{.shape = Plane{}},
                                 {.shape = Box{.half_extents = {side, side, thick}}, .frame = frame}};
  return scene;
}

double strip_length(const LayerScene& knot) { return knot.sheet.rest.vertices.col(0).maxCoeff(); }

LayerScene strip_knot(const SelfContact& contact, double share, double seconds) {
  constexpr double unit = 0.02, last = 2.05, width = 0.006, cell = 0.006;  // [m], of the parameter, [m], [m]
  constexpr int samples = 4000, across = 1, smoothings = 400;
  const auto knot = [&](double t) -> Vector3d {
    const double s = t * t;
    return unit * Vector3d(t * s - 3 * t, s * s - 4 * s, 0.35 * (t * s * s - 10 * t));
  };
  std::vector<double> arc = {0};
  const auto parameter = [](int k) { return last * (2.0 * k / samples - 1); };
  for (int k = 1; k <= samples; ++k)
    arc.push_back(arc.back() + (knot(parameter(k)) - knot(parameter(k - 1))).norm());
  const double length = arc.back();
  const int cells = static_cast<int>(std::lround(length / cell));
  std::vector<Vector3d> middle;
  for (int i = 0, k = 0; i <= cells; ++i) {
    while (k < samples && arc[static_cast<std::size_t>(k)] < length * i / cells - 1e-12) ++k;
    middle.push_back(knot(parameter(k)));
  }
  // The strip lies across the plane in which the knot bends, so that it need not stretch.
  std::vector<Vector3d> aside(middle.size(), Vector3d::Zero()), tangent(aside);
  for (std::size_t i = 0; i < middle.size(); ++i) {
    const std::size_t a = i > 0 ? i - 1 : 0, b = std::min(i + 1, middle.size() - 1);
    tangent[i] = (middle[b] - middle[a]).normalized();
    if (i > 0 && i + 1 < middle.size())
      aside[i] = (middle[i] - middle[i - 1]).cross(middle[i + 1] - middle[i]);
  }
  for (int k = 0; k < smoothings; ++k)
    for (std::size_t i = 0; i < aside.size(); ++i) {
      const Vector3d& before = aside[i > 0 ? i - 1 : 1];
      const Vector3d& after = aside[i + 1 < aside.size() ? i + 1 : i - 1];
      const Vector3d mean = (aside[i] + before + after) / 3;
      aside[i] = mean - tangent[i].dot(mean) * tangent[i];
    }
  for (Vector3d& direction : aside) direction.normalize();

  LayerScene scene = scene_of(
      make_sheet(data::rectangle({.width = length, .height = width, .cells_x = cells, .cells_y = across})),
      contact);
  Environment& environment = scene.environment;
  environment.gravity.setZero();
  environment.materials[0].bending_rigidity = 1e-6;
  std::vector<int> ends[2];
  for (int i = 0; i < scene.sheet.rest.vertices.rows(); ++i) {
    const Vector3d rest = scene.sheet.rest.vertices.row(i);
    const auto at = static_cast<std::size_t>(std::lround(rest.x() / length * cells));
    environment.state.positions.row(i) = middle[at] + (rest.y() - 0.5 * width) * aside[at];
    if (at <= 1) ends[0].push_back(i);
    if (at + 1 >= static_cast<std::size_t>(cells)) ends[1].push_back(i);
  }
  for (int end = 0; end < 2; ++end) {
    const Vector3d from = end == 0 ? middle.front() : middle.back(),
                   to(0.5 * share * length * (end == 0 ? -1 : 1), 0, 0);
    environment.holds.push_back(
        gripped(environment, ends[end], straight_path(Vector3d::Zero(), to - from, seconds)));
  }
  return scene;
}

LayerScene pinched_layers(const SelfContact& contact, double finger_friction) {
  constexpr double side = 0.06, half = 0.015, seconds = 0.15;
  const double apart = start_share * contact.thickness, closed = 0.9 * contact.thickness;
  const std::vector<Sheet> sheets = {square(side, 6, 6), square(1.1 * side, 7, 7)};
  LayerScene scene = scene_of(joined(sheets), contact);
  Points& x = scene.environment.state.positions;
  for (int i = 0; i < x.rows(); ++i) {
    const Vector3d flat = x.row(i);
    x.row(i) << (i < sheets[0].rest.vertices.rows() ? -0.5 : 0.5) * apart, flat.x() - 0.5 * side,
        flat.y() - 0.5 * side;
  }
  Hold top{.to = 0.2};
  for (int i = 0; i < x.rows(); ++i)
    if (x(i, 2) > 0.5 * side - 1e-9) top.vertices.push_back(i);
  scene.environment.holds = {top};
  for (int finger = 0; finger < 2; ++finger) {
    const double way = finger == 0 ? -1 : 1;
    const Vector3d open(way * (0.5 * apart + half + 1e-4), 0, 0), shut(way * (0.5 * closed + half), 0, 0);
    scene.environment.obstacles.push_back(
        {.shape = Box{.half_extents = {half, half, side}},
         .friction = std::vector<double>(2, finger == 0 ? 0.0 : finger_friction),
         .frame = add_frame(scene.environment, straight_path(open, shut, seconds))});
  }
  return scene;
}

Vector3d mean_velocity(const LayerScene& scene, const Body& body) {
  return rows_of(body, scene.environment.state.velocities).colwise().mean().transpose();
}

}  // namespace flash::sim
