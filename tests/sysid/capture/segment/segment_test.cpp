#include "sysid/capture/segment/segment.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <random>

#include "data/files/error.h"

namespace flash::sysid {
namespace {

enum class Origin { table, cloth, arm, block, fleck };

struct Scene {
  data::Points points;
  std::vector<Origin> origins;
  std::vector<double> height;  // above the table, without noise [m]
  TablePlane table;
  ArmCylinder arm;
};

constexpr double noise = 0.001;  // [m]

// A table tilted by 2 degrees, a sheet hanging by one corner in the shape z = c d^2 of the distance d from
// the opposite corner, the arm that holds it, a block beside it and flecks in the air.
Scene lifted_sheet(unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0.0, noise);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  const Eigen::Matrix3d tilt =
      Eigen::AngleAxisd(2 * M_PI / 180, Eigen::Vector3d(1, 1, 0).normalized()).matrix();
  const Eigen::Vector3d origin(0.4, -0.2, 0.07);

  Scene scene;
  scene.table = {origin, tilt * Eigen::Vector3d::UnitZ()};
  std::vector<Eigen::Vector3d> points;
  const auto add = [&](Origin from, const Eigen::Vector3d& local) {
    points.push_back(origin + tilt * local + Eigen::Vector3d(normal(random), normal(random), normal(random)));
    scene.origins.push_back(from);
    scene.height.push_back(local.z());
  };
  for (int i = 0; i < 20000; ++i)
    add(Origin::table, Eigen::Vector3d(uniform(random) - 0.5, uniform(random) - 0.5, 0));
  for (int i = 0; i < 8000; ++i) {
    const double x = 0.28 * uniform(random), y = 0.28 * uniform(random);
    add(Origin::cloth, Eigen::Vector3d(x, y, 0.2 * (x * x + y * y) / (2 * 0.28 * 0.28)));
  }
  for (int i = 0; i < 4000; ++i) {
    const double angle = 2 * M_PI * uniform(random);
    add(Origin::arm, Eigen::Vector3d(0.28 + 0.04 * std::cos(angle), 0.28 + 0.04 * std::sin(angle),
                                     0.21 + 0.3 * uniform(random)));
  }
  for (int i = 0; i < 500; ++i)
    add(Origin::block, Eigen::Vector3d(-0.3 + 0.03 * uniform(random), 0.3 + 0.03 * uniform(random),
                                       0.02 + 0.03 * uniform(random)));
  for (int i = 0; i < 40; ++i)
    add(Origin::fleck, Eigen::Vector3d(-0.45 + 0.4 * uniform(random), -0.45 + 0.4 * uniform(random),
                                       0.1 + 0.2 * uniform(random)));
  scene.arm.tip = origin + tilt * Eigen::Vector3d(0.28, 0.28, 0.203);
  scene.points.resize(points.size(), 3);
  for (std::size_t i = 0; i < points.size(); ++i) scene.points.row(i) = points[i].transpose();
  return scene;
}

TEST(Segment, TableIsFoundBelowSheetArmAndClutter) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const Scene scene = lifted_sheet(seed);
    const TablePlane table = find_table({scene.points}, SegmentSettings()).plane;
    // Sheet points below the tolerance count as table and bend the fit: under 3 % of them, at most 6 mm high.
    EXPECT_LT(std::acos(std::min(1.0, table.normal.dot(scene.table.normal))), 0.003) << seed;
    EXPECT_LT(std::abs((scene.table.point - table.point).dot(table.normal)), 0.0006) << seed;
  }
}

// A level piece of 0.2 x 0.2 m that moves by 0.1 m a frame, and nothing below it.
TEST(Segment, APlaneThatMovesIsClothAndNoTable) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(0.0, 0.2);
  std::vector<data::Points> frames;
  for (int k = 0; k < 6; ++k) {
    data::Points piece(2000, 3);
    for (int i = 0; i < piece.rows(); ++i) piece.row(i) << 0.1 * k + uniform(random), uniform(random), 0.3;
    frames.push_back(piece);
  }
  const auto message = [&] {
    try {
      find_table(frames, SegmentSettings());
    } catch (const data::InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_NE(message().find("is seen in 0 of 6 frames only: it is cloth"), std::string::npos) << message();
  // The table is there too, but smaller: it is the one that stands still.
  for (data::Points& frame : frames) {
    frame.conservativeResize(2500, 3);
    for (int i = 2000; i < 2500; ++i) frame.row(i) << 4 * uniform(random), 4 * uniform(random), 0.1;
  }
  const FoundTable table = find_table(frames, SegmentSettings());
  EXPECT_NEAR(table.plane.point.z(), 0.1, 1e-6);
  EXPECT_EQ(table.agreeing, 6);
  EXPECT_LT(table.tilt, 1e-6);
}

TEST(Segment, VoxelsOfAnySizeHoldAllPoints) {
  const Scene scene = lifted_sheet(2);
  SegmentSettings settings;
  settings.voxel = 1e-6;  // more cells than a 32-bit number counts
  const Segmentation result = segment_cloth(scene.points, scene.table, scene.arm, settings);
  EXPECT_EQ(result.cloth.rows(), result.counts[static_cast<int>(PointLabel::cloth)]);
}

TEST(Segment, KeepsTheSheetAndNothingElse) {
  SegmentSettings settings;
  settings.voxel = 0;
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const Scene scene = lifted_sheet(seed);
    const Segmentation result = segment_cloth(scene.points, scene.table, scene.arm, settings);
    int sheet = 0, kept = 0, foreign = 0;
    for (std::size_t i = 0; i < scene.origins.size(); ++i) {
      const bool cloth = result.labels[i] == PointLabel::cloth;
      if (scene.origins[i] == Origin::cloth && scene.height[i] > settings.table_clearance + 4 * noise) {
        ++sheet;
        kept += cloth;
      }
      foreign += cloth && scene.origins[i] != Origin::cloth;
    }
    EXPECT_GT(kept, 0.97 * sheet) << seed;  // mean + 2.5 sigmas of the neighbour distance cuts about 2 %
    EXPECT_EQ(foreign, 0) << seed;
    EXPECT_EQ(result.cloth.rows(), result.counts[static_cast<int>(PointLabel::cloth)]);
  }
}

