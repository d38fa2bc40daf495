#include "sysid/observe/cloud_search.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>
#include <string>

#include "data/machine/parallel.h"
#include "sim/device.h"
#include "sysid/observe/registration.h"
#include "tests/sysid/moving_sheet.h"

namespace flash::sysid {
namespace {

/// A sheet that moves, seen with noise and stray points from beside where it is simulated, outline included.
struct Lift {
  Replay replay;
  Motion motion;

  explicit Lift(int cells) {
    const data::TriangleMesh mesh = flat_sheet(cells);
    replay.surface = mesh;
    replay.queries = std::make_shared<const SheetDistance>(mesh.triangles, mesh.vertices);
    replay.pivot = {0.2, 0.1, 0};
    replay.recording.nuisance.offset.setConstant(0.06);
    replay.recording.nuisance.yaw = 0.3;
    replay.recording.nuisance.time = 0.1;
    motion = moving_sheet_motion(mesh, 0.01, 110);
    const Registration truth{
        .offset = {0.03, -0.02, 0.01}, .yaw = 0.1, .time_offset = 0.023, .pivot = replay.pivot};
    std::mt19937 random(5);
    std::uniform_real_distribution<double> uniform(0, 1);
    std::normal_distribution<double> normal(0, 1);
    for (const double t : {0.30, 0.43, 0.50, 0.71, 0.85}) {
      data::Points surface = moving_sheet(mesh.vertices, t + truth.time_offset);
      surface = (surface * truth.observed_from_simulated().linear().transpose()).rowwise() +
                truth.observed_from_simulated().translation().transpose();
      Observation observation{.t = t, .points = data::Points(800, 3), .contour = data::Points(20, 3)};
      for (Eigen::Index i = 0; i < observation.points.rows(); ++i) {
        const auto corners = mesh.triangles.row(
            static_cast<Eigen::Index>(uniform(random) * static_cast<double>(mesh.triangles.rows())));
        const double a = uniform(random), b = uniform(random) * (1 - a);
        observation.points.row(i) =
            (1 - a - b) * surface.row(corners[0]) + a * surface.row(corners[1]) +
            b * surface.row(corners[2]) +
            Eigen::RowVector3d(normal(random), normal(random), normal(random)) * (i % 50 == 0 ? 0.3 : 1e-3);
      }
      observation.contour = surface.topRows(20);
      replay.observations.push_back(observation);
    }
    replay.observations[3].weight = 0;
    replay.observations[2].points.resize(0, 3);
  }

  RegistrationFit fit(const CloudSearches& searches) const {
    RegistrationProblem problem = registration_problem(replay, motion);
    problem.searches = searches;
    return register_motions({problem}, {}).front();
  }
};

/// Searches on the processor, with a hierarchy of its own for each surface.
CloudSearches processor_searches(const Replay& replay) {
  return [&replay](const Motion& motion) -> CloudSearch {
    const auto found = std::make_shared<std::vector<std::vector<sim::SurfaceFoot>>>();
    return [&replay, &motion, found](CloudPoints which, const Registration& registration) {
      const auto seen = which == CloudPoints::all ? replay.observations : thinned(replay.observations, 400);
      const data::Triangles& triangles = replay.surface.triangles;
      found->clear();
      for (const Observation& observation : seen) {
        data::Points x, velocities;
        surface_at(motion, observation.t + registration.time_offset, x, &velocities);
        const SurfaceDistance surface(triangles, x);
        std::vector<sim::SurfaceFoot>& feet = found->emplace_back();
        for (Eigen::Index i = 0; i < observation.points.rows(); ++i) {
          const Eigen::Vector3d point =
              registration.observed_from_simulated().inverse() * observation.points.row(i).transpose();
          const SurfacePoint nearest = surface.nearest(point);
          const Eigen::Vector3d direction = (point - nearest.position) / nearest.distance;
          double speed = 0;
          for (int k = 0; k < 3; ++k)
            speed += nearest.barycentric[k] * velocities.row(triangles(nearest.triangle, k)).dot(direction);
          feet.push_back({nearest.distance, {direction.x(), direction.y(), direction.z()}, speed});
        }
      }
      return std::vector<std::span<const sim::SurfaceFoot>>(found->begin(), found->end());
    };
  };
}

void expect_alike(const RegistrationFit& found, const RegistrationFit& expected, double within) {
  EXPECT_NEAR((found.registration.offset - expected.registration.offset).norm(), 0, within);
  EXPECT_NEAR(found.registration.yaw, expected.registration.yaw, within);
  EXPECT_NEAR(found.registration.time_offset, expected.registration.time_offset, within);
  EXPECT_NEAR(found.score, expected.score, within);
  EXPECT_EQ(found.bounds_hit, expected.bounds_hit);
  ASSERT_EQ(found.keyframe_scores.size(), expected.keyframe_scores.size());
  for (std::size_t k = 0; k < found.keyframe_scores.size(); ++k)
    EXPECT_NEAR(found.keyframe_scores[k], expected.keyframe_scores[k], within);
}

TEST(CloudSearch, GivesTheRegistrationThatTheHierarchyGives) {
  const Lift lift(16);
  const RegistrationFit expected = lift.fit({});
  EXPECT_NEAR(expected.registration.time_offset, 0.023, 2e-3);
  expect_alike(lift.fit(processor_searches(lift.replay)), expected, 1e-12);
}

TEST(CloudSearch, ThatHasNoRoomLeavesItToTheProcessor) {
  const Lift lift(8);
  const RegistrationFit expected = lift.fit({});
  expect_alike(lift.fit([](const Motion&) { return CloudSearch(); }), expected, 0);
}

class CloudSearchOnDevice : public testing::TestWithParam<const char*> {
 protected:
  bool on_cuda = std::string(GetParam()) != "cpu";
  void SetUp() override {
    if (on_cuda && !sim::why_no_cuda().empty()) GTEST_SKIP() << sim::why_no_cuda();
  }
  /// Where the replay is simulated, and so searched.
  void place(Replay& replay) const {
    const sim::DeviceChoice choice = sim::choose_device(GetParam());
    replay.settings.device = choice.device;
    replay.settings.cuda_devices = choice.cuda_devices;
  }
};
INSTANTIATE_TEST_SUITE_P(Devices, CloudSearchOnDevice, testing::Values("cpu", "cuda", "cuda:all"));

TEST_P(CloudSearchOnDevice, RegistersAndScoresAsTheProcessorDoesOnAnyThreads) {
  for (const int cells : {4, 16, 44}) {
    Lift lift(cells);
    const RegistrationFit expected = lift.fit({});
    place(lift.replay);
    const CloudSearches searches = device_searches(lift.replay, RegistrationSettings().points_per_keyframe);
    EXPECT_EQ(static_cast<bool>(searches), on_cuda);
    std::vector<RegistrationFit> fits(8);
    data::for_each_in_parallel(fits.size(), 4, [&](std::size_t k) { fits[k] = lift.fit(searches); });
    for (const RegistrationFit& fit : fits) {
      expect_alike(fit, expected, 1e-6);
      expect_alike(fit, fits.front(), 0);
    }
  }
}

TEST_P(CloudSearchOnDevice, OfAReplayWithoutCloudsIsNone) {
  Lift lift(4);
  place(lift.replay);
  for (Observation& observation : lift.replay.observations) observation.points.resize(0, 3);
  EXPECT_FALSE(device_searches(lift.replay, 400));
}

}  // namespace
}  // namespace flash::sysid
