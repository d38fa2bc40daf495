#include "calib/detect/detect.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "calib/detect/finder.h"
#include "calib/detect/grey_image.h"
#include "data/camera/depth_image.h"
#include "data/files/atomic_file.h"
#include "data/picture/picture.h"
#include "tests/calib/rendered_view.h"
#include "tests/data/temporary_folder.h"

namespace flash::calib {
namespace {

/// Rendered pictures in a folder, with poses and intrinsics.
Dataset write_set(const data::TemporaryFolder& folder, const Target& target, int views,
                  const RenderSettings& settings = {}) {
  const data::CameraIntrinsics camera = small_camera();
  const Renderer renderer(target, camera, settings);
  std::mt19937 random(5);
  std::string poses;
  for (int v = 0; v < views; ++v) {
    std::filesystem::create_directories(folder / "images");
    const Eigen::Isometry3d pose = random_view(target, camera, 0.4, 0.6, 0.6, random);
    data::save_mask(renderer.draw(pose, random), folder / ("images/" + std::to_string(v) + ".png"));
    poses += std::to_string(v) + " 0.1 0 0 0 0 0 1\n";
  }
  folder.write("poses.tum", poses);
  data::save_camera_info(camera, folder / "camera_info.yaml");
  return load_dataset(folder / "");
}

TEST(Detect, UnreadablePicturesAreNamedAndTheRestGoesOn) {
  const data::TemporaryFolder folder;
  const Target target = parse_target("chessboard:7x5:0.03");
  const Dataset dataset = write_set(folder, target, 3);
  folder.write("images/1.png", "not a picture");
  const std::vector<Detection> detections = detect(dataset, target);
  ASSERT_EQ(detections.size(), 3u);
  EXPECT_NE(detections[1].reason.find("cannot be read"), std::string::npos);
  EXPECT_TRUE(detections[1].readings.empty());
  for (const int v : {0, 2}) {
    ASSERT_FALSE(detections[static_cast<std::size_t>(v)].readings.empty());
    const CornerReading& best = detections[static_cast<std::size_t>(v)].readings.front();
    EXPECT_EQ(best.refiner, "image_model");
    EXPECT_LT(best.observation.pose_rms, 0.05);
  }
  EXPECT_EQ(rank_refiners(detections).front().refiner, "image_model");
  EXPECT_EQ(observations_of(detections, "sectors").size(), 2u);
}

TEST(Detect, WhatIsKeptIsWhatWasFound) {
  const data::TemporaryFolder folder;
  const Target target = parse_target("chessboard:7x5:0.03");
  const Dataset dataset = write_set(folder, target, 1);
  DetectSettings settings;
  settings.cache = folder / "cache";
  const std::vector<Detection> first = detect(dataset, target, settings),
                               second = detect(dataset, target, settings);
  const auto files = std::distance(std::filesystem::directory_iterator(folder / "cache"), {});
  EXPECT_EQ(files, 1);
  ASSERT_EQ(first[0].readings.size(), second[0].readings.size());
  EXPECT_EQ(first[0].readings[0].observation.pixels, second[0].readings[0].observation.pixels);
  // Another target is another question, and a broken file no answer.
  EXPECT_THROW(detect(dataset, parse_target("chessboard:8x5:0.03"), settings), data::InputError);
  const auto spoil = [&](const std::string& text) {
    for (const auto& entry : std::filesystem::directory_iterator(folder / "cache"))
      std::ofstream(entry.path()) << text;
  };
  const auto kept = [](const std::string& points, const std::string& pixels) {
    return R"({"reason": "", "sightings": [{"refiner": "image_model", "points": [)" + points +
           R"(], "pixels": [)" + pixels + "]}]}";
  };
  for (const std::string& text : {kept("99999", "[1, 2]"), kept("-1", "[1, 2]"),
                                  kept("3, 3", "[1, 2], [1, 2]"), kept("3", "[1e300, 2]")}) {
    spoil(text);
    EXPECT_EQ(detect(dataset, target, settings)[0].readings[0].observation.pixels,
              first[0].readings[0].observation.pixels)
        << text;
  }
  // Corners that were moved by hand are found anew, with a word.
  detect(dataset, target, settings);
  for (const auto& entry : std::filesystem::directory_iterator(folder / "cache")) {
    std::string text = data::read_file(entry.path().string());
    const std::size_t place = text.find("\"pixels\":[["), dot = text.find('.', place);
    if (place == std::string::npos) continue;  // of the other target, which was not found
    text[dot - 1] = text[dot - 1] == '5' ? '6' : '5';
    std::ofstream(entry.path()) << text;
  }
  std::vector<std::string> told;
  settings.tell = [&](const std::string& line) { told.push_back(line); };
  for (int run = 0; run < 2; ++run) {
    EXPECT_EQ(detect(dataset, target, settings)[0].readings[0].observation.pixels,
              first[0].readings[0].observation.pixels);
    ASSERT_EQ(told.size(), 1U);  // the second run reads what the first wrote anew
  }
  EXPECT_NE(told.front().find(".json: is not as it was written; what it keeps of "), std::string::npos)
      << told.front();
  spoil("{");
  EXPECT_EQ(detect(dataset, target, settings)[0].readings[0].observation.pixels,
            first[0].readings[0].observation.pixels);
}

TEST(Detect, WhatIsKeptOfAnotherPictureIsFoundAnew) {
  const data::TemporaryFolder folder;
  const Target target = parse_target("chessboard:7x5:0.03");
  const Dataset dataset = write_set(folder, target, 2);
  DetectSettings settings;
  settings.cache = folder / "cache";
  const std::vector<Detection> first = detect(dataset, target, settings);
  std::vector<std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder / "cache"))
    files.push_back(entry.path().string());
  ASSERT_EQ(files.size(), 2U);
  std::filesystem::rename(files[0], folder / "kept");
  std::filesystem::rename(files[1], files[0]);
  std::filesystem::rename(folder / "kept", files[1]);
  std::vector<std::string> told;
  settings.tell = [&](const std::string& line) { told.push_back(line); };
  const std::vector<Detection> second = detect(dataset, target, settings);
  for (std::size_t i = 0; i < 2; ++i)
    EXPECT_EQ(second[i].readings[0].observation.pixels, first[i].readings[0].observation.pixels);
  EXPECT_EQ(told.size(), 2U);
}

