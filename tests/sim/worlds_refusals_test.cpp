#include <gtest/gtest.h>

#include <cmath>
#include <exception>
#include <limits>
#include <string>

#include "data/files/error.h"
#include "sim/worlds.h"
#include "tests/sim/sheet_scene.h"
#include "tests/sim/worlds_scene.h"

namespace flash::sim {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

TEST(Worlds, SettersRefuseWhatIsWrongAndChangeNothing) {
  const Sheet sheet = small_sheet();
  const auto plan = make_sheet_plan(sheet);
  const int vertices = plan->pattern.size;
  Worlds worlds(plan, {on_a_table(sheet), on_a_table(sheet)}, {}),
      untouched(plan, {on_a_table(sheet), on_a_table(sheet)}, {});
  const auto expect_refused = [](const auto& call, const std::string& part) {
    try {
      call();
      ADD_FAILURE() << "not refused: " << part;
    } catch (const data::InputError& error) {
      EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
    }
  };
  const std::vector<double> good = {0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1};
  const auto with = [&](std::size_t place, double value) {
    std::vector<double> numbers = good;
    numbers[place] = value;
    return numbers;
  };
  const auto poses = [&](const Chosen& environments, int frame, const Tensor& numbers) {
    worlds.set_poses(environments, frame, numbers);
  };
  const Tensor two = tensor(good, {2, 7});
  for (const int wrong : {-1, 2, 1 << 30})
    expect_refused(
        [&] {
          poses(std::vector{0, wrong}, 0, two);
        },
        "environment " + std::to_string(wrong) + ", expected 0 to 1");
  expect_refused([&] { poses(std::vector{1, 1}, 0, two); }, "environment 1 twice");
  for (const int wrong : {-1, 1})
    expect_refused([&] { poses({}, wrong, two); }, "environment 0: found frame");
  expect_refused([&] { poses(std::vector{0}, 0, two); }, "found 2 x 7 numbers, expected 1 x 7");
  expect_refused([&] { poses({}, 0, tensor(good, {14})); }, "found 14 numbers, expected 2 x 7");
  expect_refused([&] { poses({}, 0, {}); }, "found a number numbers");
  for (const double wrong : {nan, HUGE_VAL}) {
    const std::vector<double> numbers = with(9, wrong);
    expect_refused([&] { poses({}, 0, tensor(numbers, {2, 7})); }, "environment 1: found");
  }
  const std::vector<double> zero = with(13, 0), long_one = with(13, 1.1);
  expect_refused(
      [&] {
        poses({}, 0, tensor(zero, {2, 7}));
      },
      "environment 1: found a quaternion of length 0");
  expect_refused([&] { poses({}, 0, tensor(long_one, {2, 7})); }, "length 1.1");
  Tensor elsewhere = two, single = two, gaps = two, none = two;
  elsewhere.device = Device::cuda;
  single.type = NumberType::float32;
  gaps.strides = {8, 1};
  none.data = nullptr;
  expect_refused([&] { poses({}, 0, elsewhere); }, "CUDA device, expected the CPU's");
  expect_refused([&] { poses({}, 0, single); }, "found float32, expected float64");
  expect_refused([&] { poses({}, 0, gaps); }, "strides with gaps");
  expect_refused([&] { poses({}, 0, none); }, "found no numbers");

  for (const int hold : {-1, 2}) {
    expect_refused([&] { worlds.grasp({}, hold); }, "found hold " + std::to_string(hold));
    expect_refused([&] { worlds.release({}, hold); }, "found hold " + std::to_string(hold));
  }
  const auto grasp = [&](const Grasp& what) { worlds.grasp(std::vector{1}, 1, what); };
  expect_refused(
      [&] {
        grasp({.vertices = {0, vertices}});
      },
      "environment 1: hold 1: found a vertex that is not there");
  expect_refused([&] { grasp({.vertices = {-1}}); }, "not there");
  expect_refused([&] { grasp({.vertices = {3, 3}}); }, "found a vertex twice");
  expect_refused([&] { grasp({.vertices = {3}, .reach = Reach{}}); }, "expected one of them");
  expect_refused([&] { grasp({.reach = Reach{.threshold = nan}}); }, "threshold of nan");
  expect_refused([&] { grasp({.reach = Reach{.half_extents = {0, -1, 0}}}); }, "half extents");
  expect_refused([&] { grasp({.reach = Reach{.first_vertex = vertices}}); }, "vertices that are not there");
  expect_refused([&] { grasp({.reach = Reach{.first_vertex = 1, .vertex_count = vertices}}); }, "not there");

  data::SheetMaterial material;
  const auto set = [&] { worlds.set_materials(std::vector{1}, std::vector{material}); };
  for (double data::SheetMaterial::*field :
       {&data::SheetMaterial::membrane_stiffness, &data::SheetMaterial::poissons_ratio,
        &data::SheetMaterial::areal_density, &data::SheetMaterial::bending_rigidity,
        &data::SheetMaterial::friction, &data::SheetMaterial::air_drag,
        &data::SheetMaterial::stiffness_damping, &data::SheetMaterial::yield_curvature})
    for (const double wrong : {nan, -1.0}) {
      material = {};
      material.*field = wrong;
      expect_refused(set, "environment 1: material: ");
    }
  material = {};
  material.yield_curvature = 10;  // of a plate, which does not yield
  expect_refused(set, "environment 1: yield_curvature");
  material = {};
  expect_refused([&] { worlds.set_materials({}, std::vector{material}); }, "found 1 materials, expected 2");
  expect_refused([&] { worlds.set_materials(std::vector{0}, std::vector{material}, 1); }, "found body 1");
  expect_refused([&] { worlds.set_materials(std::vector{0}, std::vector{data::SolidMaterial{}}); },
                 "expected one of tetrahedra");

  std::vector<double> places(static_cast<std::size_t>(6 * vertices), 0.0);
  places[4] = nan;
  expect_refused(
      [&] {
        worlds.reset({}, tensor(places, {2, vertices, 3}));
      },
      "environment 0: found nan at 4");
  expect_refused(
      [&] {
        worlds.reset({}, {}, tensor(places, {2, vertices, 3}));
      },
      "velocities: environment 0");
  expect_refused([&] { worlds.reset({}, tensor(places, {2, vertices - 1, 3})); }, "expected 2 x ");
  expect_refused([&] { worlds.set_velocities({}, tensor(places, {2, vertices, 3})); }, "found nan");
  expect_refused([&] { worlds.reset(std::vector{7}); }, "environment 7");
  expect_refused([&] { (void)worlds.save(std::vector{-3}); }, "environment -3");
  expect_refused([&] { worlds.load({}, {}); }, "found 0 environments, expected 2");
  expect_refused([&] { worlds.load(std::vector{0}, worlds.save({})); }, "found 2 environments, expected 1");
  Worlds other(make_sheet_plan(small_sheet(5)), {environment_of(small_sheet(5))}, {});
  expect_refused([&] { worlds.load(std::vector{0}, other.save({})); }, "another plan");
  Worlds slower(plan, {on_a_table(sheet)}, {.solver = {.time_step = 0.02}});
  expect_refused([&] { worlds.load(std::vector{0}, slower.save({})); }, "time step");

  worlds.step(20);
  untouched.step(20);
  for (int e = 0; e < 2; ++e) expect_same(state(worlds, e), state(untouched, e));
}

TEST(Worlds, TheConstructorNamesTheEnvironmentThatDoesNotFit) {
  const Sheet sheet = small_sheet();
  const auto plan = make_sheet_plan(sheet);
  const auto what_of = [&](std::vector<Environment> environments,
                           const WorldSettings& settings) -> std::string {
    try {
      Worlds(plan, std::move(environments), settings);
    } catch (const std::exception& error) {
      return error.what();
    }
    return "not refused";
  };
  std::vector<Environment> environments(3, on_a_table(sheet));
  environments[2].state.positions.conservativeResize(5, 3);
  EXPECT_NE(what_of(environments, {}).find("environment 2: "), std::string::npos);
  environments[2] = on_a_table(sheet);
  environments[1].holds.pop_back();
  EXPECT_NE(what_of(environments, {}).find("environment 1: "), std::string::npos);
  environments[1] = on_a_table(sheet);
  environments[1].materials[0].yield_curvature = 3;
  EXPECT_NE(what_of(environments, {}).find("environment 1: "), std::string::npos);
  environments[1] = on_a_table(sheet);
  environments[2].self_contact = SelfContact{};
  EXPECT_NE(what_of(environments, {.device = Device::cuda}).find("environment 2: self-contact"),
            std::string::npos);
}

}  // namespace
}  // namespace flash::sim