TEST(Segment, WithoutTheArmCylinderTheArmStaysWithTheSheetItHolds) {
  const Scene scene = lifted_sheet(1);
  ArmCylinder none;
  none.radius = 0;
  const Segmentation result = segment_cloth(scene.points, scene.table, none, SegmentSettings());
  EXPECT_EQ(result.counts[static_cast<int>(PointLabel::arm)], 0);
  int arm_as_cloth = 0;
  for (std::size_t i = 0; i < scene.origins.size(); ++i)
    arm_as_cloth += scene.origins[i] == Origin::arm && result.labels[i] == PointLabel::cloth;
  EXPECT_GT(arm_as_cloth, 2000);
}

TEST(Segment, VoxelsHoldOnePointEachCloseToThePointsTheyStandFor) {
  const Scene scene = lifted_sheet(2);
  SegmentSettings settings;
  settings.voxel = 0.01;
  const Segmentation result = segment_cloth(scene.points, scene.table, scene.arm, settings);
  ASSERT_GT(result.cloth.rows(), 100);
  EXPECT_LT(result.cloth.rows(), result.counts[static_cast<int>(PointLabel::cloth)] / 2);
  for (int i = 0; i < result.cloth.rows(); ++i) {
    double nearest = std::numeric_limits<double>::infinity();
    for (int j = 0; j < scene.points.rows(); ++j)
      if (result.labels[j] == PointLabel::cloth)
        nearest = std::min(nearest, (scene.points.row(j) - result.cloth.row(i)).norm());
    EXPECT_LT(nearest, settings.voxel * std::sqrt(3.0));  // the diagonal of a cell
  }
}

TEST(Segment, ABaseFrameFarAwayCostsNoDigits) {
  Scene scene = lifted_sheet(3);
  const Segmentation here = segment_cloth(scene.points, scene.table, scene.arm, SegmentSettings());
  const Eigen::RowVector3d away(4096, -8192, 1024);  // powers of two: the shift itself is exact to 1e-12
  scene.points.rowwise() += away;
  scene.table.point += away.transpose();
  scene.arm.tip += away.transpose();
  const Segmentation there = segment_cloth(scene.points, scene.table, scene.arm, SegmentSettings());
  ASSERT_EQ(here.cloth.rows(), there.cloth.rows());
  EXPECT_LT(((there.cloth.rowwise() - away) - here.cloth).cwiseAbs().maxCoeff(),
            1e-6);  // float about a local origin
}

TEST(Segment, CropAndPointsThatAreNotFiniteAreOutside) {
  Scene scene = lifted_sheet(4);
  scene.points(7, 1) = std::numeric_limits<double>::quiet_NaN();
  SegmentSettings settings;
  settings.crop.max.x() = 0.55;
  const Segmentation result = segment_cloth(scene.points, scene.table, scene.arm, settings);
  EXPECT_EQ(result.labels[7], PointLabel::outside);
  EXPECT_LE(result.cloth.col(0).maxCoeff(), 0.55);
  int total = 0;
  for (int count : result.counts) total += count;
  EXPECT_EQ(total, scene.points.rows());
}

TEST(Segment, AnEmptyFrameGivesAnEmptyCloud) {
  const Scene scene = lifted_sheet(1);
  const data::Points nothing(0, 3);
  EXPECT_EQ(segment_cloth(nothing, scene.table, scene.arm, SegmentSettings()).cloth.rows(), 0);
}

TEST(Segment, NoPlaneIsAnErrorThatSaysSo) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  data::Points cloud(2000, 3);
  for (int i = 0; i < cloud.rows(); ++i) cloud.row(i) << uniform(random), uniform(random), uniform(random);
  try {
    find_table({cloud}, SegmentSettings());
    FAIL() << "a uniform cube holds no table";
  } catch (const data::InputError& error) {
    EXPECT_NE(std::string(error.what()).find("no plane across the vertical"), std::string::npos)
        << error.what();
  }
}

}  // namespace
}  // namespace flash::sysid
