#include <algorithm>
#include <cmath>

#include "data/camera/depth_map.h"
#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "data/files/text.h"
#include "data/mesh/mesh_io.h"
#include "data/recording/recording.h"

namespace flash::data {
namespace {

double diagonal(const Points& points) {
  return points.rows() == 0 ? 0 : (points.colwise().maxCoeff() - points.colwise().minCoeff()).norm();
}

Points transformed(Points points, const Eigen::Isometry3d& pose) {
  points *= pose.linear().transpose();
  points.rowwise() += pose.translation().transpose();
  return points;
}

Points inside(const CropBox& crop, const Points& points) {
  Points kept(points.rows(), 3);
  Eigen::Index count = 0;
  for (Eigen::Index i = 0; i < points.rows(); ++i)
    if (crop.contains(points.row(i))) kept.row(count++) = points.row(i);
  return kept.topRows(count);
}

/// How far the middle point of the cloud is from the middle of the sheet; the median is blind to stray
/// clusters.
double median_distance(const Points& points, const Eigen::Vector3d& from) {
  std::vector<double> distances;
  for (Eigen::Index i = 0; i < points.rows(); ++i)
    distances.push_back((points.row(i).transpose() - from).norm());
  const auto middle = distances.begin() + static_cast<long>(distances.size() / 2);
  std::nth_element(distances.begin(), middle, distances.end());
  return *middle;
}

/// A cloud is expected about the size of the sheet and as near to it as the gripper takes it.
void check_scale(const Recording& recording, const Points& cloud, const std::string& path) {
  if (cloud.rows() == 0) return;
  const Eigen::Vector3d centre = recording.start.colwise().mean();
  const double size = diagonal(recording.start);
  double reach = size + recording.nuisance.offset.norm();
  for (const auto& [name, trajectory] : recording.trajectories)
    for (const Eigen::Isometry3d& pose : trajectory.poses)
      reach = std::max(reach, (pose.translation() - centre).norm() + size);
  const double distance = median_distance(cloud, centre);
  if (distance > 20 * reach)
    throw InputError(path + ": its points lie " + format_short(distance) + " m from a sheet " +
                     format_short(size) +
                     " m across, expected metres in the base frame (millimetres read as metres?)");
}

void load_markers(const std::string& path, const Points& rest, Keyframe& keyframe) {
  const std::string text = read_file(path);
  LineReader lines(text);
  std::string_view line;
  if (!lines.next(line) || line != "vertex,x,y,z")
    throw input_error(path, "line 1", "expected the header vertex,x,y,z");
  const Eigen::Index vertices = rest.rows();
  std::vector<int> marked;
  std::vector<double> coordinates;
  while (lines.next(line)) {
    if (line.empty()) continue;
    const std::vector<std::string_view> cells = split(line, ",");
    const std::optional<long> vertex = cells.size() == 4 ? parse_integer(cells[0]) : std::nullopt;
    if (!vertex || *vertex < 0 || *vertex >= vertices)
      throw input_error(path, "line " + std::to_string(lines.number()),
                        "found \"" + std::string(line) + "\", expected vertex,x,y,z with a vertex below " +
                            std::to_string(vertices));
    marked.push_back(static_cast<int>(*vertex));
    for (std::size_t k = 1; k < 4; ++k) {
      const std::optional<double> value = parse_number(cells[k]);
      if (!value || !std::isfinite(*value))
        throw input_error(path, "line " + std::to_string(lines.number()),
                          "found \"" + std::string(cells[k]) + "\", expected a finite number");
      coordinates.push_back(*value);
    }
  }
  keyframe.markers =
      Eigen::Map<Points>(coordinates.data(), static_cast<Eigen::Index>(coordinates.size() / 3), 3);
  keyframe.marker_places = rest(marked, Eigen::all);
}

/// Adds those of one sample of the tracks that are on the object.
void add_tracked(const RecordedMarkers& markers, const MarkerSample& sample, Keyframe& keyframe) {
  const Eigen::Index before = keyframe.markers.rows();
  std::vector<Eigen::Index> rows;
  for (std::size_t i = 0; i < sample.markers.size(); ++i)
    if (markers.at[static_cast<std::size_t>(sample.markers[i])]) rows.push_back(static_cast<Eigen::Index>(i));
  const auto count = static_cast<Eigen::Index>(rows.size());
  keyframe.markers.conservativeResize(before + count, 3);
  keyframe.marker_places.conservativeResize(before + count, 3);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Eigen::Index row = rows[static_cast<std::size_t>(i)];
    const auto marker = static_cast<std::size_t>(sample.markers[static_cast<std::size_t>(row)]);
    keyframe.markers.row(before + i) = sample.positions.row(row);
    keyframe.marker_places.row(before + i) = markers.at[marker]->transpose();
  }
}

/// `left_out` counts points that are not finite.
Keyframe load_keyframe(const Recording& recording, const RecordedKeyframe& recorded, std::size_t& left_out) {
  Keyframe keyframe;
  keyframe.time = recorded.time;
  keyframe.force = recorded.force;
  Points cloud;
  if (!recorded.cloud.empty()) {
    cloud = load_point_cloud(recorded.cloud, left_out);
    check_scale(recording, cloud, recorded.cloud);
  } else if (!recorded.depth.empty()) {
    const MaskImage mask = recorded.mask.empty() ? MaskImage{} : load_mask(recorded.mask);
    cloud = transformed(points_from_depth(load_depth(recorded.depth, recording.camera->depth_scale), mask,
                                          recording.camera->intrinsics, recorded.depth),
                        recording.camera->base_from_camera);
    check_scale(recording, cloud, recorded.depth);
  }
  keyframe.cloud = inside(recording.crop, cloud);
  if (!recorded.contour.empty()) {
    const Points contour = load_point_cloud(recorded.contour, left_out);
    check_scale(recording, contour, recorded.contour);
    keyframe.contour = inside(recording.crop, contour);
  }
  if (!recorded.markers.empty()) load_markers(recorded.markers, recording.mesh.vertices, keyframe);
  if (recorded.sample >= 0)
    add_tracked(recording.markers,
                recording.markers.tracks.samples[static_cast<std::size_t>(recorded.sample)], keyframe);
  return keyframe;
}

/// Keyframes without a point, and whether that is as it should be: a sheet that still lies is below the crop.
std::string empty_notice(const Recording& recording, const std::vector<std::size_t>& empty) {
  const auto time = [&](std::size_t k) {
    return format_clock(recording.origin + recording.keyframes[k].time);
  };
  const bool only_first = empty.back() + 1 == empty.size();
  double highest = recording.table_point.z();
  for (const auto& [name, trajectory] : recording.trajectories)
    highest =
        std::max(highest, pose_at(trajectory, recording.keyframes[empty.back()].time).translation().z());
  constexpr double lifts_nothing = 0.05;  // a corner held that high leaves most of the sheet on the table [m]
  const double crop = std::max(recording.crop.min.z(), recording.table_point.z());
  const bool still_lies = recording.has_table && only_first && highest < crop + lifts_nothing;
  std::string times;
  if (only_first && empty.size() > 2)
    times = time(0) + " to " + time(empty.back());
  else
    for (const std::size_t k : empty) times += (times.empty() ? "" : ", ") + time(k);
  return recording.source + ": " + std::to_string(empty.size()) + " of " +
         std::to_string(recording.keyframes.size()) +
         " keyframes have no point inside the crop box (t = " + times + " s)" +
         (still_lies   ? ": as usual at the beginning of a lift, while the sheet lies on the table"
          : only_first ? ""
                       : ": not the first ones only, which a lift explains; check the crop and the clouds");
}

}  // namespace

