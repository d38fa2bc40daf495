#pragma once
#include <Eigen/Core>
#include <span>
#include <vector>

#include "sysid/observe/score.h"
#include "sysid/observe/sheet_shift.h"
#include "sysid/replay/replay.h"

namespace flash::sysid {

/// The hierarchy of the replay's sheet, to be moved.
SheetDistance sheet_of(const Replay& replay);

/// Where on a simulated motion each observation belongs, and the direction in which it can tell the sheet
/// from another: the normal of the surface for a point of a cloud, the normal of the border in the surface
/// for a point of the outline, every direction for a mark and for the force. Linear identification stands on
/// it: residuals, their derivatives by parameters, displacements between solutions.
///
/// Rows are weighted as the score is: the sum of squares of a vector of rows is the mean over keyframes of
/// the mean over terms of the mean square [m^2], a force counting cloud_sigma / force_sigma.
class LinearObservations {
 public:
  /// `replay`: of `motion`; its observations count. `shifts`: of the motion, where there are any.
  /// `near`: the same observations on a motion close by; where they belong there is where they are looked for
  /// first. It changes speed only. `points_per_term`: of a keyframe, evenly thinned. Keyframes are shared out
  /// over the replay's threads.
  LinearObservations(const Replay& replay, const Motion& motion, const Registration& registration,
                     const Objective& objective, const SheetShifts& shifts = {},
                     const LinearObservations* near = nullptr, Eigen::Index points_per_term = 200);

  Eigen::Index rows() const { return static_cast<Eigen::Index>(places_.size()); }

  /// What a row is of.
  enum class Term { surface, border, mark, force };
  struct Row {
    std::size_t observation = 0;  ///< index of the keyframe
    Term term = Term::surface;
    int axis = 0;          ///< of a mark or a force: x, y or z
    Eigen::Vector3d rest;  ///< where on the sheet at rest [m]; of a force zero
    double distance = 0;   ///< signed [m]; of a force [N]
    double weight = 1;     ///< by which the rows of the other functions were multiplied
  };
  Row row(Eigen::Index i) const;

  /// Rows of each weighing keyframe, in order.
  std::vector<Eigen::Index> rows_of_keyframes() const;

  /// How far each observation stands from its place, along the direction [m].
  Eigen::VectorXd residuals() const;

  /// The distances of the rows that these observations have on another motion, at a fraction of what they
  /// take with all else. `sheet`: of the replay, moved. `triangles`: of each row, where it belonged last, or
  /// empty; then where it does. It changes speed only.
  Eigen::VectorXd distances(const Replay& replay, const Motion& motion, const Registration& registration,
                            const SheetShifts& shifts, SheetDistance& sheet, std::vector<int>& triangles,
                            int threads = 1) const;

  /// How far another motion takes the sheet from each place, along the direction [m]; `replay` is of `motion`
  /// and may have another mesh. Before any registration anew.
  Eigen::VectorXd displacements(const Replay& replay, const Motion& motion) const;

  /// How far shifts take each place along the direction, to first order [m].
  Eigen::VectorXd moved_by(const Replay& replay, const SheetShifts& shifts) const;

  /// Derivatives of `displacements` by offset x, y, z [m], yaw [rad] and time [s].
  Eigen::Matrix<double, Eigen::Dynamic, 5> registration_derivatives() const;

 private:
  struct Place {
    Term term;
    std::size_t observation;  // index of the keyframe
    std::size_t mark = 0;     // index in the keyframe
    double weight = 0;        // root of the row's share
    double residual = 0;      // [m]
    int axis = 0;
    int triangle = -1;
    Eigen::Vector3d barycentric = Eigen::Vector3d::Zero();
    Eigen::Vector3d rest = Eigen::Vector3d::Zero();
    Eigen::Vector3d direction;  // unit, frame of the simulation
    Eigen::Vector3d position;   // [m]; of a force [N]
    Eigen::Vector3d velocity;   // of the sheet there [m/s]
    Eigen::Matrix3d corners;    // of a mark: those of its triangle [m]
  };
  /// One keyframe, with the motion that it is seen against.
  struct Seen {
    const Replay& replay;
    const SheetDistance& sheet;  // there
    const data::Points &positions, &velocities;
    Eigen::Isometry3d simulated_from_observed;
    std::span<const Place> near;  // its places on a motion close by
  };
  /// Appends the places of one term of a keyframe.
  static void add_term(const data::Points& points, Eigen::Index at_most, const Place& common,
                       const Seen& seen, std::vector<Place>& places);
  std::span<const Place> places_of_keyframe(std::size_t observation) const;

  std::vector<Place> places_;
  Registration registration_;
};

}  // namespace flash::sysid
