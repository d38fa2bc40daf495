#include "sysid/infer/discrepancy.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace flash::sysid {
namespace {

constexpr double kTimes[] = {0.125, 0.25, 0.5, 1};    // reaches over the duration
constexpr double kSheets[] = {0.25, 0.5, 1};          // over the longest side of the sheet
constexpr Eigen::Index kModes = 12;                   // along the sheet, at most
constexpr Eigen::Index kCoordinates = 120;            // of a field, at most
constexpr double kLeast = 1e-5;                       // variance of a coordinate over the largest
constexpr int kSizes = 20;                            // values of tau,
constexpr double kFirstSize = 0.03, kSizeStep = 1.7;  // the first over sigma, and their ratio
// Chi-square with 3 degrees of freedom: a size and two reaches.
constexpr double kOnceInTwenty = 7.815;

double matern(double distance) {
  const double x = std::sqrt(5.0) * distance;
  return (1 + x + x * x / 3) * std::exp(-x);
}

/// Row of (keyframe, channel) blocks, `modes` long each.
Eigen::Index block(int keyframe, int channel, int channels, int modes) {
  return (static_cast<Eigen::Index>(keyframe) * channels + channel) * modes;
}

double log_mean_exp(const std::vector<double>& logs, const std::vector<double>& weights) {
  const double largest = *std::max_element(logs.begin(), logs.end());
  double sum = 0;
  for (std::size_t i = 0; i < logs.size(); ++i) sum += weights[i] * std::exp(logs[i] - largest);
  return largest + std::log(sum);
}

/// -2 log likelihood at one size from coordinates in which all is diagonal.
double diagonal_deviance(double squares, const Eigen::VectorXd& gains, const Eigen::VectorXd& coordinates,
                         double tau) {
  const double variance = tau * tau;
  const Eigen::ArrayXd scale = 1 + variance * gains.array();
  return squares + scale.log().sum() - (variance * coordinates.array().square() / scale).sum();
}

}  // namespace

DiscrepancyModel::DiscrepancyModel(ObservedRows rows, const Eigen::VectorXd& residuals,
                                   std::optional<double> repeatability)
    : rows_(std::move(rows)), keyframes_(static_cast<int>(rows_.times.size())) {
  if (rows_.known.rows() == 0) rows_.known.resize(residuals.size(), 0);
  channels_ = 1 + *std::max_element(rows_.channel.begin(), rows_.channel.end());
  duration_ = std::max(rows_.times.back() - rows_.times.front(), 1e-9);
  const Eigen::RowVector2d corner = rows_.places.colwise().minCoeff();
  const Eigen::Vector2d sides = (rows_.places.colwise().maxCoeff() - corner).transpose().cwiseMax(1e-9);
  length_ = sides.maxCoeff();

  struct Mode {
    int a, b;
    double wave_number;
  };
  std::vector<Mode> modes;
  for (int a = 0; a < kModes; ++a)
    for (int b = 0; b < kModes; ++b) modes.push_back({a, b, M_PI * std::hypot(a / sides[0], b / sides[1])});
  std::stable_sort(modes.begin(), modes.end(),
                   [](const Mode& one, const Mode& other) { return one.wave_number < other.wave_number; });
  modes.resize(kModes);
  modes_ = kModes;
  wave_numbers_.resize(modes_);
  phi_.resize(residuals.size(), modes_);
  for (int j = 0; j < modes_; ++j) {
    const auto [a, b, wave_number] = modes[static_cast<std::size_t>(j)];
    wave_numbers_[j] = wave_number;
    const double scale = std::sqrt((a > 0 ? 2.0 : 1.0) * (b > 0 ? 2.0 : 1.0));  // mean square 1
    const auto x = (rows_.places.col(0).array() - corner[0]) / sides[0];
    const auto y = (rows_.places.col(1).array() - corner[1]) / sides[1];
    phi_.col(j) = scale * (M_PI * a * x).cos() * (M_PI * b * y).cos();
  }

  const Eigen::Index stacked = block(keyframes_, 0, channels_, modes_);
  modes_modes_ = Eigen::MatrixXd::Zero(modes_, stacked);
  for (Eigen::Index i = 0; i < residuals.size(); ++i) {
    const auto at = static_cast<std::size_t>(i);
    modes_modes_.middleCols(block(rows_.keyframe[at], rows_.channel[at], channels_, modes_), modes_) +=
        rows_.weights[i] * phi_.row(i).transpose() * phi_.row(i);
  }
  modes_known_ = sums(rows_.known).modes;
  estimate_noise(residuals);
  if (repeatability)
    explained_ = std::sqrt(std::max(0.0, M_PI / 4 * *repeatability * *repeatability - 0.5 * noise_ * noise_));
  for (const Shape& shape : shapes()) fields_.push_back(field(shape));
  // Half-Cauchy in what is beyond the explained; d tau = tau d log tau.
  double sum = 0;
  for (int i = 0; i < kSizes; ++i) {
    const double beyond = kFirstSize * std::pow(kSizeStep, i);
    sizes_.push_back(std::hypot(explained_, beyond * noise_));
    priors_.push_back(beyond / (1 + beyond * beyond));
    sum += priors_.back();
  }
  for (double& prior : priors_) prior /= sum * static_cast<double>(fields_.size());
}

