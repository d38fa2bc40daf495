#pragma once
#include <array>
#include <vector>

#include "sim/scene/sheet.h"

// What passes through what on straight ways, asked of all features one by one: what a solver is held against.
namespace flash::sim {

/// The vertices of a vertex and a face, or of two edges.
struct BruteMeeting {
  bool edges = false;
  std::array<int, 4> vertices{};
};

/// The surface of a sheet, of which features with a vertex in common do not meet, nor do those that are
/// `carried` whole.
struct BruteFeatures {
  BruteFeatures(const Sheet& sheet, std::vector<bool> carried_in);

  data::Triangles triangles;
  std::vector<std::array<int, 2>> edges;
  std::vector<int> vertices;  ///< of the triangles
  std::vector<bool> carried;
};

/// All features that are in one place at some share of the straight way, from the roots of the cubic at which
/// their vertices are in one plane (Provot 1997).
std::vector<BruteMeeting> brute_meetings(const BruteFeatures& features, const data::Points& from,
                                         const data::Points& to);

/// Whether an edge goes through a face.
bool brute_intersects(const BruteFeatures& features, const data::Points& positions);

/// Vertices that stand inside the closed surface of another body, a solid: it winds about them.
int brute_enclosed(const Sheet& sheet, const BruteFeatures& features, const data::Points& positions);

}  // namespace flash::sim
