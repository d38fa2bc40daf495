#include "sim/law/constraint_row.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace flash::sim {
namespace {

constexpr double h = 0.01;

// Independent statements of the two complementarity functions.
double minimum_map(double c, double l, double r) { return std::min(c, r * l); }
double smooth_map(double c, double l, double r) { return c + r * l - std::hypot(c, r * l); }

struct Sample {
  double c, l, r;
};

std::vector<Sample> samples() {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(-1, 1), exponent(-6, 0);
  std::vector<Sample> all;
  for (int i = 0; i < 500; ++i) {
    const double r = std::pow(10, exponent(random));
    all.push_back({1e-3 * unit(random), 1e-3 * unit(random) / r, r});
  }
  return all;
}

TEST(ConstraintRow, FischerBurmeisterRowIsTheDerivative) {
  for (const auto& [c, l, r] : samples()) {
    const ConstraintRow row = normal_row_fischer_burmeister(c, c, l, r, h);
    const double rho = std::hypot(c, r * l);
    const double step = 1e-4 * rho;
    // Central differences: truncation (step / rho)^2 of a function with derivatives of order one.
    EXPECT_NEAR(row.omega, (smooth_map(c + step, l, r) - smooth_map(c - step, l, r)) / (2 * step), 1e-7);
    EXPECT_NEAR(h * h * row.compliance / r,
                (smooth_map(c, l + step / r, r) - smooth_map(c, l - step / r, r)) / (2 * step), 1e-7);
    EXPECT_NEAR(row.rhs, -smooth_map(c, l, r), 1e-12 * rho);
    EXPECT_NEAR(fischer_burmeister(c, l, r), smooth_map(c, l, r), 1e-12 * rho);
  }
}

TEST(ConstraintRow, MinimumMapRowIsTheDerivative) {
  for (const auto& [c, l, r] : samples()) {
    const double distance = std::fabs(c - r * l);  // to the kink
    const double step = 0.1 * distance;
    const ConstraintRow row = normal_row_minimum_map(c, c, l, r, h);
    EXPECT_NEAR(row.omega, (minimum_map(c + step, l, r) - minimum_map(c - step, l, r)) / (2 * step), 1e-9);
    EXPECT_NEAR(h * h * row.compliance / r,
                (minimum_map(c, l + step / r, r) - minimum_map(c, l - step / r, r)) / (2 * step), 1e-9);
    EXPECT_DOUBLE_EQ(row.rhs, -minimum_map(c, l, r));
  }
}

TEST(ConstraintRow, LinearisedRowPredictsTheFunctionAfterTheFreeMotion) {
  // phi(c + dc, lambda + dlambda) to first order with dc = (c_free - c) + h^2 W dlambda.
  const double W = 3.0;
  for (const auto& [c, l, r] : samples()) {
    const double scale = std::hypot(c, r * l);
    const double free_gap = c + 1e-6 * scale, dl = 1e-6 * scale / std::max(r, h * h * W);
    for (const bool smooth : {true, false}) {
      if (!smooth && std::fabs(c - r * l) < 1e-4 * scale) continue;
      const ConstraintRow row = smooth ? normal_row_fischer_burmeister(c, free_gap, l, r, h)
                                       : normal_row_minimum_map(c, free_gap, l, r, h);
      const double c_new = free_gap + h * h * W * dl, l_new = l + dl;
      const double value = smooth ? smooth_map(c_new, l_new, r) : minimum_map(c_new, l_new, r);
      const double predicted = h * h * (row.omega * W + row.compliance) * dl - row.rhs;
      EXPECT_NEAR(value, predicted, 1e-11 * scale);  // second order: (1e-6)^2, and rounding of scale
    }
  }
}

TEST(ConstraintRow, KinksTakeAnElementOfTheGeneralisedGradient) {
  const double r = 2e-4;
  // Fischer-Burmeister at the origin: {(1 - a, r (1 - b)) : a^2 + b^2 <= 1}.
  const ConstraintRow smooth = normal_row_fischer_burmeister(0.0, 0.0, 0.0, r, h);
  const double a = 1 - smooth.omega, b = 1 - smooth.compliance * h * h / r;
  EXPECT_LE(a * a + b * b, 1 + 1e-12);
  EXPECT_EQ(smooth.rhs, 0);
  EXPECT_GT(smooth.compliance, 0);
  // Minimum map on c = r lambda: {(w, r (1 - w)) : 0 <= w <= 1}.
  for (const double c : {-1e-3, 0.0, 2e-3}) {
    const double l = c / r;
    const ConstraintRow row = normal_row_minimum_map(r * l, r * l, l, r, h);
    EXPECT_GE(row.omega, 0);
    EXPECT_LE(row.omega, 1);
    EXPECT_NEAR(row.compliance * h * h, r * (1 - row.omega), 1e-18);
  }
  // Approached along any ray the row stays inside the disc.
  for (double angle = 0; angle < 6.28; angle += 0.1) {
    const ConstraintRow row =
        normal_row_fischer_burmeister(1e-300 * std::cos(angle), 0.0, 1e-300 / r * std::sin(angle), r, h);
    EXPECT_TRUE(std::isfinite(row.omega) && std::isfinite(row.compliance));
  }
}

TEST(ConstraintRow, NormalRowsVanishExactlyOnSignorini) {
  const double r = 1e-3;
  for (const double c : {0.0, 1e-9, 1e-3}) {
    EXPECT_EQ(normal_row_minimum_map(c, c, 0.0, r, h).rhs, 0);
    EXPECT_NEAR(normal_row_fischer_burmeister(c, c, 0.0, r, h).rhs, 0, 1e-19);
    EXPECT_EQ(normal_violation(c, 0.0, r), 0);
  }
  for (const double l : {1e-6, 5.0}) {
    EXPECT_EQ(normal_row_minimum_map(0.0, 0.0, l, r, h).rhs, 0);
    EXPECT_NEAR(normal_row_fischer_burmeister(0.0, 0.0, l, r, h).rhs, 0, 1e-19);
  }
  EXPECT_GT(normal_violation(-1e-4, 0.0, r), 0);  // penetration
  EXPECT_GT(normal_violation(0.0, -1.0, r), 0);   // adhesion
  EXPECT_GT(normal_violation(1e-3, 1.0, r), 0);   // force at a distance
}

TEST(ConstraintRow, FrictionComplianceIsTheRatioOfItsFormula) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int i = 0; i < 500; ++i) {
    const double mu = 0.3 + 0.2 * unit(random), normal = 1.1 + unit(random), r = 0.02;
    const double radius = mu * normal * (0.5 + 0.4 * unit(random)), angle = 3.14 * unit(random);
    const double l[2] = {radius * std::cos(angle), radius * std::sin(angle)};
    const double c[2] = {1e-4 * unit(random), 1e-4 * unit(random)};
    const FrictionRows row = friction_rows(c, c, l, normal, mu, r, h);
    const double u = std::hypot(c[0], c[1]) / h, t = r * (mu * normal - radius), rho = std::hypot(u, t);
    // As the design states it; the subtraction rho - t loses digits where u << t.
    const double expected = (rho - t) / (u + r * mu * normal - rho) * r / h;
    EXPECT_NEAR(row.compliance, expected, 1e-9 * expected + 1e-15 * rho / (r * mu * normal) * r / h);
    EXPECT_GE(row.compliance, 0);
    for (int k : {0, 1}) EXPECT_NEAR(row.rhs[k], -h * h * row.compliance * l[k] - c[k], 1e-18);
  }
}

