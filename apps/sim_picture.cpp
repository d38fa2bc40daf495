#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "apps/command_line.h"
#include "apps/option_checks.h"
#include "apps/sim_verbs.h"
#include "data/error.h"
#include "data/mesh_io.h"
#include "data/mesh_picture.h"
#include "data/text.h"
#include "data/writable.h"

namespace flash {
namespace {

struct PictureOptions {
  std::vector<std::string> meshes;
  std::string out;
  data::MeshPictureSettings view;
  bool force = false;
};

int picture(const PictureOptions& options) {
  // The first stands out: it is what moves.
  static constexpr data::Colour colours[] = {
      {214, 62, 52}, {176, 168, 158}, {120, 140, 160}, {200, 190, 140}};
  expect_ending("--out", options.out, {".png"});
  if (data::lower_extension(options.out).empty())
    throw data::InputError("--out: found \"" + options.out + "\", expected a name that ends in .png");
  expect_each_once("meshes", options.meshes);
  data::check_file_free(options.out, options.force);
  std::vector<data::PicturedMesh> pictured;
  for (const std::string& path : options.meshes) {
    data::Geometry geometry = data::load_geometry(path);
    pictured.push_back({{std::move(geometry.points), std::move(geometry.triangles)},
                        colours[pictured.size() % std::size(colours)]});
  }
  data::save_png(data::draw_meshes(pictured, options.view), options.out);
  return exit_done;
}

}  // namespace

void add_picture_verb(CLI::App& app, Action& action) {
  CLI::App& verb =
      *app.add_subcommand("picture", "Draw meshes, such as a frame of a run and what it lies on");
  const auto options = std::make_shared<PictureOptions>();
  verb.footer(
      "The first mesh is red.\n"
      "Example:\n  flash-sim picture out/frames/000500.ply chair.obj -o chair.png");
  verb.add_option("meshes", options->meshes, "Mesh files, in one frame with z up")->required();
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
