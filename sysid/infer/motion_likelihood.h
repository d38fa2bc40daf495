#pragma once
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "sysid/emulate/grid_search.h"
#include "sysid/infer/motion_change.h"
#include "sysid/infer/residual_likelihood.h"
#include "sysid/observe/linear_observations.h"

namespace flash::sysid {

/// How likely motions of several recordings are. The registration of each is fitted within its bounds, all
/// alike likely, and errors of known shape under their prior: the sheet is moved by them before distances are
/// taken. How rows change with both is that at a reference motion.
class MotionLikelihood {
 public:
  /// `reference`: a motion a replay, near those to be asked about. `rates`: how motions change there with
  /// each parameter, over about what is likely of it. `first`: recording of `errors` that the first replay is
  /// of.
  MotionLikelihood(const std::vector<Replay>& replays, const std::vector<ReplayResult>& reference,
                   const ScoreSettings& settings, std::optional<double> repeatability,
                   const std::vector<KnownError>& errors, const std::vector<MotionChange>& rates,
                   std::size_t first = 0);

  std::size_t recordings() const { return recordings_.size(); }

  /// -2 log likelihood of motions, one a recording, up to a constant. NaN where the clock that fits one leads
  /// to steps that it lacks.
  double deviance(const std::vector<Motion>& motions, int threads = 1) const;

  /// The motion of recording r with the positions that its keyframes read where its clock is off by
  /// `time_offset` [s].
  using MotionAtClock = std::function<const Motion&(std::size_t r, double time_offset)>;
  double deviance(const MotionAtClock& motions) const;

  /// What is fitted to each motion.
  struct Nuisance {
    Eigen::Matrix<double, 5, 1> registration;  ///< offset [m], yaw [rad], time [s]
    Eigen::VectorXd errors;                    ///< how many standard deviations of each known error
  };
  /// `fitted`: one a recording: where it is looked for first, unless empty; then what was found. Near what is
  /// found it changes speed only.
  double deviance(const MotionAtClock& motions, std::vector<Nuisance>& fitted, int threads = 1) const;

  /// How well the recording that tells most tells a known error beside the parameters, in its standard
  /// deviations.
  double spread_of(std::size_t error) const;

  /// The registration of recording r at the reference, offset [m], yaw [rad] and time [s], known errors
  /// fitted beside it.
  const Eigen::Matrix<double, 5, 1>& registration(std::size_t r) const {
    return recordings_[r].nuisance.registration;
  }

  /// How well recording r tells it beside the parameters: standard deviations. Zero where a bound is.
  Eigen::Matrix<double, 5, 1> registration_spread(std::size_t r) const;

  /// How many standard deviations of a known error the reference asks for, on average over the recordings.
  double asked_of(std::size_t error) const;

  const ResidualLikelihood& of_recording(std::size_t r) const { return *recordings_[r].likelihood; }

  /// What the likelihood of a recording is linear in, about its reference.
  struct Linear {
    ObservedRows rows;
    Eigen::VectorXd residuals;  ///< of the reference, before registration and known errors are fitted [m]
    Eigen::VectorXd scale;      ///< of each row: by its stated error
  };
  const Linear& linear(std::size_t r) const { return recordings_[r].linear; }

  /// How far another motion of recording r is from the reference at each row, to first order [m].
  Eigen::VectorXd away(std::size_t r, const Motion& reference, const Motion& motion) const;

 private:
  using Registered = Eigen::Matrix<double, 5, 1>;
  struct Recording {
    Replay replay;
    Objective objective;
    Registered bounds;
    // While the likelihood is made: one standard deviation of each known error, and its square where it
    // bends.
    std::vector<SheetShifts> errors, bends;
    std::vector<double> sizes;  ///< of each known error, standard deviations
    /// Of each keyframe: what corrects the motion, one standard deviation of each known error, and its square
    /// of those that bend.
    std::vector<SheetShapes> shapes;
    std::vector<Eigen::Index> bent;  ///< the errors that bend, in that order
    Nuisance nuisance;               ///< of the reference
    Linear linear;
    Eigen::Matrix<double, Eigen::Dynamic, 5> registered;  ///< by what the registration moves each row
    Eigen::MatrixXd slopes, curves;                       ///< by what each known error does, and its square
    std::optional<LinearObservations> near;               ///< of the reference
    std::optional<ResidualLikelihood> likelihood;
  };
  /// What the index-th recording, at a time offset, takes of the errors: sizes, shapes, and those that bend.
  static void add_errors(Recording& recording, const std::vector<KnownError>& errors, std::size_t index,
                         double time_offset);
  /// Makes the likelihood that is linear about a motion at the recording's nuisance.
  static void linearize(Recording& recording, const Motion& motion, const std::vector<SheetShifts>& rates,
                        std::optional<double> repeatability, std::optional<double> limit);
  /// By what each known error moves each row about its size.
  static Eigen::MatrixXd known_at(const Recording& recording, const Eigen::VectorXd& errors);
  /// Whether a motion has what its keyframes read.
  static bool is_read(const Recording& recording, const Motion& motion, double time_offset);
  static Registration registration_of(const Recording& recording, const Nuisance& nuisance);
  /// By what the sheet is moved before distances are taken.
  static void set_shifts(const Recording& recording, const Nuisance& nuisance, SheetShifts& shifts);
  /// The likeliest nuisance of a motion, by Gauss and Newton, and its -2 log likelihood.
  static std::pair<Nuisance, double> fit_nuisance(
      const Recording& recording, const Nuisance& start,
      const std::function<const Motion&(double time_offset)>& motion_at, int threads);

  std::vector<Recording> recordings_;
};

}  // namespace flash::sysid