namespace {

/// "z 0.008 m and above".
std::string text_of(const CropBox& crop) {
  std::string text;
  for (Eigen::Index k = 0; k < 3; ++k) {
    const double low = crop.min[k], high = crop.max[k];
    if (!std::isfinite(low) && !std::isfinite(high)) continue;
    text +=
        (text.empty() ? "" : ", ") + std::string(1, "xyz"[k]) + ' ' +
        (std::isfinite(low) && std::isfinite(high) ? format_short(low) + " to " + format_short(high) + " m"
         : std::isfinite(low)                      ? "above " + format_short(low) + " m"
                                                   : "below " + format_short(high) + " m");
  }
  return text.empty() ? "open on all sides" : text;
}

}  // namespace

std::vector<Keyframe> load_keyframes(const Recording& recording, std::vector<std::string>& notices) {
  std::vector<Keyframe> keyframes;
  std::vector<std::size_t> empty;
  std::size_t left_out = 0, clouds_with_gaps = 0;
  double largest = 0;
  for (const RecordedKeyframe& recorded : recording.keyframes) {
    const std::size_t left_out_before = left_out;
    keyframes.push_back(load_keyframe(recording, recorded, left_out));
    clouds_with_gaps += left_out > left_out_before ? 1 : 0;
    const Keyframe& keyframe = keyframes.back();
    largest = std::max(largest, diagonal(keyframe.cloud));
    if (keyframe.cloud.rows() == 0 && keyframe.contour.rows() == 0 && keyframe.markers.rows() == 0 &&
        !keyframe.force)
      empty.push_back(keyframes.size() - 1);
  }
  if (empty.size() == keyframes.size())
    throw input_error(
        recording.source, "keyframes",
        recording.markers.tracks.samples.empty()
            ? "no keyframe has a point inside the crop box, " + text_of(recording.crop) +
                  ", expected points in metres in the base frame"
            : "nothing of the object was seen, expected markers that are not in markers.on_support");
  if (largest > 0 && largest < 0.005 * diagonal(recording.mesh.vertices))
    throw input_error(recording.source, "keyframes",
                      "the largest cloud is " + format_short(largest) + " m across, the sheet " +
                          format_short(diagonal(recording.mesh.vertices)) +
                          " m: expected the same unit, metres");
  if (!empty.empty()) notices.push_back(empty_notice(recording, empty));
  if (left_out > 0)
    notices.push_back(recording.source + ": " + format_count(left_out) + " points of " +
                      std::to_string(clouds_with_gaps) + " keyframes are not finite and were left out");
  return keyframes;
}

}  // namespace flash::data
