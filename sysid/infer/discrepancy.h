#pragma once
#include <Eigen/Core>
#include <optional>
#include <vector>

#include "sysid/infer/sheet_modes.h"

namespace flash::sysid {

/// Signed residuals of one recording, a row each: where they are, and how much each counts.
struct ObservedRows {
  std::vector<double> times;  ///< of the keyframes, increasing [s]
  std::vector<int> keyframe;  ///< of each row, index into `times`
  std::vector<int> channel;   ///< of each row, from 0: each channel has a discrepancy of its own
  Eigen::MatrixX2d places;    ///< of each row on the sheet at rest [m]
  Eigen::VectorXd weights;    ///< of each row: the variance of its noise is sigma^2 / weight; 0 leaves it out
  Eigen::MatrixXd known = {};  ///< errors of known shape, a column each, of unit variance [m]
  Eigen::MatrixXd free = {};   ///< errors of known shape between -1 and 1, all alike likely [m]
  Eigen::MatrixXd rates = {};  ///< by each parameter, a column each, over about what is likely of it [m]
};

/// A discrepancy that residuals make likely.
struct DiscrepancyDraw {
  double size = 0;         ///< tau [m]
  double reach_time = 0;   ///< [s]
  double reach_sheet = 0;  ///< [m]
};

/// What the residuals say of the error of the model itself.
struct Misfit {
  double noise = 0;  ///< standard deviation by which neighbours differ [m]
  double rough = 0;  ///< that of all that the discrepancy leaves: noise, and what is rough in an error [m]
  double size = 0;   ///< tau: that of the discrepancy, posterior mean [m]
  double rms = 0;    ///< its root mean square, of which an interval has to allow for all [m]
  double reach_time = 0;   ///< over which it agrees, posterior mean where it counts by its square [s]
  double reach_sheet = 0;  ///< [m]
  double gain = 0;         ///< fall of -2 log likelihood against a discrepancy of the size `explained`
  bool found = false;      ///< the gain is more than chance gives once in twenty
  double explained = 0;    ///< discrepancy that the repeatability of trials accounts for [m]
  int keyframes = 0;
  double worth = 0;  ///< keyframes of independent discrepancies that would tell the parameters as well
  std::vector<DiscrepancyDraw> draws = {};  ///< of the posterior, all alike likely
};

/// Covariance of residuals under a model that is wrong: noise, errors of known shape, and a discrepancy that
/// is smooth in time and along the sheet (Kennedy and O'Hagan 2001),
///
///     y = K a + d + e,  a ~ N(0, 1),  e ~ N(0, sigma^2 / w),
///     cov d(t, s) d(t', s') = tau^2 k(|t - t'| / reach_time) sum_j l_j phi_j(s) phi_j(s')
///
/// k is Matern's of 5/2; phi_j are the cosines of least wave number on the box of the sheet (Solin and Sarkka
/// 2020), l_j falls with it as for Matern's of 3/2 and reach_sheet, and tau^2 is the mean variance over the
/// sheet. A discrepancy needs a prior, or it takes the place of the parameters (Brynjarsdottir and O'Hagan
/// 2014): what of tau is beyond `explained` is nothing, as likely as not, or exponential, above sigma once in
/// twenty (Simpson et al. 2017), and no larger than the residuals are themselves. Reaches are an eighth to
/// the whole of the recording and of the sheet, alike. Their likelihood is restricted: what the parameters or
/// free errors could explain counts for none.
class DiscrepancyModel {
 public:
  /// Sigma is estimated from `residuals`, with the most flexible discrepancy taken out. `repeatability`: mean
  /// distance d between two trials [m]. Each trial differs from what both have in common by `explained`,
  /// pi / 2 d^2 = noise^2 + 2 explained^2, and tau is no less.
  DiscrepancyModel(ObservedRows rows, const Eigen::VectorXd& residuals,
                   std::optional<double> repeatability = {}, int threads = 1);

  double noise() const { return noise_; }  ///< sigma: what is rough in the discrepancy counts as noise [m]
  /// Of the residuals, without what free errors and the parameters explain [m].
  double residual_size() const { return left_; }
  const ObservedRows& rows() const { return rows_; }

  /// Covariance of combinations^T y, a combination of rows a column, as the residuals make it likely.
  /// `independent`: were the discrepancies of keyframes so.
  Eigen::MatrixXd covariance_of(const Eigen::MatrixXd& combinations, bool independent = false) const;

