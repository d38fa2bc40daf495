// The reference scenes through the solver, judged as their compare.py does: |got - value| <= rtol max|value|
// + atol.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "sim/newton/solver.h"
#include "sim/step/elastic_energy.h"
#include "tests/sim/reference_scene.h"
#include "tests/sim/sheet_scene.h"

namespace flash::sim {
namespace {

using nlohmann::json;

data::Points read_csv(const std::string& file) {
  std::ifstream in(reference_path(file));
  std::vector<double> values;
  for (std::string line; std::getline(in, line);) {
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream words(line);
    for (double value; words >> value;) values.push_back(value);
  }
  return Eigen::Map<data::Points>(values.data(), Eigen::Index(values.size() / 3), 3);
}

std::vector<double> flattened(const json& value) {
  if (!value.is_array()) return {value.get<double>()};
  std::vector<double> all;
  for (const json& entry : value)
    for (double number : flattened(entry)) all.push_back(number);
  return all;
}

// Judges quantities by name, those that the scene has; at its end every quantity of the scene must have been
// judged.
class Judge {
 public:
  explicit Judge(const json& scene) : expected_(scene.at("expected")) {}
  ~Judge() { EXPECT_EQ(judged_, expected_.size()) << "quantities of the scene were not judged"; }
  void operator()(const std::string& quantity, const std::vector<double>& got) {
    for (const json& entry : expected_) {
      if (entry.at("quantity") != quantity) continue;
      ++judged_;
      const std::vector<double> value = flattened(entry.at("value"));
      double largest = 0;
      for (double v : value) largest = std::max(largest, std::abs(v));
      const json& tolerance = entry.at("tolerance");
      const double allowed = tolerance.value("rtol", 0.0) * largest + tolerance.value("atol", 0.0);
      // One number may stand for many vertices that should all have it.
      const std::vector<double> all = value.size() == 1 ? std::vector<double>(got.size(), value[0]) : value;
      ASSERT_EQ(got.size(), all.size()) << quantity;
      for (std::size_t i = 0; i < all.size(); ++i)
        EXPECT_NEAR(got[i], all[i], allowed) << quantity << " " << i;
    }
  }

 private:
  const json& expected_;
  std::size_t judged_ = 0;
};

data::SheetMaterial material_of(const json& scene) {
  data::SheetMaterial material;
  const json& m = scene.at("material");
  const std::string model = m.at("model");
  material.constitutive = model == "arap"    ? data::Constitutive::tri_arap
                          : model == "corot" ? data::Constitutive::tri_corotated
                          : model == "stvk"  ? data::Constitutive::tri_stvk
                                             : data::Constitutive::tri_neohookean;
  material.membrane_stiffness = m.at("E").get<double>() * m.at("thickness").get<double>();
  material.poissons_ratio = m.at("nu");
  material.areal_density = m.value("areal_density", 0.2);
  material.bending_model = data::BendingModel::isometric;
  material.bending_rigidity = 0;
  if (scene.contains("bending")) {
    if (scene["bending"].at("model") == "hinge") material.bending_model = data::BendingModel::hinge;
    material.bending_rigidity = scene["bending"].at("D");
  }
  return material;
}

// A scene with its sheet, the environment at its start, and what the elastic forces are.
struct ReferenceRun {
  explicit ReferenceRun(const json& scene)
      : sheet(make_sheet(reference_mesh(scene.at("mesh")))), plan(make_sheet_plan(sheet)) {
    environment.materials[0] = material_of(scene);
    for (int c = 0; c < 3; ++c) environment.gravity[c] = scene.at("gravity")[c];
    environment.state.positions = sheet.rest.vertices;
    environment.state.velocities = data::Points::Zero(sheet.rest.vertices.rows(), 3);
    if (scene.contains("v0"))
      for (int c = 0; c < 3; ++c)
        environment.state.velocities.col(c).setConstant(scene["v0"][c].get<double>());
    if (scene.contains("plane") && scene["plane"].is_object())
      environment.obstacles.push_back({Plane{{0, 0, scene["plane"].at("z")}, Eigen::Vector3d::UnitZ()},
                                       {scene["plane"].at("friction").get<double>()}});
  }

