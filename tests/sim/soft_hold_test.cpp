// Holds by springs: a grasp by pads as a Winkler foundation.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "data/files/error.h"
#include "sim/batch.h"
#include "sim/oracle/projective.h"
#include "tests/sim/sheet_scene.h"

namespace flash::sim {
namespace {

using data::Points;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double h = 0.01, g = 9.81, rigid = std::numeric_limits<double>::infinity();

std::vector<int> near_corner(const Sheet& sheet, double radius) {
  std::vector<int> vertices;
  for (int i = 0; i < sheet.rest.vertices.rows(); ++i)
    if (sheet.rest.vertices.row(i).norm() < radius) vertices.push_back(i);
  return vertices;
}

/// Springs of a foundation under the cells of the held vertices: modulus [N/m^3] times area.
void soften(const Sheet& sheet, double modulus, Hold& hold) {
  hold.stiffness.resize(std::ssize(hold.vertices));
  for (Eigen::Index v = 0; v < hold.stiffness.size(); ++v)
    hold.stiffness[v] = modulus * sheet.vertex_area[hold.vertices[static_cast<std::size_t>(v)]];
}

Vector3d momentum(const Sheet& sheet, const Environment& environment) {
  return environment.materials[0].areal_density *
         (sheet.vertex_area.transpose() * environment.state.velocities).transpose();
}

double mass_of(const Sheet& sheet, const Environment& environment) {
  return environment.materials[0].areal_density * sheet.vertex_area.sum();
}

/// Of all springs of the first hold, at the end of the last step [J].
double spring_energy(const Environment& environment) {
  const Hold& hold = environment.holds[0];
  const Eigen::Isometry3d frame = frame_pose(environment, hold.frame, environment.state.time);
  const Points places = held_places(hold, environment.state.held[0], environment.state.time);
  double energy = 0;
  for (std::size_t v = 0; v < hold.vertices.size(); ++v) {
    const auto row = static_cast<Eigen::Index>(v);
    const Vector3d place = frame * places.row(row).transpose();
    energy += 0.5 * hold.stiffness[row] *
              (environment.state.positions.row(hold.vertices[v]).transpose() - place).squaredNorm();
  }
  return energy;
}

/// A gripper on a wave, without a turn.
data::Trajectory waving_gripper(double seconds) {
  data::Trajectory path;
  for (int k = 0; k <= static_cast<int>(std::lround(seconds / h)); ++k) {
    const double t = k * h;
    path.times.push_back(t);
    path.poses.emplace_back(Eigen::Translation3d(0.03 * std::sin(6 * t), 0, 0.02 * (1 - std::cos(9 * t))));
  }
  return path;
}

TEST(SoftHold, AFreeSheetSagsByItsWeightOverTheStiffness) {
  const Sheet sheet = small_sheet();
  Environment environment = environment_of(sheet);
  environment.materials[0].air_drag = 20;
  Hold pads;
  for (int i = 0; i < sheet.rest.vertices.rows(); ++i) pads.vertices.push_back(i);
  const double modulus = 1e3;
  soften(sheet, modulus, pads);
  environment.holds = {pads};
  Solver solver(sheet, {.time_step = 1, .tolerance = 1e-9});
  StepReport report;
  for (int n = 0; n < 40; ++n) report = solver.step(environment);
  EXPECT_TRUE(report.converged);
  const double sag = environment.materials[0].areal_density * g / modulus;
  const Points moved = environment.state.positions - sheet.rest.vertices;
  // Every vertex carries its own weight: the sheet stays flat. 1e-9 of it is left out of balance.
  EXPECT_LE((moved.col(2).array() + sag).abs().maxCoeff(), 1e-6 * sag);
  EXPECT_LE((report.hold_forces[0] - Vector3d(0, 0, mass_of(sheet, environment) * g)).norm(),
            1e-6 * mass_of(sheet, environment) * g);
}

TEST(SoftHold, AFreeSheetOnAMovingFoundationGoesAsTheRecurrenceOfOneMass) {
  const Sheet sheet = small_sheet();
  Environment environment = environment_of(sheet);
  Hold pads = gripped(environment, {}, waving_gripper(0.4));
  for (int i = 0; i < sheet.rest.vertices.rows(); ++i) pads.vertices.push_back(i);
  const double modulus = 2e3, density = environment.materials[0].areal_density;
  soften(sheet, modulus, pads);
  environment.holds = {pads};
  Solver solver(sheet, {.tolerance = 1e-9});
  Vector3d x = Vector3d::Zero(), v = Vector3d::Zero();
  for (int n = 1; n <= 40; ++n) {
    ASSERT_TRUE(solver.step(environment).converged) << n;
    const Vector3d place = frame_pose(environment, pads.frame, n * h).translation(), before = x;
    x = (density / (h * h) * (x + h * v + h * h * environment.gravity) + modulus * place) /
        (density / (h * h) + modulus);
    v = (x - before) / h;
    const Points moved = environment.state.positions - sheet.rest.vertices;
    EXPECT_LE((moved.rowwise() - x.transpose()).cwiseAbs().maxCoeff(), 1e-9) << n;
  }
}

/// A strip with its end on a foundation: what is on it is so long that it has no other end.
struct FoundedStrip {
  static constexpr double decay = 0.01, on = 8 * decay, off = 2 * decay, width = 0.002;
  static constexpr double rigidity = 1e-3;                                           // D [N m]
  static constexpr double modulus = 4 * rigidity / (decay * decay * decay * decay);  // beta = 1 / decay
  double cell;
  Sheet sheet;
  Environment environment;

