#pragma once
#include <array>
#include <vector>

#include "sim/law/feature_pair.h"
#include "sim/law/layer_law.h"
#include "sim/law/symmetric3.h"
#include "sim/pairs/candidate_pairs.h"
#include "sim/scene/environment.h"

namespace flash::sim {

/// Two features of the surface that feel each other at an iterate.
struct LayerTouch {
  PairKind kind = PairKind::vertex_face;
  std::array<int, 4> vertices{};
  double weights[4] = {};   ///< of the vertices in what lies between the nearest points
  double normal_force = 0;  ///< lambda_n, of the second on the first along the normal [N]
  double stiffness = 0;     ///< of the normal force [N/m]
  double slip = 0;          ///< length of the deflection of the bristles and the slip over the step [m]
  Vector3<double> normal{};
  Vector3<double> bristle{};         ///< deflection at the start of the step [m]
  Vector3<double> slip_direction{};  ///< the slip over its friction_length
  Vector3<double> dual{};            ///< what the linear problems take for it, at most 1 long
  Vector3<double> couple{};          ///< torque on the first of two edges that are nearly parallel [N m]
};

/// What the surface does to itself at an iterate.
struct LayerContact {
  std::vector<LayerTouch> touches;  ///< in the order of their kinds and vertices
  double energy = 0;                ///< of the pressure between layers [J]
  double closest = 0;  ///< distance of the nearest features that may touch [m]; 1e300: there are none
};

/// Pairs that may touch while each vertex stays in its box.
struct BoxedPairs {
  std::vector<Bounds> boxes;
  std::vector<CandidatePair> pairs;
};

/// What a surface that meets itself keeps between steps.
struct LayerMemory {
  explicit LayerMemory(const Sheet& sheet) : surface(sheet) {}

  PairSurface surface;
  BoxedPairs near;  ///< of an iterate; they serve as long as vertices stay in their boxes
  // What these pairs, and their energy, are of: another thickness and other holds have others.
  double thickness = 0, pressure = 0;
  std::vector<bool> carried;
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
  /// The first two have to outlive the step. environment.self_contact has to be there. `carried`: vertices
  /// that holds carry whole; pairs of them alone do not count.
  LayerStep(LayerMemory& memory, const Environment& environment, double time_step,
            const std::vector<bool>& carried);
  LayerStep(const LayerStep&) = default;
  virtual ~LayerStep() = default;

  /// Whether there are other pairs than in the last step, or others that press as they did not.
  bool has_other_pairs() const { return other_pairs_; }

  /// Adds what each vertex needs from outside against pressure and friction at `positions` to `force` [N].
  void add_forces(const data::Points& positions, LayerContact& contact, data::Points& force);

  /// Energy of the pressure at `positions` [J].
  double energy(const data::Points& positions);

  /// Potential of friction at the forces and in the directions of `contact` [J].
  double friction_potential(const LayerContact& contact, const data::Points& positions) const;

  /// Fills in the duals of an iterate from those of another, from which it is `length` directions of a linear
  /// problem away. Friction is (mu N) z with the dual z, and m z = s with the slip s and its friction_length
  /// m. The linear problem has both as unknowns:
  ///
  ///   z <- (s + ds - z (d . ds)) / m,   d = s / m where it slides, else 0
  ///
  /// With z = d that is Newton's method, whose matrix is zero along d: what has to stop slides past its
  /// place and back again. With z = 0 it brakes what slides by (mu N) / |s|. Chan, Golub and Mulet 1999 ("A
  /// nonlinear primal-dual method for total variation-based image restoration"), with the kink of
  /// Hintermueller and Stadler 2006.
  void carry_duals(const LayerContact& from, double length, LayerContact& to) const;

  /// Energy of bristles that bend at the end of the step [J].
  double bristle_energy(const LayerContact& contact) const;

  /// How much of the straight way from `from`, where no features meet, to `to` is free of them meeting: 1
  /// where all of it is.
  double free_share(const data::Points& from, const data::Points& to);

  /// Whether no features meet on the straight way from `from` to `to`, at neither of which they do.
  bool is_free(const data::Points& from, const data::Points& to);

  /// The bristles at the end of the step, as in State.
  std::vector<PairBristle> bristles_at_end(const LayerContact& contact) const;

  const LayerCounts& counts() const { return counts_; }
  double friction() const { return settings_.friction; }
  double thickness() const { return settings_.thickness; }
  double time_step() const { return time_step_; }

 protected:
  /// What presses the features of a pair apart at a `distance`: the barrier (layer_response).
  virtual LayerResponse response(const CandidatePair& pair, double distance) const;

 private:
  /// Whether the pairs of `candidates` are all that matter on the way between two positions.
  static bool cover(const BoxedPairs& candidates, const data::Points& from, const data::Points& to);

  /// Calls visit(pair, x, move) for each pair whose boxes may come nearer than a `reach` share of its
  /// thickness on the first `share` of the straight way between two positions, with its vertices and their
  /// motions. Ends where that returns false.
  template <typename Visit>
  void follow(const data::Points& from, const data::Points& to, const double& share, double reach,
              const Visit& visit);

  /// Fills in the pairs that come nearer than `reach` on any ways between two positions, and on those of a
  /// `margin` beside them.
  void search(const data::Points& from, const data::Points& to, double margin, double reach,
              BoxedPairs& candidates);

  LayerMemory& memory_;
  const Environment& environment_;
  SelfContact settings_;
  double time_step_;
  bool other_pairs_;
  BoxedPairs way_;  ///< between iterates that are far apart
  LayerCounts counts_;
};

/// How the force of a touch changes with what lies between its nearest points: its pressure along the normal,
/// friction across [N/m]. It is positive semidefinite, and exact where the dual is the slip's direction. The
/// Hessian is this matrix between the weighted vertices (Gauss-Newton): what the normal turns by is left out.
Symmetric3 stiffness_of(const LayerTouch& touch, double friction, double time_step);

/// Friction grows with the normal force, which falls by touch.stiffness as the points part: by the way u
/// between them the force that is needed changes by this, times -n . u. It is not symmetric [N/m].
Vector3<double> friction_coupling_of(const LayerTouch& touch, double friction);

}  // namespace flash::sim
