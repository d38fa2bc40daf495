#include "python/bindings/distances.h"

#include <vector>

#include "sysid/emulate/grid_search.h"
#include "sysid/observe/keyframe_distances.h"

namespace flash::python {

namespace nb = nanobind;

namespace {

struct Found {
  sysid::Registration registration;
  std::vector<std::string> bounds_hit;
  std::vector<double> scores;  ///< of the keyframes
  double score = 0;
  std::vector<sysid::KeyframeDistances> distances;
};

Found find(const sysid::Replay& replay, const sysid::Motion& motion, bool fit,
           const sysid::ScoreSettings& settings) {
  Found found;
  found.registration = sysid::registration_problem(replay, motion).start;
  if (fit) {
    const sysid::CandidateResult result =
        sysid::score_motions({replay}, {{.motion = motion, .converged = true, .finite = true}}, settings);
    const sysid::RecordingScore& recording = result.recordings.front();
    found.registration.offset = recording.offset;
    found.registration.yaw = recording.yaw;
    found.registration.time_offset = recording.time_offset;
    found.bounds_hit = recording.bounds_hit;
    found.score = recording.score;
    for (const sysid::KeyframeScore& keyframe : recording.keyframes) found.scores.push_back(keyframe.score);
  } else {
    found.scores = sysid::keyframe_scores(replay.surface.triangles, motion, replay.observations,
                                          found.registration, settings.objective, replay.recording.crop);
    found.score = sysid::weighted_mean_score(found.scores, replay.observations);
  }
  sysid::SheetDistance sheet(replay.surface.triangles, motion.positions.front());
  for (const sysid::Observation& observation : replay.observations)
    found.distances.push_back(sysid::keyframe_distances(motion, observation, found.registration, sheet));
  return found;
}

nb::object list_of(std::vector<double> numbers) {
  const std::size_t count = numbers.size();
  return nb::cast(array_of(std::move(numbers), {count}));
}

}  // namespace

nb::dict distances(const PreparedReplay& prepared, const Numbers& positions, const Numbers& forces, bool fit,
                   const std::string& distance, double trim, double huber, bool two_sided) {
  const sysid::Replay& replay = prepared.ready.replay;
  sysid::ScoreSettings settings;
  sysid::Robust& robust = settings.objective.robust;
  robust.kind = distance == "mean"    ? sysid::RobustKind::plain
                : distance == "huber" ? sysid::RobustKind::huber
                                      : sysid::RobustKind::trimmed;
  robust.trim_fraction = trim;
  robust.huber_delta = huber;
  settings.objective.two_sided = two_sided;
  Found found;
  {
    const nb::gil_scoped_release release;
    found = find(replay, motion_of(prepared, positions, forces), fit, settings);
  }
  nb::dict fields;
  nb::list clouds, contours, markers;
  for (sysid::KeyframeDistances& keyframe : found.distances) {
    clouds.append(list_of(std::move(keyframe.cloud)));
    contours.append(list_of(std::move(keyframe.contour)));
    markers.append(list_of(std::move(keyframe.markers)));
  }
  std::vector<double> times, weights;
  for (const sysid::Observation& observation : replay.observations) {
    times.push_back(observation.t);
    weights.push_back(observation.seen() ? observation.weight : 0);
  }
  fields["times"] = list_of(std::move(times));
  fields["weights"] = list_of(std::move(weights));
  fields["clouds"] = clouds;
  fields["contours"] = contours;
  fields["markers"] = markers;
  fields["scores"] = list_of(std::move(found.scores));
  fields["score"] = found.score;
  const Eigen::Vector3d& offset = found.registration.offset;
  fields["offset"] = list_of({offset.x(), offset.y(), offset.z()});
  fields["yaw"] = found.registration.yaw;
  fields["time_offset"] = found.registration.time_offset;
  nb::list bounds;
  for (const std::string& name : found.bounds_hit) bounds.append(nb::str(name.c_str()));
  fields["bounds_hit"] = bounds;
  return fields;
}

}  // namespace flash::python
