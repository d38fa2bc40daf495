#include "tests/prototype/row_layers.h"

#include <algorithm>
#include <cmath>

namespace flash::sim {

LayerResponse RowLayers::response(const CandidatePair& pair, double distance) const {
  const double p = multipliers_.of(key_of(pair.kind, pair.vertices)), kappa = multipliers_.penalty;
  const double pushed = p + kappa * (pair.thickness / row_reach - distance);
  const double at_rest = 0.5 * p * p / kappa;
  if (!(pushed > 0)) return {.energy = -at_rest};
  return {.energy = 0.5 * pushed * pushed / kappa - at_rest, .force = pushed, .stiffness = kappa};
}

double pressure_of(const LayerTouch& touch, double penalty) {
  return touch.stiffness > 0 ? penalty * touch.normal_force / touch.stiffness : 0;
}

double row_violation(const LayerContact& contact, const PairMultipliers& multipliers) {
  double worst = 0;
  for (const LayerTouch& touch : contact.touches) {
    if (touch.stiffness > 0 && !is_row(touch)) continue;
    const double wrong =
        pressure_of(touch, multipliers.penalty) - multipliers.of(key_of(touch.kind, touch.vertices));
    worst = std::max(worst, std::abs(wrong) / multipliers.penalty);
  }
  return worst;
}

void update_multipliers(const LayerContact& contact, PairMultipliers& multipliers) {
  multipliers.pressure.clear();
  for (const LayerTouch& touch : contact.touches)
    if (is_row(touch))
      multipliers.pressure[key_of(touch.kind, touch.vertices)] = pressure_of(touch, multipliers.penalty);
}

}  // namespace flash::sim
