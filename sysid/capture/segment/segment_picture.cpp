#include "sysid/capture/segment/segment_picture.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

namespace flash::sysid {
namespace {

constexpr int panel_width = 300, top_height = 300, margin = 8;  // [px]
constexpr data::Colour white = {255, 255, 255};

data::Colour colour_of(PointLabel label) {
  switch (label) {
    case PointLabel::cloth:
      return {200, 30, 30};
    case PointLabel::table:
      return {190, 190, 190};
    case PointLabel::arm:
      return {40, 90, 200};
    case PointLabel::clutter:
      return {190, 140, 30};
    case PointLabel::outlier:
      return {150, 40, 160};
    case PointLabel::outside:
      break;
  }
  return white;
}

// What the eye should see: all that is not the table, with a border of table around it.
Eigen::AlignedBox3d interesting_box(const std::vector<LabelledFrame>& frames) {
  Eigen::AlignedBox3d box;
  for (const LabelledFrame& frame : frames)
    for (int i = 0; i < frame.points.rows(); ++i)
      if (frame.labels[i] == PointLabel::cloth || frame.labels[i] == PointLabel::arm)
        box.extend(Eigen::Vector3d(frame.points.row(i).transpose()));
  if (box.isEmpty())
    for (const LabelledFrame& frame : frames)
      for (int i = 0; i < frame.points.rows(); ++i)
        if (frame.labels[i] != PointLabel::outside)
          box.extend(Eigen::Vector3d(frame.points.row(i).transpose()));
  if (box.isEmpty()) box = Eigen::AlignedBox3d(Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones());
  const Eigen::Vector3d border = Eigen::Vector3d::Constant(0.1 * box.diagonal().maxCoeff());
  return {box.min() - border, box.max() + border};
}

void dot(data::Picture& picture, int column, int row, int left, int top, int bottom, data::Colour colour) {
  for (int y = row; y < row + 2; ++y)
    for (int x = column; x < column + 2; ++x)
      if (x >= left && x < left + panel_width && y >= top && y < bottom) picture.at(x, y) = colour;
}

}  // namespace

data::Picture draw_segmentation(const std::vector<LabelledFrame>& frames) {
  const Eigen::AlignedBox3d box = interesting_box(frames);
  const Eigen::Vector3d size = box.diagonal();
  const double scale = std::min(panel_width / size.x(), top_height / size.y());  // [px/m]
  const int side_height = std::clamp(static_cast<int>(std::ceil(scale * size.z())), 20, 3 * top_height);
  const int columns = static_cast<int>(frames.size());
  data::Picture picture(columns * (panel_width + margin) + margin, side_height + top_height + 3 * margin,
                        {228, 228, 228});
  for (int k = 0; k < columns; ++k) {
    const int left = margin + k * (panel_width + margin);
    const std::array<int, 2> top = {margin, 2 * margin + side_height};
    const std::array<int, 2> bottom = {margin + side_height, 2 * margin + side_height + top_height};
    for (int view = 0; view < 2; ++view)
      for (int y = top[view]; y < bottom[view]; ++y)
        for (int x = left; x < left + panel_width; ++x) picture.at(x, y) = white;
    const LabelledFrame& frame = frames[k];
    // The cloth last, so that nothing hides it.
    for (const bool cloth : {false, true})
      for (int i = 0; i < frame.points.rows(); ++i) {
        const PointLabel label = frame.labels[i];
        if (label == PointLabel::outside || (label == PointLabel::cloth) != cloth) continue;
        const Eigen::Vector3d pixel = scale * (frame.points.row(i).transpose() - box.min());
        if ((pixel.array() < 0).any() || (pixel.array() > scale * size.array()).any()) continue;
        const int column = left + static_cast<int>(pixel.x());
        dot(picture, column, bottom[0] - 1 - static_cast<int>(pixel.z()), left, top[0], bottom[0],
            colour_of(label));
        dot(picture, column, bottom[1] - 1 - static_cast<int>(pixel.y()), left, top[1], bottom[1],
            colour_of(label));
      }
  }
  return picture;
}

}  // namespace flash::sysid
