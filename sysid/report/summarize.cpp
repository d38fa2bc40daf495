#include "sysid/report/summarize.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "data/asset.h"
#include "data/procedural_mesh.h"
#include "data/recording_digest.h"
#include "data/text.h"
#include "sysid/emulate/candidate_lines.h"
#include "sysid/infer/modes.h"
#include "sysid/observe/registration_parameter.h"

namespace flash::sysid {
namespace {

bool is_material(const std::string& name) {
  for (const ParameterInfo& info : known_parameters())
    if (info.name == name) return info.material;
  return false;
}

const Axis* axis_named(const std::vector<Axis>& axes, const std::string& name) {
  const auto found =
      std::find_if(axes.begin(), axes.end(), [&](const Axis& axis) { return axis.name == name; });
  return found == axes.end() ? nullptr : &*found;
}

std::map<std::string, double> parameters_of(const data::SheetMaterial& material,
                                            std::optional<double> thickness) {
  return {{"young", material.membrane_stiffness / thickness.value_or(1.0)},
          {"poisson", material.poissons_ratio},
          {"bending", material.bending_rigidity},
          {"friction", material.friction},
          {"areal_density", material.areal_density},
          {"air_drag", material.air_drag},
          {"stiffness_damping", material.stiffness_damping}};
}

// What was held, and on whose word: `--fix` is a measurement, the asset an assumption.
std::map<std::string, FixedParameter> fixed_of(const Summary& summary, const GridSettings& settings) {
  std::map<std::string, FixedParameter> fixed;
  for (const Axis& axis : settings.fixed) fixed[axis.name] = {axis.values.front(), "measured"};
  for (const char* name : {"young", "poisson", "bending", "friction", "areal_density"}) {
    const Axis* axis = axis_named(settings.axes, name);
    const bool follows_young = std::string(name) == "bending" && settings.base.bending_from_thickness;
    if (fixed.count(name) || follows_young || (axis && axis->values.size() > 1)) continue;
    fixed[name] = {summary.best.at(name), "assumed"};
  }
  return fixed;
}

SummaryRecording summarize_recording(const Replay& replay, const RecordingScore& score,
                                     const GridVerdict& verdict,
                                     const std::map<std::string, double>& nuisance) {
  SummaryRecording recording;
  recording.name = replay.recording.name;
  recording.sha256 = data::recording_sha256(replay.recording);
  recording.offset = score.offset;
  recording.yaw = score.yaw;
  recording.time_offset = score.time_offset;
  recording.nuisance = nuisance;
  recording.score = score.score;
  recording.sigma_m = verdict.sigma;
  recording.sigma_source = verdict.sigma_source;
  for (const KeyframeScore& frame : score.keyframes)
    if (frame.points > 0) recording.frames.push_back({frame.t, frame.score, frame.weight});
  return recording;
}

std::vector<std::string> warnings_of(const Summary& summary, const CandidateResult& best,
                                     const std::vector<CandidateResult>& candidates,
                                     const std::vector<Replay>& replays, const GridSettings& settings) {
  std::vector<std::string> warnings;
  const std::size_t found = static_cast<std::size_t>(summary.candidates);
  for (const ParameterFinding& finding : summary.parameters) {
    if (finding.identifiable == Identifiable::no)
      warnings.push_back(finding.name + " is not identifiable from " +
                         (summary.recordings.size() > 1 ? "these recordings" : "this recording"));
    if (finding.edge != RangeEdge::none && finding.identifiable == Identifiable::yes)
      warnings.push_back(finding.name + ": the best value is at the edge of the searched range");
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
    if (replay.recording.camera)
      for (const std::string& warning : replay.recording.camera->warnings)
        warnings.push_back(replay.recording.name + ": calibration of its camera: " + warning);
  for (std::size_t r = 0; r < best.recordings.size(); ++r)
    for (const RegistrationParameter& parameter : registration_parameters) {
      if (!is_at_bound(best.recordings[r].bounds_hit, parameter)) continue;
      const auto count =
          std::count_if(candidates.begin(), candidates.end(), [&](const CandidateResult& candidate) {
            return r < candidate.recordings.size() &&
                   is_at_bound(candidate.recordings[r].bounds_hit, parameter);
          });
      warnings.push_back(summary.recordings[r].name + ": " +
                         at_bound_text(parameter, replays[r].recording.nuisance) +
                         " (the best candidate and " + std::to_string(count) + " of all " +
                         std::to_string(candidates.size()) + " end at it)");
    }
  // A few millimetres are what a table's height is known to.
  if (best.penetration_max > 5e-3)
    warnings.push_back("the gripper takes the sheet up to " + data::format_short(1e3 * best.penetration_max) +
                       " mm below the table: is the table's height right?");
  if (summary.unconverged > 0)
    warnings.push_back(data::format_count(static_cast<std::size_t>(summary.unconverged)) + " of " +
                       data::format_count(found) + " candidates did not converge in every step");
  if (settings.base.material.constitutive == data::Constitutive::tri_arap &&
      axis_named(settings.axes, "young"))
    warnings.push_back("under TRI_ARAP young is known through young / (1 + poisson) only");
  return warnings;
}

// Empty where the answer can be used.
std::string reason_unusable(const Summary& summary, const CandidateResult& best) {
  if (best.status != CandidateStatus::ok)
    return "the best candidate did not converge (residual " + data::format_short(best.residual_max) +
           "): raise --iterations or lower --time-step";
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

void add_settings(Summary& summary, const std::vector<Replay>& replays, const GridSettings& settings) {
  const Replay& replay = replays.front();
  auto& texts = summary.settings;
  texts["mesh"] = replay.recording.mesh_spec + " (" +
                  data::format_count(static_cast<std::size_t>(replay.sheet().rest.vertices.rows())) +
                  " vertices)";
  texts["object_mesh"] = data::is_mesh_spec(replay.object_mesh)
                             ? replay.object_mesh
                             : std::filesystem::absolute(replay.object_mesh).lexically_normal().string();
  texts["constitutive"] = data::to_string(settings.base.material.constitutive);
  texts["bending_model"] = data::to_string(settings.base.material.bending_model);
  texts["time_step_s"] = data::format_number(replay.settings.solver.time_step);
  texts["max_iterations"] = std::to_string(replay.settings.solver.max_iterations);
  texts["tolerance"] = data::format_number(replay.settings.solver.tolerance);
  if (settings.base.thickness) texts["thickness_m"] = data::format_number(*settings.base.thickness);
  const Robust& robust = settings.score.objective.robust;
  texts["distance"] =
      robust.kind == RobustKind::trimmed
          ? "mean without the largest " + data::format_short(100 * robust.trim_fraction) + " %"
      : robust.kind == RobustKind::huber ? "Huber, " + data::format_short(1000 * robust.huber_delta) + " mm"
                                         : "mean";
}

}  // namespace

Summary summarize(const GridResults& results, const GridVerdict& verdict, const std::vector<Replay>& replays,
                  const GridSettings& settings) {
  Summary summary;
  summary.tool_version = FLASH_VERSION;
  summary.results_digest = digest_of(results);
  summary.candidates = static_cast<int>(results.candidates.size());
  for (const CandidateResult& candidate : results.candidates)
    summary.unconverged += candidate.status != CandidateStatus::ok;
  add_settings(summary, replays, settings);
  if (verdict.best < 0) {
    summary.exit_code = 3;
    summary.best_score = INFINITY;
    summary.warnings = {summary.candidates == 0 ? "no candidate was simulated"
                                                : "every candidate diverged: none has a score"};
    return summary;
  }
  const CandidateResult& best = results.candidates[static_cast<std::size_t>(verdict.best)];
  const ReplayCandidate candidate = candidate_at(best.values, settings);
  summary.best = parameters_of(candidate.material, settings.base.thickness);
  summary.membrane_stiffness = candidate.material.membrane_stiffness;
  summary.best_score = verdict.score;
  summary.level95 = verdict.level95;
  std::map<std::string, double> nuisance;
  for (const std::vector<Axis>* axes : {&settings.axes, &settings.fixed})
    for (std::size_t k = 0; k < axes->size(); ++k)
      if (!is_material((*axes)[k].name)) {
        const double value = axes == &settings.fixed ? (*axes)[k].values.front() : best.values[k];
        nuisance[(*axes)[k].name] = summary.best[(*axes)[k].name] = value;
      }
  for (const ParameterFinding& finding : verdict.parameters)
    if (finding.values.size() > 1) summary.parameters.push_back(finding);
  if (summary.parameters.size() == verdict.parameters.size()) summary.covariance_log = verdict.covariance_log;
  summary.fixed = fixed_of(summary, settings);
  for (std::size_t r = 0; r < replays.size(); ++r)
    summary.recordings.push_back(summarize_recording(replays[r], best.recordings[r], verdict, nuisance));
  summary.warnings = warnings_of(summary, best, results.candidates, replays, settings);
  if (const std::string warning = warning_of_modes(results, verdict.level95); !warning.empty())
    summary.warnings.push_back(warning);
  if (const std::string reason = reason_unusable(summary, best); !reason.empty()) {
    summary.exit_code = 3;
    summary.warnings.insert(summary.warnings.begin(), reason);
  }
  return summary;
}

Summary summarize(const GridResults& results, const Answer& answer, const std::vector<Replay>& replays,
                  const GridSettings& grid, const AnswerSettings& settings) {
  Summary summary = summarize(results, answer.verdict, replays, grid);
  if (answer.verdict.best < 0) return summary;
  summary.solver_check = answer.checks;
  summary.settings["solver_check"] = settings.solver_check ? "yes" : "no";
  summary.settings["horizon"] = settings.horizon ? "yes" : "no";
  constexpr double kCoarse = 0.05;  // of the score
  if (answer.interpolation > kCoarse * answer.verdict.score)
    summary.warnings.push_back("between the values of the grid the score is known to " +
                               data::format_short(1000 * answer.interpolation) +
                               " mm only, which widens the intervals: search more values or narrower ranges");
  for (std::size_t r = 0; r < replays.size(); ++r) summary.recordings[r].horizon_s = answer.horizons[r];
  return summary;
}

}  // namespace flash::sysid
