#include "data/recording/recording_markers.h"

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <filesystem>

#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "data/files/json_reader.h"
#include "data/files/text.h"

namespace flash::data {
namespace {

std::string read_path(const JsonObject& markers, const char* key) {
  const std::string path = resolve_path(markers.string(key), markers.source());
  if (!std::filesystem::exists(path)) throw markers.error(key, "a file; " + path + " does not exist");
  return path;
}

bool is_on_support(const RecordedMarkers& markers, const std::string& name) {
  return std::find(markers.on_support.begin(), markers.on_support.end(), name) != markers.on_support.end();
}

/// Whether the first of the tracks was seen when the recording starts.
bool seen_at_start(const Recording& recording) {
  const auto first = std::find_if(recording.keyframes.begin(), recording.keyframes.end(),
                                  [](const RecordedKeyframe& keyframe) { return keyframe.sample == 0; });
  return first != recording.keyframes.end() && first->time == 0;
}

/// Throws where a marker is farther from the box around the object at rest than half of its diagonal. It
/// would turn with a face that it cannot stand on.
void check_near_object(const Recording& recording, const std::string& name, const Eigen::Vector3d& place) {
  constexpr double kStalk = 0.5;  // longest, in diagonals
  const Eigen::Vector3d low = recording.mesh.vertices.colwise().minCoeff(),
                        high = recording.mesh.vertices.colwise().maxCoeff();
  const double away = (place - place.cwiseMax(low).cwiseMin(high)).norm(), diagonal = (high - low).norm();
  if (away <= kStalk * diagonal) return;
  throw input_error(recording.source, "markers",
                    "marker \"" + name + "\" is " + format_short(away) +
                        " m from the object at its start, which is " + format_short(diagonal) +
                        " m across, expected at most half of that: are its tracks in metres and in the base "
                        "frame, and is object.start right?");
}

/// How a marker that stays behaves.
struct Stay {
  double drift = 0;      ///< largest distance between the means of a tenth of its samples each [m]
  double scatter = 0;    ///< that the samples' noise alone hardly ever makes of it [m]
  std::size_t seen = 0;  ///< samples
};

Stay stay_of(const MarkerTracks& tracks, const std::string& name) {
  std::vector<Eigen::Vector3d> seen;
  for (const MarkerSample& sample : tracks.samples)
    for (std::size_t i = 0; i < sample.markers.size(); ++i)
      if (tracks.names[static_cast<std::size_t>(sample.markers[i])] == name)
        seen.emplace_back(sample.positions.row(static_cast<Eigen::Index>(i)).transpose());
  Stay stay;
  stay.seen = seen.size();
  if (seen.size() < 2) return stay;
  const std::size_t parts = std::min<std::size_t>(10, seen.size());
  std::vector<Eigen::Vector3d> means;
  for (std::size_t k = 0; k < parts; ++k) {
    const std::size_t from = k * seen.size() / parts, to = (k + 1) * seen.size() / parts;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (std::size_t i = from; i < to; ++i) sum += seen[i];
    means.emplace_back(sum / static_cast<double>(to - from));
    for (const Eigen::Vector3d& other : means)
      stay.drift = std::max(stay.drift, (means.back() - other).norm());
  }
  // Neighbours differ by noise, hardly by the drift; their median leaves out a jump.
  std::vector<double> steps;
  for (std::size_t i = 1; i < seen.size(); ++i) steps.push_back((seen[i] - seen[i - 1]).norm());
  std::nth_element(steps.begin(), steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2), steps.end());
  constexpr double kHardlyEver = 3;  // medians of a step, for the farthest two of ten means
  constexpr double kMost = 3e-3;     // no tracker is worse; steps of few samples are of the drift itself [m]
  stay.scatter =
      std::min(kMost, kHardlyEver * steps[steps.size() / 2] /
                          std::sqrt(static_cast<double>(seen.size()) / static_cast<double>(parts)));
  return stay;
}

/// A support that moves takes the frame of all markers along, or the marker is not on it.
void check_stays(const JsonObject& object, const std::string& name, Recording& recording) {
  constexpr double kDoubted = 1e-3, kMost = 5e-3;  // [m]
  const Stay stay = stay_of(recording.markers.tracks, name);
  if (stay.drift <= kDoubted + stay.scatter) return;
  const std::string text =
      "marker \"" + name + "\" moves by " + format_short(1e3 * stay.drift) + " mm over its " +
      format_count(stay.seen) + " samples, expected one that stays where it is, within " +
      format_short(1e3 * (kDoubted + stay.scatter)) + " mm: is it on the support, and does that stand still?";
  if (stay.drift > kMost + stay.scatter)
    throw input_error(object.source(), object.name_of("on_support"), text);
  recording.doubts.push_back(object.name_of("on_support") + ": " + text);
}

}  // namespace

void read_markers(const JsonObject& file, Recording& recording) {
  if (!file.has("markers")) return;
  const JsonObject object = file.object("markers");
  object.expect_fields({"tracks", "placed", "on_support"});
  RecordedMarkers& markers = recording.markers;
  markers.tracks_path = read_path(object, "tracks");
  markers.tracks = load_marker_tracks(markers.tracks_path);
  if (object.has("placed")) {
    markers.placed_path = read_path(object, "placed");
    markers.placed = load_marker_places(markers.placed_path);
  }
  const std::vector<std::string>& names = markers.tracks.names;
  const auto check = [&](const char* key, const std::string& name) {
    if (std::find(names.begin(), names.end(), name) != names.end()) return;
    const std::string nearest = nearest_name(name, names);
    throw input_error(object.source(), object.name_of(key),
                      "found marker \"" + name + "\", expected one of " + markers.tracks_path +
                          (nearest.empty() ? "" : " (did you mean \"" + nearest + "\"?)"));
  };
  if (object.has("on_support")) {
    const nlohmann::json& list = object.raw("on_support");
    if (!list.is_array()) throw object.error("on_support", "a list of markers");
    for (const nlohmann::json& name : list) {
      if (!name.is_string()) throw object.error("on_support", "a list of markers");
      markers.on_support.push_back(name.get<std::string>());
      check("on_support", markers.on_support.back());
      check_stays(object, markers.on_support.back(), recording);
    }
  }
  for (const auto& [name, place] : markers.placed) check("placed", name);
}