TEST(Detect, CornersAreThoseOfAnySizeOfTheTarget) {
  const data::TemporaryFolder folder;
  const Dataset dataset = write_set(folder, parse_target("chessboard:7x5:0.03"), 1);
  DetectSettings settings;
  settings.cache = folder / "cache";
  detect(dataset, parse_target("chessboard:7x5:0.03"), settings);
  detect(dataset, parse_target("chessboard:7x5:0.0301"), settings);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder / "cache"), {}), 1);
}

TEST(Detect, PicturesOfAnotherSizeNameTheFileOfTheirOwnSet) {
  const data::TemporaryFolder a, b, kept;
  const Target target = parse_target("chessboard:7x5:0.03");
  DetectSettings settings;
  settings.cache = kept / "";
  for (const data::TemporaryFolder* folder : {&a, &b}) {
    Dataset dataset = write_set(*folder, target, 1);  // the same picture
    dataset.camera->width += 2;
    const std::string message = data::input_error_of([&] { detect(dataset, target, settings); });
    EXPECT_NE(message.find("the picture is"), std::string::npos) << message;
    EXPECT_NE(message.find(dataset.camera_path + " says"), std::string::npos) << message;
  }
}

TEST(Detect, PictureOfHalfTheSizeIsLeftOutWithBothSizes) {
  const data::TemporaryFolder folder;
  const Target target = parse_target("chessboard:7x5:0.03");
  const Dataset dataset = write_set(folder, target, 3);
  const GreyImage whole = load_grey_image(folder / "images/1.png");
  data::Picture half(whole.width / 2, whole.height / 2, {0, 0, 0});
  data::save_png(half, folder / "images/1.png");
  const std::vector<Detection> detections = detect(dataset, target);
  EXPECT_FALSE(detections[0].readings.empty());
  EXPECT_TRUE(detections[1].readings.empty());
  EXPECT_NE(detections[1].reason.find("the picture is " + std::to_string(whole.width / 2) + " x " +
                                      std::to_string(whole.height / 2)),
            std::string::npos)
      << detections[1].reason;
  EXPECT_NE(detections[1].reason.find("says " + std::to_string(whole.width) + " x "), std::string::npos);
  EXPECT_FALSE(detections[2].readings.empty());
}

TEST(Detect, BoardsCountedOtherwiseAreNamedByTheirInnerCorners) {
  const data::TemporaryFolder folder;
  const Dataset dataset = write_set(folder, parse_target("chessboard:7x5:0.03"), 1);
  // Squares; corners with the outer ones; one less.
  for (const char* counted : {"chessboard:8x6:0.03", "chessboard:9x7:0.03", "chessboard:6x5:0.03"}) {
    const std::string message = data::input_error_of([&] { detect(dataset, parse_target(counted)); });
    EXPECT_NE(message.find("show one of 7x5 inner corners, where four squares meet: --target "
                           "chessboard:7x5:0.03"),
              std::string::npos)
        << message;
  }
}

