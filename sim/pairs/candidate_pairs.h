#pragma once
#include <array>
#include <span>
#include <vector>

#include "sim/law/feature_pair.h"
#include "sim/pairs/pair_surface.h"

namespace flash::sim {

/// Two features that may come as near as the thickness.
struct CandidatePair {
  PairKind kind = PairKind::vertex_face;
  std::array<int, 4> vertices{};
  double thickness = 0;  ///< distance from which on they feel each other [m]
  double area = 0;       ///< that the pair stands for [m^2]
};

/// All pairs that come as near as `thickness` somewhere in the boxes of their vertices, in an order that
/// depends on the boxes alone. Features that share a vertex are no pair, nor are those whose vertices are all
/// `carried`. Features of one body that are nearer at rest feel each other from 0.9 of that distance on.
///
/// Areas: the vertices above a flat layer, those of the layer, and the crossings of their edges (on the mean
/// over directions, Crofton) each stand for the area; a quarter, a quarter and a half of it counts.
void find_candidates(PairSurface& surface, std::span<const Bounds> boxes, double thickness,
                     const std::vector<bool>& carried, std::vector<CandidatePair>& pairs);

}  // namespace flash::sim
