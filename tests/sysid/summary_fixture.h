#pragma once
#include <cmath>

#include "sysid/emulate/results_store.h"
#include "sysid/report/summary.h"

namespace flash::sysid {

/// A search over bending and poisson that knows the first and not the second.
inline Summary example_summary() {
  Summary summary;
  summary.tool_version = FLASH_VERSION;
  summary.best = {{"young", 3e4},         {"poisson", 0.2},  {"bending", 1e-4},         {"friction", 0.3},
                  {"areal_density", 0.2}, {"air_drag", 0.0}, {"stiffness_damping", 0.0}};
  summary.membrane_stiffness = 30;
  summary.best_score = 0.004;
  summary.score_on_mesh = 0.0045;
  ParameterFinding bending;
  bending.name = "bending";
  bending.estimate = 1.1e-4;
  bending.interval95 = {8e-5, 1.5e-4};
  bending.identifiable = Identifiable::yes;
  bending.logarithmic = true;
  bending.values = {1e-5, 1e-4, 1e-3};
  bending.scores = {0.009, 0.004, 0.011};
  ParameterFinding poisson;
  poisson.name = "poisson";
  poisson.estimate = 0.2;
  poisson.interval95 = {0.0, 0.4};
  poisson.edge = RangeEdge::low;
  poisson.note = "no value is excluded </script>";
  poisson.values = {0.0, 0.2, 0.4};
  poisson.scores = {0.0041, 0.004, INFINITY};
  summary.parameters = {poisson, bending};
  summary.fixed = {{"friction", {0.3, "measured"}}, {"areal_density", {0.2, "assumed"}}};
  bending.bits = 2.5;
  summary.samples = Eigen::MatrixXd(2, 2);
  summary.samples << 0.1, 1e-4, 0.3, 1.2e-4;
  summary.covariance_log = Eigen::Matrix2d::Identity() * 0.01;
  SummaryRecording recording;
  recording.name = "lift";
  recording.sha256 = std::string(64, 'a');
  recording.offset = {0.01, -0.02, 0.003};
  recording.yaw = 0.1;
  recording.time_offset = 0.04;
  recording.nuisance = {{"start_yaw", 0.2}};
  recording.score = 0.004;
  recording.score_on_mesh = 0.0045;
  recording.misfit = {0.001, 0.0012, 0.003, 0.0032, 0.2, 0.1, 40, true, 0.002, 2, 1.4, {{0.003, 0.2, 0.1}}};
  recording.horizon_s = 1.9;
  recording.horizon_of = "friction";
  recording.frames = {{1.0, 0.003, 1}, {1.5, 0.005, 1}, {2.0, 0.02, 0}};
  summary.recordings = {recording};
  summary.solver_check = {{"half_step", 1e-4}, {"double_mesh", 2e-4}};
  summary.settings = {{"mesh", "sheet:0.4x0.4:0.02:alternating"}, {"thickness_m", "0.001"}};
  summary.asset = "towel.json";
  summary.candidates = 9;
  summary.wall_seconds = 12;
  summary.warnings = {"poisson is not identifiable from this recording"};
  return summary;
}

inline GridResults example_results() {
  GridResults results;
  results.axes = {{"poisson", {0.0, 0.2, 0.4}, false}, {"bending", {1e-5, 1e-4, 1e-3}, true}};
  results.recordings = {"lift"};
  for (int i = 0; i < 9; ++i) {
    CandidateResult candidate;
    candidate.id = i;
    candidate.values = {results.axes[0].values[i / 3], results.axes[1].values[i % 3]};
    candidate.score = i == 8 ? INFINITY : 0.004 + 0.001 * std::abs(i - 4);
    results.candidates.push_back(candidate);
  }
  return results;
}

}  // namespace flash::sysid