std::vector<DiscrepancyModel::Shape> DiscrepancyModel::shapes() const {
  std::vector<Shape> shapes;
  for (const double time : kTimes)
    for (const double sheet : kSheets) shapes.push_back({time * duration_, sheet * length_});
  return shapes;
}

Eigen::MatrixXd DiscrepancyModel::sheet_modes(const Shape& shape) const {
  Eigen::VectorXd variances = (-0.5 * (shape.reach_sheet * wave_numbers_.array()).square()).exp();
  variances /= variances.sum();
  return phi_ * variances.cwiseSqrt().asDiagonal();
}

Eigen::MatrixXd DiscrepancyModel::covariance(std::size_t shape) const {
  const Shape reach = shapes()[shape];
  const Eigen::MatrixXd modes = sheet_modes(reach);
  Eigen::MatrixXd covariance = modes * modes.transpose();
  for (Eigen::Index i = 0; i < covariance.rows(); ++i)
    for (Eigen::Index j = 0; j < covariance.cols(); ++j) {
      const auto a = static_cast<std::size_t>(i), b = static_cast<std::size_t>(j);
      const double apart = rows_.times[static_cast<std::size_t>(rows_.keyframe[a])] -
                           rows_.times[static_cast<std::size_t>(rows_.keyframe[b])];
      covariance(i, j) *=
          rows_.channel[a] == rows_.channel[b] ? matern(std::abs(apart) / reach.reach_time) : 0.0;
    }
  return covariance;
}

DiscrepancyModel::Sums DiscrepancyModel::sums(const Eigen::MatrixXd& residuals) const {
  Sums sums;
  sums.modes = Eigen::MatrixXd::Zero(block(keyframes_, 0, channels_, modes_), residuals.cols());
  for (Eigen::Index i = 0; i < residuals.rows(); ++i) {
    const auto at = static_cast<std::size_t>(i);
    sums.modes.middleRows(block(rows_.keyframe[at], rows_.channel[at], channels_, modes_), modes_)
        .noalias() += rows_.weights[i] * phi_.row(i).transpose() * residuals.row(i);
  }
  sums.known = rows_.known.transpose() * rows_.weights.asDiagonal() * residuals;
  sums.squares = (rows_.weights.asDiagonal() * residuals).cwiseProduct(residuals).colwise().sum().transpose();
  return sums;
}

DiscrepancyModel::Field DiscrepancyModel::field(const Shape& shape) const {
  Eigen::MatrixXd kernel(keyframes_, keyframes_);
  for (int k = 0; k < keyframes_; ++k)
    for (int l = 0; l < keyframes_; ++l)
      kernel(k, l) = matern(
          std::abs(rows_.times[static_cast<std::size_t>(k)] - rows_.times[static_cast<std::size_t>(l)]) /
          shape.reach_time);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> in_time(kernel);
  Eigen::VectorXd along = (-0.5 * (shape.reach_sheet * wave_numbers_.array()).square()).exp();
  along /= along.sum();

  // The coordinates of largest variance; each is one mode in time times one along the sheet.
  struct Coordinate {
    Eigen::Index time, mode;
    double variance;
  };
  std::vector<Coordinate> chosen;
  for (Eigen::Index i = 0; i < keyframes_; ++i)
    for (Eigen::Index j = 0; j < modes_; ++j)
      chosen.push_back({i, j, std::max(0.0, in_time.eigenvalues()[i]) * along[j]});
  std::stable_sort(chosen.begin(), chosen.end(),
                   [](const Coordinate& a, const Coordinate& b) { return a.variance > b.variance; });
  const double least = kLeast * chosen.front().variance;
  const auto enough = std::find_if(chosen.begin(), chosen.end(),
                                   [&](const Coordinate& coordinate) { return coordinate.variance < least; });
  chosen.resize(std::min<std::size_t>(static_cast<std::size_t>(enough - chosen.begin()),
                                      static_cast<std::size_t>(kCoordinates / channels_)));

  const auto per_channel = static_cast<Eigen::Index>(chosen.size());
  const Eigen::Index stacked = block(keyframes_, 0, channels_, modes_);
  Eigen::MatrixXd design = Eigen::MatrixXd::Zero(per_channel * channels_, stacked);
  for (int channel = 0; channel < channels_; ++channel)
    for (Eigen::Index c = 0; c < per_channel; ++c) {
      const Coordinate& at = chosen[static_cast<std::size_t>(c)];
      for (int k = 0; k < keyframes_; ++k)
        design(channel * per_channel + c, block(k, channel, channels_, modes_) + at.mode) =
            std::sqrt(at.variance) * in_time.eigenvectors()(k, at.time);
    }
  // Information of the coordinates, in units of 1 / sigma^2; what errors of known shape explain taken out.
  Eigen::MatrixXd weighed(design.rows(), stacked);
  for (Eigen::Index first = 0; first < stacked; first += modes_)
    weighed.middleCols(first, modes_).noalias() =
        design.middleCols(first, modes_) * modes_modes_.middleCols(first, modes_);
  const double precision = 1 / (noise_ * noise_);
  const Eigen::MatrixXd to_known = design * modes_known_;
  const Eigen::MatrixXd information =
      precision * (weighed * design.transpose() - to_known * inverse_known_ * to_known.transpose());
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(information);
  Field field{shape, {}, {}, eigen.eigenvalues().cwiseMax(0.0)};
  field.modes = eigen.eigenvectors().transpose() * design;
  field.known = -precision * (eigen.eigenvectors().transpose() * to_known * inverse_known_);
  return field;
}

