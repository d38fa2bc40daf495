#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "apps/command_line/command_line.h"
#include "apps/command_line/option_checks.h"
#include "apps/sysid/options.h"
#include "apps/sysid/verbs.h"
#include "data/asset/asset_mesh.h"
#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "data/files/folder_lock.h"
#include "data/files/json_reader.h"
#include "data/files/staged_folder.h"
#include "data/files/text.h"
#include "data/files/writable.h"
#include "data/mesh/mesh_io.h"
#include "data/mesh/procedural_mesh.h"
#include "sim/newton/accepted.h"
#include "sysid/capture/render_depth.h"
#include "sysid/capture/synth.h"
#include "sysid/capture/track_twin.h"
#include "sysid/replay/recorded_grasp.h"

namespace flash {
namespace {

namespace fs = std::filesystem;

struct SynthOptions {
  CommonOptions common;
  sysid::SynthSettings synth;
  sim::SolverSettings solver;
  std::string asset;
  std::string like;
  double marker_noise = 0;  ///< [m]
  std::string mesh;
  std::vector<std::string> holds;
  std::vector<std::string> cameras;
  std::string resolution = "160x120";
  std::string grasp_shape = "clamp";
  double field_of_view = 60;
  std::vector<double> displacement, offset;
  bool no_gripper = false;
  std::string truth;
  std::string out;
};

Eigen::Vector3d parse_position(const std::string& text) {
  const std::vector<std::string_view> words = data::split(text, ",");
  Eigen::Vector3d position;
  for (int k = 0; k < 3; ++k) {
    const auto number =
        words.size() == 3 ? data::parse_number(words[static_cast<std::size_t>(k)]) : std::nullopt;
    if (!number || !std::isfinite(*number))
      throw data::InputError("--camera: found \"" + text + "\", expected x,y,z in metres, as 0.2,-0.7,0.75");
    position[k] = *number;
  }
  return position;
}

data::CameraIntrinsics make_intrinsics(const SynthOptions& options) {
  const std::vector<std::string_view> words = data::split(options.resolution, "x");
  const auto width = words.size() == 2 ? data::parse_integer(words[0]) : std::nullopt;
  const auto height = words.size() == 2 ? data::parse_integer(words[1]) : std::nullopt;
  if (!width || !height || *width < 8 || *height < 8 || *width > 4096 || *height > 4096)
    throw data::InputError("--resolution: found \"" + options.resolution + "\", expected pixels, as 160x120");
  data::CameraIntrinsics camera;
  camera.width = static_cast<int>(*width);
  camera.height = static_cast<int>(*height);
  camera.fx = camera.fy = 0.5 * camera.width / std::tan(0.5 * options.field_of_view * M_PI / 180);
  camera.cx = 0.5 * (camera.width - 1);
  camera.cy = 0.5 * (camera.height - 1);
  return camera;
}

// Aimed a little above the middle of the sheet, where it hangs. Without --camera: from the front, above.
std::vector<sysid::SynthCamera> make_cameras(const SynthOptions& options, const data::TriangleMesh& mesh) {
  const Eigen::Vector3d low = mesh.vertices.colwise().minCoeff(), high = mesh.vertices.colwise().maxCoeff();
  const double size = (high - low).maxCoeff();
  const Eigen::Vector3d target = 0.5 * (low + high) + 0.3 * size * Eigen::Vector3d::UnitZ();
  std::vector<Eigen::Vector3d> positions;
  for (const std::string& text : options.cameras) positions.push_back(parse_position(text));
  if (positions.empty()) positions.push_back(target + size * Eigen::Vector3d(0, -2.25, 1.6));
  std::vector<sysid::SynthCamera> cameras;
  for (const Eigen::Vector3d& position : positions)
    cameras.push_back({make_intrinsics(options), sysid::look_at(position, target, Eigen::Vector3d::UnitZ())});
  return cameras;
}

Eigen::Vector3d vector_of(const std::vector<double>& numbers) {
  return Eigen::Map<const Eigen::Vector3d>(numbers.data());
}

std::string name_of_folder(const std::string& folder) {
  const fs::path path = fs::path(folder).lexically_normal();
  return path.has_filename() ? path.filename().string() : path.parent_path().filename().string();
}

// Throws InputError where the truth would take the place of a file of the recording.
void check_truth_name(const SynthOptions& options) {
  const fs::path name = fs::weakly_canonical(fs::absolute(options.truth))
                            .lexically_relative(fs::weakly_canonical(fs::absolute(options.out)));
  const bool within = !name.empty() && *name.begin() != "..";
  const bool of_recording = name.has_parent_path() || name.extension() == ".tum" ||
                            name == "recording.json" || name == "camera_info.yaml" || name == "tracks.csv" ||
                            name == "placed.csv";
  if (within && of_recording)
    throw data::InputError("--truth-out: found " + options.truth +
                           ", the name of a file of the recording, expected another, as truth.json");
}

void check_places(const SynthOptions& options) {
  expect_each_once("--camera", options.cameras);
  if (!options.truth.empty()) check_truth_name(options);
  expect_ending("--truth-out", options.truth, {".json"});
  data::check_folder_free(options.out, options.common.force);
  if (!options.truth.empty()) data::check_file_free(options.truth, options.common.force);
}

// Of a recording that stands in the folder; what makes it one goes first.
void remove_former(const std::string& folder) {
  for (const char* old : {"recording.json", "import.svg", "truth.json", "camera_info.yaml", "frames"})
    fs::remove_all(fs::path(folder) / old);
  const auto camera = [&](int c) { return fs::path(folder) / ("camera" + std::to_string(c)); };
  for (int c = 1; fs::exists(camera(c) / "depth"); ++c) fs::remove_all(camera(c));
}

// The recording whole or not at all, with its truth where that has no other place.
void publish_synthetic(const SynthOptions& options, const std::string& truth,
                       sysid::SynthRecording& synthetic) {
  data::StagedFolder staged(options.out);
  if (std::string& mesh = synthetic.recording.mesh_spec;
      !data::is_mesh_spec(mesh))  // as named from its place
    mesh = (fs::path(staged.path()) /
            data::relative_path(mesh, (fs::path(options.out) / "recording.json").string()))
               .string();
  sysid::save_synthetic(synthetic, staged.path());
  if (options.truth.empty()) data::write_atomically((fs::path(staged.path()) / "truth.json").string(), truth);
  end_after_signal();
  if (options.common.force) remove_former(options.out);
  staged.publish("recording.json");
}

// The recording of a solid again, with the marker tracks that the asset gives it.
int run_twin(const SynthOptions& options) {
  const data::Recording recording = data::load_recording(options.like);
  warn_of_doubts(recording);
  const data::Asset asset = data::load_asset(options.asset);
  if (!recording.is_solid())
    throw data::InputError("--like: found a sheet in " + recording.source +
                           ", expected a solid with marker tracks; synth makes sheets with --kind");
  check_kind(asset, recording);
  sysid::ReplaySettings settings;
  settings.solver = options.solver;
  settings.solver.stop = &stop_on_signals();
  settings.mesh = options.mesh;
  settings.element_order = asset.element_order;
  const std::string& device = options.common.device;
  if (device != "auto" && sim::choose_device(device).device == sim::Device::cuda)
    throw data::InputError("--device " + options.common.device +
                           ": --like is simulated on the CPU alone; use --device cpu or auto");
  const sysid::Replay replay = sysid::make_replay(recording, settings);
  std::vector<std::string> notices;
  const std::vector<sysid::Axis> axes = parse_values(options.holds);
  const sysid::MaterialBase base = material_base(asset, replay.sheet(), notices, axes);
  sysid::check_axes(axes, base);
  std::vector<double> values;
  for (const sysid::Axis& axis : axes) values.push_back(axis.values.front());
  check_places(options);
  for (const std::string& notice : notices) say(options.common, notice);

  const sysid::ReplayCandidate candidate = sysid::make_candidate(base, axes, values);
  sysid::ReplayResult result;
  sysid::run(replay, {candidate}, scored_steps(replay),
             [&](std::size_t, sysid::ReplayResult made) { result = std::move(made); });
  const data::MarkerTracks tracks =
      sysid::simulated_tracks(replay, result.motion, options.marker_noise, options.common.seed);
  end_after_signal();
  const data::RunFolder run(options.out);
  fs::remove(fs::path(options.out) / "recording.json");  // what makes a folder a recording goes first
  sysid::save_track_twin(replay.recording, tracks, name_of_folder(options.out), options.out);
  const std::string truth =
      options.truth.empty() ? (fs::path(options.out) / "truth.json").string() : options.truth;
  data::write_atomically(truth, sysid::truth_text(candidate, options.marker_noise, options.common.seed));
  if (options.common.json) {
    std::cout << data::format_json(nlohmann::ordered_json{{"schema", "flash-sysid-synth/1"},
                                                          {"recording", options.out},
                                                          {"truth", truth},
                                                          {"keyframes", tracks.samples.size()},
                                                          {"points", 0},
                                                          {"unconverged_share", result.unconverged_share},
                                                          {"residual_max", result.residual_max}});
  } else {
    std::printf("%s: %zu times of %zu markers\n%s\n", options.out.c_str(), tracks.samples.size(),
                tracks.names.size(), truth.c_str());
  }
  return sim::accepted(result.unconverged_share, result.residual_max) ? exit_done : exit_unusable;
}

int run_synth(SynthOptions options) {
  stop_on_signals();
  if (!options.like.empty()) return run_twin(options);
  options.synth.device = sim::choose_device(options.common.device == "auto" ? "cpu" : options.common.device);
  const data::Asset asset = data::load_asset(options.asset);
  const std::string mesh_spec = options.mesh.empty() ? asset.mesh : options.mesh;
  const data::TriangleMesh mesh = options.mesh.empty() ? data::load_rest_mesh(asset)
                                  : data::is_mesh_spec(mesh_spec)
                                      ? data::parse_mesh_spec(mesh_spec, "--mesh", "")
                                      : data::load_triangle_mesh(mesh_spec);
  std::vector<std::string> notices;
  const std::vector<sysid::Axis> axes = parse_values(options.holds);
  const sysid::MaterialBase base = material_base(asset, sim::make_sheet(mesh), notices, axes);
  std::vector<double> values;
  for (const sysid::Axis& axis : axes) values.push_back(axis.values.front());
  sysid::check_patch_size(options.synth.grasp_within, mesh);
  check_places(options);
  for (const std::string& notice : notices) say(options.common, notice);

  sysid::SynthSettings& settings = options.synth;
  settings.name = name_of_folder(options.out);
  settings.seed = options.common.seed;
  settings.cameras = make_cameras(options, mesh);
  if (!options.displacement.empty()) settings.displacement = vector_of(options.displacement);
  if (!options.offset.empty()) settings.cloud_offset = vector_of(options.offset);
  settings.grasp_shape = data::parse_grasp_shape(options.grasp_shape).value_or(settings.grasp_shape);
  if (options.no_gripper) settings.gripper_half_extents.setZero();

  const sysid::ReplayCandidate made = sysid::make_candidate(base, axes, values);
  const data::SheetMaterial& material = made.material;
  settings.nuisance = made.nuisance;
  options.solver.stop = &stop_on_signals();
  sysid::SynthRecording synthetic = sysid::synthesize(mesh, mesh_spec, material, settings, options.solver);
  end_after_signal();
  const std::string truth =
      options.truth.empty() ? (fs::path(options.out) / "truth.json").string() : options.truth;
  publish_synthetic(options, sysid::truth_text(material, settings), synthetic);
  if (!options.truth.empty()) data::write_atomically(truth, sysid::truth_text(material, settings));

  if (synthetic.unconverged_share > 0)
    warn("the simulation did not converge in " + data::format_short(100 * synthetic.unconverged_share) +
         " % of the steps, residual up to " + data::format_short(synthetic.residual_max) +
         " (accepted: 1 %, and a residual of 1)");
  Eigen::Index points = 0;
  for (const data::Points& cloud : synthetic.clouds) points += cloud.rows();
  if (options.common.json) {
    std::cout << data::format_json(nlohmann::ordered_json{{"schema", "flash-sysid-synth/1"},
                                                          {"recording", options.out},
                                                          {"truth", truth},
                                                          {"keyframes", synthetic.clouds.size()},
                                                          {"points", points},
                                                          {"unconverged_share", synthetic.unconverged_share},
                                                          {"residual_max", synthetic.residual_max}});
  } else {
    std::printf("%s: %zu keyframes, %s points\n%s\n", options.out.c_str(), synthetic.clouds.size(),
                data::format_count(static_cast<std::size_t>(points)).c_str(), truth.c_str());
  }
  return sim::accepted(synthetic.unconverged_share, synthetic.residual_max) ? exit_done : exit_unusable;
}

}  // namespace

void add_synth_verb(CLI::App& app, Action& action) {
  const auto options = std::make_shared<SynthOptions>();
  CLI::App* verb = app.add_subcommand(
      "synth", "Make a recording from an asset: simulate it and look at it with depth cameras");
  sysid::SynthSettings& synth = options->synth;
  verb->add_option("--asset", options->asset, "File of the object")->required();
  verb->add_option("--kind", synth.kind, "What is done to the sheet")
      ->check(CLI::IsMember({"corner_lift", "hang", "drag", "bar_pull", "bias_pull"}))
      ->capture_default_str();
  CLI::Option* like =
      verb->add_option("--like", options->like,
                       "Recording of a solid that is made again, with the marker tracks of the asset");
  verb->add_option("--marker-noise", options->marker_noise,
                   "Standard deviation of each coordinate of a marker [m]")
      ->check(number_from(0))
      ->needs(like)
      ->capture_default_str();
  verb->add_option("--mesh", options->mesh, "Mesh in place of the asset's, as sheet:0.4x0.4:0.02");
  add_hold_option(*verb, options->holds, "A value in place of the asset's, as bending=1e-4");
  add_vector_option(*verb, "--displacement", options->displacement,
                    "Path of the gripper x,y,z, in place of that of the kind [m]");
  verb->add_option("--duration", synth.duration, "Duration of the motion [s]")
      ->check(positive_number())
      ->capture_default_str();
  verb->add_option("--rest", synth.rest, "Time that is recorded after the motion [s]")
      ->check(number_from(0))
      ->capture_default_str();
  verb->add_option("--rate", synth.keyframe_rate, "Keyframes per second")
      ->check(positive_number())
      ->capture_default_str();
  verb->add_option("--grasp-within", synth.grasp_within, "Size of the grasped patch [m]")
      ->check(positive_number())
      ->capture_default_str();
  add_grasp_cell_option(*verb, synth.grasp_cell);
  verb->add_option("--grasp-shape", options->grasp_shape, "How the patch sits in the fingers")
      ->check(CLI::IsMember({"clamp", "point", "pinch"}))
      ->capture_default_str();
  verb->add_option("--camera", options->cameras,
                   "Position x,y,z of a camera [m], aimed at the sheet; repeat for more")
      ->type_name("X,Y,Z")
      ->allow_extra_args(false);
  verb->add_option("--resolution", options->resolution, "Width and height of the pictures [px]")
      ->capture_default_str();
  verb->add_option("--fov", options->field_of_view, "Horizontal field of view [deg]")
      ->check(number_between(5, 150))
      ->capture_default_str();
  verb->add_option("--noise", synth.depth_noise, "Standard deviation of depth along the ray [m]")
      ->check(number_from(0))
      ->capture_default_str();
  verb->add_option("--dropped", synth.dropped, "Share of keyframes lost")
      ->check(number_between(0, 1))
      ->capture_default_str();
  add_vector_option(*verb, "--offset-error", options->offset,
                    "Error that is put on the camera's place, x,y,z [m]");
  verb->add_option("--time-offset-error", synth.time_offset, "Error that is put on the camera's clock [s]")
      ->check(any_number())
      ->capture_default_str();
  verb->add_flag("--clamp-slopes", synth.clamp_slopes,
                 "The grasped patch does not bend: it holds the sheet's slope as well as its place");
  verb->add_flag("--raw", synth.raw,
                 "Write what the cameras see, table and gripper included, to cameraN/depth, as for segment");
  verb->add_flag("--forces", synth.forces, "Record the gripper's force too");
  verb->add_flag("--no-gripper", options->no_gripper, "The gripper hides no cloth from the cameras");
  verb->add_option("--time-step", options->solver.time_step, "Time step of the simulation [s]")
      ->check(time_step())
      ->capture_default_str();
  verb->add_option("--truth-out", options->truth,
                   "File for the truth; without it, truth.json in the recording");
  verb->add_option("-o,--out", options->out, "Folder of the recording")->required();
  add_seed_option(*verb, options->common);
  verb->add_option("--device", options->common.device,
                   "Where the simulation runs: cpu, cuda or cuda:1, by number; auto: the CPU")
      ->capture_default_str();
  add_common_options(*verb, options->common);
  verb->footer(
      "Example:\n"
      "  flash-sysid synth --asset towel.json --kind corner_lift --mesh sheet:0.4x0.4:0.02 --camera "
      "0.2,-0.7,0.75 \\\n"
      "    --noise 0.001 --seed 1 -o lift");
  verb->callback([options, &action] { action = [options] { return run_synth(*options); }; });
}

}  // namespace flash
