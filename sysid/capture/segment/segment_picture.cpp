#include "sysid/capture/segment/segment_picture.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <utility>

#include "data/files/text.h"
#include "data/picture/html_page.h"
#include "data/picture/picture.h"

namespace flash::sysid {
namespace {

constexpr int panel_width = 300, top_height = 300, margin = 8, line_height = 22;  // [px]
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

/// What all columns have in common.
struct Layout {
  Eigen::AlignedBox3d box;  ///< that is seen [m]
  double scale = 1;         ///< [px/m]
  int side_height = 0;      ///< of the view from the side [px]
};

Layout layout_of(const std::vector<LabelledFrame>& frames) {
  Layout layout{interesting_box(frames)};
  const Eigen::Vector3d size = layout.box.diagonal();
  layout.scale = std::min(panel_width / size.x(), top_height / size.y());
  layout.side_height = std::clamp(static_cast<int>(std::ceil(layout.scale * size.z())), 20, 3 * top_height);
  return layout;
}

data::Picture drawn_points(const std::vector<LabelledFrame>& frames, const Layout& layout) {
  const auto& [box, scale, side_height] = layout;
  const Eigen::Vector3d size = box.diagonal();
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

std::string text_at(int x, int y, const std::string& words) {
  return "<text x=\"" + std::to_string(x) + "\" y=\"" + std::to_string(y) + "\">" + words + "</text>\n";
}

std::string block(int x, int y, int width, int height, data::Colour colour) {
  std::array<char, 160> text{};
  std::snprintf(text.data(), text.size(),
                "<rect x=\"%d\" y=\"%d\" width=\"%d\" height=\"%d\" fill=\"#%02x%02x%02x\"/>\n", x, y, width,
                height, colour[0], colour[1], colour[2]);
  return text.data();
}

std::string legend(int left, int y) {
  constexpr std::array<std::pair<PointLabel, const char*>, 5> kLabels = {{{PointLabel::cloth, "cloth"},
                                                                          {PointLabel::table, "table"},
                                                                          {PointLabel::arm, "arm"},
                                                                          {PointLabel::clutter, "clutter"},
                                                                          {PointLabel::outlier, "outlier"}}};
  constexpr int kApart = 76;
  std::string svg;
  for (const auto& [label, name] : kLabels) {
    svg += block(left, y - 10, 12, 12, colour_of(label)) + text_at(left + 17, y, name);
    left += kApart;
  }
  return svg;
}

/// The longest of 1, 2 or 5 times a power of ten that takes at most a third of a panel [m].
double bar_length(double scale) {
  const double most = panel_width / (3 * scale), power = std::pow(10.0, std::floor(std::log10(most)));
  return most >= 5 * power ? 5 * power : most >= 2 * power ? 2 * power : power;
}

}  // namespace

std::string draw_segmentation(const std::vector<LabelledFrame>& frames) {
  const Layout layout = layout_of(frames);
  const data::Picture points = drawn_points(frames, layout);
  const int top = line_height + margin, below = top + points.height + line_height;
  // Legend and scale take more than one narrow column.
  const int width = std::max(points.width, 2 * panel_width), height = below + 2 * line_height;
  const auto size_of = [](int w, int h) {
    return " width=\"" + std::to_string(w) + "\" height=\"" + std::to_string(h) + '"';
  };
  std::string svg = "<svg xmlns=\"http://www.w3.org/2000/svg\"" + size_of(width, height) +
                    " font-family=\"sans-serif\" font-size=\"13\">\n" +
                    block(0, 0, width, height, {244, 244, 244});
  for (std::size_t k = 0; k < frames.size(); ++k)
    if (frames[k].time)
      svg += text_at(margin + static_cast<int>(k) * (panel_width + margin), top - margin,
                     data::format_clock(*frames[k].time) + " s");
  svg += "<image x=\"0\" y=\"" + std::to_string(top) + '"' + size_of(points.width, points.height) +
         " href=\"data:image/png;base64," + data::base64(data::encode_png(points)) + "\"/>\n";
  svg += legend(margin, below);
  const double bar = bar_length(layout.scale);
  const int bar_pixels = static_cast<int>(std::lround(layout.scale * bar)), bar_left = margin + 400;
  svg += block(bar_left, below - 6, bar_pixels, 3, {0, 0, 0}) +
         text_at(bar_left + bar_pixels + margin, below, data::format_short(1e3 * bar) + " mm") +
         text_at(margin, below + line_height,
                 "above from the side: x to the right, z up; below from the top: x to the right, y up");
  return svg + "</svg>\n";
}

}  // namespace flash::sysid
