#include "calib/detect/grey_image.h"

#include <gtest/gtest.h>

#include <cstring>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "data/camera/depth_image.h"
#include "data/files/atomic_file.h"
#include "tests/data/temporary_folder.h"

namespace flash::calib {
namespace {

TEST(GreyImage, WhatNeverEndsOrUnpacksToTooMuchIsRefused) {
  const data::TemporaryFolder folder;
  EXPECT_EQ(data::input_error_of([] { load_grey_image("/dev/zero"); }),
            "/dev/zero: is a device, a pipe or a socket, expected a file");
  data::save_mask({4, 3, std::vector<std::uint8_t>(12, 9)}, folder / "a.png");
  EXPECT_EQ(load_grey_image(folder / "a.png").width, 4);
  std::string bytes = data::read_file(folder / "a.png");
  bytes[18] = bytes[22] = 64;  // 16,388 x 16,387 pixels
  EXPECT_NE(data::input_error_of([&] {
              load_grey_image(folder.write("b.png", bytes));
            }).find("found 16,388 x 16,387 pixels, expected at most 268,435,456 in all"),
            std::string::npos);
}

TEST(GreyImage, PngIsTheSameAsOpenCvReadsIt) {
  const data::TemporaryFolder folder;
  cv::Mat colour(37, 53, CV_8UC3), grey(37, 53, CV_8UC1), deep(37, 53, CV_16UC1), clear(37, 53, CV_8UC4);
  for (cv::Mat* picture : {&colour, &grey, &deep, &clear})
    cv::randu(*picture, cv::Scalar::all(0), cv::Scalar::all(picture == &deep ? 65536 : 256));
  for (const auto& [name, picture] :
       {std::pair("colour.png", &colour), {"grey.png", &grey}, {"deep.png", &deep}, {"clear.png", &clear}}) {
    const std::string path = folder / name;
    cv::imwrite(path, *picture);
    const cv::Mat theirs = cv::imread(path, cv::IMREAD_GRAYSCALE);
    const GreyImage ours = load_grey_image(path);
    ASSERT_EQ(ours.width, theirs.cols) << name;
    ASSERT_EQ(ours.pixels.size(), theirs.total()) << name;
    EXPECT_EQ(0, std::memcmp(ours.pixels.data(), theirs.data, theirs.total())) << name;
  }
}

// Ten bits in the lower part of sixteen: read as eight they would be four grey levels.
TEST(GreyImage, OfSixteenBitsTheHighestInUseAreRead) {
  const data::TemporaryFolder folder;
  cv::Mat ten(37, 53, CV_16UC1);
  cv::randu(ten, cv::Scalar::all(0), cv::Scalar::all(1024));
  ten.at<std::uint16_t>(0, 0) = 1023;
  cv::imwrite(folder / "ten.png", ten);
  const GreyImage image = load_grey_image(folder / "ten.png");
  ASSERT_EQ(image.pixels.size(), ten.total());
  for (int y = 0; y < ten.rows; ++y)
    for (int x = 0; x < ten.cols; ++x)
      EXPECT_EQ(image.at(x, y), ten.at<std::uint16_t>(y, x) / 4);  // ten bits to eight
}

cv::Mat noise() {
  cv::Mat picture(120, 160, CV_8UC3);
  cv::randu(picture, cv::Scalar::all(0), cv::Scalar::all(256));
  return picture;
}

// Wherever a picture ends before its end: an end marker within a thumbnail, a comment or a restart is none.
TEST(GreyImage, PicturesThatAreCutOffAreNamedWhereverTheyEnd) {
  const data::TemporaryFolder folder;
  cv::imwrite(folder / "base.jpg", noise());
  cv::imwrite(folder / "restarts.jpg", noise(), {cv::IMWRITE_JPEG_RST_INTERVAL, 4});
  cv::imwrite(folder / "progressive.jpg", noise(), {cv::IMWRITE_JPEG_PROGRESSIVE, 1});
  cv::imwrite(folder / "rows.bmp", noise());
  cv::imwrite(folder / "rows.png", noise());
  std::string with_comment = data::read_file(folder / "base.jpg");
  with_comment.insert(2, std::string("\xff\xfe\x00\x06\xff\xd9\xff\xd9", 8));
  folder.write("comment.jpg", with_comment);
  for (const char* name :
       {"base.jpg", "restarts.jpg", "progressive.jpg", "comment.jpg", "rows.bmp", "rows.png"}) {
    const std::string whole = data::read_file(folder / name);
    EXPECT_EQ(load_grey_image(folder / name).width, 160) << name;
    EXPECT_EQ(load_grey_image(folder.write(std::string("more_") + name, whole + "\r\n and more")).width, 160)
        << name;
    // Of a PNG the last twelve bytes say no more than that it ends.
    const bool png = std::string(name).ends_with("png");
    for (const std::size_t missing :
         {png ? 20 : std::size_t{1}, whole.size() / 10, whole.size() / 2, 9 * whole.size() / 10}) {
      const std::string path =
          folder.write(std::string("cut_") + name, whole.substr(0, whole.size() - missing));
      testing::internal::CaptureStderr();
      const std::string said = data::input_error_of([&] { load_grey_image(path); });
      EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
      EXPECT_NE(said.find(std::string("cut_") + name + ": "), std::string::npos) << said;
      EXPECT_NE(said.find(png ? "ends within its data" : "the picture is cut off: found "), std::string::npos)
          << said << missing;
    }
  }
}

TEST(GreyImage, WhatIsWrongWithAPngIsSaidOnce) {
  const data::TemporaryFolder folder;
  cv::Mat picture(200, 200, CV_8UC1);
  cv::randu(picture, 0, 256);
  cv::imwrite(folder / "a.png", picture);
  std::string bytes = data::read_file(folder / "a.png");
  for (std::size_t i = bytes.size() / 2; i < bytes.size() / 2 + 40; ++i) bytes[i] ^= 0x5a;
  const std::string path = folder.write("b.png", bytes);
  testing::internal::CaptureStderr();
  const std::string said = data::input_error_of([&] { load_grey_image(path); });
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  EXPECT_NE(said.find("b.png: PNG cannot be decoded"), std::string::npos) << said;
}

}  // namespace
}  // namespace flash::calib
