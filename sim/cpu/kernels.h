#pragma once
#include "sim/cpu/triangle_group.h"
#include "sim/law/membrane_law.h"

namespace flash::sim {

// What the kernels in sim/cpu/kernels read and write: plain arrays alone. Code that they shared with other
// sources could be compiled for more than the machine has. Vertices are in elimination order.

/// Rows of a front, of its update matrix alike, are padded to a multiple of this: whole vectors at every
/// level.
inline constexpr int front_padding = 16;

/// Numbers that the inverse of a panel takes for each vertex: three rows of sixteen.
inline constexpr long inverse_size = 48;

/// A supernode: vertices eliminated together, and those below them that they touch.
struct Front {
  int first_column, column_count;  ///< own vertices
  int first_row, row_count;        ///< below them: in FrontTree::rows and rows_in_parent
  int first_child, child_count;    ///< in FrontTree::children
  int first_block, block_count;    ///< matrix blocks that enter it, in FrontTree::blocks
  int padded_rows;                 ///< rows of its columns, 3 a vertex, padded to whole vectors
  int padded_update_rows;          ///< rows of its update matrix, padded to whole vectors
  long columns_at;                 ///< its columns [L11; L21] in the factor
  long built_at, update_at;        ///< its update matrix on the stack: where it is made, and where it waits
};

/// A block of the matrix in a front.
struct FrontBlock {
  int row, column;  ///< in vertices of the front
  int transposed;
  int source;  ///< block of the BlockPattern
};

/// The elimination tree in the order of elimination.
struct FrontTree {
  int front_count;
  const Front* fronts;
  const int* rows;            ///< row vertices, ascending in each front
  const int* rows_in_parent;  ///< places of these rows in the parent's front
  const int* children;
  const FrontBlock* blocks;
};

/// Rows of 3 x 3 blocks.
struct BlockRows {
  int size;
  const int* starts;   ///< where each row starts in `columns`, and where the last ends
  const int* columns;  ///< vertices
};

/// Rows four at a time, as in RowGroups.
struct FourRows {
  int size;
  const int* rows;     ///< four a group, -1 where there are fewer
  const int* starts;   ///< where each group starts in `columns`, and where the last ends
  const int* columns;  ///< vertices
};

template <typename Scalar>
struct LinearKernels {
  int stored_bytes;  ///< bytes that a number of the factor takes
  /// Cholesky factorization of the matrix blocks `values`, for solves. Writes the panels of the fronts, those
  /// of single precision rounded to half, and the inverses of their diagonal blocks: `inverse_size` numbers a
  /// vertex. `front`, `stack`: memory for the columns of the largest front, and for update matrices. Returns
  /// false at a pivot that is not positive.
  bool (*factorize)(const FrontTree& tree, const double* values, Scalar* front, Scalar* stack, void* factor,
                    Scalar* inverses);
  /// x <- (L L^T)^-1 x, four numbers a vertex, the last of them zero. `front`: memory for the rows of the
  /// largest front and `front_padding` more.
  void (*solve)(const FrontTree& tree, const void* factor, const Scalar* inverses, Scalar* front, Scalar* x);
  /// Copies blocks of nine numbers to three columns of four, transposed where `transposed`. The fourth
  /// numbers are not written: they have to be zero.
  void (*copy_blocks)(int count, const int* sources, const char* transposed, const double* from, Scalar* to);
  /// y = B x, B of blocks from copy_blocks, four numbers a vertex.
  void (*multiply_blocks)(const BlockRows& rows, const Scalar* blocks, const Scalar* x, Scalar* y);
  /// y += scale S x, S scalar: four values a column. Four numbers a vertex.
  void (*add_rows)(const FourRows& groups, const Scalar* values, Scalar scale, const Scalar* x, Scalar* y);
  Scalar (*dot)(long size, const Scalar* x, const Scalar* y);
  /// y += a x.
  void (*add_scaled)(long size, Scalar a, const Scalar* x, Scalar* y);
  /// y = x + b y.
  void (*scale_and_add)(long size, Scalar b, const Scalar* x, Scalar* y);
};

/// The loops that take the time of a step, compiled for one InstructionLevel.
struct Kernels {
  LinearKernels<float> single_precision;
  LinearKernels<double> double_precision;

  /// Returns the energy of the triangles [J] and adds its gradient, three numbers a vertex.
  double (*add_membrane_gradient)(MembraneLaw law, const SheetLame& lame, const TriangleGroup* groups,
                                  long count, const double* positions, double* gradient);
  /// Adds `scale` times the Hessian of the membrane energy to blocks of nine numbers; `positive`: without its
  /// negative eigenvalues.
  void (*add_membrane_hessian)(MembraneLaw law, const SheetLame& lame, const TriangleGroup* groups,
                               long count, const double* positions, double scale, bool positive,
                               double* values);
};

template <typename Scalar>
const LinearKernels<Scalar>& linear(const Kernels& kernels) {
  if constexpr (sizeof(Scalar) == sizeof(float))
    return kernels.single_precision;
  else
    return kernels.double_precision;
}

}  // namespace flash::sim