void add_tracked_keyframes(Recording& recording) {
  const std::vector<MarkerSample>& samples = recording.markers.tracks.samples;
  std::vector<RecordedKeyframe>& keyframes = recording.keyframes;
  for (std::size_t k = 0; k < samples.size(); ++k) {
    const auto same = std::find_if(keyframes.begin(), keyframes.end(), [&](const RecordedKeyframe& keyframe) {
      return keyframe.sample < 0 && keyframe.time == samples[k].time;
    });
    RecordedKeyframe& keyframe = same == keyframes.end() ? keyframes.emplace_back() : *same;
    keyframe.time = samples[k].time;
    keyframe.sample = static_cast<int>(k);
  }
  std::stable_sort(keyframes.begin(), keyframes.end(),
                   [](const RecordedKeyframe& a, const RecordedKeyframe& b) { return a.time < b.time; });
}

void place_object_by_markers(Recording& recording) {
  const RecordedMarkers& markers = recording.markers;
  const MarkerSample& first = markers.tracks.samples.front();
  const bool at_start = seen_at_start(recording);
  std::vector<Eigen::Vector3d> placed, seen;
  for (std::size_t i = 0; i < first.markers.size(); ++i) {
    const std::string& name = markers.tracks.names[static_cast<std::size_t>(first.markers[i])];
    const auto place = markers.placed.find(name);
    if (place == markers.placed.end() || (!at_start && !is_on_support(markers, name))) continue;
    placed.push_back(place->second);
    seen.emplace_back(first.positions.row(static_cast<Eigen::Index>(i)).transpose());
  }
  const auto matrix = [](const std::vector<Eigen::Vector3d>& points) {
    Eigen::Matrix3Xd columns(3, static_cast<Eigen::Index>(points.size()));
    for (std::size_t i = 0; i < points.size(); ++i) columns.col(static_cast<Eigen::Index>(i)) = points[i];
    return columns;
  };
  const Eigen::Matrix3Xd from = matrix(placed), to = matrix(seen);
  constexpr double kLine = 1e-3;  // second extent over the first
  bool fixed = placed.size() >= 3;
  if (fixed) {
    const Eigen::Matrix3Xd centred = from.colwise() - from.rowwise().mean();
    const Eigen::Vector3d extents =
        Eigen::JacobiSVD<Eigen::Matrix3d>(centred * centred.transpose()).singularValues().cwiseSqrt();
    fixed = extents[1] > kLine * extents[0];
  }
  if (!fixed)
    throw input_error(
        recording.source, "object.start",
        "missing, and " + format_count(placed.size()) + " markers of " + markers.placed_path +
            " tell the pose, expected three or more that are not on a line" +
            (at_start ? "" : "; before the first of the tracks only those of markers.on_support count"));
  recording.base_from_object = Eigen::Isometry3d(Eigen::umeyama(from, to, false));
  const double misfit = std::sqrt(((recording.base_from_object * from) - to).colwise().squaredNorm().mean());
  const double size =
      (recording.mesh.vertices.colwise().maxCoeff() - recording.mesh.vertices.colwise().minCoeff()).norm();
  if (misfit > 0.1 * size)
    throw input_error(recording.source, "markers.placed",
                      "markers are seen " + format_short(misfit) +
                          " m from where they are placed on an object " + format_short(size) +
                          " m across, expected metres, in the frame of object.mesh");
  recording.notices.push_back(recording.source + ": " + format_count(placed.size()) +
                              " markers give the pose of the object to " + format_short(1e3 * misfit) +
                              " mm");
  recording.start = (recording.mesh.vertices * recording.base_from_object.linear().transpose()).rowwise() +
                    recording.base_from_object.translation().transpose();
}

void place_markers(Recording& recording) {
  RecordedMarkers& markers = recording.markers;
  if (markers.tracks.samples.empty()) return;
  const MarkerSample& first = markers.tracks.samples.front();
  const bool at_start = seen_at_start(recording) && recording.start_mesh.empty();
  const Eigen::Isometry3d object_from_base = recording.base_from_object.inverse();
  for (std::size_t m = 0; m < markers.tracks.names.size(); ++m) {
    const std::string& name = markers.tracks.names[m];
    std::optional<Eigen::Vector3d>& at = markers.at.emplace_back();
    if (is_on_support(markers, name)) continue;
    const auto seen = std::find(first.markers.begin(), first.markers.end(), static_cast<int>(m));
    const auto place = markers.placed.find(name);
    if (at_start && seen != first.markers.end()) {
      at = object_from_base * first.positions.row(seen - first.markers.begin()).transpose();
    } else if (place != markers.placed.end()) {
      at = place->second;
    } else {
      throw input_error(recording.source, "markers.placed",
                        "marker \"" + name +
                            "\" is missing, expected its place on the object, as it is not seen when the "
                            "recording starts");
    }
    check_near_object(recording, name, *at);
  }
}

}  // namespace flash::data
