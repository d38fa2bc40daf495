#include "sysid/capture/import_picture.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>

#include "data/files/text.h"

namespace flash::sysid {
namespace {

constexpr double kPanel = 460, kMargin = 24, kLegend = 200;  // [px]
constexpr std::size_t kFrames = 7, kPoints = 250;            // drawn, and of each

template <class... Arguments>
std::string formatted(const char* format, Arguments... arguments) {
  std::array<char, 256> text{};
  std::snprintf(text.data(), text.size(), format, arguments...);
  return text.data();
}

/// From blue over green to yellow.
std::string colour_of(double share) {
  constexpr std::array<std::array<double, 3>, 4> kStops = {
      {{59, 82, 139}, {33, 145, 140}, {94, 201, 98}, {230, 190, 20}}};
  const double at = std::clamp(share, 0.0, 1.0) * (kStops.size() - 1);
  const auto k = std::min(static_cast<std::size_t>(at), kStops.size() - 2);
  const double part = at - static_cast<double>(k);
  std::array<int, 3> rgb{};
  for (std::size_t c = 0; c < 3; ++c)
    rgb[c] = static_cast<int>(std::lround((1 - part) * kStops[k][c] + part * kStops[k + 1][c]));
  return formatted("#%02x%02x%02x", rgb[0], rgb[1], rgb[2]);
}

/// One view along an axis: which coordinates go to the right and up, and where its lower left corner is.
struct Panel {
  int right = 0, up = 2;
  double left = 0, bottom = 0;  ///< [px]
  double scale = 1;             ///< [px/m]
  Eigen::Vector3d low = Eigen::Vector3d::Zero();

