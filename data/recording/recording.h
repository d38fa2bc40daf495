#pragma once
#include <Eigen/Geometry>
#include <array>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "data/camera/camera.h"
#include "data/mesh/mesh.h"
#include "data/mesh/selection.h"
#include "data/motion/trajectory.h"
#include "data/recording/marker_tracks.h"

namespace flash::data {

/// How the patch sits in the fingers: flat, held in one point, or folded to a ridge.
enum class GraspShape { clamp, point, pinch };

struct RecordedGrasp {
  std::string gripper;                                  ///< name of a trajectory
  double from = 0.0;                                    ///< [s]
  double to = std::numeric_limits<double>::infinity();  ///< [s]
  Selection select;
  GraspShape shape = GraspShape::clamp;
  double depth = 0.01;  ///< pinch: height of the ridge [m]
  Eigen::Vector3d direction =
      Eigen::Vector3d::Zero();  ///< pinch: along the ridge, base frame; zero: the sheet's diagonal
  double pitch = 0.0;           ///< pinch: tilt of the ridge [rad]
  /// Of a mesh that was made smaller along what is held: of that; 0: no smaller than elsewhere [m].
  double cell = 0.0;
};

/// Vertices that are held where they start.
struct RecordedSupport {
  std::string name = "support";
  Selection select;                                        ///< by corner, vertices or box
  double from = -std::numeric_limits<double>::infinity();  ///< the recording starts no later [s]
  double to = std::numeric_limits<double>::infinity();     ///< [s]
};

/// A weight that hangs on the object, shared by the vertices evenly, and moves with it.
struct RecordedLoad {
  Selection select;            ///< by corner, vertices or box
  double attached_mass = 0.0;  ///< [kg]
};

/// Markers that were tracked.
struct RecordedMarkers {
  std::string tracks_path, placed_path;           ///< resolved, empty where absent
  MarkerTracks tracks;                            ///< as seen
  std::map<std::string, Eigen::Vector3d> placed;  ///< where they are on the object at rest [m]
  std::vector<std::string> on_support;            ///< stay where they are: they tell the object's pose alone
  std::vector<std::optional<Eigen::Vector3d>>
      at;  ///< of each that is scored: on the object at rest, or beside it [m]
};

/// Axis-aligned, base frame; open sides are infinite [m].
struct CropBox {
  Eigen::Vector3d min = Eigen::Vector3d::Constant(-std::numeric_limits<double>::infinity());
  Eigen::Vector3d max = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
  bool contains(const Eigen::Vector3d& point) const {
    return (point.array() >= min.array()).all() && (point.array() <= max.array()).all();
  }
};

/// One observation; paths are resolved, empty where absent.
struct RecordedKeyframe {
  double time = 0.0;                     ///< [s]
  std::string cloud;                     ///< base frame [m]
  std::string depth, mask;               ///< camera frame
  std::string markers;                   ///< CSV: vertex,x,y,z of tracked marks, base frame [m]
  int sample = -1;                       ///< of the marker tracks; -1: none
  std::string contour;                   ///< observed outline as a cloud, base frame [m]
  std::optional<Eigen::Vector3d> force;  ///< gripper on sheet [N]
};

/// Bounds, symmetric about zero, of what is fitted beside the material.
struct NuisanceBounds {
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();  ///< cloud against robot [m]
  double yaw = 0.0;                                  ///< about the vertical [rad]
  double time = 0.0;                                 ///< clock of the clouds against the robot's [s]
  double table_height = 0.0;                         ///< [m]
  double start_yaw = 0.0;                            ///< of the sheet on the table [rad]
};

struct RecordedCamera {
  CameraIntrinsics intrinsics;
  Eigen::Isometry3d base_from_camera = Eigen::Isometry3d::Identity();  ///< T_base_camera
  double depth_scale = 0.001;                                          ///< [m] a count of the depth images
  std::string intrinsics_path;
  std::vector<std::string> warnings;  ///< of the calibration behind T_base_camera, worst first
};

/// A recorded interaction, "flash-recording/1".
struct Recording {
  std::string source;  ///< path of recording.json
  std::string name;
  double origin = 0;  ///< time by the file's clock at which the recording starts: its first grasp, support
                      ///< or keyframe. Every time below counts from there, but for those of marker tracks [s]
  std::string kind =
      "free";  ///< documents only: corner_lift, hang, bar_pull, bias_pull, drag, cantilever, free
  Eigen::Vector3d gravity{0, 0, -9.81};  ///< [m/s^2]
  std::string mesh_spec;                 ///< "sheet:..." or resolved path
  TriangleMesh mesh;      ///< rest shape, object frame [m]; of a solid all vertices and the outer faces
  Tetrahedra tetrahedra;  ///< of a solid; empty: a sheet
  std::string asset;      ///< resolved path, or empty
  Eigen::Isometry3d base_from_object = Eigen::Isometry3d::Identity();  ///< T_base_object at the start
  std::string start_mesh;  ///< resolved path of start positions, or empty
  Points start;            ///< positions at the start, base frame [m], one row a vertex
  bool has_table = false;
  Eigen::Vector3d table_point = Eigen::Vector3d::Zero();    ///< [m]
  Eigen::Vector3d table_normal = Eigen::Vector3d::UnitZ();  ///< unit, up
  std::map<std::string, Trajectory> trajectories;           ///< T_base_gripper by name
  std::map<std::string, std::string> trajectory_paths;      ///< resolved
  std::vector<RecordedGrasp> grasps;
  std::vector<RecordedSupport> supports;
  std::vector<RecordedLoad> loads;
  RecordedMarkers markers;
  std::optional<RecordedCamera> camera;
  CropBox crop;
  std::vector<RecordedKeyframe> keyframes;
  NuisanceBounds nuisance;
  std::vector<std::string>
      notices;                      ///< what a reader should know: empty keyframes, ends of trajectories, ...
  std::vector<std::string> doubts;  ///< what is likely wrong, without the recording's name