TEST(ConstraintRow, FrictionRowsVanishExactlyOnCoulomb) {
  const double mu = 0.4, normal = 2, r = 0.02, W = r / h;
  for (double angle = 0; angle < 6.28; angle += 0.37) {
    const double direction[2] = {std::cos(angle), std::sin(angle)};
    const double zero[2] = {0, 0};
    const double inside[2] = {0.9 * mu * normal * direction[0], 0.9 * mu * normal * direction[1]};
    const double rim[2] = {mu * normal * direction[0], mu * normal * direction[1]};
    const FrictionRows stick = friction_rows(zero, zero, inside, normal, mu, r, h);
    EXPECT_EQ(stick.compliance, 0);
    EXPECT_EQ(stick.rhs[0], 0);
    EXPECT_EQ(stick.rhs[1], 0);
    const double slip[2] = {-1e-4 * direction[0], -1e-4 * direction[1]};
    const FrictionRows sliding = friction_rows(slip, slip, rim, normal, mu, r, h);
    EXPECT_NEAR(h * h * sliding.compliance, 1e-4 / (mu * normal), 1e-15);
    EXPECT_NEAR(sliding.rhs[0], 0, 1e-18);
    EXPECT_NEAR(sliding.rhs[1], 0, 1e-18);
    EXPECT_NEAR(friction_violation(slip, rim, normal, mu, h * h * W), 0, 1e-18);
    EXPECT_EQ(friction_violation(zero, inside, normal, mu, h * h * W), 0);
    EXPECT_GT(friction_violation(slip, inside, normal, mu, h * h * W), 1e-6);  // slips inside the cone
    const double along[2] = {1e-4 * direction[0], 1e-4 * direction[1]};
    EXPECT_GT(friction_violation(along, rim, normal, mu, h * h * W), 1e-6);  // pushes along the slip
  }
}

