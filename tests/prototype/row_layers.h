#pragma once
#include <array>
#include <cstddef>
#include <unordered_map>
#include <utility>

#include "sim/step/layer_contact.h"

namespace flash::sim {

/// How far pairs are followed, as a multiple of the thickness: a multiplier may push beyond it while it is
/// still wrong.
inline constexpr double row_reach = 1.25;

/// A pair by its vertices, which come in one order; true: of edges.
using PairKey = std::pair<bool, std::array<int, 4>>;

struct PairHash {
  std::size_t operator()(const PairKey& key) const {
    std::size_t hash = key.first ? 1 : 0;
    for (const int vertex : key.second)
      hash = (hash ^ static_cast<std::size_t>(vertex)) * std::size_t{1099511628211};
    return hash;
  }
};

inline PairKey key_of(PairKind kind, const std::array<int, 4>& vertices) {
  return {kind == PairKind::edge_edge, vertices};
}

/// Multipliers of the rows d >= t, one a pair, as pressures on the area that the pair stands for.
struct PairMultipliers {
  double penalty = 0;                                      ///< kappa [Pa/m]
  std::unordered_map<PairKey, double, PairHash> pressure;  ///< p [Pa]; none: 0

  double of(const PairKey& key) const {
    const auto found = pressure.find(key);
    return found == pressure.end() ? 0 : found->second;
  }
};

/// Layers that hard rows d >= t keep apart, in place of the barrier. A pair presses with
///
///   max(0, p + kappa (t - d)),
///
/// its multiplier where that is right: then d = t, or d > t and p = 0. Areas, friction and detection of ways
/// are those of the barrier. The thickness of the environment has to be row_reach times t.
class RowLayers : public LayerStep {
 public:
  /// The multipliers have to outlive it.
  RowLayers(const LayerStep& barrier, const PairMultipliers& multipliers)
      : LayerStep(barrier), multipliers_(multipliers) {}

 protected:
  LayerResponse response(const CandidatePair& pair, double distance) const override;

 private:
  const PairMultipliers& multipliers_;
};

/// What a touch of RowLayers presses with, as above [Pa].
double pressure_of(const LayerTouch& touch, double penalty);

/// Whether a touch is a row. Edges that are nearly parallel, whose area fades, have the penalty alone: faces
/// beside them have rows.
inline bool is_row(const LayerTouch& touch) { return touch.stiffness > 0 && norm(touch.couple) == 0; }

/// How much nearer than t the features of a row are, or how much farther where they press [m].
double row_violation(const LayerContact& contact, const PairMultipliers& multipliers);

/// Makes what each touch presses with its multiplier (Uzawa), and those of all other pairs zero.
void update_multipliers(const LayerContact& contact, PairMultipliers& multipliers);

}  // namespace flash::sim