  // Holds vertices at `share` of the way from the rest shape to their prescribed places.
  void hold(const json& scene, double share) {
    environment.holds.clear();
    environment.state.held.clear();
    const data::Points& rest = sheet.rest.vertices;
    if (scene.contains("fixed") && scene["fixed"].contains("positions")) {
      const data::Points targets = reference_points(scene["fixed"]["positions"]);
      for (std::size_t i = 0; i < scene["fixed"]["vertices"].size(); ++i) {
        const int v = scene["fixed"]["vertices"][i];
        environment.holds.push_back(support(
            v, {true, true, true}, rest.row(v) + share * (targets.row(Eigen::Index(i)) - rest.row(v))));
      }
    }
    if (!scene.contains("rollers")) return;
    const double stretch = 1 + share * (scene.at("stretch").get<double>() - 1);
    std::vector<std::array<bool, 3>> axes(std::size_t(rest.rows()), {false, false, true});
    for (int v : scene["rollers"].at("x").at("vertices")) axes[v][0] = true;
    for (int v : scene["rollers"].at("y").at("vertices")) axes[v][1] = true;
    for (int v = 0; v < int(rest.rows()); ++v)
      environment.holds.push_back(
          support(v, axes[v], Eigen::Vector3d(stretch * rest(v, 0), rest(v, 1), rest(v, 2))));
  }

  // Implicit Euler in steps so long that inertia hardly counts, until nothing moves.
  void settle(double tolerance, double time_step = 1.0) {
    SolverSettings settings;
    settings.time_step = time_step;
    settings.max_iterations = 400;
    settings.tolerance = tolerance;
    Solver solver(plan, settings);
    for (int k = 0; k < 100; ++k) {
      solver.step(environment);
      const double moved = time_step * environment.state.velocities.rowwise().norm().maxCoeff();
      environment.state.velocities.setZero();
      if (moved < 1e-9) return;
    }
    ADD_FAILURE() << "did not settle";
  }

  // Force of the supports at rest, and the energies.
  data::Points support_forces(ElasticEnergy& energy) const {
    const data::SheetMaterial& m = environment.materials[0];
    data::Points force = data::Points::Zero(sheet.rest.vertices.rows(), 3);
    energy = add_elastic_gradient(
        *plan, {plan->bodies[0], m, bending_operator(*plan, m.bending_model, m.poissons_ratio)},
        environment.state.positions, force);
    return force - m.areal_density * sheet.vertex_area * environment.gravity.transpose();
  }