  explicit FoundedStrip(double cell_in)
      : cell(cell_in),
        sheet(make_sheet(data::rectangle({.width = on + off,
                                          .height = width,
                                          .cells_x = static_cast<int>(std::lround((on + off) / cell)),
                                          .cells_y = static_cast<int>(std::lround(width / cell))}))),
        environment(environment_of(sheet)) {
    environment.gravity.setZero();
    environment.materials[0] = {
        .membrane_stiffness = 1e3, .poissons_ratio = 0, .bending_rigidity = rigidity, .air_drag = 20};
    Hold pads;
    std::vector<double> areas;
    for (int i = 0; i < sheet.rest.vertices.rows(); ++i) {
      const double x = sheet.rest.vertices(i, 0), y = sheet.rest.vertices(i, 1);
      if (x > on + 1e-9) continue;
      const bool end = x < 1e-9 || x > on - 1e-9, side = y < 1e-9 || y > width - 1e-9;
      pads.vertices.push_back(i);
      areas.push_back(cell * cell * (end ? 0.5 : 1) * (side ? 0.5 : 1));
    }
    pads.stiffness = modulus * VectorXd::Map(areas.data(), std::ssize(areas));
    environment.holds = {pads};
  }

  /// Loads a column of vertices at x with a force along z [N], as even as cells are.
  void load(double x, double force) {
    for (int i = 0; i < sheet.rest.vertices.rows(); ++i) {
      if (std::abs(sheet.rest.vertices(i, 0) - x) > 1e-9) continue;
      const double y = sheet.rest.vertices(i, 1);
      const bool side = y < 1e-9 || y > width - 1e-9;
      environment.loads.push_back({i, {0, 0, force * cell / width * (side ? 0.5 : 1)}});
    }
  }

  void settle() {
    Solver solver(sheet, {.time_step = 10, .max_iterations = 200, .tolerance = 1e-6});
    StepReport report;
    for (int n = 0; n < 12; ++n) report = solver.step(environment);
    EXPECT_TRUE(report.converged);
  }