  double x(const Eigen::Vector3d& point) const { return left + scale * (point[right] - low[right]); }
  double y(const Eigen::Vector3d& point) const { return bottom - scale * (point[up] - low[up]); }
};

std::string text_at(double x, double y, const std::string& words) {
  return formatted("<text x=\"%.1f\" y=\"%.1f\">", x, y) + words + "</text>\n";
}

/// Edges of one triangle alone.
std::vector<std::array<int, 2>> outline_of(const data::Triangles& triangles) {
  std::map<std::array<int, 2>, int> count;
  for (const auto triangle : triangles.rowwise())
    for (int k = 0; k < 3; ++k) {
      const int a = triangle[k], b = triangle[(k + 1) % 3];
      ++count[{std::min(a, b), std::max(a, b)}];
    }
  std::vector<std::array<int, 2>> edges;
  for (const auto& [edge, uses] : count)
    if (uses == 1) edges.push_back(edge);
  return edges;
}

struct Shown {
  data::Points sheet;                         ///< as it starts
  std::vector<std::array<int, 2>> outline;    ///< of the sheet
  std::vector<Eigen::Vector3d> way;           ///< of the gripper
  std::vector<const data::Keyframe*> frames;  ///< some, in order of time
  double start = 0;                           ///< of the first frame, seen or not [s]
  Eigen::AlignedBox3d box;
};

Shown shown_of(const data::Recording& recording, const std::vector<data::Keyframe>& keyframes) {
  Shown shown;
  shown.sheet = (recording.mesh.vertices * recording.base_from_object.linear().transpose()).rowwise() +
                recording.base_from_object.translation().transpose();
  shown.outline = outline_of(recording.mesh.triangles);
  for (const auto point : shown.sheet.rowwise()) shown.box.extend(point.transpose());
  const data::Trajectory& trajectory = recording.trajectories.at(recording.grasps.front().gripper);
  for (const double t : trajectory.times)
    if (t <= keyframes.back().time + 1e-9) shown.way.push_back(data::pose_at(trajectory, t).translation());
  if (shown.way.empty()) shown.way.push_back(trajectory.poses.front().translation());
  for (const Eigen::Vector3d& place : shown.way) shown.box.extend(place);
  shown.start = keyframes.front().time;
  std::vector<const data::Keyframe*> seen;
  for (const data::Keyframe& keyframe : keyframes)
    if (keyframe.cloud.rows() > 0) seen.push_back(&keyframe);
  const std::size_t count = std::min(seen.size(), kFrames);
  for (std::size_t k = 0; k < count; ++k)
    shown.frames.push_back(seen[count == 1 ? 0 : k * (seen.size() - 1) / (count - 1)]);
  for (const data::Keyframe* frame : shown.frames)
    for (const auto point : frame->cloud.rowwise()) shown.box.extend(point.transpose());
  if (recording.has_table)
    shown.box.extend(
        Eigen::Vector3d(shown.box.center().x(), shown.box.center().y(), recording.table_point.z()));
  const Eigen::Vector3d border = Eigen::Vector3d::Constant(0.06 * shown.box.diagonal().maxCoeff());
  shown.box.min() -= border;
  shown.box.max() += border;
  return shown;
}

std::string drawn(const Panel& panel, const Shown& shown, const data::Recording& recording,
                  const std::vector<Eigen::Vector3d>& cameras, double width, double height) {
  std::string svg = formatted(
      "<rect x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\" fill=\"#fff\" stroke=\"#bbb\"/>\n",
      panel.left, panel.bottom - height, width, height);
  if (panel.up == 2 && recording.has_table) {
    const double y = panel.y({0, 0, recording.table_point.z()});
    svg += formatted(
        "<line x1=\"%.1f\" y1=\"%.1f\" x2=\"%.1f\" y2=\"%.1f\" stroke=\"#888\" stroke-width=\"2\"/>\n",
        panel.left, y, panel.left + width, y);
  }
  for (std::size_t f = 0; f < shown.frames.size(); ++f) {
    const data::Points& cloud = shown.frames[f]->cloud;
    const double share =
        shown.frames.size() < 2 ? 0 : static_cast<double>(f) / static_cast<double>(shown.frames.size() - 1);
    svg += "<g fill=\"" + colour_of(share) + "\" fill-opacity=\"0.6\">\n";
    const Eigen::Index step = 1 + cloud.rows() / static_cast<Eigen::Index>(kPoints);
    for (Eigen::Index i = 0; i < cloud.rows(); i += step) {
      const Eigen::Vector3d point = cloud.row(i).transpose();
      svg += formatted("<circle cx=\"%.1f\" cy=\"%.1f\" r=\"1.3\"/>\n", panel.x(point), panel.y(point));
    }
    svg += "</g>\n";
  }
  svg += "<g stroke=\"#c81e1e\" stroke-width=\"1.5\">\n";
  for (const auto& [a, b] : shown.outline) {
    const Eigen::Vector3d from = shown.sheet.row(a).transpose(), to = shown.sheet.row(b).transpose();
    svg += formatted("<line x1=\"%.1f\" y1=\"%.1f\" x2=\"%.1f\" y2=\"%.1f\"/>\n", panel.x(from),
                     panel.y(from), panel.x(to), panel.y(to));
  }
  svg += "</g>\n<polyline fill=\"none\" stroke=\"#111\" stroke-width=\"1.5\" points=\"";
  const std::size_t stride = 1 + shown.way.size() / 400;
  for (std::size_t k = 0; k < shown.way.size(); k += stride)
    svg += formatted("%.1f,%.1f ", panel.x(shown.way[k]), panel.y(shown.way[k]));
  svg += formatted("%.1f,%.1f\"/>\n", panel.x(shown.way.back()), panel.y(shown.way.back()));
  svg += formatted("<circle cx=\"%.1f\" cy=\"%.1f\" r=\"4\" fill=\"#111\"/>\n", panel.x(shown.way.front()),
                   panel.y(shown.way.front()));
  for (std::size_t k = 0; k < cameras.size(); ++k) {  // most are outside of the panel, and stand at its edge
    const double x = std::clamp(panel.x(cameras[k]), panel.left + 6, panel.left + width - 6),
                 y = std::clamp(panel.y(cameras[k]), panel.bottom - height + 6, panel.bottom - 6);
    svg += formatted("<rect x=\"%.1f\" y=\"%.1f\" width=\"10\" height=\"10\" fill=\"#7b2fbe\"/>\n", x - 5,
                     y - 5);
  }
  return svg;
}

std::string legend(const Shown& shown, const std::vector<Eigen::Vector3d>& cameras, double left,
                   double scale) {
  std::string svg;
  double y = kMargin + 12;
  const auto line = [&](const std::string& colour, const std::string& words) {
    svg += formatted("<rect x=\"%.1f\" y=\"%.1f\" width=\"12\" height=\"12\" fill=\"%s\"/>\n", left, y - 10,
                     colour.c_str()) +
           text_at(left + 18, y, words);
    y += 20;
  };
  line("#c81e1e", "sheet as it starts");
  line("#111", "way of the gripper");
  line("#888", "table");
  for (std::size_t k = 0; k < cameras.size(); ++k)
    line("#7b2fbe", formatted("camera %.2f %.2f %.2f m", cameras[k].x(), cameras[k].y(), cameras[k].z()));
  for (std::size_t f = 0; f < shown.frames.size(); ++f)
    line(colour_of(shown.frames.size() < 2
                       ? 0
                       : static_cast<double>(f) / static_cast<double>(shown.frames.size() - 1)),
         formatted("cloud %.2f s after the first", shown.frames[f]->time - shown.start));
  svg += formatted(
      "<line x1=\"%.1f\" y1=\"%.1f\" x2=\"%.1f\" y2=\"%.1f\" stroke=\"#111\" stroke-width=\"3\"/>\n", left,
      y + 6, left + 0.1 * scale, y + 6);
  return svg + text_at(left, y + 24, "100 mm");
}

}  // namespace

std::string draw_import(const data::Recording& recording, const std::vector<data::Keyframe>& keyframes,
                        const std::vector<Eigen::Vector3d>& cameras) {
  const Shown shown = shown_of(recording, keyframes);
  const Eigen::Vector3d size = shown.box.diagonal();
  const double scale = kPanel / size.maxCoeff();
  const double width = scale * size.x(), side = scale * size.z(), top = scale * size.y();
  const double left = kMargin, legend_left = left + width + kMargin;
  const double height = side + top + 3 * kMargin + 32;
  const Panel from_side{0, 2, left, kMargin + 16 + side, scale, shown.box.min()},
      from_top{0, 1, left, 2 * kMargin + 32 + side + top, scale, shown.box.min()};
  return formatted(
             "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%.0f\" height=\"%.0f\" viewBox=\"0 0 %.0f "
             "%.0f\" "
             "font-family=\"sans-serif\" font-size=\"12\">\n",
             legend_left + kLegend, std::max(height, 320.0), legend_left + kLegend, std::max(height, 320.0)) +
         "<rect width=\"100%\" height=\"100%\" fill=\"#f4f4f4\"/>\n" +
         text_at(left, kMargin + 8, "from the side: x to the right, z up") +
         drawn(from_side, shown, recording, cameras, width, side) +
         text_at(left, 2 * kMargin + 24 + side, "from the top: x to the right, y up") +
         drawn(from_top, shown, recording, cameras, width, top) + legend(shown, cameras, legend_left, scale) +
         "</svg>\n";
}

}  // namespace flash::sysid
