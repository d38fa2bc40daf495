#pragma once
#include <Eigen/Core>
#include <random>

#include "sysid/infer/discrepancy.h"

namespace flash::sysid {

inline constexpr double kNoise = 1e-3;  // [m]

/// A strip of 20 cm seen at `keyframes` times within 0.8 s, `points` at each.
inline ObservedRows strip_rows(int keyframes, int points) {
  ObservedRows rows;
  const int count = keyframes * points;
  rows.places.resize(count, 2);
  rows.weights = Eigen::VectorXd::Ones(count);
  for (int k = 0; k < keyframes; ++k) rows.times.push_back(0.8 * k / (keyframes - 1));
  for (int i = 0; i < count; ++i) {
    rows.keyframe.push_back(i / points);
    rows.channel.push_back(0);
    const double along = (i % points + 0.5) / points;
    rows.places.row(i) << 0.2 * along, 0.025 * ((7 * i) % points) / (points - 1);
  }
  return rows;
}

/// Of unit variance.
inline Eigen::VectorXd normal(std::mt19937& random, Eigen::Index count) {
  std::normal_distribution<double> draw;
  return Eigen::VectorXd::NullaryExpr(count, [&](Eigen::Index) { return draw(random); });
}

}  // namespace flash::sysid
