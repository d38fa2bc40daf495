#include "python/bindings/replay.h"

#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <atomic>
#include <future>
#include <memory>
#include <optional>
#include <thread>

#include "data/files/error.h"
#include "data/files/text.h"
#include "python/bindings/distances.h"
#include "python/bindings/likelihood.h"
#include "python/bindings/worker.h"
#include "sim/device.h"
#include "sim/newton/accepted.h"
#include "sysid/emulate/material_base.h"
#include "sysid/observe/horizon.h"
#include "sysid/replay/memory_estimate.h"
#include "sysid/report/settings_texts.h"
#include "sysid/report/summary.h"

namespace flash::python {

namespace nb = nanobind;

namespace {

using Values = std::vector<std::pair<std::string, double>>;

/// As the command line has them, so that both are refused alike.
std::vector<sysid::Axis> axes_of(const Values& values) {
  std::vector<sysid::Axis> axes;
  for (const auto& [name, value] : values)
    axes.push_back(sysid::parse_hold(name + "=" + data::format_number(value)).axis);
  return axes;
}

/// What flash_sim.sysid.replay is told; each as the option of flash-sysid of that name.
struct Options {
  std::string mesh;
  double time_step, tolerance;
  int iterations;
  std::optional<std::string> grasp_shape;
  std::optional<double> grasp_within, grasp_cell;
  bool clamp_slopes;
  std::optional<double> self_contact, layer_friction;
  std::string device;
  int threads;
};

sysid::ReplaySettings settings_of(const Options& options) {
  sysid::ReplaySettings settings;
  settings.solver.time_step = options.time_step;
  settings.solver.max_iterations = options.iterations;
  settings.solver.tolerance = options.tolerance;
  settings.mesh = options.mesh;
  settings.grasp_shape = data::parse_grasp_shape(options.grasp_shape.value_or(""));
  settings.grasp_within = options.grasp_within;
  settings.grasp_cell = options.grasp_cell;
  settings.clamp_slopes = options.clamp_slopes;
  if (options.self_contact)
    settings.self_contact =
        sim::SelfContact{.thickness = *options.self_contact, .friction = options.layer_friction.value_or(-1)};
  const sim::DeviceChoice device = sim::choose_device(options.device == "auto" ? "cpu" : options.device);
  if (settings.self_contact && device.device == sim::Device::cuda)
    throw data::InputError("--device: found \"" + options.device +
                           "\", expected cpu: --self-contact is simulated there alone");
  settings.device = device.device;
  settings.cuda_devices = device.cuda_devices;
  settings.threads = options.threads > 0 ? options.threads
                                         : std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  return settings;
}

std::shared_ptr<PreparedReplay> prepare(const LoadedRecording& loaded, const std::string& asset, bool horizon,
                                        const Options& options) {
  const nb::gil_scoped_release release;
  auto prepared = std::make_shared<PreparedReplay>();
  prepared->asset = data::load_asset(asset);
  if (prepared->asset.element_type == data::ElementType::tetrahedron && options.clamp_slopes)
    throw data::InputError(
        "--clamp-slopes: found a solid, expected a sheet: a solid has no slopes of its own");
  prepared->ready = sysid::make_asset_replay(loaded.recording, prepared->asset, settings_of(options));
  sysid::AssetReplay& ready = prepared->ready;
  sysid::check_job({ready.replay}, 1, sysid::estimate_batch({ready.replay}, 1, true));
  if (ready.identified && horizon) sysid::drop_beyond_horizon(ready.identified->horizon_s, ready.replay);
  return prepared;
}

/// All positions one after the other.
nb::object positions_of(const sysid::Motion& motion) {
  const auto vertices = static_cast<std::size_t>(motion.positions.front().rows());
  std::vector<double> numbers;
  numbers.reserve(motion.positions.size() * vertices * 3);
  for (const data::Points& positions : motion.positions)
    numbers.insert(numbers.end(), positions.data(), positions.data() + positions.size());
  return nb::cast(array_of(std::move(numbers), {motion.positions.size(), vertices, 3}));
}

nb::object forces_of(const sysid::Motion& motion) {
  std::vector<double> numbers;
  for (const Eigen::Vector3d& force : motion.forces)
    numbers.insert(numbers.end(), force.data(), force.data() + 3);
  return nb::cast(array_of(std::move(numbers), {motion.forces.size(), 3}));
}

/// What flash_sim.sysid.Motion has, by its names.
nb::dict run(const PreparedReplay& prepared, const Values& values) {
  const std::vector<sysid::Axis> axes = axes_of(values);
  sysid::Replay replay = prepared.ready.replay;
  std::vector<std::string> notices;
  const sysid::MaterialBase base = sysid::material_base(prepared.asset, replay.sheet(), notices, axes);
  const sysid::ReplayCandidate candidate = sysid::candidate_of(prepared.ready, base, axes);
  if (replay.settings.device == sim::Device::cuda)
    if (const std::string why = sysid::why_not_on_device(replay, {candidate}); !why.empty())
      throw data::InputError("--device: found cuda, expected cpu: " + why);
  std::atomic<bool> stop = false;
  replay.settings.solver.stop = &stop;
  sysid::ReplayResult result;
  std::future<void> work = std::async(std::launch::async, [&] {
    sysid::run(replay, {candidate}, sysid::every_step(replay),
               [&](std::size_t, sysid::ReplayResult finished) { result = std::move(finished); });
  });
  await(work, [&] { stop = true; });
  if (!result.finite)
    throw std::runtime_error(replay.recording.name + ": the simulation diverged; lower time_step");
  nb::dict fields, parameters;
  for (const sysid::Parameter& parameter : sysid::known_parameters())
    if (sysid::is_of(parameter, base) && parameter.material)
      parameters[parameter.name.c_str()] = parameter.get(candidate, base);
  for (const auto& [name, value] : values) parameters[name.c_str()] = value;
  const sysid::Motion& motion = result.motion;
  fields["positions"] = positions_of(motion);
  fields["forces"] = forces_of(motion);
  fields["values"] = parameters;
  fields["converged"] = result.converged;
  fields["accepted"] = sim::accepted(result.unconverged_share, result.residual_max);
  fields["unconverged_share"] = result.unconverged_share;
  fields["residual_max"] = result.residual_max;
  fields["penetration_max"] = result.penetration_max;
  notices.insert(notices.begin(), replay.notices.begin(), replay.notices.end());
  fields["notices"] = notices;
  return fields;
}

nb::list parameters() {
  nb::list rows;
  for (const sysid::Parameter& p : sysid::known_parameters())
    rows.append(nb::make_tuple(p.name, p.unit, p.low, p.high, p.meaning));
  return rows;
}

}  // namespace

sysid::Motion motion_of(const PreparedReplay& prepared, const Numbers& positions, const Numbers& forces) {
  const sysid::Replay& replay = prepared.ready.replay;
  sysid::Motion motion{replay.start, replay.settings.solver.time_step, {}, {}};
  const auto vertices = static_cast<Eigen::Index>(positions.shape(1));
  if (vertices != replay.surface.vertices.rows())
    throw data::InputError("motion.positions: found " + std::to_string(vertices) + " vertices, expected " +
                           std::to_string(replay.surface.vertices.rows()));
  for (std::size_t k = 0; k < positions.shape(0); ++k)
    motion.positions.emplace_back(Eigen::Map<const data::Points>(
        positions.data() + static_cast<std::ptrdiff_t>(k) * 3 * vertices, vertices, 3));
  for (std::size_t k = 0; k < forces.shape(0); ++k)
    motion.forces.emplace_back(Eigen::Map<const Eigen::Vector3d>(forces.data() + 3 * k));
  return motion;
}

void bind_replay(nb::module_& module) {
  nb::class_<PreparedReplay>(module, "PreparedReplay")
      .def("run", &run)
      .def("distances", &distances)
      .def("mesh",
           [](const PreparedReplay& p) { return sysid::settings_texts({p.ready.replay}, {}).at("mesh"); })
      .def("rest", [](const PreparedReplay& p) { return array_of(p.ready.replay.surface.vertices); })
      .def("triangles", [](const PreparedReplay& p) { return array_of(p.ready.replay.surface.triangles); })
      .def("clock", [](const PreparedReplay& p) {
        const sysid::Replay& replay = p.ready.replay;
        return nb::make_tuple(replay.start, replay.settings.solver.time_step, replay.steps);
      });
  module.def(
      "prepare_replay",
      [](const LoadedRecording& recording, const std::string& asset, bool horizon, const std::string& mesh,
         double time_step, int iterations, double tolerance, const std::optional<std::string>& grasp_shape,
         std::optional<double> grasp_within, std::optional<double> grasp_cell, bool clamp_slopes,
         std::optional<double> self_contact, std::optional<double> layer_friction, const std::string& device,
         int threads) {
        return prepare(recording, asset, horizon,
                       {mesh, time_step, tolerance, iterations, grasp_shape, grasp_within, grasp_cell,
                        clamp_slopes, self_contact, layer_friction, device, threads});
      },
      nb::arg("recording"), nb::kw_only(), nb::arg("asset"), nb::arg("horizon"), nb::arg("mesh"),
      nb::arg("time_step"), nb::arg("iterations"), nb::arg("tolerance"), nb::arg("grasp_shape").none(),
      nb::arg("grasp_within").none(), nb::arg("grasp_cell").none(), nb::arg("clamp_slopes"),
      nb::arg("self_contact").none(), nb::arg("layer_friction").none(), nb::arg("device"),
      nb::arg("threads"));
  module.def("parameters", &parameters);
  module.def("check_summary", [](const std::string& path) { sysid::load_summary(path); });
  bind_likelihood(module);
}

}  // namespace flash::python
