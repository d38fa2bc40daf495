#include "data/scene/scene_solver.h"

#include <cmath>
#include <string>

#include "data/files/error.h"
#include "data/files/text.h"

namespace flash::data {

int steps_of(double duration, double time_step) {
  const double steps = std::round(duration / time_step);
  return steps >= 0 && steps <= max_steps ? static_cast<int>(steps) : -1;
}

void read_steps(const JsonObject& file, Scene& scene) {
  scene.time_step = file.number("timestep");
  if (!(scene.time_step >= min_time_step && scene.time_step <= max_time_step))
    throw file.error("timestep", "a number from " + format_short(min_time_step) + " to " +
                                     format_short(max_time_step) + " [s]");
  if (file.has("steps") && file.has("duration"))
    throw input_error(file.source(), "steps", "found duration beside it, expected one of the two");
  scene.steps_by_default = !file.has("steps") && !file.has("duration");
  if (file.has("steps")) {
    const double steps = file.number("steps");
    if (!(steps >= 0 && steps <= max_steps) || steps != std::floor(steps))
      throw file.error("steps", "a whole number from 0 to " + format_count(max_steps));
    scene.steps = static_cast<int>(steps);
  }
  if (!file.has("duration")) return;
  scene.steps = steps_of(file.not_negative("duration"), scene.time_step);
  if (scene.steps < 0)
    throw file.error("duration", "at most " + format_count(max_steps) + " steps of " +
                                     format_short(scene.time_step) + " s, so at most " +
                                     format_short(max_steps * scene.time_step) + " s");
}

void read_solver(const JsonObject& file, SceneSolver& solver) {
  if (file.has("linearsolver")) {
    const JsonObject object = file.object("linearsolver");
    object.expect_fields({"type"});
    solver.linear_solver =
        object.choice("type", solver.linear_solver,
                      {"SPARSE_CHOLESKY", "SPARSE_INVERSE", "SPARSE_CHOLESKY_CUDA", "SPARSE_INVERSE_CUDA"});
  }
  if (file.has("constraintsolver")) {
    const JsonObject object = file.object("constraintsolver");
    object.expect_fields({"type", "linearsolver", "maxforce", "iterations", "tolerance"});
    solver.constraint_solver = object.choice("type", solver.constraint_solver,
                                             {"automatic", "NonSmoothNewton", "LiteNonSmoothNewton",
                                              "NonSmoothNewton_CUDA", "LiteNonSmoothNewton_CUDA"});
    solver.constraint_linear_solver = object.choice("linearsolver", solver.constraint_linear_solver,
                                                    {"DENSE_CHOLESKY_EIGEN", "DENSE_CG", "DENSE_PCG_JACOBI",
                                                     "DENSE_CR", "DENSE_PCR_JACOBI", "MATRIX_FREE"});
    solver.max_force = object.positive("maxforce", solver.max_force);
    solver.constraint_iterations = object.integer("iterations", solver.constraint_iterations);
    if (solver.constraint_iterations < 1) throw object.error("iterations", "a whole number from 1");
    solver.constraint_tolerance = object.positive("tolerance", solver.constraint_tolerance);
  }
  if (file.has("solver")) {
    const JsonObject object = file.object("solver");
    object.expect_fields({"type", "iterations", "tolerance", "exit_speed"});
    solver.integrator = object.choice("type", solver.integrator, {"newton", "projective"});
    solver.max_iterations = object.integer("iterations", solver.max_iterations);
    if (solver.max_iterations < 1) throw object.error("iterations", "a whole number from 1");
    solver.tolerance = object.positive("tolerance", solver.tolerance);
    if (solver.tolerance > 1) throw object.error("tolerance", "a number above 0, at most 1");
    solver.exit_speed = object.positive("exit_speed", solver.exit_speed);
  }
}

}  // namespace flash::data
