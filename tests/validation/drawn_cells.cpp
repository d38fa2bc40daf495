// Writes what flash-calib says of drawn cells, for handeye_methods.py: four cameras beside one arm whose
// kinematic model is wrong, a print that is bent and not quite of its size, a lens file that is off by half a
// percent. Of each camera one folder of FOLDER: workspace.json, image.json, two-arms.json as handeye has them
// for each use, and detect.json with the corners.
//   drawn_cells FOLDER CELLS FIRST_SEED HELD_OUT_SEED
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <vector>

#include "calib/calibrate/extrinsics.h"
#include "calib/report/extrinsics_json.h"
#include "data/machine/parallel.h"
#include "tests/calib/arm_scene.h"
#include "tests/calib/cell_scene.h"

namespace flash::calib {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr int kCameras = 4;
constexpr double kBend = 2e-4,
                 kLensShare = 0.005;  // of the print [m], of focal lengths and of half a diagonal

data::CameraIntrinsics stated_lens(data::CameraIntrinsics camera, std::mt19937& random) {
  std::normal_distribution<double> normal;
  for (double* length : {&camera.fx, &camera.fy}) *length *= 1 + kLensShare * normal(random);
  for (double* centre : {&camera.cx, &camera.cy})
    *centre += kLensShare * 0.5 * std::hypot(camera.width, camera.height) * normal(random);
  return camera;
}

std::vector<HandEyeScene> cell_of(unsigned seed) {
  SceneSettings settings = protocol_settings(Setup::eye_to_hand);
  settings.robot_deg = 0.01;
  settings.robot_mm = 0.05;
  const Eigen::Matrix3Xd stated = board_points();
  std::mt19937 random(seed + 1'000'000'000);
  std::normal_distribution<double> normal;
  Warp warp;
  for (double& bend : warp) bend = kBend * normal(random);
  const double size = 1 + usual_size_sd(stated) * normal(random);
  const HandEyeScene first = make_arm_scene(settings, {.zero_deg = 0.1, .length_mm = 0.5}, 0.6, stated, seed);
  std::vector<HandEyeScene> cameras(kCameras, first);
  for (int c = 0; c < kCameras; ++c) {
    HandEyeScene& scene = cameras[static_cast<std::size_t>(c)];
    const double aside = 0.12 * (c - 0.5 * (kCameras - 1));  // [m], turned back towards the board
    scene.truth.X =
        scene.truth.X * make_pose({aside, 0.3 * aside, 0}, {0, -aside / settings.distance, 0.2 * c});
    scene.points = size * shaped(stated, target_bows(stated), {.warp = warp});
    for (std::size_t i = 0; i < scene.observations.size(); ++i) look(scene, i, scene.truth.X, random);
    scene.points = stated;
    scene.camera = stated_lens(scene.camera, random);
    for (Observation& o : scene.observations)
      o.T_camera_target = {fitted_pose(scene.camera, stated, o.pixels, o.T_camera_target.front())};
  }
  return cameras;
}

Json numbers(const Eigen::MatrixXd& columns) {
  Json list = Json::array();
  for (Eigen::Index k = 0; k < columns.cols(); ++k) {
    list.push_back(Json::array());
    for (const double x : columns.col(k)) list.back().push_back(x);
  }
  return list;
}

/// As flash-calib detect --json writes it.
Json detections(const HandEyeScene& scene, const std::string& refiner) {
  Json views = Json::array();
  for (const Observation& o : scene.observations)
    views.push_back(
        {{"image", o.image},
         {"readings", {{{"refiner", refiner}, {"points", o.points}, {"pixels", numbers(o.pixels)}}}}});
  return {{"target_points", numbers(scene.points)}, {"views", views}};
}

void write(const fs::path& path, const Json& json) { std::ofstream(path) << json.dump() << '\n'; }

void write_camera(const HandEyeScene& scene, const fs::path& folder, unsigned held_out_seed) {
  const std::string refiner = "drawn";
  fs::create_directories(folder);
  write(folder / "detect.json", detections(scene, refiner));
  for (const Use use : {Use::workspace, Use::image, Use::two_arms}) {
    CalibrateSettings settings;
    settings.use = use;
    settings.held_out_seed = held_out_seed;
    const Calibration result = calibrate(scene.settings.setup, scene.camera, scene.points,
                                         grid_symmetries(scene.points), scene.observations, settings);
    write(folder / (std::string(to_string(use)) + ".json"),
          to_json(result, {.dataset = {}, .target = {}, .poses = {}, .camera = {}, .refiner = refiner}, 0));
  }
}

}  // namespace
}  // namespace flash::calib

int main(int argc, char** argv) {
  if (argc != 5) {
    std::fprintf(stderr, "drawn_cells: found %d arguments, expected FOLDER CELLS FIRST_SEED HELD_OUT_SEED\n",
                 argc - 1);
    return 2;
  }
  const std::filesystem::path folder = argv[1];
  const auto cells = static_cast<std::size_t>(std::atoi(argv[2]));
  const auto first = static_cast<unsigned>(std::atoi(argv[3])),
             held_out = static_cast<unsigned>(std::atoi(argv[4]));
  flash::data::for_each_in_parallel(cells, 0, [&](std::size_t i) {
    const unsigned seed = first + static_cast<unsigned>(i);
    const std::vector<flash::calib::HandEyeScene> cameras = flash::calib::cell_of(seed);
    for (std::size_t c = 0; c < cameras.size(); ++c)
      flash::calib::write_camera(
          cameras[c], folder / ("cell" + std::to_string(seed)) / ("camera" + std::to_string(c + 1)),
          held_out);
  });
}