DiscrepancyModel::Reduced DiscrepancyModel::reduce(const Eigen::MatrixXd& residuals) const {
  const Sums sums = this->sums(residuals);
  Reduced reduced;
  reduced.squares =
      (sums.squares -
       sums.known.cwiseProduct(inverse_known_ * sums.known).colwise().sum().transpose().eval()) /
      (noise_ * noise_);
  for (const Field& field : fields_)
    reduced.coordinates.emplace_back(field.modes * sums.modes / (noise_ * noise_) + field.known * sums.known);
  return reduced;
}

/// The fixed point of sigma^2 = squares of what is left / (rows - what was fitted), under a discrepancy that
/// is all but free (Fellner 1986).
void DiscrepancyModel::estimate_noise(const Eigen::VectorXd& residuals) {
  const double rows = rows_.weights.sum();
  const double all = std::sqrt(residuals.cwiseAbs2().dot(rows_.weights) / rows);
  noise_ = std::max(all, 1e-9);
  const Shape flexible{kTimes[0] * duration_, kSheets[0] * length_};
  const double variance = 100 * noise_ * noise_;
  for (int round = 0; round < 8; ++round) {
    const Eigen::Index count = rows_.known.cols();
    const Eigen::MatrixXd known = rows_.known.transpose() * rows_.weights.asDiagonal() * rows_.known;
    inverse_known_ = (known + noise_ * noise_ * Eigen::MatrixXd::Identity(count, count))
                         .ldlt()
                         .solve(Eigen::MatrixXd::Identity(count, count));
    fields_ = {field(flexible)};
    const Reduced reduced = reduce(residuals);
    const Eigen::ArrayXd gains = fields_[0].gains.array(), x = reduced.coordinates[0].col(0).array();
    const Eigen::ArrayXd fitted = variance * x / (1 + variance * gains);
    const double left = reduced.squares[0] - 2 * (fitted * x).sum() + (fitted * fitted * gains).sum();
    const double freedom =
        rows - (variance * gains / (1 + variance * gains)).sum() - static_cast<double>(count);
    const double before = noise_;
    noise_ = std::max(noise_ * std::sqrt(std::max(left, 0.0) / std::max(freedom, 0.1 * rows)), 1e-9);
    if (std::abs(noise_ - before) < 1e-3 * before) break;
  }
  fields_.clear();
}

Eigen::VectorXd DiscrepancyModel::deviance(const Eigen::MatrixXd& residuals) const {
  const Reduced reduced = reduce(residuals);
  std::vector<double> weights;
  for (std::size_t f = 0; f < fields_.size(); ++f)
    weights.insert(weights.end(), priors_.begin(), priors_.end());
  Eigen::VectorXd deviance(residuals.cols());
  for (Eigen::Index c = 0; c < residuals.cols(); ++c) {
    std::vector<double> logs;
    for (std::size_t f = 0; f < fields_.size(); ++f)
      for (const double tau : sizes_)
        logs.push_back(-0.5 * diagonal_deviance(reduced.squares[c], fields_[f].gains,
                                                reduced.coordinates[f].col(c), tau));
    deviance[c] = -2 * log_mean_exp(logs, weights);
  }
  return deviance;
}

