#include "sysid/infer/discrepancy.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <utility>

#include "data/machine/parallel.h"
#include "data/numbers/chi_square.h"
#include "sysid/infer/agreed_numbers.h"
#include "sysid/infer/discrepancy_prior.h"
#include "sysid/infer/local_noise.h"

namespace flash::sysid {
namespace {

/// Reaches over the duration, all alike likely. Chosen: not varied.
constexpr double kTimes[] = {shortest_reach, 0.25, 0.5, 1};
/// Reaches over the longest side of the sheet, all alike likely. Chosen: not varied.
constexpr double kSheets[] = {shortest_reach, 0.25, 0.5, 1};
/// Of a field, at most. Work: with the next one, the likelihood is that of the dense covariance to 1e-3
/// (tests).
constexpr Eigen::Index kCoordinates = 160;
/// Variance of a coordinate over the largest. Work: smaller ones are left out.
constexpr double kLeast = 1e-5;
constexpr int kSizes = 20;  // Values of tau, to that of the residuals. Work: points of a quadrature.
/// Over sigma: the least tau above none. Work: where the quadrature begins; less is none beside the noise.
constexpr double kFirstSize = 0.03;
/// Of the rows, over which the noise is estimated at least. Chosen: keeps few rows from a noise without end;
/// not varied.
constexpr double kLeastFreedom = 0.1;
/// Rows of one keyframe and channel that are too few to tell noise from misfit. Chosen: for the markers of a
/// silicone beam, where both came out as none; not varied.
constexpr int kFew = 12;
/// Of what has no prior, over the residuals. Theory: stands for infinity in a restricted likelihood.
constexpr double kVague = 100;
/// Fall of -2 log likelihood from which a discrepancy is found. Theory: chi-square with 3 degrees of freedom,
/// a size and two reaches, once in twenty.
constexpr double kOnceInTwenty = data::chi_square_95_of_3;
constexpr std::size_t kDraws = 32;  // Of size and reaches. Work: draws for predictions.

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

/// Of the matrix that was factored: the sum of squares of L^-1, whose columns are zero above the diagonal.
double trace_of_inverse(const Eigen::LLT<Eigen::MatrixXd>& factor) {
  constexpr Eigen::Index kColumns = 32;  // At a time. Work.
  const Eigen::MatrixXd& packed = factor.matrixLLT();
  double sum = 0;
  for (Eigen::Index left = packed.rows(); left > 0; left -= kColumns) {
    Eigen::MatrixXd columns = Eigen::MatrixXd::Identity(left, std::min(left, kColumns));
    packed.bottomRightCorner(left, left).triangularView<Eigen::Lower>().solveInPlace(columns);
    sum += columns.squaredNorm();
  }
  return sum;
}

/// log |I + v T| - v x^T (I + v T)^-1 x for a tridiagonal T without negative eigenvalues.
double tridiagonal_deviance(const Eigen::VectorXd& diagonal, const Eigen::VectorXd& beside,
                            const Eigen::VectorXd& x, double v) {
  double logarithm = 0, squares = 0, pivot = 1, last = 0;
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    const double off = i > 0 ? v * beside[i - 1] : 0;
    last = x[i] - off / pivot * last;
    pivot = std::max(1 + v * diagonal[i] - off * off / pivot, 1.0);  // rounding alone takes it below
    logarithm += std::log(pivot);
    squares += last * last / pivot;
  }
  return logarithm - v * squares;
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

