#pragma once
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "apps/sim/hold_watch.h"
#include "apps/sim/scene_run.h"
#include "apps/sim/scene_warnings.h"
#include "sim/newton/step_report.h"
#include "sim/scene/scene.h"
#include "sim/step/penetration.h"

namespace flash::sim {

/// The deepest vertex of a kind that a run has seen.
struct Deepest {
  Penetration penetration;
  std::size_t body = 0;
  double time = 0;  ///< at the end of its step [s]

  void see(const Penetration& seen, std::size_t in_body, double at) {
    if (seen.depth > penetration.depth) *this = {seen, in_body, at};
  }
};

/// Watches the objects of a scene step by step, for the figures and the warnings of its summary.
class SceneObserver {
 public:
  explicit SceneObserver(std::size_t bodies) : watches_(bodies), deepest_(bodies) {}

  /// After each step, which ends at `time` [s] and took `time_step`; `reports`: of each body.
  void see(const std::vector<SceneBody>& bodies, const std::vector<StepReport>& reports, double time,
           double time_step, SceneSummary& summary);

  /// What there is to say at the end of a run, in `summary.warnings`.
  void conclude(const data::Scene& scene, const std::vector<SceneBody>& bodies, SceneSummary& summary) const;

 private:
  void see_collapse(const SceneBody& body, std::size_t b, double time, SceneSummary& summary);

  double nearest_ = no_layers;  ///< layers at the end of a step [m]
  Deepest held_, started_, squeezed_;
  double inside_at_end_ = 0;  ///< depth at the start of the last step [m]
  std::string holder_;        ///< of the deepest vertex that is held
  std::vector<HoldWatch> watches_;
  std::vector<ComingThrough> deepest_;                         ///< of each body, at any time
  std::map<std::pair<std::size_t, int>, Collapse> collapses_;  ///< of solids
};

}  // namespace flash::sim
