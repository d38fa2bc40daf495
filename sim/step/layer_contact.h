#pragma once
#include <array>
#include <vector>

#include "sim/law/feature_pair.h"
#include "sim/law/layer_law.h"
#include "sim/law/symmetric3.h"
#include "sim/pairs/candidate_pairs.h"
#include "sim/scene/environment.h"

namespace flash::sim {

/// Two features of the surface that press each other at an iterate.
struct LayerTouch {
  PairKind kind = PairKind::vertex_face;
  std::array<int, 4> vertices{};
  NearestPoints nearest;
  double area = 0;          ///< that the pair stands for [m^2]
  double crossing = 1;      ///< what parallel edges leave of it
  LayerResponse response;   ///< per area
  double normal_force = 0;  ///< lambda_n, of the second on the first along the normal [N]
};

/// Friction between two features at the normal force, the nearest points and the normal of some iterate.
struct LayerFriction {
  PairKind kind = PairKind::vertex_face;
  std::array<int, 4> vertices{};
  double weights[4] = {};  ///< of the vertices in what lies between the nearest points
  Vector3<double> normal{};
  double bound = 0;                  ///< mu lambda_n [N]
  Vector3<double> bristle{};         ///< deflection at the start of the step [m]
  double slip = 0;                   ///< length of the bristles' deflection and the slip over the step [m]
  Vector3<double> slip_direction{};  ///< the slip over its friction_length
};

/// What the surface does to itself at an iterate.
struct LayerContact {
  std::vector<LayerTouch> touches;
  std::vector<LayerFriction> frictions;
  double energy = 0;   ///< of the pressure between layers [J]
  double closest = 0;  ///< distance of the nearest features that may touch [m]; 1e300: there are none
};

/// How many pairs a step had to look at.
struct LayerCounts {
  long pairs = 0;     ///< candidates, the most at a time
  long searches = 0;  ///< for candidates
  long ways = 0;      ///< of pairs that were followed by continuous detection
};

/// The contact of the surface with itself over one step from environment.state. Pressure is the gradient of a
/// potential (layer_response), and so conserves momentum. Friction is that of bristles, as against obstacles,
/// a pair each. Ways are free where continuous detection says so.
class LayerStep {
 public:
  /// The arguments have to outlive the step. environment.self_contact has to be there.
  LayerStep(PairSurface& surface, const Environment& environment, double time_step);

  /// Vertices that holds carry whole: pairs of them alone do not count.
  void set_carried(const std::vector<bool>& carried);

  /// Adds what each vertex needs from outside against pressure and friction at `positions` to `force` [N].
  void add_forces(const data::Points& positions, LayerContact& contact, data::Points& force);

  /// Energy of the pressure at `positions` [J].
  double energy(const data::Points& positions);

  /// Potential of friction at the forces and in the directions of `contact` [J].
  double friction_potential(const LayerContact& contact, const data::Points& positions) const;

  /// Energy of bristles that bend at the end of the step [J].
  double bristle_energy(const LayerContact& contact) const;

  /// How much of the straight way from `from`, where no features meet, to `to` is free of them meeting: 1
  /// where all of it is.
  double free_share(const data::Points& from, const data::Points& to);

  /// The bristles at the end of the step, as in State.
  std::vector<PairBristle> bristles_at_end(const LayerContact& contact) const;

  const LayerCounts& counts() const { return counts_; }
  double friction() const { return settings_.friction; }
  double thickness() const { return settings_.thickness; }
  double time_step() const { return time_step_; }

 private:
  /// Pairs that may touch while each vertex stays in its box.
  struct Candidates {
    std::vector<Bounds> boxes;
    std::vector<CandidatePair> pairs;
  };

  /// Whether the pairs of `candidates` are all that matter on the way between two positions.
  static bool cover(const Candidates& candidates, const data::Points& from, const data::Points& to);

  /// Fills in the pairs of all ways between two positions, and of a `margin` beside them.
  void search(const data::Points& from, const data::Points& to, double margin, Candidates& candidates);

  /// Friction of touches at their own normal forces, without slips yet.
  void frictions_of(const std::vector<LayerTouch>& touches, std::vector<LayerFriction>& frictions) const;

  PairSurface& surface_;
  const Environment& environment_;
  SelfContact settings_;
  double time_step_;
  std::vector<bool> carried_;
  Candidates near_;  ///< an iterate
  Candidates way_;   ///< between iterates that are far apart
  LayerCounts counts_;
};

/// How friction changes with what lies between its nearest points [N/m].
Symmetric3 stiffness_of(const LayerFriction& friction, double time_step);

}  // namespace flash::sim
