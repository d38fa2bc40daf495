#include "sysid/capture/segment/segment_picture.h"

#include <gtest/gtest.h>

namespace flash::sysid {
namespace {

/// Cloth from the origin to 1 m, and one point of the arm.
LabelledFrame frame_at(std::optional<double> time) {
  LabelledFrame frame;
  frame.points.resize(3, 3);
  frame.points << 0, 0, 0, 1, 1, 0.5, 0.5, 0.5, 0.5;
  frame.labels = {PointLabel::cloth, PointLabel::cloth, PointLabel::arm};
  frame.time = time;
  return frame;
}

int count(const std::string& text, const std::string& words) {
  int found = 0;
  for (std::size_t at = text.find(words); at != std::string::npos; at = text.find(words, at + 1)) ++found;
  return found;
}

TEST(SegmentPicture, EachColumnHasItsTime) {
  const std::string svg = draw_segmentation({frame_at(0.25), frame_at(1.5)});
  EXPECT_EQ(count(svg, ">0.25 s<"), 1);
  EXPECT_EQ(count(svg, ">1.5 s<"), 1);
  EXPECT_EQ(count(draw_segmentation({frame_at({})}), " s<"), 0);
}

TEST(SegmentPicture, TheLegendNamesWhatIsDrawn) {
  const std::string svg = draw_segmentation({frame_at(0)});
  for (const char* name : {"cloth", "table", "arm", "clutter", "outlier"})
    EXPECT_EQ(count(svg, std::string(">") + name + "<"), 1) << name;
}

// The view is 1.2 m wide, a border of a tenth included, on 300 px: 200 mm are 50 px.
TEST(SegmentPicture, TheBarIsAsLongAsItSays) {
  const std::string svg = draw_segmentation({frame_at(0)});
  EXPECT_EQ(count(svg, ">200 mm<"), 1);
  EXPECT_EQ(count(svg, "width=\"50\" height=\"3\""), 1);
}

}  // namespace
}  // namespace flash::sysid
