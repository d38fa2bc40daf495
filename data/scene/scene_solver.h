#pragma once
#include "data/files/json_reader.h"
#include "data/scene/scene.h"

namespace flash::data {

/// "timestep", and "steps" or "duration": how long a scene runs. Throws InputError as load_scene does.
void read_steps(const JsonObject& file, Scene& scene);

/// "linearsolver", "constraintsolver" and "solver": by what its steps are solved.
void read_solver(const JsonObject& file, SceneSolver& solver);

}  // namespace flash::data