  rows_of_.resize(static_cast<std::size_t>(keyframes_ * channels_));
  for (std::size_t i = 0; i < rows_.keyframe.size(); ++i)
    rows_of_[static_cast<std::size_t>(rows_.keyframe[i] * channels_ + rows_.channel[i])].push_back(
        static_cast<Eigen::Index>(i));
  modes_modes_.assign(static_cast<std::size_t>(channels_), Eigen::MatrixXd(keyframes_, modes_ * modes_));
  data::for_each_in_parallel(rows_of_.size(), threads, [&](std::size_t b) {
    const Eigen::MatrixXd modes = along_.values(rows_of_[b], Eigen::all),
                          squares = modes.transpose() * rows_.weights(rows_of_[b]).asDiagonal() * modes;
    modes_modes_[b % modes_modes_.size()].row(static_cast<Eigen::Index>(b / modes_modes_.size())) =
        squares.reshaped().transpose();
  });
  Sums of_known = sums(known_, threads);
  modes_known_ = std::move(of_known.modes);
  known_known_ = std::move(of_known.known);
  estimate_noise(residuals);
  const double between = noise_is_told_ ? noise_between_neighbours(rows_, residuals, threads) : 0;
  misfit_.rough = noise_;
  misfit_.keyframes = keyframes_;
  misfit_.noise = between > 0 ? std::clamp(between, 1e-9, noise_) : noise_;
  if (repeatability)
    explained_ = std::sqrt(
        std::max(0.0, M_PI / 4 * *repeatability * *repeatability - 0.5 * misfit_.noise * misfit_.noise));
  sizes_ = {explained_};
  priors_ = {0};
  misfit_.explained = explained_;
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
  if (noise_is_told_)
    weigh(residuals, threads);
  else
    assume();
  between_keyframes_ = between_keyframes();
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

Eigen::MatrixXd DiscrepancyModel::by_modes(const Eigen::MatrixXd& columns, int threads) const {
  Eigen::MatrixXd sums(block(keyframes_, 0, channels_, modes_), columns.cols());
  data::for_each_in_parallel(rows_of_.size(), threads, [&](std::size_t b) {
    sums.middleRows(static_cast<Eigen::Index>(b) * modes_, modes_) =
        Eigen::MatrixXd(along_.values(rows_of_[b], Eigen::all)).transpose() *
        Eigen::MatrixXd(columns(rows_of_[b], Eigen::all));
  });
  return sums;
}

DiscrepancyModel::Sums DiscrepancyModel::sums(const Eigen::MatrixXd& residuals, int threads) const {
  const Eigen::MatrixXd weighed = rows_.weights.asDiagonal() * residuals;
  return {by_modes(weighed, threads), known_.transpose() * weighed,
          weighed.cwiseProduct(residuals).colwise().sum().transpose()};
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

  const auto per_channel = static_cast<Eigen::Index>(chosen.size()), all = per_channel * channels_;
  Field field{{},
              Eigen::MatrixXd(keyframes_, per_channel),
              Eigen::MatrixXd::Zero(all, all),
              Eigen::MatrixXd(all, known_.cols())};
  for (const Coordinate& at : chosen) {
    field.shares.col(static_cast<Eigen::Index>(field.modes.size())) =
        std::sqrt(at.variance) * times.eigenvectors().col(at.time);
    field.modes.push_back(at.mode);
  }
  Eigen::MatrixXd with_modes;
  for (int channel = 0; channel < channels_; ++channel)
    for (Eigen::Index c = 0; c < per_channel; ++c) {
      const Eigen::Index mode = field.modes[static_cast<std::size_t>(c)], first = channel * per_channel;
      const auto share = field.shares.col(c);
      with_modes = share.asDiagonal() *
                   modes_modes_[static_cast<std::size_t>(channel)].middleCols(mode * modes_, modes_);
      for (Eigen::Index d = c; d < per_channel; ++d)
        field.squares(first + d, first + c) =
            field.shares.col(d).dot(with_modes.col(field.modes[static_cast<std::size_t>(d)]));
      const Eigen::MatrixXd mode_known = modes_known_(of_mode(channel, mode), Eigen::all);
      field.known.row(first + c) = share.transpose() * mode_known;
    }
  return field;
}

double DiscrepancyModel::squares_of(const Sums& sums) const {
  return (sums.squares[0] - sums.known.col(0).dot(inverse_known_ * sums.known.col(0))) / (noise_ * noise_);
}

Eigen::VectorXd DiscrepancyModel::products_with(const Field& field, const Sums& sums) const {
  Eigen::VectorXd products = -(field.known * (inverse_known_ * sums.known.col(0)));
  for (int channel = 0; channel < channels_; ++channel)
    for (Eigen::Index c = 0; c < field.shares.cols(); ++c)
      products[channel * field.shares.cols() + c] += field.shares.col(c).dot(
          sums.modes.col(0)(of_mode(channel, field.modes[static_cast<std::size_t>(c)])));
  return products / (noise_ * noise_);
}

Eigen::MatrixXd DiscrepancyModel::information_of(const Field& field) const {
  Eigen::MatrixXd information = field.squares;
  information.noalias() -= field.known * inverse_known_ * field.known.transpose();
  return information / (noise_ * noise_);
}

std::vector<double> DiscrepancyModel::deviances(const Shape& shape, const Sums& sums,
                                                const std::vector<double>& sizes) const {
  const Field field = this->field(shape);
  // Turned so that the information is tridiagonal: then each size costs as many operations as coordinates.
  const Eigen::Tridiagonalization<Eigen::MatrixXd> turned(information_of(field));
  const Eigen::VectorXd diagonal = turned.diagonal(), beside = turned.subDiagonal(),
                        products = turned.matrixQ().adjoint() * products_with(field, sums);
  const double squares = squares_of(sums);
  std::vector<double> all;
  for (const double tau : sizes)
    all.push_back(squares + tridiagonal_deviance(diagonal, beside, products, tau * tau));
  return all;
}

/// The fixed point of sigma^2 = squares of what is left / (rows - what was fitted), under a discrepancy that
/// is all but free (Fellner 1986). Where that leaves no row, as of a few markers, nothing tells noise
/// from discrepancy: of what the errors of known shape leave, half of the variance counts as each.
void DiscrepancyModel::estimate_noise(const Eigen::VectorXd& residuals) {
  const double rows = rows_.weights.sum();
  const double all = std::sqrt(residuals.cwiseAbs2().dot(rows_.weights) / rows);
  noise_ = std::max(all, 1e-9);
  const Field flexible = field({kTimes[0] * duration_, kSheets[0] * along_.length});
  const Sums sums = this->sums(residuals);
  const double variance = 100 * noise_ * noise_;
  const auto count = static_cast<double>(known_.cols()),
             coordinates = static_cast<double>(flexible.squares.cols());
  for (int round = 0; round < 8; ++round) {
    Eigen::MatrixXd normal = known_known_;
    normal.diagonal().array() += noise_ * noise_;
    inverse_known_ = normal.ldlt().solve(Eigen::MatrixXd::Identity(normal.rows(), normal.cols()));
    if (round == 0) {
      const Eigen::VectorXd left = residuals - known_ * (inverse_known_ * sums.known);
      left_ = std::sqrt(left.cwiseAbs2().dot(rows_.weights) / rows);
    }
    // With V the variance of the coordinates, G their information and B = 1 + V G, V B^-1 x is fitted.
    Eigen::MatrixXd matrix = variance * information_of(flexible);
    matrix.diagonal().array() += 1;
    const Eigen::LLT<Eigen::MatrixXd> factor(matrix);
    const Eigen::VectorXd x = products_with(flexible, sums), fitted = variance * factor.solve(x);
    const double left = squares_of(sums) - fitted.dot(x) - fitted.squaredNorm() / variance;
    const double freedom = rows - (coordinates - trace_of_inverse(factor)) - count;
    if (round == 0 && freedom < 1 && most_rows_together(rows_) <= kFew) {
      const double of_known = (inverse_known_ * known_known_).trace();
      noise_ = std::max(left_ * std::sqrt(0.5 * rows / std::max(rows - of_known, 1.0)), 1e-9);
      noise_is_told_ = false;
      break;
    }
    const double before = noise_;
    noise_ =
        std::max(noise_ * std::sqrt(std::max(left, 0.0) / std::max(freedom, kLeastFreedom * rows)), 1e-9);
    if (std::abs(noise_ - before) < 1e-3 * before) break;
  }
}

double DiscrepancyModel::deviance_at(const Eigen::VectorXd& residuals, std::size_t shape, double tau) const {
  return deviances(shapes()[shape], sums(residuals), {tau}).front();
}

void DiscrepancyModel::assume() {
  // As long as the recording, so that keyframes alike do not count as many, and short along the sheet.
  const std::size_t longest = (std::size(kTimes) - 1) * std::size(kSheets);
  const std::vector<Shape> all = shapes();
  const Eigen::VectorXd at_rows =
      along_.values.cwiseAbs2() * variances_along(along_, all[longest].reach_sheet);
  variances_.assign(all.size(), 0);
  variances_[longest] = noise_ * noise_ / at_rows.mean();
  misfit_.size = misfit_.rms = noise_;
  misfit_.reach_time = all[longest].reach_time;
  misfit_.reach_sheet = all[longest].reach_sheet;
  misfit_.draws = {{misfit_.size, misfit_.reach_time, misfit_.reach_sheet}};
}

void DiscrepancyModel::weigh(const Eigen::VectorXd& residuals, int threads) {
  const std::vector<Shape> all = shapes();
  const Sums sums = this->sums(residuals);
  std::vector<std::vector<double>> of_shapes(all.size());  // at each size
  data::for_each_in_parallel(all.size(), threads,
                             [&](std::size_t f) { of_shapes[f] = deviances(all[f], sums, sizes_); });
  double least = std::numeric_limits<double>::infinity(), without = least;
  for (const std::vector<double>& of_sizes : of_shapes) {
    without = std::min(without, of_sizes.front());
    least = std::min(least, *std::min_element(of_sizes.begin(), of_sizes.end()));
  }
  misfit_.gain = std::max(0.0, without - least);
  misfit_.found = misfit_.gain > kOnceInTwenty;
  variances_.assign(all.size(), 0);
  double total = 0, squares = 0;
  std::vector<double> weights;  // in order of shapes, then sizes
  for (std::size_t f = 0; f < all.size(); ++f)
    for (std::size_t s = 0; s < sizes_.size(); ++s) {
      const double weight = priors_[s] * std::exp(-0.5 * (of_shapes[f][s] - least)),
                   square = std::max(weight * sizes_[s] * sizes_[s], std::numeric_limits<double>::min());
      weights.push_back(weight);
      total += weight;
      squares += square;
      variances_[f] += square;
      misfit_.size += weight * sizes_[s];
      misfit_.reach_time += square * all[f].reach_time;
      misfit_.reach_sheet += square * all[f].reach_sheet;
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
    const Shape& shape = all[at / sizes_.size()];
    misfit_.draws.push_back({sizes_[at % sizes_.size()], shape.reach_time, shape.reach_sheet});
  }
}

std::vector<Eigen::MatrixXd> DiscrepancyModel::between_keyframes() const {
  std::vector<Eigen::MatrixXd> between(static_cast<std::size_t>(modes_),
                                       Eigen::MatrixXd::Zero(keyframes_, keyframes_));
  const std::vector<Shape> all = shapes();
  for (std::size_t f = 0; f < all.size(); ++f) {
    if (variances_[f] == 0) continue;
    const Eigen::VectorXd sheet = variances_[f] * variances_along(along_, all[f].reach_sheet);
    const Eigen::MatrixXd times = in_time(all[f]);
    for (std::size_t mode = 0; mode < between.size(); ++mode)
      between[mode] += sheet[static_cast<Eigen::Index>(mode)] * times;
  }
  return between;
}

Eigen::MatrixXd DiscrepancyModel::covariance_of(const Eigen::MatrixXd& combinations, bool independent) const {
  const Eigen::VectorXd spreads =
      rows_.weights.unaryExpr([](double weight) { return weight > 0 ? 1 / weight : 0.0; });
  const Eigen::MatrixXd known = combinations.transpose() * rows_.known;
  Eigen::MatrixXd covariance =
      noise_ * noise_ * combinations.transpose() * spreads.asDiagonal() * combinations +
      known * known.transpose();
  const Eigen::MatrixXd by_modes = this->by_modes(combinations);
  for (int channel = 0; channel < channels_; ++channel)
    for (int mode = 0; mode < modes_; ++mode) {
      const Eigen::MatrixXd at_keyframes = by_modes(of_mode(channel, mode), Eigen::all);
      const Eigen::MatrixXd& between = between_keyframes_[static_cast<std::size_t>(mode)];
      if (independent)
        covariance.noalias() += at_keyframes.transpose() * between.diagonal().asDiagonal() * at_keyframes;
      else
        covariance.noalias() += at_keyframes.transpose() * between * at_keyframes;
    }
  return covariance;
}

}  // namespace flash::sysid
