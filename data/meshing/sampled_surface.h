#pragma once
#include "data/meshing/point_samples.h"

namespace flash::data {

struct SampledSurfaceSettings {
  double width = 0.0075;  ///< standard deviation of the Gaussian weights [m]
  double cell = 0.005;    ///< of the grid on which the surface is sought [m]
};

/// The surface that samples with normals lie about, with its borders.
///
/// At x it is where sum w_i (n_i + N) . (x - p_i) = 0, with w_i = exp(-|x - p_i|^2 / 2 s^2), s the width, and
/// N the mean normal there. On a circle each summand is 0, so that curvature shifts nothing; with n_i or N
/// alone it would by s^2 / 2 R (implicit moving least squares, Kolluri 2005, use n_i). It ends where the mean
/// of the samples lies s sqrt(2 / pi) to one side: that is the border of a half plane of samples, whatever
/// their density. A right corner is cut by 0.5 s, and holes narrower than about 3 s close.
///
/// The triangles are those of marching tetrahedra (Doi and Koide 1991): small, uneven, consistently turned.
/// Not clean at all: parts may be lone or meet in a vertex.
TriangleMesh sampled_surface(const PointSamples& samples, const SampledSurfaceSettings& settings);

}  // namespace flash::data
