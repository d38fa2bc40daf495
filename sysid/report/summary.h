#pragma once
#include <Eigen/Core>
#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "sysid/infer/agreement.h"
#include "sysid/infer/clock_offset.h"
#include "sysid/infer/discrepancy.h"
#include "sysid/infer/finding.h"
#include "sysid/infer/marker_fit.h"
#include "sysid/infer/solver_check.h"

namespace flash::sysid {

/// A parameter that was not searched.
struct FixedParameter {
  double value = 0;
  std::string source = "assumed";        ///< "measured" or "assumed"
  std::optional<double> deviation = {};  ///< standard deviation, where one was stated
};

struct SummaryFrame {
  double t = 0;       ///< [s]
  double score = 0;   ///< mean distance of the observed points to the simulated surface [m]
  double weight = 1;  ///< 0: dropped (beyond the predictability horizon)
};

/// How the estimate fits one recording, and the nuisance values found for it.
struct SummaryRecording {
  std::string name;
  std::string sha256;     ///< of recording.json and the files it names
  std::string mesh;       ///< specification or file that was searched; empty: an earlier program did not say
  bool own_mesh = false;  ///< it is the recording's own
  std::string mesh_sha256 = {};                      ///< mesh_digest of it
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();  ///< observed = simulated moved by this [m]
  double yaw = 0;                                    ///< [rad]
  double time_offset = 0;                            ///< [s]
  std::optional<ClockOffset> clock = {};             ///< none: not estimated
  std::map<std::string, double> nuisance;            ///< the others found: table_height_m, start_yaw_rad, ...
  double score = 0;                                  ///< on the mesh that the answer is of [m]
  double score_on_mesh = 0;  ///< on the mesh that was searched; infinite: an earlier program did not say [m]
  double error_cost = 0;     ///< of errors that are fitted, see LeftResiduals
  double spread = 0;         ///< s of the likelihood, see LeftResiduals [m]
  Misfit misfit;             ///< error of the model itself
  std::optional<MarkerFit> markers;  ///< of what was tracked
  std::optional<double> horizon_s;   ///< predictable until here [s]
  std::string horizon_of;            ///< the parameter whose change parts the motion there
  std::vector<SummaryFrame> frames;
};

struct Summary;

/// Whether young is E [Pa], of a solid or beside a thickness, and not E t [N/m].
bool young_is_in_pascal(const Summary& summary);

/// From the first to the last keyframe that counts [s].
double duration_of(const SummaryRecording& recording);

/// What one more recording is expected to tell beside those at hand.
struct NextExperiment {
  std::string name;  ///< "bar_pull", or "lift again"
  double bits = 0;   ///< expected information: by how many powers of two what is likely shrinks
  std::map<std::string, double> spread_before, spread;  ///< standard deviation of each parameter, without and
                                                        ///< with it: of its logarithm or in its unit
};

/// Whether no misfit was found, or repeatability explains it, to 0.01 mm; and whether noise explains what is
/// missed of markers.
bool model_fits(const SummaryRecording& recording);

/// All that a search found: the file summary.json (schema "flash-sysid-summary/2").
struct Summary {
  std::map<std::string, double> best;  ///< every parameter of the estimate
  double membrane_stiffness = 0;       ///< E t of the estimate [N/m]
  double best_score = 0;     ///< of the estimate, on the mesh that the answer is of (settings "score_of") [m]
  double score_on_mesh = 0;  ///< of the estimate on the mesh that was searched, as a replay gives it [m]
  std::vector<ParameterFinding> parameters;  ///< the searched ones, in the order of the axes
  std::map<std::string, FixedParameter> fixed;
  /// Priors of what was not searched and counts as unknown: one standard deviation to both sides.
  std::map<std::string, std::array<double, 2>> held;
  Eigen::MatrixXd covariance_log;  ///< of log(parameter) in the order of `parameters`; empty: not estimated
  Eigen::MatrixXd samples;         ///< of the posterior: a draw a row, in the order of `parameters`
  /// Of each sample, areal density [kg/m^2] or density [kg/m^3]; empty where that is known. Motion tells
  /// stiffnesses as ratios to it.
  Eigen::VectorXd sample_weights;
  std::vector<NextExperiment> next_experiments;  ///< best first; empty: they were not ranked
  std::vector<SummaryRecording> recordings;
  std::vector<SolverCheck> solver_check;
  bool by_points = false;              ///< see Answer
  std::optional<Agreement> agreement;  ///< of several recordings; values in the order of `parameters`
  std::map<std::string, std::string> settings;  ///< constitutive, bending_model, mesh, time_step_s, ...
  std::string asset;                            ///< path of the asset the search started from
  int candidates = 0;
  int unconverged = 0;
  std::string device = "cpu";
  double wall_seconds = 0;
  std::string tool_version;
  std::string results_digest;            ///< of the tables it was made from (candidate_lines.h)
  std::vector<double> open_information;  ///< see model_comparison.h [m^2]
  std::string residuals_digest;          ///< of residuals.csv; empty: none
  std::vector<std::string> warnings;
  int exit_code = 0;  ///< 0 usable; 3 finished, but the answer cannot be used
};

/// The text of summary.json. Its last field, `digest`, covers the others: 16 digits of a SHA-256.
std::string summary_text(const Summary& summary);

/// Written to a temporary file and renamed, so that a reader never sees half of it. Throws std::runtime_error
/// when the folder cannot be written.
void save_summary(const Summary& summary, const std::string& path);

/// Throws data::InputError naming file and field unless the file is of schema "flash-sysid-summary/2", was
/// written by this program or an earlier one of the same major version, and holds values that a search can
/// find, as they were written: `digest` is that of its other fields.
Summary load_summary(const std::string& path);

}  // namespace flash::sysid
