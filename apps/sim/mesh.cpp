#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "apps/command_line/command_line.h"
#include "apps/command_line/doubts_option.h"
#include "apps/command_line/option_checks.h"
#include "apps/sim/verbs.h"
#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "data/files/json_reader.h"
#include "data/files/text.h"
#include "data/files/writable.h"
#include "data/mesh/mesh_io.h"
#include "data/mesh/procedural_mesh.h"
#include "data/meshing/flatten.h"
#include "data/meshing/fused_frames.h"
#include "data/meshing/scanned_surface.h"
#include "data/meshing/tetrahedralize.h"

namespace flash {
namespace {

/// Above this a sheet is said not to develop: cloth that hangs by its weight strains less.
constexpr double most_rms_strain = 0.01;

struct MeshOptions {
  std::string input, out, flat;
  data::ScanSettings scan;
  data::DepthFrames frames;
  std::string lens;  ///< of depth frames: "stated", "solved", a file; empty: they have to agree
  double scale = 1;
  bool points = false, tets = false, weld = false, json = false, force = false, despite_doubts = false;
};

std::string millimetres(double metres) { return data::format_short(1000 * metres) + " mm"; }
std::string percent(double share) { return data::format_short(100 * share) + " %"; }

bool are_depth_frames(const MeshOptions& options) {
  const data::DepthFrames& frames = options.frames;
  return !(frames.intrinsics + frames.poses + frames.extrinsics).empty();
}

/// The scan in metres; without triangles it is a cloud. `notice` becomes what its lens has to say.
data::Geometry load(const MeshOptions& options, std::size_t& left_out, std::string& notice) {
  data::Geometry scan;
  if (!std::filesystem::is_directory(options.input))
    scan = data::load_scan(options.input, left_out);
  else if (are_depth_frames(options))
    scan.points = data::fused_depth(options.frames, options.despite_doubts, notice);
  else
    scan.points = data::fused_clouds(options.input, left_out);
  scan.points *= options.scale;
  if (options.points) scan.triangles.resize(0, 3);
  return scan;
}

/// A sheet whose triangles lie on each other has no rest shape.
void check_turned_over(const MeshOptions& options, const data::FlatShape& flat, Eigen::Index triangles) {
  if (flat.inverted == 0 || options.despite_doubts) return;
  throw data::InputError(
      options.input + ": does not lie flat: found " + data::format_count(std::size_t(flat.inverted)) +
      " of " + data::format_count(std::size_t(triangles)) +
      " triangles turned over, expected none; --despite-doubts writes the shape all the same");
}

std::vector<std::string> warnings_of(const data::ScannedSurface& sheet, std::size_t left_out) {
  std::vector<std::string> warnings;
  if (left_out > 0)
    warnings.push_back(data::format_count(left_out) + " points that are not finite were left out");
  if (sheet.dropped > 0.01)
    warnings.push_back("parts with " + percent(sheet.dropped) +
                       " of the area hang on nothing and were left out");
  if (sheet.far_points > 0.01)
    warnings.push_back(percent(sheet.far_points) + " of the scan lies more than three edges off the mesh");
  if (sheet.borders > 1)
    warnings.push_back(std::to_string(sheet.borders - 1) +
                       " holes are wider than --holes and stay open, or are bordered too oddly to close");
  return warnings;
}

void print(const MeshOptions& options, const data::ScannedSurface& sheet,
           const std::optional<data::FlatShape>& flat) {
  std::printf("%s: %s vertices, %s triangles; edges %s to %s, %s in the mean\n", options.out.c_str(),
              data::format_count(std::size_t(sheet.mesh.vertices.rows())).c_str(),
              data::format_count(std::size_t(sheet.mesh.triangles.rows())).c_str(),
              millimetres(sheet.edges.least).c_str(), millimetres(sheet.edges.largest).c_str(),
              millimetres(sheet.edges.mean).c_str());
  std::printf("the scan lies %s rms off it; %s outliers left out, %d holes closed, %d borders\n",
              millimetres(sheet.distance_rms).c_str(), data::format_count(sheet.outliers).c_str(),
              sheet.filled, sheet.borders);
  if (flat)
    std::printf("%s: %s x %s m; edges strained by %s rms, %s at most\n", options.flat.c_str(),
                data::format_short(flat->width).c_str(), data::format_short(flat->height).c_str(),
                percent(flat->rms_strain).c_str(), percent(flat->largest_strain).c_str());
}

nlohmann::ordered_json json_of(const MeshOptions& options, const data::ScannedSurface& sheet,
                               const std::optional<data::FlatShape>& flat,
                               const std::vector<std::string>& warnings, int exit_code) {
  nlohmann::ordered_json json = {{"schema", "flash-sim-mesh/1"},
                                 {"mesh", options.out},
                                 {"vertices", sheet.mesh.vertices.rows()},
                                 {"triangles", sheet.mesh.triangles.rows()},
                                 {"edge_min_m", sheet.edges.least},
                                 {"edge_mean_m", sheet.edges.mean},
                                 {"edge_max_m", sheet.edges.largest},
                                 {"euler", sheet.euler},
                                 {"borders", sheet.borders},
                                 {"points", sheet.points},
                                 {"outliers", sheet.outliers},
                                 {"dropped_share", sheet.dropped},
                                 {"far_share", sheet.far_points},
                                 {"holes_closed", sheet.filled},
                                 {"distance_rms_m", sheet.distance_rms},
                                 {"flat", nullptr},
                                 {"warnings", warnings},
                                 {"exit_code", exit_code}};
  if (flat)
    json["flat"] = {{"mesh", options.flat},
                    {"width_m", flat->width},
                    {"height_m", flat->height},
                    {"strain_rms", flat->rms_strain},
                    {"strain_max", flat->largest_strain},
                    {"turned_over", flat->inverted}};
  return json;
}

int mesh_sheet(const MeshOptions& options) {
  std::size_t left_out = 0;
  std::string lens_notice;
  const data::Geometry scan = load(options, left_out, lens_notice);
  const data::ScannedSurface sheet =
      scan.triangles.rows() > 0
          ? data::mesh_of_surface({scan.points, scan.triangles}, options.scan, options.input)
          : data::mesh_of_cloud(scan.points, options.scan, options.input);
  std::vector<std::string> warnings = warnings_of(sheet, left_out);
  if (!lens_notice.empty()) warnings.push_back(lens_notice);
  std::vector<data::FileText> files = {{options.out, data::format_triangle_mesh(sheet.mesh, options.out)}};
  std::optional<data::FlatShape> flat;
  int exit_code = exit_done;
  if (!options.flat.empty()) {
    flat = data::flattened(sheet.mesh, options.input);
    check_turned_over(options, *flat, sheet.mesh.triangles.rows());
    files.push_back(
        {options.flat, data::format_triangle_mesh({flat->vertices, sheet.mesh.triangles}, options.flat)});
    if (flat->inverted > 0) {
      warnings.insert(warnings.begin(),
                      data::format_count(std::size_t(flat->inverted)) +
                          " triangles of the flat shape are turned over; it is no rest shape");
      exit_code = exit_unusable;
    }
    if (!(flat->rms_strain <= most_rms_strain)) {
      warnings.insert(warnings.begin(),
                      "the surface does not develop: laid flat, its edges are strained by " +
                          percent(flat->rms_strain) + " rms and " + percent(flat->largest_strain) +
                          " at most (accepted: " + percent(most_rms_strain) +
                          " rms); the flat shape is not its rest shape");
      exit_code = exit_unusable;
    }
  }
  end_after_signal();
  data::write_together(files);
  for (const std::string& warning : warnings) std::cerr << "flash-sim: warning: " << warning << '\n';
  if (options.json)
    std::cout << data::format_json(json_of(options, sheet, flat, warnings, exit_code));
  else
    print(options, sheet, flat);
  return exit_code;
}

int mesh_solid(const MeshOptions& options) {
  data::Geometry surface = data::load_geometry(options.input);
  const data::FilledSolid solid = data::filled_solid({options.scale * surface.points, surface.triangles},
                                                     options.scan.edge, options.input);
  end_after_signal();
  data::save_tet_mesh(solid.mesh, options.out);
  if (options.json) {
    const nlohmann::ordered_json json = {{"schema", "flash-sim-mesh/1"},
                                         {"mesh", options.out},
                                         {"vertices", solid.mesh.vertices.rows()},
                                         {"tetrahedra", solid.mesh.tetrahedra.rows()},
                                         {"edge_min_m", solid.shortest_edge},
                                         {"edge_max_m", solid.longest_edge},
                                         {"volume_m3", solid.volume},
                                         {"surface_volume_m3", solid.surface_volume},
                                         {"angle_min_deg", solid.least_angle},
                                         {"angle_max_deg", solid.largest_angle},
                                         {"exit_code", exit_done}};
    std::cout << data::format_json(json);
    return exit_done;
  }
  std::printf("%s: %s vertices, %s tetrahedra; edges %s to %s; faces meet at %s to %s degrees\n",
              options.out.c_str(), data::format_count(std::size_t(solid.mesh.vertices.rows())).c_str(),
              data::format_count(std::size_t(solid.mesh.tetrahedra.rows())).c_str(),
              millimetres(solid.shortest_edge).c_str(), millimetres(solid.longest_edge).c_str(),
              data::format_short(solid.least_angle).c_str(), data::format_short(solid.largest_angle).c_str());
  std::printf("volume %s m^3, within the surface %s m^3\n", data::format_number(solid.volume).c_str(),
              data::format_number(solid.surface_volume).c_str());
  return exit_done;
}

/// Of a file, or made on the spot.
data::Geometry given_mesh(const std::string& name) {
  if (data::is_tet_mesh_spec(name)) {
    const data::TetMesh solid = data::parse_tet_mesh_spec(name, "mesh", "");
    return {.points = solid.vertices, .triangles = {}, .tetrahedra = solid.tetrahedra};
  }
  if (!data::is_mesh_spec(name)) return data::load_geometry(name);
  const data::TriangleMesh sheet = data::parse_mesh_spec(name, "mesh", "");
  return {.points = sheet.vertices, .triangles = sheet.triangles, .tetrahedra = {}};
}

/// The mesh as it is, but for vertices of a file in one place, which become one.
int mesh_welded(const MeshOptions& options) {
  const data::Geometry given = given_mesh(options.input);
  const bool is_made = data::is_made_on_the_spot(options.input);
  const bool is_solid = given.tetrahedra.rows() > 0;
  std::string text;
  Eigen::Index vertices = 0;
  if (is_solid) {
    data::TetMesh solid =
        is_made ? data::TetMesh{given.points, given.tetrahedra} : data::load_tet_mesh(options.input, true);
    solid.vertices *= options.scale;
    vertices = solid.vertices.rows();
    text = data::format_tet_mesh(solid, options.out);
  } else {
    data::TriangleMesh sheet = is_made ? data::TriangleMesh{given.points, given.triangles}
                                       : data::load_triangle_mesh(options.input, true);
    sheet.vertices *= options.scale;
    vertices = sheet.vertices.rows();
    text = data::format_triangle_mesh(sheet, options.out);
  }
  end_after_signal();
  data::write_atomically(options.out, text);
  const Eigen::Index elements = is_solid ? given.tetrahedra.rows() : given.triangles.rows(),
                     joined = given.points.rows() - vertices;
  const char* kind = is_solid ? "tetrahedra" : "triangles";
  if (options.json)
    std::cout << data::format_json({{"schema", "flash-sim-mesh/1"},
                                    {"mesh", options.out},
                                    {"vertices", vertices},
                                    {kind, elements},
                                    {"joined", joined},
                                    {"exit_code", exit_done}});
  else
    std::printf("%s: %s vertices, %s %s; %s vertices in the place of another, or of no element, are gone\n",
                options.out.c_str(), data::format_count(std::size_t(vertices)).c_str(),
                data::format_count(std::size_t(elements)).c_str(), kind,
                data::format_count(std::size_t(joined)).c_str());
  return exit_done;
}

/// The lens of depth frames, and where they were seen from.
void read_lens(MeshOptions& options) {
  data::DepthFrames& frames = options.frames;
  std::string own;
  frames.lens = data::parse_lens_choice(options.lens, own);
  if (!own.empty() && !frames.intrinsics.empty())
    throw data::InputError("--lens: found " + own + ", expected stated or solved beside --intrinsics");
  if (!own.empty()) frames.intrinsics = own;
  if (!are_depth_frames(options)) return;
  if (frames.poses.empty() == frames.extrinsics.empty())
    throw data::InputError("--intrinsics: depth frames need one of --poses and --extrinsics");
  if (frames.intrinsics.empty() && !frames.poses.empty())
    throw data::InputError("--poses: are for depth frames, which need --intrinsics");
}

/// A mesh that is made on the spot is written as its name says.
void expect_no_scan_option(const CLI::App& verb, const MeshOptions& options) {
  for (const char* name : {"--flat", "--edge", "--smoothing", "--holes", "--points", "--tets", "--weld",
                           "--intrinsics", "--lens", "--poses", "--extrinsics", "--masks", "--depth-scale"})
    if (verb.count(name) > 0)
      throw data::InputError(std::string(name) + ": is of scans, found " + options.input +
                             ", which is made as its name says");
}

int mesh(const CLI::App& verb, MeshOptions options) {
  const bool is_made = data::is_made_on_the_spot(options.input);
  if (is_made) expect_no_scan_option(verb, options);
  read_lens(options);
  data::check_file_free(options.out, options.force);
  if (options.weld || is_made) return mesh_welded(options);
  if (options.tets) {
    data::format_tet_mesh({}, options.out);  // refuses the ending before the work
    return mesh_solid(options);
  }
  data::format_triangle_mesh({}, options.out);
  if (!options.flat.empty()) {
    data::check_file_free(options.flat, options.force);
    data::format_triangle_mesh({}, options.flat);
  }
  return mesh_sheet(options);
}

}  // namespace

void add_mesh_verb(CLI::App& app, Action& action) {
  CLI::App& verb = *app.add_subcommand("mesh", "Make a mesh to simulate from a scan or a closed surface");
  const auto options = std::make_shared<MeshOptions>();
  verb.footer(
      "A scan is a cloud, a mesh, or a folder of clouds or depth frames of one sheet that does not move. "
      "--flat\n"
      "lays the sheet out: the rest shape of its asset. Exit code 3: it does not develop, more than 1 % "
      "rms.\n"
      "Exit code 2: triangles of the flat shape are turned over; --despite-doubts writes it.\n"
      "Examples:\n"
      "  flash-sim mesh scan.ply --edge 0.01 -o cloth.obj --flat cloth_flat.obj\n"
      "  flash-sim mesh depth --intrinsics camera_info.yaml --poses camera.tum -o cloth.obj\n"
      "  flash-sim mesh solid.stl --scale 0.001 --tets --edge 0.005 -o solid.vtk\n"
      "  flash-sim mesh part.msh --weld -o part.vtk\n"
      "  flash-sim mesh sheet:0.4x0.3:0.01 -o towel.obj");
  verb.add_option(
          "scan", options->input,
          "Cloud or mesh (.ply .obj .stl .vtk .msh .pcd), or a folder of .ply, .pcd or depth .png; a name as "
          "sheet:0.4x0.3:0.01 or box:0.1x0.03x0.03:0.01 is written as it says")
      ->required();
  verb.add_option("-o,--out", options->out, "Mesh to write (.obj .ply .vtk; of tetrahedra .vtk .tet)")
      ->required();
  CLI::Option* flat =
      verb.add_option("--flat", options->flat, "Flat rest shape to write, of the same triangles");
  CLI::Option* edge = verb.add_option("--edge", options->scan.edge, "Length of the edges [m]")
                          ->check(positive_number())
                          ->capture_default_str();
  CLI::Option* smoothing =
      verb.add_option("--smoothing", options->scan.smoothing,
                      "Standard deviation of the weights about a place of a cloud [m]; 0: 3/4 of --edge")
          ->check(number_from(0))
          ->capture_default_str();
  CLI::Option* holes =
      verb.add_option("--holes", options->scan.holes, "Diameter up to which holes are closed [m]")
          ->check(number_from(0))
          ->capture_default_str();
  verb.add_option("--scale", options->scale, "Metres a unit of the scan: 0.001 of millimetres")
      ->check(positive_number())
      ->capture_default_str();
  CLI::Option* points =
      verb.add_flag("--points", options->points, "Take the vertices of a mesh alone, as a cloud");
  verb.add_option("--intrinsics", options->frames.intrinsics,
                  "Of depth frames: camera_info, OpenCV, camchain, JSON or npz");
  verb.add_option(
          "--lens", options->lens,
          "Where --extrinsics hold with another lens than --intrinsics: solved takes theirs, stated that "
          "of --intrinsics, a file that one. Without it such files are refused")
      ->type_name("stated|solved|FILE");
  verb.add_option("--poses", options->frames.poses,
                  "Of depth frames: T_world_camera, a pose a frame (TUM, CSV)");
  verb.add_option("--extrinsics", options->frames.extrinsics,
                  "Of depth frames: where a camera stands still (extrinsics JSON, TUM)");
  verb.add_option("--masks", options->frames.masks, "Of depth frames: folder of masks of the same names");
  verb.add_option("--depth-scale", options->frames.depth_scale, "Of depth frames: metres a count")
      ->check(positive_number())
      ->capture_default_str();
  CLI::Option* tets =
      verb.add_flag("--tets", options->tets, "Fill a closed surface with tetrahedra; needs tetgen")
          ->excludes(flat)
          ->excludes(points);
  verb.add_flag("--weld", options->weld,
                "Join the vertices in one place of a mesh of triangles or tetrahedra, and change nothing but "
                "its --scale")
      ->excludes(flat)
      ->excludes(points)
      ->excludes(tets)
      ->excludes(edge)
      ->excludes(smoothing)
      ->excludes(holes);
  verb.add_flag("--json", options->json, "Print what was made as JSON on stdout");
  verb.add_flag("--force", options->force, "Write over what is there");
  add_doubts_option(
      verb, options->despite_doubts,
      "Write a flat shape with triangles turned over; take a calibration that said it cannot be "
      "used");
  verb.callback([&action, &verb, options] {
    options->frames.folder = options->input;
    action = [&verb, options] { return mesh(verb, *options); };
  });
}

}  // namespace flash
