#pragma once
#include <Eigen/Core>
#include <optional>
#include <vector>

namespace flash::sysid {

/// Signed residuals of one recording, a row each: where they are, and how much each counts.
struct ObservedRows {
  std::vector<double> times;  ///< of the keyframes, increasing [s]
  std::vector<int> keyframe;  ///< of each row, index into `times`
  std::vector<int> channel;   ///< of each row, from 0: each channel has a discrepancy of its own
  Eigen::MatrixX2d places;    ///< of each row on the sheet at rest [m]
  Eigen::VectorXd weights;    ///< of each row: the variance of its noise is sigma^2 / weight; 0 leaves it out
  Eigen::MatrixXd known = {};  ///< errors of known shape, a column each, of unit variance [m]
};

/// What the residuals say of the error of the model itself.
struct Misfit {
  double noise = 0;        ///< sigma: standard deviation of what is independent from row to row [m]
  double size = 0;         ///< tau: that of the discrepancy, posterior mean [m]
  double reach_time = 0;   ///< over which it agrees, posterior mean [s]
  double reach_sheet = 0;  ///< [m]
  double gain = 0;         ///< fall of -2 log likelihood against a discrepancy of the size `explained`
  bool found = false;      ///< the gain is more than chance gives once in twenty
  double explained = 0;    ///< discrepancy that the repeatability of trials accounts for [m]
  int keyframes = 0;
  double worth = 0;  ///< keyframes of independent discrepancies that would tell the parameters as well
};

/// The likelihood of residuals under a model that is wrong: noise, errors of known shape, and a discrepancy
/// that is smooth in time and along the sheet (Kennedy and O'Hagan 2001),
///
///     y = K a + d + e,  a ~ N(0, 1),  e ~ N(0, sigma^2 / w),
///     cov d(t, s) d(t', s') = tau^2 k(|t - t'| / reach_time) sum_j l_j phi_j(s) phi_j(s')
///
/// k is Matern's of 5/2; phi_j are the cosines of least wave number on the box of the sheet (Solin and Sarkka
/// 2020), l_j falls with it as for a Gaussian kernel of reach_sheet, and tau^2 is the mean variance over the
/// sheet. A discrepancy needs a prior, or it takes the place of the parameters (Brynjarsdottir and O'Hagan
/// 2014): tau is half-Cauchy of scale sigma about `explained`, reaches are an eighth to the whole of the
/// recording and a quarter to the whole of the sheet, alike. The likelihood is the mean over them.
class DiscrepancyModel {
 public:
  /// Sigma is estimated from `residuals`, with the most flexible discrepancy taken out. `repeatability`: mean
  /// distance d between two trials [m]. Each trial differs from what both have in common by `explained`,
  /// pi / 2 d^2 = sigma^2 + 2 explained^2, and tau is no less.
  DiscrepancyModel(ObservedRows rows, const Eigen::VectorXd& residuals,
                   std::optional<double> repeatability = {});

  double noise() const { return noise_; }
  Eigen::Index rows() const { return rows_.weights.size(); }

  /// -2 log likelihood of each column of residuals [m], up to a constant common to all.
  Eigen::VectorXd deviance(const Eigen::MatrixXd& residuals) const;

  /// The discrepancy at residuals of the estimate. `rates`: derivatives of the residuals by the parameters.
  Misfit describe(const Eigen::VectorXd& residuals, const Eigen::MatrixXd& rates) const;

  /// -2 log likelihood at one discrepancy; the brute force of a test knows it too. `shape`: see shapes().
  double deviance_at(const Eigen::VectorXd& residuals, std::size_t shape, double tau) const;

  struct Shape {
    double reach_time, reach_sheet;  ///< [s], [m]
  };
  std::vector<Shape> shapes() const;

  /// Covariance of the discrepancy between rows over tau^2, of a shape.
  Eigen::MatrixXd covariance(std::size_t shape) const;

 private:
  /// Sums over the rows of each keyframe and channel.
  struct Sums {
    Eigen::MatrixXd modes;    ///< modes x (keyframe, channel), stacked, by column of residuals
    Eigen::MatrixXd known;    ///< known columns by column of residuals
    Eigen::VectorXd squares;  ///< of each column
  };
  /// One pair of reaches, in the coordinates in which the discrepancy's information is diagonal.
  struct Field {
    Shape shape;
    Eigen::MatrixXd modes;  ///< rows: coordinates; columns: (keyframe, channel, mode)
    Eigen::MatrixXd known;  ///< from Sums::known
    Eigen::VectorXd gains;  ///< information of each coordinate over its prior at tau = 1 m
  };
  struct Reduced {
    Eigen::VectorXd squares;                   ///< of what errors of known shape leave
    std::vector<Eigen::MatrixXd> coordinates;  ///< of each field, by column of residuals
  };
  Sums sums(const Eigen::MatrixXd& residuals) const;
  Field field(const Shape& shape) const;
  Reduced reduce(const Eigen::MatrixXd& residuals) const;
  void estimate_noise(const Eigen::VectorXd& residuals);
  Eigen::MatrixXd sheet_modes(const Shape& shape) const;  ///< scaled, a row each
  double worth(const Field& field, double tau, const Eigen::MatrixXd& rates) const;

  ObservedRows rows_;
  int channels_ = 1, keyframes_ = 0, modes_ = 0;
  double noise_ = 0, explained_ = 0, duration_ = 0, length_ = 0;
  Eigen::MatrixXd phi_;           ///< modes of each row, unscaled
  Eigen::VectorXd wave_numbers_;  ///< of the modes [1/m]
  Eigen::MatrixXd modes_modes_;   ///< (keyframe, channel) blocks of sum w phi phi^T, side by side
  Eigen::MatrixXd modes_known_;   ///< (keyframe, channel, mode) by known
  Eigen::MatrixXd inverse_known_;
  std::vector<Field> fields_;
  std::vector<double> sizes_, priors_;  ///< tau [m] and the prior of each
};

}  // namespace flash::sysid