TEST(ConstraintRow, FrictionRowIsTheDerivativeOfItsLawAtFrozenCompliance) {
  // g(lambda) = c(lambda) + h^2 E lambda with c = c_free + h^2 W (lambda - lambda_0): dg = h^2 (W + E).
  const double mu = 0.4, normal = 2, r = 0.02, W = r / h;
  const double c[2] = {3e-5, -1e-5}, free_slip[2] = {4e-5, 2e-5}, l[2] = {0.1, 0.5};
  const FrictionRows row = friction_rows(c, free_slip, l, normal, mu, r, h);
  for (int k : {0, 1}) {
    const auto g = [&](double dl) { return free_slip[k] + h * h * (W * dl + row.compliance * (l[k] + dl)); };
    const double slope = (g(1e-3) - g(-1e-3)) / 2e-3;
    EXPECT_NEAR(slope, h * h * (row.omega * W + row.compliance), 1e-12);
    EXPECT_NEAR(row.rhs[k], -g(0), 1e-18);
  }
}

// lambda_t - P(lambda_t - c_t / r) in the frame (e, e_perp), written independently.
void natural_map(const double c[2], const double l[2], double limit, double r, double value[2]) {
  const double q[2] = {l[0] - c[0] / r, l[1] - c[1] / r};
  const double size = std::hypot(q[0], q[1]), scale = size > limit ? limit / size : 1;
  for (int k : {0, 1}) value[k] = l[k] - scale * q[k];
}

TEST(ConstraintRow, SlipRowsAreTheDerivativeOfTheProjectionOnTheDisc) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> unit(-1, 1);
  const double mu = 0.4, normal = 2, limit = mu * normal, r = 2e-4;
  for (int i = 0; i < 500; ++i) {
    const double c[2] = {3e-4 * unit(random), 3e-4 * unit(random)};
    const double l[2] = {0.6 * unit(random), 0.6 * unit(random)};
    const double q = std::hypot(l[0] - c[0] / r, l[1] - c[1] / r);
    if (std::fabs(q - limit) < 0.05 * limit) continue;  // the kink
    const SlipRows rows = slip_rows(c, c, l, normal, mu, r, h);
    const double e[2] = {rows.direction[0], rows.direction[1]}, p[2] = {-e[1], e[0]};
    EXPECT_EQ(rows.along.omega == 0, q > limit);
    // Each row is its component of the map times a factor; the factor is read off one derivative, the rest
    // follows.
    const auto component = [&](const double* axis, double dc_e, double dc_p, double dl_e, double dl_p) {
      double value[2];
      const double c2[2] = {c[0] + dc_e * e[0] + dc_p * p[0], c[1] + dc_e * e[1] + dc_p * p[1]};
      const double l2[2] = {l[0] + dl_e * e[0] + dl_p * p[0], l[1] + dl_e * e[1] + dl_p * p[1]};
      natural_map(c2, l2, limit, r, value);
      return axis[0] * value[0] + axis[1] * value[1];
    };
    const double dl = 1e-5, dc = r * dl;
    const auto check = [&](const ConstraintRow& row, const double* axis, bool is_along) {
      const double by_c = (component(axis, is_along * dc, !is_along * dc, 0, 0) -
                           component(axis, -is_along * dc, -!is_along * dc, 0, 0)) /
                          (2 * dl);
      const double by_l = (component(axis, 0, 0, is_along * dl, !is_along * dl) -
                           component(axis, 0, 0, -is_along * dl, -!is_along * dl)) /
                          (2 * dl);
      const double cross = (component(axis, !is_along * dc, is_along * dc, 0, 0) -
                            component(axis, -!is_along * dc, -is_along * dc, 0, 0)) /
                           (2 * dl);
      const double value = component(axis, 0, 0, 0, 0);
      const double factor = row.omega > 0 ? r * row.omega / by_c : h;  // [m/N]
      EXPECT_NEAR(cross, 0, 1e-7);
      EXPECT_NEAR(by_c * factor, r * row.omega, 1e-7 * r);
      EXPECT_NEAR(by_l * factor, h * h * row.compliance, 1e-6 * (h * h * row.compliance + r));
      EXPECT_NEAR(-value * factor, row.rhs, 1e-6 * std::fabs(row.rhs) + 1e-12);
    };
    check(rows.along, e, true);
    check(rows.across, p, false);
  }
}

