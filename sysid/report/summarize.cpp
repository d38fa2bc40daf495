#include "sysid/report/summarize.h"

#include <algorithm>
#include <cmath>

#include "data/asset/asset.h"
#include "data/files/text.h"
#include "data/recording/recording_digest.h"
#include "sysid/emulate/candidate_lines.h"
#include "sysid/emulate/search_warnings.h"
#include "sysid/infer/held.h"
#include "sysid/observe/registration_parameter.h"
#include "sysid/report/searched_mesh.h"
#include "sysid/report/settings_texts.h"

namespace flash::sysid {
namespace {

bool is_material(const std::string& name) {
  const Parameter* const found = find_parameter(name);
  return found != nullptr && found->material;
}

const Axis* axis_named(const std::vector<Axis>& axes, const std::string& name) {
  const auto found =
      std::find_if(axes.begin(), axes.end(), [&](const Axis& axis) { return axis.name == name; });
  return found == axes.end() ? nullptr : &*found;
}

/// Those of the asset.
std::map<std::string, double> parameters_of(const ReplayCandidate& candidate, const MaterialBase& base) {
  std::map<std::string, double> parameters;
  for (const Parameter& parameter : known_parameters()) {
    if (!parameter.material || !is_of(parameter, base)) continue;
    const double value = parameter.get(candidate, base);
    if (std::isfinite(value)) parameters[parameter.name] = value;  // most bend elastically, however far
  }
  return parameters;
}

// What was held, and on whose word: a measurement, or an assumption of the command line or the asset.
std::map<std::string, FixedParameter> fixed_of(const Summary& summary, const GridSettings& settings) {
  std::map<std::string, FixedParameter> fixed;
  for (const Axis& axis : settings.fixed) fixed[axis.name] = {axis.values.front(), "measured"};
  for (const char* name :
       {"young", "poisson", "bending", "yield_curvature", "friction", "areal_density", "density"}) {
    if (summary.best.count(name) == 0) continue;
    const Axis* axis = axis_named(settings.axes, name);
    const bool follows_young = std::string(name) == "bending" && settings.base.bending_from_thickness;
    if (fixed.count(name) || follows_young || (axis && axis->values.size() > 1)) continue;
    fixed[name] = {summary.best.at(name), "assumed"};
  }
  for (auto& [name, each] : fixed)
    if (const auto stated = settings.deviations.find(name); stated != settings.deviations.end())
      each.deviation = stated->second;
  return fixed;
}

SummaryRecording summarize_recording(const Replay& replay, const RecordingScore& score, const Misfit& misfit,
                                     const std::map<std::string, double>& nuisance) {
  SummaryRecording recording;
  recording.name = replay.recording.name;
  recording.sha256 = data::recording_sha256(replay.recording, replay.object_mesh);
  recording.mesh = named_mesh(replay);
  recording.own_mesh = replay.settings.mesh.empty();
  recording.mesh_sha256 = mesh_digest(recording.mesh);
  recording.offset = score.offset;
  recording.yaw = score.yaw;
  recording.time_offset = score.time_offset;
  recording.nuisance = nuisance;
  recording.score = score.score;
  recording.misfit = misfit;
  for (const KeyframeScore& frame : score.keyframes)
    if (frame.points > 0) recording.frames.push_back({frame.t, frame.score, frame.weight});
  return recording;
}

std::string mm(double metres) { return data::format_short(std::round(1e5 * metres) / 100) + " mm"; }

/// "it misses the markers by 12.4 mm, ...".
std::string miss_of(const MarkerFit& markers) {
  return "it misses the markers by " + mm(markers.miss) + ", of the " + mm(markers.motion) +
         " that they move, where noise of " + mm(markers.noise) +
         " along an axis (--sigma markers) explains " + mm(markers.most_noise());
}

/// "lift: the model does not fit: ..."; empty where it fits, and where the answer cannot be used.
std::string warning_of_misfit(const SummaryRecording& recording, const std::string& object) {
  const Misfit& misfit = recording.misfit;
  if (model_fits(recording) || (recording.markers && recording.markers->explains_nothing())) return "";
  if (recording.markers && !recording.markers->follows())
    return recording.name + ": the model does not fit: " + miss_of(*recording.markers) +
           ". The intervals allow for it, but are those of a model that does not fit";
  std::string worth;
  if (misfit.worth < misfit.keyframes)
    worth = "; " + std::to_string(misfit.keyframes) + " keyframes are worth " +
            data::format_short(std::round(10 * misfit.worth) / 10);
  return recording.name + ": the model does not fit: apart from noise of " + mm(misfit.noise) +
         " it misses the " + object + " by " + mm(misfit.size) +
         (misfit.explained > 0 ? " where repeatability explains " + mm(misfit.explained) : "") + worth +
         ". The intervals allow for it, but are those of a model that does not fit";
}

/// Frames that end long before the gripper does may have been stamped at too high a rate.
std::string doubt_of_rate(const data::Recording& recording) {
  if (recording.grasps.empty() || recording.keyframes.size() < 2) return "";
  const data::Trajectory& trajectory = recording.trajectories.at(recording.grasps.front().gripper);
  const double frames = recording.keyframes.back().time - recording.keyframes.front().time;
  const double poses = trajectory.times.back() - trajectory.times.front();
  if (frames >= 2.0 / 3 * poses) return "";
  return "its frames take " + data::format_short(frames) + " s, its trajectory " + data::format_short(poses) +
         " s: is the rate of the frames too high (--times)?";
}

/// ": numbers 3, 7 of results.csv"; of many, the first five.
std::string numbers_of_unconverged(const std::vector<CandidateResult>& candidates) {
  constexpr int kNamed = 5;
  std::string numbers;
  int count = 0;
  for (const CandidateResult& candidate : candidates)
    if (candidate.status != CandidateStatus::ok && ++count <= kNamed)
      numbers += (numbers.empty() ? " " : ", ") + std::to_string(candidate.id);
  return std::string(count > 1 ? ": numbers" : ": number") + numbers + (count > kNamed ? ", ..." : "") +
         " of results.csv";
}

/// `best`: the estimate on the search's own mesh; `fit`: as it is registered in the answer.
std::vector<std::string> warnings_of(const Summary& summary, const CandidateResult& best,
                                     const CandidateResult& fit,
                                     const std::vector<CandidateResult>& candidates,
                                     const std::vector<Replay>& replays, const GridSettings& settings) {
  std::vector<std::string> warnings;
  const std::size_t found = static_cast<std::size_t>(summary.candidates);
  for (const ParameterFinding& finding : summary.parameters) {
    if (finding.identifiable == Identifiable::no)
      warnings.push_back(finding.name + " is not identifiable from " +
                         (summary.recordings.size() > 1 ? "these recordings" : "this recording"));
    if (finding.edge != RangeEdge::none) warnings.push_back(finding.name + ": " + edge_text(finding.edge));
  }
  const auto claims_bending = [](const ParameterFinding& finding) {
    return finding.name == "bending" && finding.identifiable != Identifiable::no;
  };
  if (std::any_of(summary.parameters.begin(), summary.parameters.end(), claims_bending))
    for (const Replay& replay : replays)
      if (replay.recording.gravity.isZero())
        warnings.push_back(replay.recording.name +
                           ": gravity is zero in recording.json: what is said of bending rests on inertia "
                           "alone, and is wrong where the sheet had weight");
  for (const Replay& replay : replays)
    for (const std::string& doubt : replay.recording.doubts)
      warnings.push_back(replay.recording.name + ": " + doubt);
  for (const Replay& replay : replays)
    if (replay.recording.camera)
      for (const std::string& warning : replay.recording.camera->warnings)
        warnings.push_back(replay.recording.name + ": calibration of its camera: " + warning);
  for (std::size_t r = 0; r < summary.recordings.size() && r < replays.size(); ++r)
    if (!model_fits(summary.recordings[r]))
      if (const std::string rate = doubt_of_rate(replays[r].recording); !rate.empty())
        warnings.push_back(summary.recordings[r].name + ": " + rate);
  for (std::size_t r = 0; r < fit.recordings.size(); ++r)
    for (const RegistrationParameter& parameter : registration_parameters) {
      if (!is_at_bound(fit.recordings[r].bounds_hit, parameter)) continue;
      const auto count =
          std::count_if(candidates.begin(), candidates.end(), [&](const CandidateResult& candidate) {
            return r < candidate.recordings.size() &&
                   is_at_bound(candidate.recordings[r].bounds_hit, parameter);
          });
      warnings.push_back(summary.recordings[r].name + ": " +
                         at_bound_text(parameter, replays[r].recording.nuisance) + " (the estimate and " +
                         std::to_string(count) + " of " + std::to_string(candidates.size()) +
                         " candidates end at it)");
    }
  // A few millimetres are what a table's height is known to.
  if (best.penetration_max > 5e-3)
    warnings.push_back("the gripper takes the sheet up to " + data::format_short(1e3 * best.penetration_max) +
                       " mm below the table: is the table's height right?");
  if (summary.unconverged > 0)
    warnings.push_back(data::format_count(static_cast<std::size_t>(summary.unconverged)) + " of " +
                       data::format_count(found) + " candidates did not converge in every step" +
                       numbers_of_unconverged(candidates));
  if (settings.base.material.constitutive == data::Constitutive::tri_arap &&
      axis_named(settings.axes, "young"))
    warnings.push_back("under TRI_ARAP young is known through young / (1 + poisson) only");
  return warnings;
}

/// Empty where the recordings do not contradict each other.
std::string contradiction_in(const Answer& answer, const std::vector<Replay>& replays,
                             const std::vector<Axis>& ranges) {
  if (!answer.agreement) return "";
  std::vector<std::string> names;
  for (const Replay& replay : replays) names.push_back(replay.recording.name);
  return contradiction_text(*answer.agreement, in_own_coordinates(ranges), names);
}

// Empty where the answer can be used. `contradiction`: of the recordings, or of what was held.
std::string reason_unusable(const Summary& summary, const CandidateResult& best,
                            const std::string& contradiction) {
  if (best.status != CandidateStatus::ok)
    return "the estimate did not converge (residual " + data::format_short(best.residual_max) +
           "): raise --iterations or lower --time-step";
  for (const SummaryRecording& recording : summary.recordings)
    if (recording.markers && recording.markers->explains_nothing())
      return recording.name +
             ": the model explains less than half of what was seen: " + miss_of(*recording.markers) +
             ". Are gravity, mesh, start and the markers' frame right?";
  if (!contradiction.empty()) return contradiction;
  const auto is_searched_material = [](const ParameterFinding& finding) { return is_material(finding.name); };
  const auto is_known = [&](const ParameterFinding& finding) {
    return is_searched_material(finding) && finding.identifiable != Identifiable::no;
  };
  const auto& findings = summary.parameters;
  if (std::any_of(findings.begin(), findings.end(), is_searched_material) &&
      std::none_of(findings.begin(), findings.end(), is_known))
    return "none of the searched parameters is identifiable from the recordings";
  return "";
}

/// "bending 5e-05 to 0.002, friction 0.15 to 0.6".
std::string searched_text(const std::vector<Axis>& axes) {
  std::string text;
  for (const Axis& axis : axes)
    if (axis.values.size() > 1)
      text += (text.empty() ? "" : ", ") + axis.name + " " + data::format_short(axis.values.front()) +
              " to " + data::format_short(axis.values.back());
  return text;
}

std::optional<MarkerFit> markers_of(const Fit& fit, std::size_t r, double noise) {
  if (r >= fit.replays.size() || r >= fit.motions.size()) return {};
  const Replay& replay = fit.replays[r];
  const RecordingScore& score = fit.score.recordings[r];
  return marker_fit_of(replay, fit.motions[r].motion,
                       {score.offset, score.yaw, score.time_offset, replay.pivot, replay.up}, noise);
}

/// Every so many draws, of the parameters that were searched.
void add_samples(Summary& summary, const Answer& answer) {
  constexpr Eigen::Index kSamples = 64;
  std::vector<Eigen::Index> columns;
  for (std::size_t k = 0; k < answer.parameters.size(); ++k)
    if (answer.parameters[k].values.size() > 1) columns.push_back(static_cast<Eigen::Index>(k));
  const Eigen::Index count = std::min(kSamples, answer.samples.rows());
  summary.samples.resize(count, static_cast<Eigen::Index>(columns.size()));
  if (answer.weights.size() > 0) summary.sample_weights.resize(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Eigen::Index draw = i * answer.samples.rows() / count;
    summary.samples.row(i) = answer.samples.row(draw)(columns);
    if (answer.weights.size() > 0) summary.sample_weights[i] = answer.weights[draw];
  }
}

/// What recordings ask for by themselves, of the parameters that were searched.
Agreement searched_alone(const Answer& answer) {
  Agreement agreement = *answer.agreement;
  for (std::vector<std::vector<double>>* const each : {&agreement.alone, &agreement.spreads})
    for (std::vector<double>& numbers : *each)
      for (std::size_t k = answer.parameters.size(); k-- > 0;)
        if (answer.parameters[k].values.size() < 2)
          numbers.erase(numbers.begin() + static_cast<std::ptrdiff_t>(k));
  return agreement;
}

}  // namespace

Summary summarize(const GridResults& results, const Answer& answer, const std::vector<Replay>& replays,
                  const GridSettings& searched, const AnswerSettings& asked) {
  GridSettings settings = searched;
  if (answer.grasp_size) settings.centres = {{"grasp_size", {*answer.grasp_size}, false}};
  Summary summary;
  summary.tool_version = FLASH_VERSION;
  summary.results_digest = digest_of(results);
  summary.candidates = static_cast<int>(results.candidates.size());
  for (const CandidateResult& candidate : results.candidates)
    summary.unconverged += candidate.status != CandidateStatus::ok;
  summary.settings = settings_texts(replays, settings);
  if (answer.best < 0) {
    summary.exit_code = 3;
    summary.best_score = INFINITY;
    const bool diverged = std::any_of(
        results.candidates.begin(), results.candidates.end(),
        [](const CandidateResult& candidate) { return candidate.status == CandidateStatus::diverged; });
    summary.warnings = {summary.candidates == 0 ? "no candidate was simulated"
                        : diverged              ? "every candidate diverged: none has a score"
                                   : "no candidate has a score: what was observed has too few points"};
    return summary;
  }
  const CandidateResult& estimate = answer.estimate;
  const ReplayCandidate candidate = candidate_at(answer.values, settings);
  summary.best = parameters_of(candidate, settings.base);
  if (!candidate.solid) summary.membrane_stiffness = candidate.material.membrane_stiffness;
  summary.best_score = answer.fit.score.score;
  summary.score_on_mesh = estimate.score;
  const bool on_mesh = answer.fit.replays.empty() || answer.fit.score.score == estimate.score;
  summary.settings["score_of"] =
      on_mesh ? replays.front().recording.mesh_spec : "cells of no size (extrapolated)";
  std::map<std::string, double> nuisance;
  for (const std::vector<Axis>* axes : {&settings.axes, &settings.fixed, &settings.centres})
    for (std::size_t k = 0; k < axes->size(); ++k)
      if (!is_material((*axes)[k].name)) {
        const double value = axes == &settings.axes ? answer.values[k] : (*axes)[k].values.front();
        nuisance[(*axes)[k].name] = summary.best[(*axes)[k].name] = value;
      }
  for (const ParameterFinding& finding : answer.parameters)
    if (finding.values.size() > 1) summary.parameters.push_back(finding);
  if (summary.parameters.size() == answer.parameters.size()) summary.covariance_log = answer.covariance_log;
  if (answer.samples.rows() > 0) add_samples(summary, answer);
  summary.fixed = fixed_of(summary, settings);
  for (const HeldParameter& held : held_parameters(settings, replays, answer.values))
    summary.held[held.name] = held.values;
  constexpr double kAtBound = 1e-6;  // of it
  for (std::size_t r = 0; r < replays.size(); ++r) {
    const Misfit misfit = r < answer.misfits.size() ? answer.misfits[r] : Misfit{};
    summary.recordings.push_back(
        summarize_recording(replays[r], answer.fit.score.recordings[r], misfit, nuisance));
    summary.recordings.back().markers = markers_of(answer.fit, r, settings.score.objective.marker_sigma);
    // At its bound it is not told, and one that recordings share is not that of each.
    if (r < answer.clocks.size() && !settings.score.shared.time &&
        std::abs(answer.clocks[r].estimate) < (1 - kAtBound) * replays[r].recording.nuisance.time)
      summary.recordings.back().clock = answer.clocks[r];
    if (r < answer.residuals.size()) {
      summary.recordings.back().error_cost = answer.residuals[r].error_cost;
      summary.recordings.back().spread = answer.residuals[r].spread;
    }
    if (r < estimate.recordings.size())
      summary.recordings.back().score_on_mesh = estimate.recordings[r].score;
    if (r < answer.horizons.size() && answer.horizons[r]) {
      summary.recordings.back().horizon_s = answer.horizons[r]->t;
      summary.recordings.back().horizon_of = answer.horizons[r]->parameter;
    }
  }
  const std::string object = settings.base.solid ? "object" : "cloth";
  for (const SummaryRecording& recording : summary.recordings)
    if (const std::string warning = warning_of_misfit(recording, object); !warning.empty())
      summary.warnings.push_back(warning);
  for (const std::string& warning :
       warnings_of(summary, estimate, answer.fit.score, results.candidates, replays, settings))
    summary.warnings.push_back(warning);
  summary.warnings.insert(summary.warnings.end(), answer.warnings.begin(), answer.warnings.end());
  summary.by_points = answer.by_points;
  summary.solver_check = answer.checks;
  summary.open_information = {answer.open_information.begin(), answer.open_information.end()};
  if (answer.agreement) summary.agreement = searched_alone(answer);
  if (!asked.solver_check)
    summary.warnings.emplace_back(
        "no finer solution was asked for: how far mesh, step and iterations move the answer is not known");
  else
    for (const std::string& warning : warnings_of_grasps(replays)) summary.warnings.push_back(warning);
  summary.settings["solver_check"] = asked.solver_check ? "yes" : "no";
  if (asked.repeatability) summary.settings["repeatability_m"] = data::format_number(*asked.repeatability);
  summary.settings["searched"] = searched_text(asked.ranges.empty() ? settings.axes : asked.ranges);
  summary.settings["horizon"] = asked.horizon ? "yes" : "no";
  std::string contradiction =
      contradiction_in(answer, replays, asked.ranges.empty() ? settings.axes : asked.ranges);
  for (const std::string& text : answer.contradicted)
    if (contradiction.empty())
      contradiction = text;
    else
      summary.warnings.push_back(text);
  const std::string reason = reason_unusable(summary, estimate, contradiction);
  if (!contradiction.empty() && reason != contradiction) summary.warnings.push_back(contradiction);
  if (!reason.empty()) {
    summary.exit_code = 3;
    summary.warnings.insert(summary.warnings.begin(), reason);
  }
  return summary;
}

}  // namespace flash::sysid
