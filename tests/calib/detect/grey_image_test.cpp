#include "calib/detect/grey_image.h"

#include <gtest/gtest.h>

#include "data/atomic_file.h"
#include "data/depth_image.h"
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

}  // namespace
}  // namespace flash::calib
