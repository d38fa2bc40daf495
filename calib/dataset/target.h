#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

namespace flash::calib {

enum class TargetKind { chessboard, charuco, aruco, aruco_grid, apriltag, aprilgrid, circle_grid };

/// A flat calibration target. Its frame lies in its plane, as one faces the print: x to the right, y down, z
/// into the board, away from the camera. The origin is
///   chessboard: an inner corner, with a black square between x and y where the colours allow the choice;
///   charuco: the outer corner of the upper left square;
///   aruco, apriltag: the middle of the marker;  aruco_grid: the upper left corner of the first marker;
///   aprilgrid: the lower left corner of the first tag, as Kalibr prints it: rows run to -y;
///   circle_grid: the first dot; the big dot, if there is one, stands lower left: rows run to -y.
struct Target {
  TargetKind kind = TargetKind::chessboard;
  int columns = 1;          ///< inner corners (chessboard), squares (charuco), markers, tags or dots along x
  int rows = 1;             ///< the same along y
  double spacing = 0;       ///< side of a square, or distance between centres of neighbouring dots [m]
  double marker_size = 0;   ///< side of a marker or tag, black border included [m]
  double marker_gap = 0;    ///< between neighbouring markers of a grid, or tags of an aprilgrid [m]
  std::string dictionary;   ///< ArUco: DICT_4X4_50, ...; AprilTag: 36h11, ...
  int first_id = 0;         ///< id of the marker, or of the first marker of a grid; -1: any
  bool has_origin = false;  ///< circle grid whose origin is a bigger dot
};

/// From the command line: chessboard:9x6:0.025, charuco:5x7:0.036:0.018:DICT_6X6_250,
/// aruco:DICT_4X4_50:0:0.09, aruco_grid:5x7:0.04:0.01:DICT_4X4_50[:FIRST], apriltag:36h11:0:0.048 (or any
/// instead of 0), aprilgrid:6x6:0.088:0.3 (gap as a fraction of the tag), circles:10x10:0.0254[:origin-dot].
/// Throws data::InputError naming the part that is wrong.
Target parse_target(const std::string& text);

/// What parse_target reads as that target.
std::string to_words(const Target& target);

/// The same from the JSON beside a recording, or from Kalibr's YAML of an aprilgrid.
Target load_target(const std::string& path);

/// Corners or dots in the target frame [m], 3 x N, z = 0. Their column is the id of a point everywhere else.
/// Boards row by row; markers and tags their corners upper left, upper right, lower right, lower left.
Eigen::Matrix3Xd target_points(const Target& target);

/// What a picture alone cannot tell apart: renumberings i -> permutation[i] of the points that turn the
/// target onto itself, colours included; the identity first. A chessboard with one side odd and one even has
/// no other.
std::vector<std::vector<int>> target_symmetries(const Target& target);

}  // namespace flash::calib