  Sheet sheet;
  std::shared_ptr<const SheetPlan> plan;
  Environment environment;
};

double largest_deviation(const json& scene, const ReferenceRun& run) {
  const data::Points reference = read_csv(scene.at("reference_positions"));
  return (run.environment.state.positions - reference).rowwise().norm().maxCoeff();
}

void expect_positions(const json& scene, const ReferenceRun& run) {
  const data::Points reference = read_csv(scene.at("reference_positions"));
  const double moved = (reference - run.sheet.rest.vertices).rowwise().norm().maxCoeff();
  EXPECT_LE(largest_deviation(scene, run), scene.value("position_tolerance", 0.02 * moved + 1e-4));
}

std::vector<int> vertices_at(const data::Points& rest, int axis, double value) {
  std::vector<int> found;
  for (int i = 0; i < int(rest.rows()); ++i)
    if (std::abs(rest(i, axis) - value) < 1e-9) found.push_back(i);
  return found;
}

std::vector<std::string> scene_names(const std::string& prefix) {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(reference_path(""))) {
    const std::string name = entry.path().stem().string();
    if (entry.path().extension() == ".json" && name.starts_with(prefix)) names.push_back(name);
  }
  std::sort(names.begin(), names.end());
  return names;
}

std::string test_name(const testing::TestParamInfo<std::string>& info) {
  std::string name = info.param;
  std::replace_if(
      name.begin(), name.end(), [](char c) { return !std::isalnum(static_cast<unsigned char>(c)); }, '_');
  return name;
}

class PatchScene : public testing::TestWithParam<std::string> {};

TEST_P(PatchScene, HasTheForcesOfTheContinuum) {
  const json scene = reference_scene(GetParam());
  Judge judge(scene);
  ReferenceRun run(scene);
  // Large displacements in parts, so that no triangle turns over on the way.
  for (int part = 1; part <= 10; ++part) {
    run.hold(scene, part / 10.0);
    run.settle(1e-9);
  }
  const data::Points &x = run.environment.state.positions, &rest = run.sheet.rest.vertices;
  ElasticEnergy energy;
  const data::Points force = run.support_forces(energy);
  const std::vector<int> right = vertices_at(rest, 0, 0.1), top = vertices_at(rest, 1, 0.08);
  Eigen::RowVector3d right_force = Eigen::RowVector3d::Zero();
  double top_force = 0;
  std::vector<double> inner;
  for (int v : right) right_force += force.row(v);
  for (int v : top) top_force += force(v, 1);
  for (int v : right)
    if (rest(v, 1) > 1e-9 && rest(v, 1) < 0.08 - 1e-9) inner.insert(inner.end(), {force(v, 0), force(v, 1)});
  expect_positions(scene, run);
  judge("max deviation from affine m", {largest_deviation(scene, run)});
  judge("lateral stretch", {(x.col(1).maxCoeff() - x.col(1).minCoeff()) / 0.08});
  judge("pull force N", {right_force[0]});
  judge("right edge force N", {right_force[0], right_force[1]});
  judge("top edge force y N", {top_force});
  judge("stored energy J", {energy.membrane});
  judge("right edge inner vertex force N", inner);
  const double thickness = scene["material"]["thickness"];
  if (!scene.contains("stretch")) {
    // F_21 = gamma/2; an inner vertex of the right edge carries one cell of 0.02 m.
    const double gamma = 2 * (x(right.front(), 1) - rest(right.front(), 1)) / 0.1;
    judge("shear modulus P12/gamma Pa", {inner.back() / (0.02 * thickness) / gamma});
    return;
  }
  const double strain = scene["stretch"].get<double>() - 1;
  const double lateral = 1 - (x.col(1).maxCoeff() - x.col(1).minCoeff()) / 0.08;
  judge("E recovered", {right_force[0] / (0.08 * thickness * strain)});
  judge("nu recovered", {lateral / strain});
}

std::vector<std::string> patch_scenes() {
  std::vector<std::string> names = scene_names("stretch_");
  for (const std::string& name : scene_names("shear_")) names.push_back(name);
  return names;
}
INSTANTIATE_TEST_SUITE_P(Reference, PatchScene, testing::ValuesIn(patch_scenes()), test_name);

class HangingStrip : public testing::TestWithParam<std::string> {};

TEST_P(HangingStrip, StretchesUnderItsWeight) {
  const json scene = reference_scene(GetParam());
  Judge judge(scene);
  ReferenceRun run(scene);
  run.hold(scene, 1);
  run.settle(1e-9);
  ElasticEnergy energy;
  const data::Points force = run.support_forces(energy);
  double support = 0;
  for (const Hold& hold : run.environment.holds) support += force(hold.vertices[0], 2);
  const Eigen::VectorXd down = (run.sheet.rest.vertices - run.environment.state.positions).col(2);
  expect_positions(scene, run);
  judge("tip elongation m", {down.maxCoeff()});
  judge("downward displacement m", {down.begin(), down.end()});
  judge("support force N", {support});
}
INSTANTIATE_TEST_SUITE_P(Reference, HangingStrip, testing::ValuesIn(scene_names("hang_strip")), test_name);

class Cantilever : public testing::TestWithParam<std::string> {};

TEST_P(Cantilever, DropsAsTheElastica) {
  const json scene = reference_scene(GetParam());
  Judge judge(scene);
  ReferenceRun run(scene);
  run.hold(scene, 1);
  // Steps of about the strip's own time: it swings down without folding on the way.
  run.settle(1e-7, 0.05);
  const data::Points& x = run.environment.state.positions;
  const double length = scene.at("L_eff"), end = run.sheet.rest.vertices.col(0).maxCoeff();
  const std::vector<int> tips = vertices_at(run.sheet.rest.vertices, 0, end);
  double drop = 0, along = 0;
  for (int v : tips) {
    drop -= x(v, 2) / double(tips.size());
    along += x(v, 0) / double(tips.size());
  }
  const data::SheetMaterial& m = run.environment.materials[0];
  const double weight = m.areal_density * 9.81;
  expect_positions(scene, run);
  judge("tip drop / L_eff", {drop / length});
  judge("tip x / L_eff", {(along + length - end) / length});
  judge("tip drop / (w L_eff^4/8D)", {drop / (weight * std::pow(length, 4) / (8 * m.bending_rigidity))});
}

std::vector<std::string> cantilever_scenes() {
  std::vector<std::string> names = scene_names("cantilever_");
  std::erase(names, "cantilever_convergence");
  return names;
}
INSTANTIATE_TEST_SUITE_P(Reference, Cantilever, testing::ValuesIn(cantilever_scenes()), test_name);

class RigidMotion : public testing::TestWithParam<std::string> {};

TEST_P(RigidMotion, FallsSlidesAndSticksAsTheDiscreteLawSays) {
  const json scene = reference_scene(GetParam());
  Judge judge(scene);
  ReferenceRun run(scene);
  SolverSettings settings;
  settings.time_step = scene.at("dt");
  settings.tolerance = 1e-6;
  Solver solver(run.plan, settings);
  const data::Points start = run.environment.state.positions;
  StepReport report;
  for (int k = 0; k < scene.at("steps"); ++k) {
    report = solver.step(run.environment);
    ASSERT_TRUE(report.converged);
  }
  const data::Points &x = run.environment.state.positions, &v = run.environment.state.velocities;
  const Eigen::VectorXd moved = x.col(0) - start.col(0);
  const std::vector<double> along(moved.begin(), moved.end()), height(x.col(2).begin(), x.col(2).end());
  expect_positions(scene, run);
  judge("z (implicit Euler)", height);
  judge("z (continuum) ", height);
  judge("x displacement after 1 s", along);
  judge("y,z displacement", {(x - start).rightCols<2>().cwiseAbs().maxCoeff()});
  judge("distance (implicit Euler)", along);
  judge("distance (continuum)", along);
  judge("final speed", {v.rowwise().norm().maxCoeff()});
  std::vector<double> velocity(v.data(), v.data() + v.size());
  judge("velocity after one step", velocity);
  if (!report.obstacle_forces.empty()) judge("normal force sum N", {report.obstacle_forces[0].z()});
}

std::vector<std::string> rigid_scenes() {
  std::vector<std::string> names;
  for (const char* prefix : {"free_fall", "incline", "slide", "impact"})
    for (const std::string& name : scene_names(prefix)) names.push_back(name);
  return names;
}
INSTANTIATE_TEST_SUITE_P(Reference, RigidMotion, testing::ValuesIn(rigid_scenes()), test_name);

class Equilibrium : public testing::TestWithParam<std::string> {};

TEST_P(Equilibrium, Holds) {
  const json scene = reference_scene(GetParam());
  Judge judge(scene);
  ReferenceRun run(scene);
  run.hold(scene, 1);
  const data::Points start = read_csv(scene.at("reference_positions"));
  run.environment.state.positions = start;
  ElasticEnergy energy;
  const data::Points force = run.support_forces(energy);
  Eigen::RowVector3d gripper = Eigen::RowVector3d::Zero();
  const std::size_t held = run.environment.holds.size();
  for (std::size_t i = held / 2; i < held; ++i) gripper += force.row(run.environment.holds[i].vertices[0]);
  judge("gripper force [N]", {gripper[0], gripper[1], gripper[2]});
  judge("potential of membrane [J]", {energy.membrane});
  judge("potential of bending [J]", {energy.bending});
  Solver solver(run.plan, {});
  for (int k = 0; k < 100; ++k) solver.step(run.environment);
  judge("max drift after 1 s [m]", {(run.environment.state.positions - start).rowwise().norm().maxCoeff()});
}
INSTANTIATE_TEST_SUITE_P(Reference, Equilibrium, testing::ValuesIn(scene_names("equil_")), test_name);

class CornerLift : public testing::TestWithParam<std::string> {};

TEST_P(CornerLift, MovesAsTheReferenceUntilItFolds) {
  const json scene = reference_scene(GetParam());
  Judge judge(scene);
  ReferenceRun run(scene);
  const std::vector<int> held = scene.at("fixed").at("vertices");
  data::Trajectory gripper;
  const double dt = scene.at("dt");
  for (int k = 0; k <= scene.at("steps"); ++k) {
    const double t = k * dt / 3, s = t * t * t * (10 - 15 * t + 6 * t * t);
    gripper.times.push_back(k * dt);
    gripper.poses.push_back(Eigen::Isometry3d(Eigen::Translation3d(-0.1 * s, 0, 0.35 * s)));
  }
  run.environment.holds = {gripped(run.environment, held, gripper, dt)};
  SolverSettings settings;
  settings.time_step = dt;
  settings.tolerance = 1e-5;
  Solver solver(run.plan, settings);
  const double tolerance = scene.at("expected")[0].at("tolerance").at("atol");
  std::vector<double> distances;
  for (int k = 1; k <= std::lround(2.5 / dt); ++k) {
    solver.step(run.environment);
    for (const auto& [time, frame] : scene.at("frames").items()) {
      if (std::abs(std::stod(time) - k * dt) > 1e-6) continue;
      const data::Points difference = run.environment.state.positions - read_csv(frame.at("positions"));
      const double rms = std::sqrt(difference.rowwise().squaredNorm().mean());
      EXPECT_LE(rms, tolerance + 0.05e-3 * frame.at("rms_sensitivity_mm").at("logE").get<double>())
          << time << " s";
      distances.push_back(rms);
    }
  }
  judge("vertex rms to reference positions at each frame [m]", distances);
}
INSTANTIATE_TEST_SUITE_P(Reference, CornerLift, testing::ValuesIn(scene_names("lift11_")), test_name);

}  // namespace
}  // namespace flash::sim
