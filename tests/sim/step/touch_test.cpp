#include "sim/step/touch.h"

#include <gtest/gtest.h>

#include <vector>

namespace flash::sim {
namespace {

using Eigen::Vector3d;

TEST(Touch, SurfacesShareAForceByNonNegativeLeastSquares) {
  for (int sample = 0; sample < 2000; ++sample) {
    std::vector<Touch> touches(static_cast<size_t>(1 + sample % 6));
    for (Touch& touch : touches) touch.normal = Vector3d::Random().normalized();
    const Vector3d needed = Vector3d::Random();
    share_force(touches, needed, [](const Touch&) { return true; });
    // The conditions of the minimum of |needed - sum forces * normals|^2 over forces not below zero.
    Vector3d rest = needed;
    for (size_t k = 0; k < touches.size(); ++k) rest -= touches[k].normal_force * touches[k].normal;
    for (size_t k = 0; k < touches.size(); ++k) {
      EXPECT_GE(touches[k].normal_force, 0);
      EXPECT_EQ(touches[k].holds, touches[k].normal_force > 0);
      // Three faces that span a volume of less than a thousandth count as two of them.
      EXPECT_LE(touches[k].normal.dot(rest), 1e-3 * needed.norm());
      // Rounding, by three normals that span a volume of 1e-3 at least.
      EXPECT_NEAR(touches[k].normal_force * touches[k].normal.dot(rest), 0, 1e-7);
    }
  }
}

}  // namespace
}  // namespace flash::sim
