#include "data/meshing/tetrahedralize.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cerrno>
#include <cmath>
#include <filesystem>
#include <limits>
#include <sstream>
#include <system_error>
#include <utility>
#include <vector>

#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "data/files/text.h"
#include "data/mesh/enclosed_volume.h"
#include "data/mesh/mesh_io.h"
#include "data/mesh/obstacle_mesh.h"
#include "data/mesh/tet_faces.h"

namespace flash::data {
namespace {

namespace fs = std::filesystem;

/// A folder that goes with the value.
class ScratchFolder {
 public:
  ScratchFolder() : path_((fs::temp_directory_path() / "flash-tets-XXXXXX").string()) {
    if (mkdtemp(path_.data()) == nullptr) throw std::system_error(errno, std::generic_category(), path_);
  }
  ~ScratchFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  std::string file(const char* name) const { return (fs::path(path_) / name).string(); }

 private:
  std::string path_;
};

std::string off_text(const TriangleMesh& mesh) {
  std::string text =
      "OFF\n" + std::to_string(mesh.vertices.rows()) + ' ' + std::to_string(mesh.triangles.rows()) + " 0\n";
  for (const auto& x : mesh.vertices.rowwise())
    text += format_number(x[0]) + ' ' + format_number(x[1]) + ' ' + format_number(x[2]) + '\n';
  for (const auto& t : mesh.triangles.rowwise())
    text += "3 " + std::to_string(t[0]) + ' ' + std::to_string(t[1]) + ' ' + std::to_string(t[2]) + '\n';
  return text;
}

/// Runs the program found along PATH with what it says going to the file `log`; its exit status. Throws
/// InputError where there is none.
int run_program(std::vector<std::string> words, const std::string& log) {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  posix_spawn_file_actions_adddup2(&actions, STDOUT_FILENO, STDERR_FILENO);
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  pid_t child = 0;
  const int error = posix_spawnp(&child, words[0].c_str(), &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (error != 0)
    throw InputError("--tets: the program \"" + words[0] +
                     "\" makes the tetrahedra and is not installed; on Debian: apt-get install " + words[0]);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return status;
}

/// What tetgen says of itself goes; what it says of the surface stays, in one line.
std::string reason_in(const std::string& log) {
  std::string reason;
  std::istringstream lines(log);
  for (std::string line; std::getline(lines, line);)
    if (line.find("rror") != std::string::npos || line.find("intersect") != std::string::npos ||
        line.find("cross") != std::string::npos) {
      line.erase(0, line.find_first_not_of(" \t"));
      reason += (reason.empty() ? "" : "; ") + line;
      if (reason.size() > 200) break;
    }
  return reason.empty() ? "no reason is given" : reason;
}

void measure(FilledSolid& solid) {
  solid.least_angle = solid.shortest_edge = std::numeric_limits<double>::infinity();
  const Points& x = solid.mesh.vertices;
  for (const auto& t : solid.mesh.tetrahedra.rowwise()) {
    const Eigen::Vector3d a = x.row(t[1]) - x.row(t[0]), b = x.row(t[2]) - x.row(t[0]),
                          c = x.row(t[3]) - x.row(t[0]);
    solid.volume += a.cross(b).dot(c) / 6;
    std::vector<Eigen::Vector3d> normals;  // outwards
    for (const Eigen::Vector3i& face : faces_of(t)) {
      const Eigen::Vector3d u = x.row(face[1]) - x.row(face[0]), v = x.row(face[2]) - x.row(face[0]);
      normals.push_back(u.cross(v).normalized());
    }
    for (std::size_t i = 0; i < 4; ++i)
      for (std::size_t k = 0; k < i; ++k) {
        const double angle = 180 / EIGEN_PI * std::acos(std::clamp(-normals[i].dot(normals[k]), -1.0, 1.0));
        solid.least_angle = std::min(solid.least_angle, angle);
        solid.largest_angle = std::max(solid.largest_angle, angle);
        const double length = (x.row(t[int(i)]) - x.row(t[int(k)])).norm();
        solid.shortest_edge = std::min(solid.shortest_edge, length);
        solid.longest_edge = std::max(solid.longest_edge, length);
      }
  }
}

}  // namespace

FilledSolid filled_solid(const TriangleMesh& surface, double edge, const std::string& source) {
  constexpr double most_tetrahedra = 1e6;
  const ObstacleMesh checked = checked_obstacle_mesh(surface, source);
  if (!checked.closed)
    throw InputError(source + ": is open along " + format_count(std::size_t(checked.border_edges)) +
                     " edges; expected a closed surface, which has an inside to fill");
  check_crossings(checked.mesh, source);
  FilledSolid result;
  result.surface_volume = enclosed_volume(checked.mesh);
  const double share = edge * edge * edge / (6 * std::sqrt(2));  // of a regular tetrahedron
  if (result.surface_volume / share > most_tetrahedra)
    throw InputError(source + ": " + format_short(result.surface_volume) + " m^3 would take " +
                     format_count(std::size_t(std::min(result.surface_volume / share, 1e15))) +
                     " tetrahedra of --edge " + format_short(edge) + ", expected at most " +
                     format_count(std::size_t(most_tetrahedra)) +
                     " (is it in metres? --scale 0.001 takes millimetres)");
  const ScratchFolder folder;
  write_atomically(folder.file("surface.off"), off_text(checked.mesh));
  // p: fill the surface; q: circumradius at most 1.4 times the shortest edge, faces 14 degrees apart; a: the
  // largest volume; k: write .vtk; N, E, F: nothing else; C: check the result.
  const int status =
      run_program({"tetgen", "-pq1.4/14a" + format_number(share) + "kNEFC", folder.file("surface.off")},
                  folder.file("log"));
  const std::string made = folder.file("surface.1.vtk");
  if (status != 0 || !fs::exists(made))
    throw InputError(source + ": tetgen cannot fill it: " + reason_in(read_file(folder.file("log"))));
  try {
    result.mesh = load_tet_mesh(made);
  } catch (const InputError& error) {
    throw InputError(source + ": tetgen filled it badly: " + error.what());
  }
  measure(result);
  return result;
}

}  // namespace flash::data