TEST(ConstraintRow, SlipRowsVanishExactlyOnCoulomb) {
  const double mu = 0.4, normal = 2, r = 2e-4;
  for (double angle = 0; angle < 6.28; angle += 0.37) {
    const double rim[2] = {mu * normal * std::cos(angle), mu * normal * std::sin(angle)};
    const double slip[2] = {-1e-4 * std::cos(angle), -1e-4 * std::sin(angle)}, zero[2] = {0, 0};
    const SlipRows sliding = slip_rows(slip, slip, rim, normal, mu, r, h);
    EXPECT_NEAR(sliding.along.rhs, 0, 1e-17);
    EXPECT_NEAR(sliding.across.rhs, 0, 1e-17);
    EXPECT_NEAR(h * h * sliding.across.compliance, 1e-4 / (mu * normal), 1e-15);
    const double inside[2] = {0.5 * rim[0], 0.5 * rim[1]};
    const SlipRows sticking = slip_rows(zero, zero, inside, normal, mu, r, h);
    EXPECT_EQ(sticking.along.rhs, 0);
    EXPECT_EQ(sticking.across.rhs, 0);
    const SlipRows lifted = slip_rows(slip, slip, rim, 0.0, mu, r, h);
    EXPECT_EQ(lifted.along.omega, 0);
    EXPECT_NEAR(lifted.along.rhs / (h * h * lifted.along.compliance), -rim[0], 1e-15);
  }
}

TEST(ConstraintRow, FrictionAtItsKinksIsFinite) {
  const double zero[2] = {0, 0}, slip[2] = {1e-4, 0}, rim[2] = {0.8, 0}, over[2] = {3, 4};
  for (const auto* c : {zero, slip})
    for (const auto* l : {zero, rim, over})
      for (const double normal : {0.0, 2.0})
        for (const double mu : {0.0, 0.4}) {
          const FrictionRows row = friction_rows(c, c, l, normal, mu, 0.02, h);
          EXPECT_TRUE(std::isfinite(row.compliance)) << mu;
          EXPECT_GE(row.compliance, 0);
          EXPECT_GE(row.omega, 0);
          if (normal * mu == 0) {  // a frictionless row: dlambda = rhs / (h^2 E) = -lambda
            EXPECT_EQ(row.omega, 0);
            EXPECT_NEAR(row.rhs[0] / (h * h * row.compliance), -l[0], 1e-15);
          }
        }
}

TEST(ConstraintRow, BilateralRowReachesItsAnchorInOneStep) {
  const double W = 5, free_gap = 3e-3, l = 0.7;
  for (const double compliance : {0.0, 2.0}) {
    const ConstraintRow row = bilateral_row(free_gap, l, compliance, h);
    const double dl = row.rhs / (h * h * (row.omega * W + row.compliance));
    EXPECT_NEAR(free_gap + h * h * W * dl + h * h * compliance * (l + dl), 0, 1e-17);
  }
}

TEST(ConstraintRow, DiscTreatsAllDirectionsAlike) {
  for (double angle = 0; angle < 6.28; angle += 0.1) {
    double l[2] = {3 * std::cos(angle), 3 * std::sin(angle)};
    project_on_disc(l, 2.0, 0.5);
    EXPECT_NEAR(std::hypot(l[0], l[1]), 1, 1e-15);
    EXPECT_NEAR(std::remainder(std::atan2(l[1], l[0]) - angle, 2 * M_PI), 0, 1e-15);
    double pulled[2] = {1, 1};
    project_on_disc(pulled, -1.0, 0.5);
    EXPECT_EQ(pulled[0], 0);
  }
}

}  // namespace
}  // namespace flash::sim
