// Simulation-based calibration (Talts et al. 2018) of all that stands between observed points and the draws
// of a posterior: registration, errors of known shape, the likelihood, its noise, the emulator, the extents
// and the sampler.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

#include "sysid/infer/adaptive_design.h"
#include "sysid/infer/sampled_look.h"
#include "tests/sysid/moving_sheet.h"

namespace flash::sysid {
namespace {

constexpr int kCells = 6, kKeyframes = 5;
constexpr double kStep = 0.05, kBetween = 0.1, kNoise = 2e-3;  // [s], [s], [m]

std::vector<Axis> searched() {
  return {parse_axis("bending", "1e-5:1e-3:5:log"), parse_axis("friction", "0.1:0.9:5")};
}

/// From -1 to 1 over the range of an axis.
double within(const Axis& axis, double value) {
  const double low = coordinate_of(axis, axis.values.front()), high = coordinate_of(axis, axis.values.back());
  return 2 * (coordinate_of(axis, value) - low) / (high - low) - 1;
}

/// A sheet that moves by itself, by two parameters, by which it is not straight, and by a bulge of `error`
/// standard deviations.
Motion motion_at(const data::TriangleMesh& mesh, const std::vector<double>& values, double error) {
  const std::vector<Axis> axes = searched();
  const double a = within(axes[0], values[0]), b = within(axes[1], values[1]);
  const double first = a + 0.3 * b + 0.15 * a * a, second = b - 0.25 * a * b;
  Motion motion = moving_sheet_motion(mesh, kStep, 12);
  for (std::size_t i = 0; i < motion.positions.size(); ++i) {
    const double t = kStep * static_cast<double>(i);
    for (Eigen::Index v = 0; v < mesh.vertices.rows(); ++v) {
      const double x = mesh.vertices(v, 0) / 0.4, y = mesh.vertices(v, 1) / 0.3;
      const double bulge = std::exp(-10 * (std::pow(x - 0.6, 2) + std::pow(y - 0.3, 2)));
      motion.positions[i].row(v) += Eigen::RowVector3d(
          2e-3 * first * t * std::sin(5 * x), 0,
          3e-3 * (first * t * std::cos(4 * x + y) + second * (0.3 + t) * std::sin(6 * y) * x) +
              1e-3 * error * bulge);
    }
  }
  return motion;
}

/// What the emulator and the likelihood assume of a recording, and recordings that are so.
class Problem {
 public:
  Problem() : axes_(searched()) {
    data::TriangleMesh& mesh = replay_.surface;
    mesh = flat_sheet(kCells);
    replay_.queries = std::make_shared<const SheetDistance>(mesh.triangles, mesh.vertices);
    replay_.pivot = Eigen::Vector3d(0.2, 0.15, 0);
    data::NuisanceBounds& bounds = replay_.recording.nuisance;
    bounds.offset.setConstant(4e-3);
    bounds.yaw = 0.02;
    bounds.time = 0.02;
    std::vector<Motion> motions;
    for (const std::vector<double>& point : cartesian_product(axes_))
      motions.push_back(motion_at(mesh, point, 0));
    interpolant_.emplace(axes_, motions);
  }

  const std::vector<Axis>& axes() const { return axes_; }
  GridSettings grid() const {
    GridSettings grid;
    grid.axes = axes_;
    return grid;
  }

  /// Parameters, registration and error drawn from their priors, points with noise: the truth's coordinates.
  std::array<double, 2> draw(std::mt19937_64& random) {
    std::uniform_real_distribution<double> even(-1, 1);
    std::normal_distribution<double> normal;
    std::array<double, 2> truth{};
    std::vector<double> values;
    for (std::size_t k = 0; k < 2; ++k) {
      const double low = coordinate_of(axes_[k], axes_[k].values.front()),
                   high = coordinate_of(axes_[k], axes_[k].values.back());
      truth[k] = low + (high - low) * (even(random) + 1) / 2;
      values.push_back(value_of(axes_[k], truth[k]));
    }
    const data::NuisanceBounds& bounds = replay_.recording.nuisance;
    Registration registration;
    for (int k = 0; k < 3; ++k) registration.offset[k] = bounds.offset[k] * even(random);
    registration.yaw = bounds.yaw * even(random);
    registration.time_offset = bounds.time * even(random);
    registration.pivot = replay_.pivot;
    registration.up = replay_.up;
    const data::TriangleMesh& mesh = replay_.surface;
    // The emulator is what is tested with: the motion is its own, the bulge beside it.
    Motion motion = interpolant_->at(values);
    const double size = normal(random);
    const Motion bulged = motion_at(mesh, values, size), flat = motion_at(mesh, values, 0);
    for (std::size_t i = 0; i < motion.positions.size(); ++i)
      motion.positions[i] += bulged.positions[i] - flat.positions[i];
    replay_.observations.clear();
    for (int k = 0; k < kKeyframes; ++k) {
      Observation observation{.t = 0.05 + kBetween * k};
      data::Points positions;
      surface_at(motion, observation.t + registration.time_offset, positions);
      observation.points.resize(mesh.triangles.rows(), 3);
      for (Eigen::Index i = 0; i < mesh.triangles.rows(); ++i) {
        Eigen::Vector3d point = Eigen::Vector3d::Zero();
        for (int c = 0; c < 3; ++c) point += positions.row(mesh.triangles(i, c)).transpose() / 3;
        for (double& x : point) x += kNoise * normal(random);
        observation.points.row(i) = (registration.observed_from_simulated() * point).transpose();
      }
      replay_.observations.push_back(std::move(observation));
    }
    return truth;
  }

