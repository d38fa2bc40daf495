// Writes a dataset that flash-calib reads, drawn by the tests' renderer, with the truth beside it:
//   rendered_dataset OUT SETUP TARGET VIEWS WIDTHxHEIGHT ROBOT_DEG ROBOT_MM [SEED]
//   rendered_dataset demo eye-in-hand chessboard:9x6:0.025 40 1280x720 0.05 0.5
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <string>

#include "calib/extrinsics.h"
#include "calib/pose.h"
#include "data/atomic_file.h"
#include "data/picture.h"
#include "data/trajectory.h"
#include "tests/calib/rendered_view.h"

namespace flash::calib {
namespace {

namespace fs = std::filesystem;

struct DatasetSettings {
  Setup setup = Setup::eye_in_hand;
  std::string target;
  int views = 20;
  int width = 1280, height = 720;      ///< [px]
  double robot_deg = 0, robot_mm = 0;  ///< noise of the reported poses per axis
  unsigned seed = 1;
};

Eigen::Isometry3d make_pose(const Eigen::Vector3d& translation, const Eigen::Vector3d& rotation) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() = translation;
  T.linear() = rotation_exp(rotation);
  return T;
}

data::Picture to_picture(const GreyImage& image) {
  data::Picture picture(image.width, image.height, {0, 0, 0});
  for (std::size_t i = 0; i < picture.pixels.size(); ++i)
    picture.pixels[i] = {image.pixels[i], image.pixels[i], image.pixels[i]};
  return picture;
}

/// A camera of 60 degrees across with a little distortion.
data::CameraIntrinsics make_camera(int width, int height) {
  data::CameraIntrinsics camera;
  camera.width = width;
  camera.height = height;
  camera.fx = camera.fy = 0.5 * width / std::tan(M_PI / 6);
  camera.cx = 0.5 * (width - 1);
  camera.cy = 0.5 * (height - 1);
  camera.model = data::DistortionModel::plumb_bob;
  camera.distortion = {-0.08, 0.02, 0.0005, -0.0003, 0};
  return camera;
}

void write_dataset(const DatasetSettings& settings, const std::string& out) {
  std::mt19937 random(settings.seed);
  std::normal_distribution<double> normal;
  const auto normal3 = [&] { return Eigen::Vector3d(normal(random), normal(random), normal(random)); };
  const Target target = parse_target(settings.target);
  const data::CameraIntrinsics camera = make_camera(settings.width, settings.height);
  const bool in_hand = settings.setup == Setup::eye_in_hand;
  // Optical axis down, as the camera looks from the hand; or towards the robot from a metre away.
  const Eigen::Isometry3d X = in_hand ? make_pose({0.05, -0.02, 0.06}, {0.02, -0.03, 1.55})
                                      : make_pose({1.1, 0.1, 0.5}, {-1.2, -1.2, 1.2});
  const Eigen::Isometry3d Z =
      in_hand ? make_pose({0.5, 0.1, 0}, {M_PI, 0, 0.2}) : make_pose({0, 0.02, 0.1}, {0, 0.1, 0.3});
  const Eigen::Matrix3Xd points = target_points(target);
  const double size = (points.rowwise().maxCoeff() - points.rowwise().minCoeff()).maxCoeff();
  const double near = std::max(1.5 * size, 0.25), far = std::max(2.8 * size, 0.45);
  const Renderer renderer(target, camera);
  data::Trajectory reported;
  for (int i = 0; i < settings.views; ++i) {
    const Eigen::Isometry3d T_camera_target = random_view(target, camera, near, far, 0.7, random);
    const Eigen::Isometry3d T_base_gripper =
        in_hand ? Z * T_camera_target.inverse() * X.inverse() : X * T_camera_target * Z.inverse();
    Vector6d error;
    error << settings.robot_mm * 1e-3 * normal3(), settings.robot_deg * M_PI / 180 * normal3();
    reported.times.push_back(i);
    reported.poses.push_back(moved(T_base_gripper, error));
    char name[32];
    std::snprintf(name, sizeof name, "%03d.png", i);
    data::save_png(to_picture(renderer.draw(T_camera_target, random)),
                   (fs::path(out) / "images" / name).string());
  }
  data::save_tum(reported, (fs::path(out) / "poses.tum").string());
  data::save_camera_info(camera, (fs::path(out) / "camera_info.yaml").string());
  data::write_atomically((fs::path(out) / "target.json").string(),
                         std::string("{\"setup\": \"") + to_string(settings.setup) + "\", \"target\": \"" +
                             settings.target + "\"}\n");
  data::Trajectory truth;
  truth.times = {0, 1};
  truth.poses = {X, Z};
  data::save_tum(truth, (fs::path(out) / "truth" / "X_and_Z.tum").string());
}

}  // namespace
}  // namespace flash::calib

int main(int argc, char** argv) try {
  using namespace flash::calib;
  if (argc < 8) {
    std::cerr << "usage: rendered_dataset OUT SETUP TARGET VIEWS WIDTHxHEIGHT ROBOT_DEG ROBOT_MM [SEED]\n";
    return 2;
  }
  DatasetSettings settings{.setup = parse_setup(argv[2], "command line", "SETUP"),
                           .target = argv[3],
                           .views = std::stoi(argv[4]),
                           .robot_deg = std::stod(argv[6]),
                           .robot_mm = std::stod(argv[7])};
  if (std::sscanf(argv[5], "%dx%d", &settings.width, &settings.height) != 2)
    throw std::runtime_error("WIDTHxHEIGHT: expected as 1280x720");
  if (argc > 8) settings.seed = static_cast<unsigned>(std::stoul(argv[8]));
  write_dataset(settings, argv[1]);
  return 0;
} catch (const std::exception& error) {
  std::cerr << "rendered_dataset: " << error.what() << '\n';
  return 1;
}