// A board that is cut off looks like one with a row less.
TEST(Detect, BoardsThatTheFirstPicturesCutOffAreFoundInTheRest) {
  const data::TemporaryFolder folder, cut;
  const Target target = parse_target("chessboard:7x5:0.03");
  const Dataset dataset = write_set(folder, target, 5);
  write_set(cut, parse_target("chessboard:7x4:0.03"), 4);
  for (const char* picture : {"images/0.png", "images/1.png", "images/2.png", "images/3.png"})
    std::filesystem::rename(cut / picture, folder / picture);
  const std::vector<Detection> detections = detect(dataset, target);
  EXPECT_TRUE(detections[0].readings.empty());
  EXPECT_FALSE(detections[4].readings.empty());
}

/// A lens so wide that sectors do not see a board at the edge of the picture; another way does.
data::CameraIntrinsics wide_camera() {
  data::CameraIntrinsics camera = small_camera();
  camera.fx = camera.fy = 300;
  camera.model = data::DistortionModel::plumb_bob;
  camera.distortion = {-0.28, 0.07, 0, 0, -0.007};
  return camera;
}

// A thorough search takes seconds a picture: it is asked for few pictures where none shows the board.
TEST(Detect, ThoroughSearchGoesOnOnlyWhereABoardIsSeen) {
  const Target target = parse_target("chessboard:9x6:0.025");
  const data::CameraIntrinsics camera = wide_camera();
  const Renderer renderer(target, camera);
  const Rectifier rectifier(camera);
  const Finder nearby = make_finder(target, rectifier, Search::nearby),
               thorough = make_finder(target, rectifier);
  std::mt19937 random(7);
  GreyImage easy, hard;
  for (int view = 0; view < 200 && (easy.pixels.empty() || hard.pixels.empty()); ++view) {
    const GreyImage image = renderer.draw(random_view(target, camera, 0.1, 0.2, 1.0, random), random);
    const Found found = nearby(image);
    if (!found.is_open)
      easy = image;
    else if (!thorough(image).sightings.empty())
      hard = image;
  }
  ASSERT_FALSE(easy.pixels.empty() || hard.pixels.empty());

  constexpr int kPictures = 12;  // of which six, the even ones, are asked first
  const auto seen = [&](int hard_picture, int easy_picture) {
    const data::TemporaryFolder folder;
    std::filesystem::create_directories(folder / "images");
    std::string poses;
    for (int k = 0; k < kPictures; ++k) {
      GreyImage blank = easy;
      std::fill(blank.pixels.begin(), blank.pixels.end(), 120);
      data::save_mask(k == hard_picture   ? hard
                      : k == easy_picture ? easy
                                          : blank,
                      folder / ("images/" + std::to_string(10 + k) + ".png"));
      poses += std::to_string(10 + k) + " 0.1 0 0 0 0 0 1\n";
    }
    folder.write("poses.tum", poses);
    data::save_camera_info(camera, folder / "camera_info.yaml");
    std::vector<int> pictures;
    int told = 0;
    try {
      const std::vector<Detection> detections =
          detect(load_dataset(folder / ""), target, {}, [&](int done, int) { told = done; });
      for (int k = 0; k < kPictures; ++k)
        if (!detections[static_cast<std::size_t>(k)].readings.empty()) pictures.push_back(k);
    } catch (const data::InputError& error) {
      EXPECT_NE(std::string(error.what()).find("seen in none of 12 pictures"), std::string::npos);
    }
    EXPECT_EQ(told, kPictures);
    return pictures;
  };
  EXPECT_EQ(seen(4, -1), std::vector<int>({4}));
  EXPECT_EQ(seen(5, -1), std::vector<int>());
  EXPECT_EQ(seen(5, 8), std::vector<int>({5, 8}));
}

TEST(Detect, TransposedBoardIsTheSameBoard) {
  const data::TemporaryFolder folder;
  const Dataset dataset = write_set(folder, parse_target("chessboard:7x5:0.03"), 2);
  for (const Detection& detection : detect(dataset, parse_target("chessboard:5x7:0.03"))) {
    ASSERT_FALSE(detection.readings.empty()) << detection.reason;
    EXPECT_EQ(detection.readings.front().observation.points.size(), 35U);
    EXPECT_LT(detection.readings.front().observation.pose_rms, 0.05);  // as of 7 x 5
  }
}

TEST(Detect, NoTargetAnywhereIsAnError) {
  const data::TemporaryFolder folder;
  const Dataset dataset = write_set(folder, parse_target("chessboard:7x5:0.03"), 2);
  const std::string message =
      data::input_error_of([&] { detect(dataset, parse_target("apriltag:36h11:0:0.05")); });
  EXPECT_NE(message.find("seen in none of 2 pictures"), std::string::npos) << message;
  EXPECT_NE(message.find("no tag of 36h11"), std::string::npos) << message;
}

}  // namespace
}  // namespace flash::calib