  bool is_solid() const { return tetrahedra.rows() > 0; }
};

/// Reads recording.json (or its folder), its mesh and trajectories and checks them: field by field, times
/// sorted and overlapping, plausible sizes and durations, the grasp on the mesh. A grasp without `from`
/// begins with the first keyframe or pose of its gripper. Clouds are checked by load_keyframes. Throws
/// InputError.
Recording load_recording(const std::string& path);

/// Points of the observation that lie in the crop box, base frame [m].
struct Keyframe {
  double time = 0.0;                     ///< [s]
  Points cloud;                          ///< may be empty
  Points contour;                        ///< may be empty
  Points markers;                        ///< [m]
  Points marker_places;                  ///< of each on the object at rest, or beside it [m]
  std::optional<Eigen::Vector3d> force;  ///< [N]
};

/// Loads every keyframe; depth images become points through the camera. Throws InputError where all are
/// empty, or a cloud is far off the scale of the mesh (millimetres read as metres). `notices` says which are
/// empty, whether that is usual, and how many points are not finite.
std::vector<Keyframe> load_keyframes(const Recording& recording, std::vector<std::string>& notices);

/// Puts a mesh in place of the recording's: its name, the rest shape, and of a file or specification of
/// tetrahedra these. Throws InputError, of a specification naming `source` and `field`.
void load_object_mesh(const std::string& mesh, const std::string& source, const std::string& field,
                      Recording& recording);

/// Vertices a grasp takes, in order of index. Throws InputError where there are none.
std::vector<int> select_vertices(const Recording& recording, const RecordedGrasp& grasp);

/// Those of a support or a load; `field` names it in the message.
std::vector<int> select_vertices(const Recording& recording, const Selection& select,
                                 const std::string& field);

/// Writes recording.json with paths relative to it. The files it names must stand already.
void save_recording(const Recording& recording, const std::string& path);

const char* to_string(GraspShape shape);                               ///< "clamp", "point", "pinch"
std::optional<GraspShape> parse_grasp_shape(const std::string& text);  ///< of such a text

}  // namespace flash::data
