#include "sysid/infer/discrepancy.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <utility>

#include "data/chi_square.h"
#include "data/parallel.h"
#include "sysid/infer/discrepancy_prior.h"
#include "sysid/infer/local_noise.h"

namespace flash::sysid {
namespace {

constexpr double kTimes[] = {0.125, 0.25, 0.5, 1};   // reaches over the duration
constexpr double kSheets[] = {0.125, 0.25, 0.5, 1};  // over the longest side of the sheet
constexpr Eigen::Index kCoordinates = 160;           // of a field, at most
constexpr double kLeast = 1e-5;                      // variance of a coordinate over the largest
constexpr int kSizes = 20;                           // values of tau, to that of the residuals
constexpr double kFirstSize = 0.03;                  // over sigma
constexpr double kLeastFreedom = 0.1;                // of the rows
constexpr int kFew = 12;        // rows of one keyframe and channel that are too few to tell noise from misfit
constexpr double kVague = 100;  // of what is not known, over the residuals
// Chi-square with 3 degrees of freedom: a size and two reaches.
constexpr double kOnceInTwenty = data::chi_square_95_of_3;
constexpr std::size_t kDraws = 32;  // of size and reaches

/// Row of (keyframe, channel) blocks, `modes` long each.
Eigen::Index block(int keyframe, int channel, int channels, int modes) {
  return (static_cast<Eigen::Index>(keyframe) * channels + channel) * modes;
}

/// The most rows that one keyframe has of one channel.
int most_rows_together(const ObservedRows& rows) {
  std::map<std::pair<int, int>, int> counts;
  int most = 0;
  for (std::size_t i = 0; i < rows.keyframe.size(); ++i)
    most = std::max(most, ++counts[{rows.keyframe[i], rows.channel[i]}]);
  return most;
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
                                   std::optional<double> repeatability, int threads)
    : rows_(std::move(rows)), keyframes_(static_cast<int>(rows_.times.size())) {
  for (Eigen::MatrixXd* columns : {&rows_.known, &rows_.free, &rows_.rates})
    if (columns->rows() == 0) columns->resize(residuals.size(), 0);
  known_.resize(residuals.size(), rows_.known.cols() + rows_.free.cols() + rows_.rates.cols());
  known_ << rows_.known, rows_.free, rows_.rates;
  for (Eigen::Index c = rows_.known.cols(); c < known_.cols(); ++c)
    if (const double norm = known_.col(c).norm(); norm > 0) known_.col(c) *= kVague * residuals.norm() / norm;
  channels_ = 1 + *std::max_element(rows_.channel.begin(), rows_.channel.end());
  duration_ = std::max(rows_.times.back() - rows_.times.front(), 1e-9);
  along_ = sheet_modes(rows_.places);
  modes_ = static_cast<int>(along_.wave_numbers.size());

  const Eigen::Index stacked = block(keyframes_, 0, channels_, modes_);
  modes_modes_ = Eigen::MatrixXd::Zero(modes_, stacked);
  for (Eigen::Index i = 0; i < residuals.size(); ++i) {
    const auto at = static_cast<std::size_t>(i);
    modes_modes_.middleCols(block(rows_.keyframe[at], rows_.channel[at], channels_, modes_), modes_) +=
        rows_.weights[i] * along_.values.row(i).transpose() * along_.values.row(i);
  }
  modes_known_ = sums(known_).modes;
  estimate_noise(residuals);
  const double between = noise_is_told_ ? noise_between_neighbours(rows_, residuals) : 0;
  misfit_.noise = between > 0 ? std::clamp(between, 1e-9, noise_) : noise_;
  if (repeatability)
    explained_ = std::sqrt(
        std::max(0.0, M_PI / 4 * *repeatability * *repeatability - 0.5 * misfit_.noise * misfit_.noise));
  const std::vector<Shape> all = shapes();
  fields_.resize(all.size());
  data::for_each_in_parallel(all.size(), threads, [&](std::size_t f) { fields_[f] = field(all[f]); });
  sizes_ = {explained_};
  priors_ = {0};
  const double first = kFirstSize * noise_, last = std::max(left_, 2 * first);
  double sum = 0;
  for (int i = 0; i < kSizes; ++i) {
    const double beyond = first * std::pow(last / first, static_cast<double>(i) / (kSizes - 1));
    sizes_.push_back(std::hypot(explained_, beyond));
    priors_.push_back(beyond * std::exp(-beyond / (usual_discrepancy * noise_)));  // d tau = tau d log tau
    sum += priors_.back();
  }
  for (double& prior : priors_) prior /= 2 * sum;
  priors_.front() = 0.5;
  weigh(residuals);
}

std::vector<DiscrepancyModel::Shape> DiscrepancyModel::shapes() const {
  std::vector<Shape> shapes;
  for (const double time : kTimes)
    for (const double sheet : kSheets) shapes.push_back({time * duration_, sheet * along_.length});
  return shapes;
}

Eigen::MatrixXd DiscrepancyModel::in_time(const Shape& shape) const {
  Eigen::MatrixXd kernel(keyframes_, keyframes_);
  for (int k = 0; k < keyframes_; ++k)
    for (int l = 0; l < keyframes_; ++l)
      kernel(k, l) = correlation_in_time(
          std::abs(rows_.times[static_cast<std::size_t>(k)] - rows_.times[static_cast<std::size_t>(l)]) /
          shape.reach_time);
  return kernel;
}

Eigen::MatrixXd DiscrepancyModel::scaled_modes(const Shape& shape) const {
  return along_.values * variances_along(along_, shape.reach_sheet).cwiseSqrt().asDiagonal();
}

Eigen::MatrixXd DiscrepancyModel::covariance(std::size_t shape) const {
  const Shape reach = shapes()[shape];
  const Eigen::MatrixXd modes = scaled_modes(reach);
  Eigen::MatrixXd covariance = modes * modes.transpose();
  for (Eigen::Index i = 0; i < covariance.rows(); ++i)
    for (Eigen::Index j = 0; j < covariance.cols(); ++j) {
      const auto a = static_cast<std::size_t>(i), b = static_cast<std::size_t>(j);
      const double apart = rows_.times[static_cast<std::size_t>(rows_.keyframe[a])] -
                           rows_.times[static_cast<std::size_t>(rows_.keyframe[b])];
      covariance(i, j) *= rows_.channel[a] == rows_.channel[b]
                              ? correlation_in_time(std::abs(apart) / reach.reach_time)
                              : 0.0;
    }
  return covariance;
}

DiscrepancyModel::Sums DiscrepancyModel::sums(const Eigen::MatrixXd& residuals) const {
  Sums sums;
  sums.modes = Eigen::MatrixXd::Zero(block(keyframes_, 0, channels_, modes_), residuals.cols());
  for (Eigen::Index i = 0; i < residuals.rows(); ++i) {
    const auto at = static_cast<std::size_t>(i);
    sums.modes.middleRows(block(rows_.keyframe[at], rows_.channel[at], channels_, modes_), modes_)
        .noalias() += rows_.weights[i] * along_.values.row(i).transpose() * residuals.row(i);
  }
  sums.known = known_.transpose() * rows_.weights.asDiagonal() * residuals;
  sums.squares = (rows_.weights.asDiagonal() * residuals).cwiseProduct(residuals).colwise().sum().transpose();
  return sums;
}

DiscrepancyModel::Field DiscrepancyModel::field(const Shape& shape) const {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> times(in_time(shape));
  const Eigen::VectorXd sheet = variances_along(along_, shape.reach_sheet);

  // The coordinates of largest variance; each is one mode in time times one along the sheet.
  struct Coordinate {
    Eigen::Index time, mode;
    double variance;
  };
  std::vector<Coordinate> chosen;
  for (Eigen::Index i = 0; i < keyframes_; ++i)
    for (Eigen::Index j = 0; j < modes_; ++j)
      chosen.push_back({i, j, std::max(0.0, times.eigenvalues()[i]) * sheet[j]});
  std::stable_sort(chosen.begin(), chosen.end(),
                   [](const Coordinate& a, const Coordinate& b) { return a.variance > b.variance; });
  const double least = kLeast * chosen.front().variance;
  const auto enough = std::find_if(chosen.begin(), chosen.end(),
                                   [&](const Coordinate& coordinate) { return coordinate.variance < least; });
  chosen.resize(std::min<std::size_t>(static_cast<std::size_t>(enough - chosen.begin()),
                                      static_cast<std::size_t>(kCoordinates / channels_)));

  // Coordinate c acts on the one mode of each keyframe that it is made of, by shares(k, c).
  const auto per_channel = static_cast<Eigen::Index>(chosen.size()), all = per_channel * channels_;
  std::vector<Eigen::Index> mode_of;
  Eigen::MatrixXd shares(keyframes_, per_channel);
  for (const Coordinate& at : chosen) {
    shares.col(static_cast<Eigen::Index>(mode_of.size())) =
        std::sqrt(at.variance) * times.eigenvectors().col(at.time);
    mode_of.push_back(at.mode);
  }
  // Information of the coordinates, in units of 1 / sigma^2; what errors of known shape explain taken out.
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(all, all), to_known(all, known_.cols());
  for (int channel = 0; channel < channels_; ++channel) {
    const Eigen::Index first = channel * per_channel;
    auto own = information.block(first, first, per_channel, per_channel);
    to_known.middleRows(first, per_channel).setZero();
    for (int k = 0; k < keyframes_; ++k) {
      const Eigen::Index at = block(k, channel, channels_, modes_);
      const Eigen::MatrixXd of_keyframe = modes_modes_.middleCols(at, modes_)(mode_of, mode_of);
      const auto share = shares.row(k).transpose();
      own += (share * share.transpose()).cwiseProduct(of_keyframe);
      to_known.middleRows(first, per_channel) +=
          share.asDiagonal() * modes_known_.middleRows(at, modes_)(mode_of, Eigen::all);
    }
  }
  const double precision = 1 / (noise_ * noise_);
  information -= to_known * inverse_known_ * to_known.transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(precision * information);
  const Eigen::MatrixXd turned = eigen.eigenvectors().transpose();
  Field field{shape,
              Eigen::MatrixXd::Zero(all, block(keyframes_, 0, channels_, modes_)),
              {},
              eigen.eigenvalues().cwiseMax(0.0)};
  for (int channel = 0; channel < channels_; ++channel)
    for (int k = 0; k < keyframes_; ++k)
      for (Eigen::Index c = 0; c < per_channel; ++c)
        field.modes.col(block(k, channel, channels_, modes_) + mode_of[static_cast<std::size_t>(c)]) +=
            shares(k, c) * turned.col(channel * per_channel + c);
  field.known = -precision * (turned * to_known * inverse_known_);
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
/// is all but free (Fellner 1986). Where that leaves no row, as of a few markers, nothing tells noise
/// from discrepancy: of what the errors of known shape leave, half of the variance counts as each.
void DiscrepancyModel::estimate_noise(const Eigen::VectorXd& residuals) {
  const double rows = rows_.weights.sum();
  const double all = std::sqrt(residuals.cwiseAbs2().dot(rows_.weights) / rows);
  noise_ = std::max(all, 1e-9);
  const Shape flexible{kTimes[0] * duration_, kSheets[0] * along_.length};
  const double variance = 100 * noise_ * noise_;
  for (int round = 0; round < 8; ++round) {
    const Eigen::Index count = known_.cols();
    const Eigen::MatrixXd known = known_.transpose() * rows_.weights.asDiagonal() * known_;
    inverse_known_ = (known + noise_ * noise_ * Eigen::MatrixXd::Identity(count, count))
                         .ldlt()
                         .solve(Eigen::MatrixXd::Identity(count, count));
    if (round == 0) {
      const Eigen::VectorXd left =
          residuals -
          known_ * (inverse_known_ * (known_.transpose() * (rows_.weights.asDiagonal() * residuals)));
      left_ = std::sqrt(left.cwiseAbs2().dot(rows_.weights) / rows);
    }
    fields_ = {field(flexible)};
    const Reduced reduced = reduce(residuals);
    const Eigen::ArrayXd gains = fields_[0].gains.array(), x = reduced.coordinates[0].col(0).array();
    const Eigen::ArrayXd fitted = variance * x / (1 + variance * gains);
    const double left = reduced.squares[0] - 2 * (fitted * x).sum() + (fitted * fitted * gains).sum();
    const double freedom =
        rows - (variance * gains / (1 + variance * gains)).sum() - static_cast<double>(count);
    if (round == 0 && freedom < 1 && most_rows_together(rows_) <= kFew) {
      const double of_known = (inverse_known_ * known).trace();
      noise_ = std::max(left_ * std::sqrt(0.5 * rows / std::max(rows - of_known, 1.0)), 1e-9);
      noise_is_told_ = false;
      break;
    }
    const double before = noise_;
    noise_ =
        std::max(noise_ * std::sqrt(std::max(left, 0.0) / std::max(freedom, kLeastFreedom * rows)), 1e-9);
    if (std::abs(noise_ - before) < 1e-3 * before) break;
  }
  fields_.clear();
}

double DiscrepancyModel::deviance_at(const Eigen::VectorXd& residuals, std::size_t shape, double tau) const {
  const Reduced reduced = reduce(residuals);
  return diagonal_deviance(reduced.squares[0], fields_[shape].gains, reduced.coordinates[shape].col(0), tau);
}

void DiscrepancyModel::weigh(const Eigen::VectorXd& residuals) {
  const Reduced reduced = reduce(residuals);
  misfit_.rough = noise_;
  misfit_.explained = explained_;
  misfit_.keyframes = keyframes_;
  if (!noise_is_told_) {
    // As long as the recording, so that keyframes alike do not count as many, and short along the sheet.
    const std::size_t longest = (std::size(kTimes) - 1) * std::size(kSheets);
    const Eigen::VectorXd at_rows =
        along_.values.cwiseAbs2() * variances_along(along_, fields_[longest].shape.reach_sheet);
    variances_.assign(fields_.size(), 0);
    variances_[longest] = noise_ * noise_ / at_rows.mean();
    misfit_.size = misfit_.rms = noise_;
    misfit_.reach_time = fields_[longest].shape.reach_time;
    misfit_.reach_sheet = fields_[longest].shape.reach_sheet;
    misfit_.draws = {{misfit_.size, misfit_.reach_time, misfit_.reach_sheet}};
    return;
  }
  std::vector<double> deviances;
  double least = std::numeric_limits<double>::infinity(), without = least;
  for (std::size_t f = 0; f < fields_.size(); ++f) {
    const auto at = [&](double tau) {
      return diagonal_deviance(reduced.squares[0], fields_[f].gains, reduced.coordinates[f].col(0), tau);
    };
    without = std::min(without, at(explained_));
    for (const double tau : sizes_) {
      deviances.push_back(at(tau));
      least = std::min(least, deviances.back());
    }
  }
  misfit_.gain = std::max(0.0, without - least);
  misfit_.found = misfit_.gain > kOnceInTwenty;
  variances_.assign(fields_.size(), 0);
  double total = 0, squares = 0;
  std::vector<double> weights;  // in order of fields, then sizes
  for (std::size_t f = 0, i = 0; f < fields_.size(); ++f)
    for (std::size_t s = 0; s < sizes_.size(); ++s, ++i) {
      const double weight = priors_[s] * std::exp(-0.5 * (deviances[i] - least)),
                   square = std::max(weight * sizes_[s] * sizes_[s], std::numeric_limits<double>::min());
      weights.push_back(weight);
      total += weight;
      squares += square;
      variances_[f] += square;
      misfit_.size += weight * sizes_[s];
      misfit_.reach_time += square * fields_[f].shape.reach_time;
      misfit_.reach_sheet += square * fields_[f].shape.reach_sheet;
    }
  for (double& variance : variances_) variance /= total;
  misfit_.size /= total;
  misfit_.rms = std::sqrt(squares / total);
  misfit_.reach_time /= squares;
  misfit_.reach_sheet /= squares;
  // Systematic resampling (Kitagawa 1996).
  double below = 0;
  std::size_t at = 0;
  for (std::size_t draw = 0; draw < kDraws; ++draw) {
    const double share = (static_cast<double>(draw) + 0.5) / kDraws * total;
    while (at + 1 < weights.size() && below + weights[at] < share) below += weights[at++];
    const Shape& shape = fields_[at / sizes_.size()].shape;
    misfit_.draws.push_back({sizes_[at % sizes_.size()], shape.reach_time, shape.reach_sheet});
  }
}

Eigen::MatrixXd DiscrepancyModel::covariance_of(const Eigen::MatrixXd& combinations, bool independent) const {
  const Eigen::VectorXd spreads =
      rows_.weights.unaryExpr([](double weight) { return weight > 0 ? 1 / weight : 0.0; });
  const Eigen::MatrixXd known = combinations.transpose() * rows_.known;
  Eigen::MatrixXd covariance =
      noise_ * noise_ * combinations.transpose() * spreads.asDiagonal() * combinations +
      known * known.transpose();
  // Of each keyframe and channel, how much of each mode the combinations have.
  Eigen::MatrixXd modes = Eigen::MatrixXd::Zero(block(keyframes_, 0, channels_, modes_), combinations.cols());
  for (Eigen::Index i = 0; i < combinations.rows(); ++i) {
    const auto at = static_cast<std::size_t>(i);
    modes.middleRows(block(rows_.keyframe[at], rows_.channel[at], channels_, modes_), modes_).noalias() +=
        along_.values.row(i).transpose() * combinations.row(i);
  }
  for (std::size_t f = 0; f < fields_.size(); ++f) {
    const Eigen::VectorXd sheet = variances_[f] * variances_along(along_, fields_[f].shape.reach_sheet);
    const Eigen::MatrixXd times = in_time(fields_[f].shape);
    for (int channel = 0; channel < channels_; ++channel)
      for (int k = 0; k < keyframes_; ++k)
        for (int l = 0; l < keyframes_; ++l) {
          if (independent && k != l) continue;
          covariance.noalias() +=
              times(k, l) * modes.middleRows(block(k, channel, channels_, modes_), modes_).transpose() *
              sheet.asDiagonal() * modes.middleRows(block(l, channel, channels_, modes_), modes_);
        }
  }
  return covariance;
}

}  // namespace flash::sysid