  /// Deflection of the middle of the strip at x.
  double deflection(double x) const {
    int best = 0;
    for (int i = 0; i < sheet.rest.vertices.rows(); ++i)
      if ((sheet.rest.vertices.row(i) - Eigen::RowVector3d(x, width / 2, 0)).norm() <
          (sheet.rest.vertices.row(best) - Eigen::RowVector3d(x, width / 2, 0)).norm())
        best = i;
    return environment.state.positions(best, 2);
  }
};

// Hetenyi 1946, Beams on Elastic Foundation, the semi-infinite beam: under an end force P and an end moment M
// its end goes down by 2 beta P / k + 2 beta^2 M / k and turns by 2 beta^2 P / k + 4 beta^3 M / k, where 4
// beta^3 / k = 1 / (D beta). Springs at vertices see a deflection of wave length 1 / beta to (beta cell)^2.

TEST(SoftHold, AnEndMomentTurnsAStripOnItsFoundationAsHetenyiSays) {
  for (const double cell : {1e-3, 5e-4}) {
    FoundedStrip strip(cell);
    const double beta = 1 / strip.decay, force = 1e-5, arm = strip.decay;
    const double moment = force * arm / strip.width;  // per width
    strip.load(strip.on + strip.decay, -force);
    strip.load(strip.on + strip.decay + arm, force);
    strip.settle();
    const double down = strip.deflection(strip.on), away = 4e-3;
    // Between edge and load the strip is a circle's arc.
    const double slope =
        (strip.deflection(strip.on + away) - down) / away - moment * away / (2 * strip.rigidity);
    const double expected_slope = moment / (strip.rigidity * beta);
    const double expected_down = 2 * moment * beta * beta / strip.modulus;
    const double tolerance = std::pow(beta * cell, 2);
    EXPECT_NEAR(slope, expected_slope, tolerance * expected_slope) << cell;
    EXPECT_NEAR(down, expected_down, tolerance * expected_down) << cell;
  }
}

TEST(SoftHold, AWeightBesideTheFoundationTurnsAndLowersItsEdge) {
  const double cell = 1e-3;
  FoundedStrip strip(cell);
  const double beta = 1 / strip.decay, force = 1e-5, arm = 2 * strip.decay;
  const double line = force / strip.width, moment = line * arm;
  strip.load(strip.on + arm, force);
  strip.settle();
  const double down = strip.deflection(strip.on), away = 4e-3, d = strip.rigidity;
  const double slope =
      (strip.deflection(strip.on + away) - down) / away - (moment * away / 2 - line * away * away / 6) / d;
  const double expected_slope = 2 * beta * beta * (line + 2 * beta * moment) / strip.modulus;
  const double expected_down = 2 * beta * (line + beta * moment) / strip.modulus;
  const double tolerance = std::pow(beta * cell, 2);
  EXPECT_NEAR(slope, expected_slope, tolerance * expected_slope);
  EXPECT_NEAR(down, expected_down, tolerance * expected_down);
}

/// A sheet that a gripper waves by its corner.
Environment waved(const Sheet& sheet) {
  Environment environment = environment_of(sheet);
  environment.materials[0].bending_rigidity = 1e-3;
  environment.holds = {gripped(environment, near_corner(sheet, 0.035), waving_gripper(0.5))};
  return environment;
}

TEST(SoftHold, TendsToTheRigidOneAsOneOverItsStiffness) {
  const Sheet sheet = small_sheet();
  const auto end_of = [&](double modulus) {
    Environment environment = waved(sheet);
    if (std::isfinite(modulus)) soften(sheet, modulus, environment.holds[0]);
    Solver solver(sheet, {.max_iterations = 100, .tolerance = 1e-9});
    for (int n = 1; n <= 20; ++n) EXPECT_TRUE(solver.step(environment).converged) << n;
    return environment.state.positions;
  };
  const Points held = end_of(rigid);
  double last = 0;
  for (const double modulus : {1e8, 1e9, 1e10}) {
    const double off = (end_of(modulus) - held).cwiseAbs().maxCoeff();
    if (last > 0) {
      EXPECT_NEAR(last / off, 10, 0.5) << modulus;
    }
    last = off;
  }
}

TEST(SoftHold, ItsForceIsWeightPlusInertiaInEveryStep) {
  const Sheet sheet = small_sheet();
  Environment environment = waved(sheet);
  soften(sheet, 1e6, environment.holds[0]);
  Solver solver(sheet, {.tolerance = 1e-7});
  for (int n = 1; n <= 40; ++n) {
    const Vector3d before = momentum(sheet, environment);
    const StepReport report = solver.step(environment);
    EXPECT_TRUE(report.converged) << n;
    const Vector3d expected =
        (momentum(sheet, environment) - before) / h - mass_of(sheet, environment) * environment.gravity;
    EXPECT_LE((report.hold_forces[0] - expected).norm(), 1e-4 * expected.norm()) << n;
  }
}

TEST(SoftHold, MakesNoEnergy) {
  // What sheet and springs store together grows by no more than the work at the moving ends of the springs.
  const Sheet sheet = small_sheet();
  for (const double modulus : {1e4, 1e6, 1e9}) {
    Environment environment = waved(sheet);
    soften(sheet, modulus, environment.holds[0]);
    Solver solver(sheet, {.tolerance = 1e-7});
    const auto stored = [&](const StepReport& report) {
      return report.kinetic + report.membrane + report.bending + report.gravitational +
             spring_energy(environment);
    };
    double before = 0;
    for (int n = 1; n <= 40; ++n) {
      const auto place = [&](int step) {
        return Vector3d(frame_pose(environment, environment.holds[0].frame, step * h).translation());
      };
      const StepReport report = solver.step(environment);
      EXPECT_TRUE(report.converged) << modulus << " " << n;
      EXPECT_EQ(report.substeps, 1);
      const double done = report.hold_forces[0].dot(place(n) - place(n - 1));
      const double gain = stored(report) - before - done;
      // A residual of 1e-7 |M g| over the way of a step, a centimetre.
      if (n > 1) {
        EXPECT_LE(gain, 1e-7 * mass_of(sheet, environment) * g * 0.01) << modulus << " " << n;
      }
      before = stored(report);
    }
  }
}

TEST(SoftHold, OfNoStiffnessHoldsNothing) {
  const Sheet sheet = small_sheet();
  Environment held = waved(sheet), free = held;
  held.holds[0].stiffness = VectorXd::Zero(std::ssize(held.holds[0].vertices));
  free.holds.clear();
  Solver solver(sheet, {}), free_solver(sheet, {});
  for (int n = 1; n <= 20; ++n) {
    const StepReport report = solver.step(held);
    free_solver.step(free);
    EXPECT_EQ(report.hold_forces[0].norm(), 0);
  }
  EXPECT_LE((held.state.positions - free.state.positions).cwiseAbs().maxCoeff(), 1e-15);
}

TEST(SoftHold, WithInfiniteStiffnessIsTheRigidOne) {
  const Sheet sheet = small_sheet();
  Environment soft = waved(sheet), held = soft;
  soft.holds[0].stiffness = VectorXd::Constant(std::ssize(soft.holds[0].vertices), rigid);
  Solver solver(sheet, {}), other(sheet, {});
  for (int n = 1; n <= 20; ++n) {
    solver.step(soft);
    other.step(held);
  }
  EXPECT_EQ(soft.state.positions, held.state.positions);
}

TEST(SoftHold, DoesNothingToAVertexThatAnotherHoldCarries) {
  const Sheet sheet = small_sheet();
  Environment both = waved(sheet), held = both;
  Hold elsewhere{.vertices = {0}, .targets = Eigen::RowVector3d(0, 0, 0.05)};
  elsewhere.stiffness = VectorXd::Constant(1, 1e4);
  both.holds.push_back(elsewhere);
  Solver solver(sheet, {}), other(sheet, {});
  for (int n = 1; n <= 20; ++n) {
    const StepReport report = solver.step(both), expected = other.step(held);
    EXPECT_EQ(report.hold_forces[1].norm(), 0);
    EXPECT_EQ(report.hold_forces[0], expected.hold_forces[0]);
  }
  EXPECT_EQ(both.state.positions, held.state.positions);
}

TEST(SoftHold, TwoOnAVertexAddUp) {
  const Sheet sheet = small_sheet();
  Environment one = waved(sheet), two = one;
  soften(sheet, 4e6, one.holds[0]);
  soften(sheet, 1e6, two.holds[0]);
  two.holds.push_back(two.holds[0]);
  two.holds[1].stiffness *= 3;
  Solver solver(sheet, {.tolerance = 1e-8}), other(sheet, {.tolerance = 1e-8});
  for (int n = 1; n <= 20; ++n) {
    const StepReport report = solver.step(one), halves = other.step(two);
    const Vector3d whole = report.hold_forces[0];
    EXPECT_LE((halves.hold_forces[0] - 0.25 * whole).norm(), 1e-5 * whole.norm()) << n;
    EXPECT_LE((halves.hold_forces[1] - 0.75 * whole).norm(), 1e-5 * whole.norm()) << n;
  }
  EXPECT_LE((one.state.positions - two.state.positions).cwiseAbs().maxCoeff(), 1e-8);
}

/// What the steps of a lift take.
struct LiftCost {
  int iterations = 0, solves = 0, factorizations = 0, substeps = 0, unconverged = 0;
};

LiftCost cost_of_lift(const Sheet& sheet, double modulus) {
  Environment environment = environment_of(sheet);
  environment.materials[0].bending_rigidity = 1e-4;
  environment.materials[0].friction = 0.3;
  environment.obstacles.push_back({Plane{}});
  environment.holds = {gripped(environment, near_corner(sheet, 0.025),
                               straight_path(Vector3d::Zero(), {0.05, 0.05, 0.1}, 0.6))};
  if (std::isfinite(modulus)) soften(sheet, modulus, environment.holds[0]);
  Solver solver(sheet, {});
  LiftCost cost;
  for (int n = 0; n < 60; ++n) {
    const StepReport report = solver.step(environment);
    cost.iterations += report.iterations;
    cost.solves += report.solves;
    cost.factorizations += report.factorizations;
    cost.substeps += report.substeps;
    cost.unconverged += report.converged ? 0 : 1;
  }
  return cost;
}

TEST(SoftHold, TakesAboutAsManyIterationsAsTheRigidOne) {
  const Sheet sheet = small_sheet(20, 0.2);
  const LiftCost held = cost_of_lift(sheet, rigid);
  for (const double modulus : {1e6, 1e7, 1e8, 1e9, 1e10, 1e11}) {
    const LiftCost soft = cost_of_lift(sheet, modulus);
    EXPECT_EQ(soft.unconverged, held.unconverged) << modulus;
    EXPECT_LE(soft.iterations, 1.2 * held.iterations) << modulus;
    EXPECT_LE(soft.solves, 1.3 * held.solves) << modulus;
  }
}

TEST(SoftHold, MayOpenAndCloseOnTheWay) {
  const Sheet sheet = small_sheet();
  Environment environment = waved(sheet);
  soften(sheet, 1e8, environment.holds[0]);
  Hold again = environment.holds[0];
  environment.holds[0].to = 0.1;
  again.from = 0.15;
  environment.holds.push_back(again);
  Solver solver(sheet, {});
  for (int n = 1; n <= 30; ++n) {
    const StepReport report = solver.step(environment);
    EXPECT_TRUE(report.converged) << n;
    EXPECT_EQ(report.hold_forces[0].norm() > 0, n <= 10) << n;
    EXPECT_EQ(report.hold_forces[1].norm() > 0, n > 15) << n;
  }
}

TEST(SoftHold, HoldsAClothThatMeetsItself) {
  const Sheet sheet = small_sheet(10, 0.2);
  Environment environment = environment_of(sheet);
  environment.materials[0].bending_rigidity = 1e-5;
  environment.self_contact = SelfContact{};
  // The corner goes over the sheet and down on it.
  data::Trajectory path;
  for (int k = 0; k <= 40; ++k) {
    const double s = k / 40.0, angle = M_PI * s;
    path.times.push_back(0.02 * k);
    path.poses.emplace_back(Eigen::Translation3d(0.07 * (1 - std::cos(angle)), 0.07 * (1 - std::cos(angle)),
                                                 0.08 * std::sin(angle)));
  }
  environment.obstacles.push_back({Plane{}});
  environment.holds = {gripped(environment, near_corner(sheet, 0.025), path)};
  soften(sheet, 1e7, environment.holds[0]);
  Solver solver(sheet, {});
  double nearest = 1;
  int unconverged = 0;
  for (int n = 1; n <= 80; ++n) {
    const StepReport report = solver.step(environment);
    unconverged += report.converged ? 0 : 1;
    nearest = std::min(nearest, report.layer_distance);
  }
  EXPECT_EQ(unconverged, 0);
  EXPECT_GT(nearest, 0);
  EXPECT_LT(nearest, environment.self_contact->thickness);
}

TEST(SoftHold, RefusesWhatItCannotBe) {
  const Sheet sheet = small_sheet();
  const auto plan = make_sheet_plan(sheet);
  const auto said = [&](const std::function<void(Hold&)>& change) -> std::string {
    Environment environment = waved(sheet);
    environment.holds[0].name = "pads";
    environment.holds[0].vertices = {0, 1};
    environment.holds[0].stiffness = Eigen::Vector2d(1e4, 1e4);
    change(environment.holds[0]);
    std::string first, second;
    try {
      Batch(plan, {environment}, {.steps = 1});
    } catch (const data::InputError& error) {
      first = error.what();
    }
    try {
      Solver(plan, {}).step(environment);
    } catch (const data::InputError& error) {
      second = error.what();
    }
    EXPECT_EQ(first, second.empty() ? "" : "environment 0: " + second);
    return second;
  };
  EXPECT_EQ(said([](Hold&) {}), "");
  EXPECT_EQ(said([](Hold& hold) { hold.stiffness = VectorXd::Zero(3); }),
            "hold pads: stiffness: found 3 numbers, expected one a vertex, 2");
  EXPECT_EQ(said([](Hold& hold) { hold.stiffness[1] = -1; }),
            "hold pads: stiffness: found -1 N/m at vertex 1, expected zero or more");
  EXPECT_EQ(said([](Hold& hold) { hold.stiffness[0] = std::nan(""); }),
            "hold pads: stiffness: found nan N/m at vertex 0, expected zero or more");
  EXPECT_EQ(said([](Hold& hold) { hold.axes[1] = false; }),
            "hold pads: stiffness: found axes that are not held, expected all of them");
  EXPECT_EQ(said([](Hold& hold) { hold.reach = Reach{}; }),
            "hold pads: stiffness: found a reach beside it, expected vertices");

  Environment environment = waved(sheet);
  environment.holds[0].name = "pads";
  soften(sheet, 1e6, environment.holds[0]);
  try {
    ProjectiveSolver(sheet, {}).step(environment);
    FAIL() << "springs in the projective method";
  } catch (const data::InputError& error) {
    EXPECT_STREQ(error.what(),
                 "hold pads: stiffness: the projective method knows rigid holds alone; use Newton's");
  }
}

}  // namespace
}  // namespace flash::sim
