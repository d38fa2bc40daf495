#pragma once
#include <Eigen/Core>
#include <array>
#include <optional>

#include "calib/detect/grey_image.h"
#include "calib/detect/rectifier.h"

namespace flash::calib {

/// Where a shape that the lens has blurred lies in a picture: its brightness, with the blur among the
/// unknowns, is fitted to the pixels by least squares. A blur that is alike on all sides moves neither edges
/// nor crossings, so that nothing is left that pulls to one side. All places are rectified pixels.

/// The crossing of a chessboard. along_x, along_y: its lines as the seed knows them, towards neighbouring
/// corners. radius: of the disc of pixels that sees nothing but the four squares [px]. Empty where the pixels
/// show no crossing within `radius` of the seed.
std::optional<Eigen::Vector2d> fit_crossing(const GreyImage& image, const Rectifier& rectifier,
                                            const Eigen::Vector2d& seed, const Eigen::Vector2d& along_x,
                                            const Eigen::Vector2d& along_y, double radius);

using Quad = std::array<Eigen::Vector2d, 4>;  ///< corners in order, either way round

/// The corners of a bordered square marker: a line through each blurred side, or an arc where it is plainly
/// bent, away from the corners; their intersections. inside, outside: widths of the plain bands on both sides
/// of the edge as shares of the side. Empty where a side shows no edge.
std::optional<Quad> fit_quad(const GreyImage& image, const Rectifier& rectifier, const Quad& seed,
                             double inside, double outside);

struct Dot {
  Eigen::Vector2d centre;  ///< of the ellipse; not the image of the circle's centre
  double area;             ///< [px^2]
};

/// A dark elliptic dot. reach: pixels within that distance of the seed see this dot alone [px]. Empty where
/// they show none.
std::optional<Dot> fit_dot(const GreyImage& image, const Rectifier& rectifier, const Eigen::Vector2d& seed,
                           double reach);

/// Centre of the ellipse that a circle on the plane becomes under a homography (plane to rectified px).
Eigen::Vector2d circle_image_centre(const Eigen::Matrix3d& homography, const Eigen::Vector2d& centre,
                                    double radius);

}  // namespace flash::calib
