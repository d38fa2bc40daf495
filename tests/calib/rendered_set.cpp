#include "tests/calib/rendered_set.h"

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <opencv2/imgcodecs.hpp>

#include "calib/geometry/pose.h"
#include "data/camera/depth_image.h"
#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "data/motion/trajectory.h"
#include "data/picture/picture.h"
#include "tests/calib/rendered_view.h"

namespace flash::calib {
namespace {

namespace fs = std::filesystem;

constexpr double kDepthScale = 0.001;           // [m] a count, as most cameras write it
constexpr double kStart = 1000, kPeriod = 0.4;  // of a stream's pictures [s]

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

void save_picture(GreyImage image, int jpeg_quality, const fs::path& path) {
  if (jpeg_quality == 0) return data::save_png(to_picture(image), path.string());
  fs::create_directories(path.parent_path());
  const cv::Mat grey(image.height, image.width, CV_8UC1, image.pixels.data());
  if (!cv::imwrite(path.string(), grey, {cv::IMWRITE_JPEG_QUALITY, jpeg_quality}))
    throw data::InputError(path.string() + ": cannot be written");
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

/// Where things are, and where the gripper is at view i or time t.
struct Scene {
  HandEyePoses truth;
  std::function<Eigen::Isometry3d(double)> gripper;
};

Eigen::Isometry3d gripper_of(Setup setup, const HandEyePoses& truth, const Eigen::Isometry3d& C) {
  return setup == Setup::eye_in_hand ? truth.Z * C.inverse() * truth.X.inverse()
                                     : truth.X * C * truth.Z.inverse();
}

Eigen::Isometry3d target_in_camera(Setup setup, const HandEyePoses& truth, const Eigen::Isometry3d& G) {
  return setup == Setup::eye_in_hand ? truth.X.inverse() * G.inverse() * truth.Z
                                     : truth.X.inverse() * G * truth.Z;
}

Scene make_scene(const RenderedSetSettings& settings, const Target& target,
                 const data::CameraIntrinsics& camera, std::mt19937& random) {
  const bool in_hand = settings.setup == Setup::eye_in_hand;
  Scene scene;
  // Optical axis down, as the camera looks from the hand; or towards the robot from a metre away.
  scene.truth.X = in_hand ? make_pose({0.05, -0.02, 0.06}, {0.02, -0.03, 1.55})
                          : make_pose({1.1, 0.1, 0.5}, {-1.2, -1.2, 1.2});
  scene.truth.Z =
      in_hand ? make_pose({0.5, 0.1, 0}, {M_PI, 0, 0.2}) : make_pose({0, 0.02, 0.1}, {0, 0.1, 0.3});
  const Eigen::Matrix3Xd points = target_points(target);
  const Eigen::Vector3d low = points.rowwise().minCoeff(), high = points.rowwise().maxCoeff();
  const Eigen::Vector3d middle = (low + high) / 2;
  const double size = (high - low).maxCoeff();
  const double near = settings.least_distance > 0 ? settings.least_distance : std::max(1.5 * size, 0.25);
  const double far = settings.most_distance > 0 ? settings.most_distance : std::max(2.8 * size, 0.45);
  const Eigen::Isometry3d to_middle = make_pose(middle, Eigen::Vector3d::Zero());
  const Setup setup = settings.setup;

  switch (settings.motion) {
    case RobotMotion::random:
      scene.gripper = [=, &target, &camera, &random, truth = scene.truth](double) {
        return gripper_of(setup, truth, random_view(target, camera, near, far, 0.7, random));
      };
      break;
    case RobotMotion::one_axis: {
      const Eigen::Isometry3d start = gripper_of(
          setup, scene.truth, make_pose({0, 0, (near + far) / 2}, {0.3, -0.2, 0.1}) * to_middle.inverse());
      scene.gripper = [=](double i) {
        return moved(start, (Vector6d() << 0.01 * std::sin(i), 0.01 * std::cos(1.3 * i),
                             0.02 * std::sin(2 * i), 0, 0, 0.3 * std::sin(1.7 * i))
                                .finished());
      };
      break;
    }
    case RobotMotion::pan_tilt: {
      // Pan about the upright, tilt about the level axis above it; the camera looks ahead, along y.
      scene.truth.X =
          make_pose({0.05, 0.03, 0.04}, {-M_PI / 2, 0, 0}) * make_pose({0, 0, 0}, {0.01, 0.02, 0.02});
      scene.truth.Z = scene.truth.X * make_pose({0.02, -0.01, 0.8}, {0.35, -0.3, 0.1}) * to_middle.inverse();
      const Eigen::Isometry3d neck = make_pose({0, 0, 1.2}, Eigen::Vector3d::Zero());
      const auto head = [neck](double pan, double tilt) {
        return neck * make_pose({0, 0, 0}, {0, 0, pan}) * make_pose({0, 0, 0.05}, {tilt, 0, 0});
      };
      scene.truth.Z = head(0, 0) * scene.truth.Z;
      scene.gripper = [head](double i) { return head(0.25 * std::sin(0.7 * i), 0.17 * std::sin(1.9 * i)); };
      break;
    }
    case RobotMotion::stream:
      scene.gripper = [=, truth = scene.truth](double t) {
        // Up to 0.7 rad/s and 0.2 m/s; incommensurable, so that no two views are alike.
        const double distance = (near + far) / 2 + 0.3 * (far - near) * std::sin(1.1 * t);
        const Eigen::Vector3d tilt(0.45 * std::sin(1.3 * t + 1), 0.4 * std::sin(0.9 * t),
                                   0.5 * std::sin(0.7 * t));
        return gripper_of(
            setup, truth,
            make_pose({0.1 * distance * std::sin(1.7 * t), 0.06 * distance * std::cos(1.5 * t), distance},
                      Eigen::Vector3d::Zero()) *
                make_pose(Eigen::Vector3d::Zero(), tilt) * to_middle.inverse());
      };
  }
  return scene;
}

data::DepthImage depth_picture(const Renderer& renderer, const data::CameraIntrinsics& camera,
                               const Eigen::Isometry3d& C, const RenderedSetSettings& settings,
                               std::mt19937& random) {
  std::normal_distribution<double> noise(0, std::max(1e-3 * settings.depth_mm, 1e-12));
  data::DepthImage depth;
  depth.width = camera.width;
  depth.height = camera.height;
  for (const double z : renderer.depth(C))
    depth.pixels.push_back(z > 0 ? static_cast<std::uint16_t>(
                                       std::lround((settings.depth_factor * z + noise(random)) / kDepthScale))
                                 : 0);
  return depth;
}

}  // namespace

HandEyePoses write_rendered_set(const RenderedSetSettings& settings, const std::string& folder) {
  std::mt19937 random(settings.seed);
  std::normal_distribution<double> normal;
  const auto normal3 = [&] { return Eigen::Vector3d(normal(random), normal(random), normal(random)); };
  const auto reported = [&](const Eigen::Isometry3d& pose) {
    Vector6d error;
    error << settings.robot_mm * 1e-3 * normal3(), settings.robot_deg * M_PI / 180 * normal3();
    return moved(pose, error);
  };
  const Target target = parse_target(settings.target);
  const data::CameraIntrinsics camera = make_camera(settings.width, settings.height);
  const Scene scene = make_scene(settings, target, camera, random);
  RenderSettings rendering{.noise = settings.pixel_noise};
  if (settings.exposure > 0) rendering.samples = 5;  // each moment has places of its own
  const Renderer renderer(target, camera, rendering);
  const bool stream = settings.motion == RobotMotion::stream;
  data::Trajectory poses;
  for (int i = 0; i < settings.views; ++i) {
    const double stamp = stream ? kStart + 0.5 + kPeriod * i : i;
    const double taken = stream ? stamp + settings.time_offset : stamp;
    const Eigen::Isometry3d T_base_gripper = scene.gripper(taken);
    const Eigen::Isometry3d C = target_in_camera(settings.setup, scene.truth, T_base_gripper);
    char name[32];
    std::snprintf(name, sizeof name, stream ? "%.3f" : "%03.0f", stamp);
    if (!stream) {
      poses.times.push_back(i);
      poses.poses.push_back(reported(T_base_gripper));
    }
    std::vector<Eigen::Isometry3d> exposed{C};
    if (stream && settings.exposure > 0) {
      constexpr int kMoments = 12;  // closer than a pixel each
      exposed.clear();
      for (int k = 0; k < kMoments; ++k)
        exposed.push_back(
            target_in_camera(settings.setup, scene.truth,
                             scene.gripper(taken + settings.exposure * ((k + 0.5) / kMoments - 0.5))));
    }
    save_picture(renderer.draw(exposed, random), settings.jpeg_quality,
                 fs::path(folder) / "images" / (name + std::string(settings.jpeg_quality ? ".jpg" : ".png")));
    if (settings.depth_mm >= 0)
      data::save_depth_image(depth_picture(renderer, camera, C, settings, random),
                             (fs::path(folder) / "depth" / (name + std::string(".png"))).string());
  }
  for (int k = 0; stream && k * 0.01 < kPeriod * settings.views + 1; ++k) {
    poses.times.push_back(kStart + 0.01 * k);
    poses.poses.push_back(reported(scene.gripper(poses.times.back())));
  }
  data::save_tum(poses, (fs::path(folder) / "poses.tum").string());
  data::save_camera_info(camera, (fs::path(folder) / "camera_info.yaml").string());
  data::write_atomically((fs::path(folder) / "target.json").string(),
                         std::string("{\"setup\": \"") + to_string(settings.setup) + "\", \"target\": \"" +
                             settings.target + "\"}\n");
  data::Trajectory truth;
  truth.times = {0, 1};
  truth.poses = {scene.truth.X, scene.truth.Z};
  data::save_tum(truth, (fs::path(folder) / "truth" / "X_and_Z.tum").string());
  return scene.truth;
}

RobotMotion parse_motion(const std::string& text) {
  if (text == "random") return RobotMotion::random;
  if (text == "pan-tilt") return RobotMotion::pan_tilt;
  if (text == "one-axis") return RobotMotion::one_axis;
  if (text == "stream") return RobotMotion::stream;
  throw data::InputError("motion: found \"" + text + "\", expected random, pan-tilt, one-axis or stream");
}

}  // namespace flash::calib
