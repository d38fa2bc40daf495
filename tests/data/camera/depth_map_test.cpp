#include "data/camera/depth_map.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

#include "tests/data/temporary_folder.h"

namespace flash::data {
namespace {

template <class Number>
std::string bytes_of(const std::vector<Number>& numbers) {
  std::string bytes(numbers.size() * sizeof(Number), '\0');
  std::memcpy(bytes.data(), numbers.data(), bytes.size());
  return bytes;
}

/// As numpy.save writes version 1 of its format.
std::string npy(const std::string& type, const std::string& shape, const std::string& bytes,
                bool columns_first = false) {
  std::string header = "{'descr': '" + type + "', 'fortran_order': " + (columns_first ? "True" : "False") +
                       ", 'shape': " + shape + ", }";
  header.resize(117, ' ');
  header += '\n';
  return std::string("\x93NUMPY\x01\x00", 8) + static_cast<char>(header.size()) + '\0' + header + bytes;
}

/// As TIFF 6.0 has it: little endian, one strip, not compressed. format: 1 unsigned, 3 real.
std::string tiff(std::uint16_t bits, std::uint16_t format, std::uint32_t width, std::uint32_t height,
                 const std::string& bytes) {
  struct Entry {
    std::uint16_t tag, type;
    std::uint32_t value;
  };
  const auto size = static_cast<std::uint32_t>(bytes.size());
  const std::vector<Entry> entries = {{256, 4, width}, {257, 4, height}, {258, 3, bits}, {259, 3, 1},
                                      {262, 3, 1},     {273, 4, 8},      {277, 3, 1},    {278, 4, height},
                                      {279, 4, size},  {339, 3, format}};
  std::string text = "II";
  text += bytes_of<std::uint16_t>({42}) + bytes_of<std::uint32_t>({8 + size}) + bytes;
  text += bytes_of<std::uint16_t>({static_cast<std::uint16_t>(entries.size())});
  for (const Entry& entry : entries)
    text += bytes_of<std::uint16_t>({entry.tag, entry.type}) + bytes_of<std::uint32_t>({1, entry.value});
  return text + bytes_of<std::uint32_t>({0});
}

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

// The same two rows of three pixels, one of which saw nothing, as each kind of file.
TEST(DepthMap, AllFilesSayTheSame) {
  const TemporaryFolder folder;
  const std::vector<std::uint16_t> counts = {500, 750, 0, 1000, 1250, 1500};
  const std::vector<float> metres = {0.5F, 0.75F, kNan, 1.0F, 1.25F, 1.5F};
  const std::vector<double> doubles = {0.5, 0.75, -1, 1, 1.25, 1.5};
  save_depth_image({3, 2, counts}, folder / "a.png");
  const std::string files[] = {
      folder / "a.png",
      folder.write("counts.npy", npy("<u2", "(2, 3)", bytes_of(counts))),
      folder.write("metres.npy", npy("<f4", "(2, 3)", bytes_of(metres))),
      folder.write("doubles.npy", npy("<f8", "(2, 3)", bytes_of(doubles))),
      folder.write("columns.npy", npy("<f8", "(2, 3)", bytes_of<double>({0.5, 1, 0.75, 1.25, 0, 1.5}), true)),
      folder.write("counts.tif", tiff(16, 1, 3, 2, bytes_of(counts))),
      folder.write("metres.tiff", tiff(32, 3, 3, 2, bytes_of(metres))),
      folder.write("doubles.TIFF", tiff(64, 3, 3, 2, bytes_of(doubles)))};
  for (const std::string& file : files) {
    const DepthMap depth = load_depth(file, 0.001);
    ASSERT_TRUE(depth.width == 3 && depth.height == 2) << file;
    for (std::size_t i = 0; i < counts.size(); ++i)
      EXPECT_NEAR(depth.pixels[i], 0.001 * counts[i], 1e-15) << file;
  }
}

TEST(DepthMap, WhatIsNoDepthIsRefusedByName) {
  const TemporaryFolder folder;
  const auto refused = [&](const std::string& name, const std::string& text) {
    const std::string path = folder.write(name, text),
                      message = input_error_of([&] { load_depth(path, 0.001); });
    EXPECT_TRUE(message.starts_with(path)) << message;
    return message.substr(std::min(path.size(), message.size()));
  };
  EXPECT_EQ(refused("a.npy", npy("<f4", "(1, 2)", bytes_of<float>({812, 900}))),
            ": found depths of 900 as real numbers, expected metres: are these millimetres?");
  EXPECT_EQ(refused("b.npy", npy("<f4", "(2,)", bytes_of<float>({1, 2}))),
            ": found 1 dimensions, expected two, height and width");
  EXPECT_EQ(refused("c.npy", npy("<f4", "(2, 2)", bytes_of<float>({1, 2}))),
            ": found another number of elements than its shape says (<f4), expected real numbers, as "
            "numpy.float64");
  EXPECT_EQ(refused("d.npy", npy("|O", "(1, 2)", "pickle")),
            ": found objects (|O), expected real numbers, as numpy.float64");
  EXPECT_EQ(refused("e.npy", npy("<c16", "(1, 1)", bytes_of<double>({1, 2}))),
            ": found complex numbers (<c16), expected real numbers, as numpy.float64");
  EXPECT_EQ(refused("f.npy", npy("<U2", "(1, 1)", "a\0\0\0b\0\0\0")),
            ": found text (<U2), expected real numbers, as numpy.float64");
  EXPECT_EQ(
      refused("g.npy", npy(">f8", "(1, 1)", bytes_of<double>({1}))),
      ": found numbers with their bytes the other way round (>f8), expected real numbers, as numpy.float64");
  // A scale that is not that of the counts.
  const std::string counts = folder / "counts.png";
  save_depth_image({3, 1, {0, 800, 900}}, counts);
  EXPECT_EQ(input_error_of([&] { load_depth(counts, 1); }),
            counts +
                ": found depths of 900 m at 1 m a count, expected a depth scale of 0.001 where counts are "
                "millimetres, which makes 0.9 m of them");
  EXPECT_EQ(load_depth(counts, 0.1).at(1, 0), 80);
  EXPECT_EQ(refused("a.tiff", "II*"), ": is no TIFF, or cannot be opened");
  EXPECT_EQ(
      refused("b.tiff", tiff(8, 1, 1, 1, "a")),
      ": found 8 bits in 1 channel, expected depth in strips, real numbers of 32 or 64 bits or whole ones "
      "of 16");
  EXPECT_NE(refused("c.tiff", tiff(32, 3, 1U << 20, 1U << 20, "a")).find("256 megapixels"),
            std::string::npos);
  const std::string whole = tiff(32, 3, 2, 1, bytes_of<float>({1, 2}));
  for (std::size_t length = 0; length + 8 < whole.size(); length += 7)
    EXPECT_NE(refused("d.tiff", whole.substr(0, length)), "");
}

TEST(DepthMap, MasksAndLensesGoWithIt) {
  const TemporaryFolder folder;
  const std::string depth =
      folder.write("depth/7.npy", npy("<f4", "(2, 3)", bytes_of<float>({1, 1, 1, 1, 1, 1})));
  EXPECT_EQ(mask_of("masks", depth), "masks/7.png");
  EXPECT_EQ(mask_of("masks", "depth/7.png"), "masks/7.png");
  const CameraIntrinsics lens =
      load_depth_lens(folder.write("k.json", R"({"fx": 1, "fy": 1, "cx": 1, "cy": 1})"), depth);
  EXPECT_TRUE(lens.width == 3 && lens.height == 2);
}

}  // namespace
}  // namespace flash::data
