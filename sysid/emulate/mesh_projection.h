#pragma once
#include <Eigen/SparseCholesky>
#include <memory>

#include "data/mesh/mesh.h"

namespace flash::sysid {

/// Carries positions from one mesh of a sheet to another of it.
struct MeshProjection {
  Eigen::SparseMatrix<double> load;                                               ///< to x from
  std::shared_ptr<const Eigen::SimplicialLLT<Eigen::SparseMatrix<double>>> mass;  ///< to x to
};

/// The surface of triangles on `to` that is nearest to one on `from`, in the mean square over the rest shape:
/// with the shape functions phi of `to`,
///
///     M x_to = B x_from,    M_ij = integral of phi_i phi_j,    B x_from = integral of phi_i x_from.
///
/// A sheet that is bent into an arc of radius r lies up to h^2 / 8r beside chords of h, all to one side. To
/// take its vertices from those of smaller cells would keep that: points seen between them miss the surface
/// by the same distance, and what answers for it is the material. This one lies to both sides alike.
MeshProjection projection(const data::TriangleMesh& from, const data::TriangleMesh& to);

/// `positions`: of the vertices of `from`, rows.
data::Points projected(const MeshProjection& projection, const data::Points& positions);

}  // namespace flash::sysid
