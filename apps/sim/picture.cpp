#include <CLI/CLI.hpp>
#include <Eigen/Geometry>
#include <array>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "apps/command_line/command_line.h"
#include "apps/command_line/option_checks.h"
#include "apps/sim/verbs.h"
#include "data/files/error.h"
#include "data/files/text.h"
#include "data/files/writable.h"
#include "data/mesh/connected_parts.h"
#include "data/mesh/mesh_io.h"
#include "data/picture/mesh_picture.h"
#include "data/scene/obstacle_surfaces.h"
#include "data/scene/scene.h"
#include "sim/scene/scene.h"
#include "sim/scene_worlds.h"

namespace flash {
namespace {

struct PictureOptions {
  std::vector<std::string> meshes;
  std::string scene;
  std::string out;
  data::MeshPictureSettings view;
  bool force = false;
};

constexpr std::array<data::Colour, 6> of_objects = {
    {{214, 62, 52}, {66, 112, 188}, {74, 152, 92}, {226, 164, 44}, {146, 92, 178}, {52, 152, 162}}};
constexpr data::Colour of_obstacles = {178, 174, 168};

/// The time of a frame of a run, which its name counts in steps [s].
double time_of(const std::string& frame, const data::Scene& scene) {
  const std::string name = std::filesystem::path(frame).stem().string();
  const auto step = data::parse_number(name);
  if (!step || name.find_first_not_of("0123456789") != std::string::npos)
    throw data::InputError("--scene: found it beside " + frame +
                           ", expected a frame of a run of that scene, as out/frames/000500.ply");
  if (*step > scene.steps)
    throw data::InputError(frame + ": found step " + data::format_short(*step) + ", expected at most the " +
                           std::to_string(scene.steps) + " of " + scene.source + " (--scene)");
  return *step * scene.time_step;
}

/// Throws where the frame has other vertices than the scene's objects: it is of another scene or mesh.
void check_frame(const std::string& frame, const data::Scene& scene) {
  std::vector<std::string> notices;
  const auto expected = static_cast<Eigen::Index>(sim::vertices_of(sim::scene_bodies(scene, 1, notices)));
  const Eigen::Index found = data::load_geometry(frame).points.rows();
  if (found != expected)
    throw data::InputError(frame + ": found " + std::to_string(found) + " vertices, expected the " +
                           std::to_string(expected) + " of " + scene.source + " (--scene)");
}

/// Adds what the scene stands on, in grey, and turns all so that gravity points down.
void add_scene(const std::string& path, const std::vector<std::string>& frames,
               std::vector<data::PicturedMesh>& pictured) {
  const data::Scene scene = data::load_scene(path);
  const double time = time_of(frames.front(), scene);
  for (const std::string& frame : frames) check_frame(frame, scene);
  Eigen::AlignedBox3d about;
  for (const data::PicturedMesh& each : pictured)
    for (const auto& vertex : each.mesh.vertices.rowwise()) about.extend(vertex.transpose());
  for (data::TriangleMesh& surface : data::obstacle_surfaces(scene, time, about))
    pictured.push_back({std::move(surface), of_obstacles});
  if (!(scene.gravity.norm() > 0)) return;
  const auto upright = Eigen::Quaterniond::FromTwoVectors(-scene.gravity, Eigen::Vector3d::UnitZ());
  for (data::PicturedMesh& each : pictured) each.mesh.vertices *= upright.toRotationMatrix().transpose();
}

int picture(const PictureOptions& options) {
  expect_ending("--out", options.out, {".png"});
  if (data::lower_extension(options.out).empty())
    throw data::InputError("--out: found \"" + options.out + "\", expected a name that ends in .png");
  expect_each_once("meshes", options.meshes);
  data::check_file_free(options.out, options.force);
  std::vector<data::PicturedMesh> pictured;
  for (const std::string& path : options.meshes) {
    data::Geometry geometry = data::load_geometry(path);
    for (data::TriangleMesh& part : data::connected_parts({geometry.points, geometry.triangles}))
      pictured.push_back({std::move(part), of_objects[pictured.size() % of_objects.size()]});
  }
  if (!options.scene.empty()) add_scene(options.scene, options.meshes, pictured);
  data::save_png(data::draw_meshes(pictured, options.view), options.out);
  return exit_done;
}

}  // namespace

void add_picture_verb(CLI::App& app, Action& action) {
  CLI::App& verb =
      *app.add_subcommand("picture", "Draw meshes, such as a frame of a run and what it lies on");
  const auto options = std::make_shared<PictureOptions>();
  verb.footer(
      "Each object has a colour of its own, the first one red. Obstacles of the scene are grey.\n"
      "Example:\n  flash-sim picture out/frames/000500.ply --scene chair.json -o chair.png");
  verb.add_option("meshes", options->meshes, "Mesh files, in one frame with z up, or of a scene")->required();
  verb.add_option("--scene", options->scene,
                  "Scene of the run: draw its obstacles too, at the time of the frame");
  verb.add_option("-o,--out", options->out, "Picture to write (.png)")->required();
  verb.add_option("--azimuth", options->view.azimuth, "Where the eye stands: from the x axis towards y [deg]")
      ->check(any_number())
      ->capture_default_str();
  verb.add_option("--elevation", options->view.elevation, "Of the eye above the horizon [deg]")
      ->check(number_between(-89, 89))
      ->capture_default_str();
  verb.add_option("--width", options->view.width, "Of the picture [px]")
      ->check(whole_number(16, 4096))
      ->capture_default_str();
  verb.add_option("--height", options->view.height, "Of the picture [px]")
      ->check(whole_number(16, 4096))
      ->capture_default_str();
  verb.add_flag("--force", options->force, "Write over what is there");
  verb.callback([&action, options] { action = [options] { return picture(*options); }; });
}

}  // namespace flash
