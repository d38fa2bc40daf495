#include "sysid/infer/profile.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "sysid/emulate/score_interpolant.h"

namespace flash::sysid {
namespace {

constexpr double kFloor = 0.005;  // m

/// Squared score of keyframe k at given coordinates.
using KeyframeScoreAt = std::function<double(std::size_t, const std::vector<double>&)>;

GridResults grid_of(const std::vector<Axis>& axes, std::size_t keyframes, const KeyframeScoreAt& score,
                    std::size_t recordings = 1) {
  GridResults results{axes, std::vector<std::string>(recordings, "lift"), {}};
  for (const std::vector<double>& values : cartesian_product(axes)) {
    CandidateResult result;
    result.id = static_cast<int>(results.candidates.size());
    result.values = std::vector<double>(values);  // assigning it makes GCC 12 warn of a null pointer
    result.converged = true;
    result.recordings.resize(recordings);
    std::vector<double> x = values;
    for (std::size_t i = 0; i < axes.size(); ++i)
      if (axes[i].logarithmic) x[i] = std::log(values[i]);
    for (std::size_t k = 0; k < keyframes; ++k) {
      RecordingScore& recording = result.recordings[k * recordings / keyframes];
      recording.keyframes.push_back({static_cast<double>(k), score(k, x), 100, 1});
    }
    for (RecordingScore& recording : result.recordings) {
      for (const KeyframeScore& keyframe : recording.keyframes)
        recording.score += keyframe.score / static_cast<double>(recording.keyframes.size());
      recording.keyframes.push_back({99, 0, 100, 0});  // no weight: not a sample
      result.score += recording.score / static_cast<double>(recordings);
    }
    results.candidates.push_back(result);
  }
  return results;
}

/// What each keyframe alone would answer: scattered about a common mean.
std::vector<double> scattered(std::size_t count, double mean, double spread, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(mean, spread);
  std::vector<double> values(count);
  for (double& value : values) value = normal(random);
  return values;
}

double mean_of(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

double standard_error(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += std::pow(value - mean_of(values), 2);
  const auto count = static_cast<double>(values.size());
  return std::sqrt(sum / (count - 1) / count);
}

TEST(Profile, IntervalIsStudentsForTheMeanOfWhatEachKeyframeWouldAnswer) {
  // With equal parabolas 4 D^2 / var(D) is ((x - mean) / standard error)^2 without approximation.
  const std::vector<double> own = scattered(20, std::log(1.2e-4), 0.3, 1);
  const auto score = [&](std::size_t k, const std::vector<double>& x) {
    return kFloor + 1e-3 * std::pow(x[0] - own[k], 2);
  };
  // 2.093: 97.5 % of Student's t at 19 degrees of freedom (tabulated).
  const double half = 2.093 * standard_error(own);
  for (const char* values : {"1e-5:1e-3:41:log", "1e-5:1e-3:9:log", "1.2e-5:0.9e-3:8:log"}) {
    const GridVerdict verdict = profile_grid(grid_of({parse_axis("bending", values)}, 20, score));
    EXPECT_EQ(verdict.keyframes, 20);
    EXPECT_EQ(verdict.sigma_source, "residual");
    const ParameterFinding& finding = verdict.parameters[0];
    EXPECT_EQ(finding.identifiable, Identifiable::yes);
    // A square of a parabola between values 0.6 apart: cubic splines leave a few per cent of the interval.
    EXPECT_NEAR(std::log(*finding.estimate), mean_of(own), 0.03 * half) << values;
    EXPECT_NEAR(std::log((*finding.interval95)[0]), mean_of(own) - half, 0.05 * half) << values;
    EXPECT_NEAR(std::log((*finding.interval95)[1]), mean_of(own) + half, 0.05 * half) << values;
  }
}

// Of kept motions, which alone tell the slope there.
TEST(Profile, AnEstimateAtTheEndOfTheRangeHasTheIntervalOfTheLikelihoodRatio) {
  // The keyframes want m, the range begins at e beyond it: ((x - m)^2 - (e - m)^2) / variance < t^2.
  const std::vector<double> own = scattered(20, std::log(1.2e-4), 0.3, 1);
  const auto score = [&](std::size_t k, const std::vector<double>& x) {
    return kFloor + 1e-3 * std::pow(x[0] - own[k], 2);
  };
  const double m = mean_of(own), half = 2.093 * standard_error(own);
  for (const double beyond : {0.3, 1.0, 2.0}) {  // of the interval's half
    const double edge = m + beyond * half;
    Axis axis = parse_axis("bending", "1e-4:1e-3:25:log");
    for (int i = 0; i < 25; ++i) axis.values[static_cast<std::size_t>(i)] = std::exp(edge + 0.1 * i);
    ProfileSettings settings;
    settings.information.assign(20, Eigen::MatrixXd::Ones(1, 1));  // all keyframes tell alike
    const ParameterFinding finding = profile_grid(grid_of({axis}, 20, score), settings).parameters[0];
    EXPECT_EQ(finding.edge, RangeEdge::low);
    EXPECT_EQ(finding.identifiable, Identifiable::upper_bound);
    const double expected = m + std::hypot(half, edge - m);
    EXPECT_NEAR(std::log((*finding.interval95)[1]), expected, 0.05 * half) << beyond;
  }
}

TEST(Profile, IntervalsAndCovarianceOfCorrelatedParameters) {
  const std::vector<double> first = scattered(24, std::log(100), 0.4, 2),
                            second = scattered(24, std::log(1.2e-4), 0.2, 3);
  const auto score = [&](std::size_t k, const std::vector<double>& x) {
    const double a = x[0] - first[k], b = x[1] - second[k];
    return kFloor + 1e-3 * (a * a + 2 * b * b + 1.6 * a * b);
  };
  const GridVerdict verdict = profile_grid(
      grid_of({parse_axis("young", "10:1e3:9:log"), parse_axis("bending", "3e-5:5e-4:9:log")}, 24, score));
  const std::vector<double>* own[] = {&first, &second};
  ASSERT_EQ(verdict.covariance_log.rows(), 2);
  for (int k = 0; k < 2; ++k) {
    const double half = 2.074 * standard_error(*own[k]);  // 22 degrees of freedom
    const ParameterFinding& finding = verdict.parameters[k];
    EXPECT_NEAR(std::log(*finding.estimate), mean_of(*own[k]), 0.05 * half);
    EXPECT_NEAR(std::log((*finding.interval95)[1] / (*finding.interval95)[0]), 2 * half, 0.1 * half);
    EXPECT_NEAR(verdict.covariance_log(k, k), std::pow(standard_error(*own[k]), 2),
                0.1 * verdict.covariance_log(k, k));
  }
}

TEST(Profile, FlatOneSidedAndEdgeAreSaid) {
  const std::vector<double> own = scattered(20, 0, 1, 4);
  const auto score = [&](std::size_t k, const std::vector<double>& x) {
    double sum = kFloor + 1e-6 * std::pow(x[0] - 50 * own[k], 2);              // flat
    sum += 1e-3 * std::exp(-8 * (x[1] - 0.5) + 0.3 * own[k]);                  // only small is excluded
    sum += 1e-3 * std::log1p(std::exp(x[2] - std::log(1e-5) + 0.3 * own[k]));  // only large is excluded
    return sum + 1e-5 * std::pow(x[3] - std::log(1e5) + 0.1 * own[k], 2);      // the best lies beyond
  };
  const GridVerdict verdict =
      profile_grid(grid_of({parse_axis("poisson", "0:0.4:5"), parse_axis("friction", "0.1:1:10"),
                            parse_axis("bending", "1e-6:1e-3:7:log"), parse_axis("young", "1:1e3:7:log")},
                           20, score));
  EXPECT_EQ(verdict.parameters[0].identifiable, Identifiable::no);
  EXPECT_NE(verdict.parameters[0].note.find("not identifiable"), std::string::npos);
  EXPECT_EQ(verdict.parameters[1].identifiable, Identifiable::lower_bound);
  EXPECT_LT((*verdict.parameters[1].interval95)[0], 1);
  EXPECT_EQ((*verdict.parameters[1].interval95)[1], 1);
  EXPECT_EQ(verdict.parameters[2].identifiable, Identifiable::upper_bound);
  EXPECT_EQ(verdict.parameters[3].identifiable, Identifiable::lower_bound);
  EXPECT_EQ(verdict.parameters[3].edge, RangeEdge::high);
}

TEST(Profile, RepeatabilityWidensTheIntervalAndIsSaid) {
  const std::vector<double> own = scattered(20, std::log(3e-5), 0.2, 5);
  const GridResults results = grid_of({parse_axis("bending", "1e-6:1e-3:31:log")}, 20,
                                      [&](std::size_t k, const std::vector<double>& x) {
                                        return std::sqrt(kFloor * kFloor * (1 + std::pow(x[0] - own[k], 2)));
                                      });
  const GridVerdict without = profile_grid(results), with = profile_grid(results, 0.010);
  EXPECT_EQ(without.sigma_source, "residual");
  EXPECT_EQ(with.sigma_source, "repeatability");
  EXPECT_NEAR(with.sigma, 0.010, 1e-9);
  // 20 (s^2 - s0^2) / 0.01^2 = 3.84, s^2 = 0.005^2 (1 + x^2 + ...): x = 1.96 * 0.01 / (0.005 sqrt(20)).
  const auto interval = *with.parameters[0].interval95;
  EXPECT_NEAR(0.5 * std::log(interval[1] / interval[0]), 1.96 * 2 / std::sqrt(20), 0.03);
}

TEST(Profile, AFinerSolutionWidensTheIntervalToItsSideOnly) {
  const std::vector<double> own = scattered(20, std::log(3e-5), 0.2, 6);
  const GridResults results = grid_of({parse_axis("bending", "1e-6:1e-3:15:log")}, 20,
                                      [&](std::size_t k, const std::vector<double>& x) {
                                        return kFloor + 1e-3 * std::pow(x[0] - own[k], 2);
                                      });
  const auto plain = *profile_grid(results).parameters[0].interval95;
  // The search's own settings move at 1.2 D as the finer ones do at D: the truth is the lower one.
  const auto wide =
      *profile_grid(results, {}, {{SolverShift::Constant(1, std::log(1.2))}}).parameters[0].interval95;
  EXPECT_NEAR(wide[0], plain[0] / 1.2, 1e-12);
  EXPECT_EQ(wide[1], plain[1]);
  const GridVerdict lost = profile_grid(results, {}, {{SolverShift::Constant(1, 9)}});
  EXPECT_EQ(lost.parameters[0].identifiable, Identifiable::upper_bound);
  // Where the whole range changes the score by less than a finer solution does, nothing is excluded.
  EXPECT_EQ(profile_grid(results, {}, {{}, 1.0}).parameters[0].identifiable, Identifiable::no);
}

/// A score that rises little along log(bending) = log(3e-5) + poisson, from 0.1, and much across it.
GridResults valley_over(const char* poisson, const char* bending) {
  const std::vector<double> own = scattered(20, std::log(3e-5), 0.01, 8);
  return grid_of({parse_axis("poisson", poisson), parse_axis("bending", bending)}, 20,
                 [&](std::size_t k, const std::vector<double>& x) {
                   const double along = x[0] - 0.1 + 0.1 * (own[k] - std::log(3e-5));
                   return kFloor + 1e-3 * std::pow(x[1] - x[0] - own[k], 2) + 1e-4 * along * along;
                 });
}

TEST(Profile, AnIntervalHoldsTheValleyThatTheSolverCannotTellFromFlat) {
  const GridResults results = valley_over("0:0.4:5", "1e-6:1e-3:31:log");
  const GridVerdict exact = profile_grid(results);
  EXPECT_EQ(exact.parameters[0].identifiable, Identifiable::yes);
  EXPECT_NEAR(std::log((*exact.parameters[1].interval95)[1] / 3e-5), 0.1, 0.02);
  // poisson changes the score by 9e-6 m at most, bending by 1e-3 m and more.
  const GridVerdict doubtful = profile_grid(results, {}, {{}, 5e-5});
  EXPECT_EQ(doubtful.parameters[0].identifiable, Identifiable::no);
  EXPECT_EQ(doubtful.parameters[1].identifiable, Identifiable::yes);
  EXPECT_NEAR(std::log((*doubtful.parameters[1].interval95)[0] / 3e-5), 0.0, 0.01);
  EXPECT_NEAR(std::log((*doubtful.parameters[1].interval95)[1] / 3e-5), 0.4, 0.01);
}

TEST(Profile, AValleyThatLeavesTheGridIsHeldToTheEndsOfTheRange) {
  const GridResults results = valley_over("0.08:0.12:5", "2.5e-5:4e-5:9:log");
  // Over 0 to 0.4 and 1e-6 to 1e-3 the score rises by 9e-6 m along the valley, by far more across it.
  const auto end = [](std::size_t axis, double poisson, double bending, double rise) {
    return RangeEnd{axis, kFloor + rise, Eigen::Vector2d(poisson, bending)};
  };
  const ProfileSettings settings{.repeatability = {},
                                 .solver = {{}, 5e-5},
                                 .ends = {end(0, 0, 3e-5, 1e-6), end(0, 0.4, 3e-5 * std::exp(0.4), 9e-6),
                                          end(1, 0, 1e-6, 1e-2), end(1, 0.4, 1e-3, 1e-2)}};
  const GridVerdict verdict = profile_grid(results, settings);
  EXPECT_EQ(verdict.parameters[0].identifiable, Identifiable::no);
  EXPECT_EQ((*verdict.parameters[0].interval95)[1], 0.4);
  EXPECT_EQ(verdict.parameters[1].identifiable, Identifiable::yes);
  EXPECT_LE((*verdict.parameters[1].interval95)[0], 3e-5);
  EXPECT_NEAR((*verdict.parameters[1].interval95)[1], 3e-5 * std::exp(0.4), 1e-9);
}

TEST(Profile, RecordingsThatContradictEachOtherWidenTheInterval) {
  std::vector<double> own = scattered(20, std::log(3e-5), 0.05, 7);
  const auto score = [&](std::size_t k, const std::vector<double>& x) {
    return kFloor + 1e-3 * std::pow(x[0] - own[k], 2);
  };
  const auto width = [&] {
    const auto interval = *profile_grid(grid_of({parse_axis("bending", "1e-6:1e-3:31:log")}, 20, score, 2))
                               .parameters[0]
                               .interval95;
    return std::log(interval[1] / interval[0]);
  };
  const double agreeing = width();
  for (std::size_t k = 10; k < own.size(); ++k) own[k] += 0.4;  // the second recording wants another value
  EXPECT_GT(width(), 5 * agreeing);
  EXPECT_GT(width(), 0.4);  // both answers are inside
}

// --friction 0.3 says what --fix friction=0.3 says.
TEST(Profile, AnAxisOfOneValueIsNoParameterOfTheRegion) {
  const Axis bending{"bending", {1e-5, 3e-5, 1e-4, 3e-4, 1e-3}, true};
  const std::vector<double> wanted = scattered(12, std::log(1e-4), 0.5, 3);
  const auto score = [&](std::size_t k, const std::vector<double>& x) {
    return std::sqrt(kFloor * kFloor + 1e-6 * std::pow(x[0] - wanted[k], 2));
  };
  const GridVerdict alone = profile_grid(grid_of({bending}, 12, score));
  const GridVerdict with_one = profile_grid(grid_of({bending, {"friction", {0.3}, false}}, 12, score));
  EXPECT_DOUBLE_EQ(with_one.level95, alone.level95);
  EXPECT_DOUBLE_EQ((*with_one.parameters[0].interval95)[0], (*alone.parameters[0].interval95)[0]);
}

TEST(Profile, WithoutAUsableCandidateThereIsNoVerdict) {
  const auto none = [](std::size_t, const std::vector<double>&) {
    return std::numeric_limits<double>::infinity();
  };
  EXPECT_EQ(profile_grid(grid_of({parse_axis("young", "1,2")}, 5, none)).best, -1);
}

TEST(ScoreInterpolant, DerivativesAreThoseOfFiniteDifferencesAndValuesThoseOfTheGrid) {
  const GridResults results = grid_of(
      {parse_axis("young", "1,2,5,9,20"), parse_axis("bending", "1e-6:1e-4:6:log"),
       parse_axis("poisson", "0.1,0.4")},
      4, [](std::size_t k, const std::vector<double>& x) {
        return 0.01 + 1e-3 * (std::sin(0.3 * x[0] + static_cast<double>(k)) + std::cos(x[1]) * (1 + x[2]));
      });
  const ScoreInterpolant surface(results);
  Eigen::VectorXd x(3);
  x << 5, std::log(1e-6), 0.4;
  const CandidateResult& there = results.candidates[2 * 12 + 1];
  for (int k = 0; k < 4; ++k)
    EXPECT_NEAR(surface.scores(x)[k], there.recordings[0].keyframes[static_cast<std::size_t>(k)].score,
                1e-12);
  x << 3.3, std::log(7e-6), 0.22;
  Eigen::VectorXd gradient, other;
  Eigen::MatrixXd hessian, unused;
  surface.score(x, gradient, hessian);
  for (int i = 0; i < 3; ++i) {
    const double h = 1e-5;
    Eigen::VectorXd low = x, high = x;
    low[i] -= h;
    high[i] += h;
    Eigen::VectorXd gradient_low, gradient_high;
    const double slope =
        (surface.score(high, gradient_high, unused) - surface.score(low, gradient_low, unused)) / (2 * h);
    EXPECT_NEAR(gradient[i], slope, 1e-9);
    EXPECT_NEAR((hessian.col(i) - (gradient_high - gradient_low) / (2 * h)).norm(), 0, 1e-8);
    EXPECT_NEAR(surface.weights().dot(surface.gradients(x).col(i)), gradient[i], 1e-12);
  }
}

}  // namespace
}  // namespace flash::sysid
