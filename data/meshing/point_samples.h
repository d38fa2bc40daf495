#pragma once
#include <Eigen/Core>

#include "data/mesh/mesh.h"

namespace flash::data {

/// Points of a surface.
struct PointSamples {
  Points points;            ///< [m]
  Points normals;           ///< of length 1, on one side of the surface; no rows: not known yet
  Eigen::VectorXd weights;  ///< how many measured points each stands for
};

/// One sample a cube of `cell` [m] that holds points: their mean, in the order of the cubes.
PointSamples thinned(const PointSamples& samples, double cell);

/// Median distance from a sample to the nearest other one [m]; at least two samples.
double spacing_of(const PointSamples& samples);

/// Without those whose mean distance to their eight nearest is above three times the median of it.
PointSamples without_outliers(const PointSamples& samples);

/// Finds normals: of the plane through the samples within `radius` [m], the twelve nearest at least. They are
/// turned to one side from sample to sample, along the pairs of neighbours that differ least (Hoppe et al.
/// 1992), and together so that most of them point up, along z.
void find_normals(PointSamples& samples, double radius);

}  // namespace flash::data
