#include "sysid/capture/unrolled_cloth.h"

#include <gtest/gtest.h>

#include <cmath>

namespace flash::sysid {
namespace {

/// A rectangle that is raised at its corner to a plane of `slope`, about level lines across `down`;
/// `material`: where its points lay, from the corner.
data::Points raised(const Eigen::Vector3d& tool, const Eigen::Vector2d& down, double slope,
                    std::vector<Eigen::Vector2d>& material) {
  const Eigen::Vector2d level(-down.y(), down.x());
  for (int i = 0; i < 20; ++i)
    for (int j = 0; j < 15; ++j) material.emplace_back(0.01 * i, 0.01 * j);
  data::Points points(static_cast<Eigen::Index>(material.size()), 3);
  for (std::size_t k = 0; k < material.size(); ++k) {
    const double along = material[k].dot(down), flat = along / std::hypot(1, slope);
    const Eigen::Vector2d place = flat * down + material[k].dot(level) * level;
    points.row(static_cast<Eigen::Index>(k)) =
        (tool + Eigen::Vector3d(place.x(), place.y(), -slope * flat)).transpose();
  }
  return points;
}

TEST(UnrolledCloth, ASheetThatBendsAboutLevelLinesIsLaidBack) {
  const Eigen::Vector2d down = Eigen::Vector2d(1, 0.6).normalized();
  std::vector<Eigen::Vector2d> material;
  const Eigen::Vector3d tool(0.4, -0.2, 0.3);
  const std::vector<Eigen::Vector2d> found = unrolled(raised(tool, down, 1.2, material), tool);
  ASSERT_EQ(found.size(), material.size());
  for (std::size_t k = 0; k < found.size(); ++k) EXPECT_TRUE(found[k].isApprox(material[k], 1e-9)) << k;
}

TEST(UnrolledCloth, WhatIsFlatOrStrayTellsNothing) {
  std::vector<Eigen::Vector2d> material;
  const data::Points flat = raised({0, 0, 0}, Eigen::Vector2d::UnitX(), 0.1, material);
  EXPECT_TRUE(unrolled(flat, Eigen::Vector3d::Zero()).empty());
  EXPECT_TRUE(unrolled(flat.topRows(99), Eigen::Vector3d::Zero()).empty());
}

}  // namespace
}  // namespace flash::sysid