double DiscrepancyModel::deviance_at(const Eigen::VectorXd& residuals, std::size_t shape, double tau) const {
  const Reduced reduced = reduce(residuals);
  return diagonal_deviance(reduced.squares[0], fields_[shape].gains, reduced.coordinates[shape].col(0), tau);
}

double DiscrepancyModel::worth(const Field& field, double tau, const Eigen::MatrixXd& rates) const {
  // Information with the discrepancy as it is, and as if it were independent from keyframe to keyframe.
  const Eigen::MatrixXd weighed = rows_.weights.asDiagonal() * rates;
  const Eigen::MatrixXd told =
      rates - rows_.known * (inverse_known_ * (rows_.known.transpose() * weighed));  // not by known shapes
  const Eigen::MatrixXd modes = sums(told).modes;
  const double precision = 1 / (noise_ * noise_);
  const Eigen::MatrixXd all = precision * told.transpose() * rows_.weights.asDiagonal() * told;
  /// What a field of independent coordinates, columns of their part in the stacked modes, leaves of it.
  const auto left = [&](const Eigen::MatrixXd& information, const Eigen::MatrixXd& seen) -> Eigen::MatrixXd {
    const Eigen::Index count = information.rows();
    return seen.transpose() * (information + Eigen::MatrixXd::Identity(count, count)).ldlt().solve(seen);
  };
  Eigen::MatrixXd field_information(field.modes.rows(), modes.rows());
  Eigen::VectorXd along = (-0.5 * (field.shape.reach_sheet * wave_numbers_.array()).square()).exp();
  const Eigen::VectorXd roots = tau * (along / along.sum()).cwiseSqrt();
  Eigen::MatrixXd independent = all;
  for (Eigen::Index first = 0; first < modes.rows(); first += modes_) {
    const auto here = modes_modes_.middleCols(first, modes_);
    field_information.middleCols(first, modes_).noalias() = field.modes.middleCols(first, modes_) * here;
    independent -= left(precision * (roots.asDiagonal() * here * roots.asDiagonal()),
                        precision * (roots.asDiagonal() * modes.middleRows(first, modes_)));
  }
  const Eigen::MatrixXd correlated =
      all - left(precision * tau * tau * (field_information * field.modes.transpose()),
                 precision * tau * (field.modes * modes));
  const double ratio = correlated.determinant() / independent.determinant();
  if (!(ratio > 0)) return std::numeric_limits<double>::quiet_NaN();
  return keyframes_ * std::min(1.0, std::pow(ratio, 1 / static_cast<double>(rates.cols())));
}

Misfit DiscrepancyModel::describe(const Eigen::VectorXd& residuals, const Eigen::MatrixXd& rates) const {
  const Reduced reduced = reduce(residuals);
  Misfit misfit;
  misfit.noise = noise_;
  misfit.explained = explained_;
  misfit.keyframes = keyframes_;
  std::vector<double> logs;
  double least = std::numeric_limits<double>::infinity(), without = least;
  for (std::size_t f = 0; f < fields_.size(); ++f) {
    const auto at = [&](double tau) {
      return diagonal_deviance(reduced.squares[0], fields_[f].gains, reduced.coordinates[f].col(0), tau);
    };
    without = std::min(without, at(explained_));
    for (const double tau : sizes_) {
      const double deviance = at(tau);
      logs.push_back(-0.5 * deviance);
      least = std::min(least, deviance);
    }
  }
  misfit.gain = std::max(0.0, without - least);
  misfit.found = misfit.gain > kOnceInTwenty;
  double total = 0;
  const auto most = std::max_element(logs.begin(), logs.end());
  for (std::size_t f = 0, i = 0; f < fields_.size(); ++f)
    for (std::size_t s = 0; s < sizes_.size(); ++s, ++i) {
      const double weight = priors_[s] * std::exp(logs[i] - *most);
      total += weight;
      misfit.size += weight * sizes_[s];
      misfit.reach_time += weight * fields_[f].shape.reach_time;
      misfit.reach_sheet += weight * fields_[f].shape.reach_sheet;
    }
  misfit.size /= total;
  misfit.reach_time /= total;
  misfit.reach_sheet /= total;
  const auto likeliest = static_cast<std::size_t>(most - logs.begin());
  misfit.worth = rates.cols() == 0
                     ? keyframes_
                     : worth(fields_[likeliest / sizes_.size()], sizes_[likeliest % sizes_.size()], rates);
  return misfit;
}

}  // namespace flash::sysid