  /// Of the residuals given to the constructor; `worth` is left to the likelihood.
  const Misfit& misfit() const { return misfit_; }

  /// -2 log restricted likelihood at one discrepancy, for tests. `shape`: see shapes().
  double deviance_at(const Eigen::VectorXd& residuals, std::size_t shape, double tau) const;

  struct Shape {
    double reach_time, reach_sheet;  ///< [s], [m]
  };
  std::vector<Shape> shapes() const;

  /// Covariance of the discrepancy between rows over tau^2, of a shape; for tests.
  Eigen::MatrixXd covariance(std::size_t shape) const;

 private:
  /// Sums over the rows of each keyframe and channel.
  struct Sums {
    Eigen::MatrixXd modes;    ///< modes x (keyframe, channel), stacked, by column of residuals
    Eigen::MatrixXd known;    ///< known columns by column of residuals
    Eigen::VectorXd squares;  ///< of each column
  };
  /// One pair of reaches. Each coordinate of a channel is one mode in time times one along the sheet, of unit
  /// variance at tau = 1 m.
  struct Field {
    std::vector<Eigen::Index> modes;  ///< along the sheet, of each coordinate
    Eigen::MatrixXd shares;           ///< of each coordinate (column) in each keyframe
    Eigen::MatrixXd squares;          ///< lower half of their products with each other, over the rows
    Eigen::MatrixXd known;            ///< their products with the errors of known shape
  };
  Sums sums(const Eigen::MatrixXd& residuals, int threads = 1) const;
  /// Of columns, a row a row: their products with the modes, stacked as in Sums.
  Eigen::MatrixXd by_modes(const Eigen::MatrixXd& columns, int threads = 1) const;
  /// Where the keyframes have a mode along the sheet of a channel, in what is stacked as in Sums.
  auto of_mode(int channel, Eigen::Index mode) const {
    return Eigen::seqN(channel * modes_ + mode, keyframes_, channels_ * modes_);
  }
  Field field(const Shape& shape) const;
  /// Of what errors of known shape leave, over sigma^2: the residuals' squares, their products with the
  /// coordinates of a field, and the lower half of the information of these.
  double squares_of(const Sums& sums) const;
  Eigen::VectorXd products_with(const Field& field, const Sums& sums) const;
  Eigen::MatrixXd information_of(const Field& field) const;
  /// -2 log restricted likelihood at each size tau.
  std::vector<double> deviances(const Shape& shape, const Sums& sums, const std::vector<double>& sizes) const;
  void estimate_noise(const Eigen::VectorXd& residuals);
  void weigh(const Eigen::VectorXd& residuals, int threads);
  /// Sets the variances where nothing tells them: half of that of the residuals.
  void assume();
  /// Covariances between keyframes of what each mode along the sheet has of the discrepancy [m^2].
  std::vector<Eigen::MatrixXd> between_keyframes() const;
  Eigen::MatrixXd in_time(const Shape& shape) const;       ///< correlation between keyframes
  Eigen::MatrixXd scaled_modes(const Shape& shape) const;  ///< along the sheet, a row each

  ObservedRows rows_;
  Eigen::MatrixXd known_;  ///< errors of known shape and, of no known size, free ones and the parameters
  int channels_ = 1, keyframes_ = 0, modes_ = 0;
  double noise_ = 0, left_ = 0, explained_ = 0, duration_ = 0;
  bool noise_is_told_ = true;                       ///< from the discrepancy
  SheetModes along_;                                ///< of each row
  std::vector<std::vector<Eigen::Index>> rows_of_;  ///< of each keyframe and channel
  std::vector<Eigen::MatrixXd> modes_modes_;  ///< of each channel: a keyframe a row, sum w phi phi^T along it
  Eigen::MatrixXd modes_known_;               ///< (keyframe, channel, mode) by known
  Eigen::MatrixXd known_known_, inverse_known_;
  std::vector<double> sizes_, priors_;  ///< tau [m] and the prior of each
  std::vector<double> variances_;       ///< of each shape: tau^2 times how likely both are, summed over tau
  std::vector<Eigen::MatrixXd> between_keyframes_;  ///< see between_keyframes()
  Misfit misfit_;
};

}  // namespace flash::sysid