  /// Twice, as the answer of a search does: about the middle of the ranges, then about what was found.
  Look look(bool sampled = false) const {
    const Emulator emulator = this->emulator();
    const GridSettings grid = this->grid();
    const std::vector<double> middle = {axes_[0].values[2], axes_[1].values[2]};
    const auto about = [&](const Extent& extent, const std::vector<double>& at, const WeightedDraws* before) {
      if (sampled) return sampled_look(emulator, extent, at, axes_, grid, {}, {error()}, {}, before);
      return narrow(emulator, extent, at, axes_, grid, {}, {error()});
    };
    const Look first = about(extent_of(axes_), middle, nullptr);
    return about(extent_of(first.posterior.axes), first.posterior.values(),
                 first.draws ? &*first.draws : nullptr);
  }

  Emulator emulator() const { return {{{replay_, TwoMeshMotions(*interpolant_)}}, 0}; }

 private:
  KnownError error() const {
    const std::vector<double> middle = {axes_[0].values[2], axes_[1].values[2]};
    const auto one = [&](double size) {
      ReplayResult result;
      result.motion = motion_at(replay_.surface, middle, size);
      result.finite = result.converged = true;
      return std::make_shared<const Motions>(Motions{{replay_}, {result}});
    };
    return {{{-1, one(0)}, {1, one(1)}}};
  }

  std::vector<Axis> axes_;
  Replay replay_;
  std::optional<MotionInterpolant> interpolant_;
};

void expect_even_ranks(bool sampled, int problems) {
  constexpr int kBins = 10;
  Problem problem;
  std::mt19937_64 random(20);
  std::array<std::array<int, kBins>, 2> ranks{};
  for (int i = 0; i < problems; ++i) {
    const std::array<double, 2> truth = problem.draw(random);
    const Look look = problem.look(sampled);
    for (std::size_t k = 0; k < 2; ++k) {
      const auto draws = look.posterior.samples.col(static_cast<Eigen::Index>(k)).array();
      const double below = (draws < truth[k]).cast<double>().mean();
      ++ranks[k][static_cast<std::size_t>(std::min(kBins - 1.0, below * kBins))];
    }
  }
  for (const auto& counts : ranks) {
    double chi2 = 0;
    const double expected = static_cast<double>(problems) / kBins;
    for (const int count : counts) chi2 += std::pow(count - expected, 2) / expected;
    EXPECT_LT(chi2, 21.67);  // 99 % at 9 degrees of freedom
  }
}

TEST(EmulatedCalibration, RanksOfTheTruthAreEven) { expect_even_ranks(false, 200); }

TEST(SampledLook, RanksOfTheTruthAreEven) { expect_even_ranks(true, 100); }

// Each quantile by quadrature of the likelihood itself over the whole range, on a grid far finer than the
// posterior's.
void expect_quantiles_of_quadrature(bool sampled) {
  constexpr int kFine = 60;
  Problem problem;
  std::mt19937_64 random(5);
  problem.draw(random);
  const Look look = problem.look(sampled);
  std::vector<Axis> fine = problem.axes();
  for (Axis& axis : fine) {
    const double low = coordinate_of(axis, axis.values.front()),
                 high = coordinate_of(axis, axis.values.back());
    axis.values.clear();
    for (int i = 0; i < kFine; ++i) {
      const double x = low + (high - low) * (i + 0.5) / kFine;
      axis.values.push_back(axis.logarithmic ? std::exp(x) : x);
    }
  }
  const Eigen::VectorXd deviance = deviance_over(problem.emulator(), fine, look.likelihood, problem.grid());
  // A row a value of the first axis.
  Eigen::MatrixXd mass(kFine, kFine);
  for (Eigen::Index i = 0; i < deviance.size(); ++i)
    mass(i / kFine, i % kFine) = std::exp(-0.5 * (deviance[i] - deviance.minCoeff()));
  mass /= mass.sum();
  for (std::size_t k = 0; k < 2; ++k) {
    const Eigen::VectorXd marginal =
        k == 0 ? Eigen::VectorXd(mass.rowwise().sum()) : Eigen::VectorXd(mass.colwise().sum().transpose());
    const Axis& axis = problem.axes()[k];
    const double low = coordinate_of(axis, axis.values.front()),
                 high = coordinate_of(axis, axis.values.back());
    for (const double share : {0.025, 0.25, 0.5, 0.75, 0.975}) {
      const double cells = kFine * (look.posterior.quantile(k, share) - low) / (high - low);
      const auto whole = static_cast<Eigen::Index>(std::min(cells, kFine - 1.0));
      const double below =
          marginal.head(whole).sum() + (cells - static_cast<double>(whole)) * marginal[whole];
      // 12,800 draws of some 30 sweeps' memory are worth 1,600 or more.
      const double worth = look.draws ? look.draws->effective_size : 1600;
      EXPECT_NEAR(below, share, 3 * std::sqrt(share * (1 - share) / worth)) << axis.name;
    }
  }
}

TEST(EmulatedCalibration, QuantilesAreThoseOfNestedQuadrature) { expect_quantiles_of_quadrature(false); }

TEST(SampledLook, QuantilesAreThoseOfNestedQuadrature) { expect_quantiles_of_quadrature(true); }

}  // namespace
}  // namespace flash::sysid
