#pragma once
// Depth pictures as kernels draw them: of each pixel the nearest hit is kept as one number, of which the
// greatest shows, whatever the order in which triangles come. The processor can run it too.
#include <cstdint>
#include <cstring>

#include "sim/render/depth_pictures.h"

namespace flash::sim::cuda {

/// A mesh that pictures show; the same in all of them.
struct DrawnMesh {
  const int* corners;  ///< of each triangle 3 vertices
  int triangles, vertices;
  int first_vertex;     ///< among those of all meshes
  std::uint32_t first;  ///< number of its first triangle among those of all meshes
  double yields;        ///< SeenMesh::yields [m]
};

/// A mesh in one picture.
struct PlacedMesh {
  const double* vertices;  ///< x y z of each [m]; null: not seen
  Frame<double> frame;     ///< in that of the camera
};

/// Pictures that are drawn together. Pointers are to the memory of who draws.
struct PictureBatch {
  Pinhole camera;
  int pictures, meshes, vertices;      ///< vertices of all meshes
  const DrawnMesh* drawn;              ///< of each mesh
  const PlacedMesh* placed;            ///< of each picture, mesh by mesh
  const Frame<double>* camera_frames;  ///< of each picture, in the base frame
  /// Of each picture and pixel the nearest hit of meshes that yield, and of those that do not: see
  /// nearest_key.
  std::uint64_t* yielding;
  std::uint64_t* solid;
  SeenVertex* seen;  ///< of each picture the vertices of all meshes
  DepthPictures to;

  FLASH_HOST_DEVICE int pixels() const { return camera.width * camera.height; }
};

inline constexpr std::uint64_t no_key = 0;

/// Inverse depth in single precision, whose bits rise with it, and then the triangle, of which the first is
/// the greatest.
FLASH_HOST_DEVICE inline std::uint64_t nearest_key(double inverse_depth, std::uint32_t triangle) {
  const auto single = static_cast<float>(inverse_depth);
  std::uint32_t bits;
  memcpy(&bits, &single, sizeof bits);
  return std::uint64_t{bits} << 32 | std::uint32_t{~triangle};
}
FLASH_HOST_DEVICE inline std::uint32_t triangle_of(std::uint64_t key) {
  return ~static_cast<std::uint32_t>(key);
}

FLASH_HOST_DEVICE inline const PlacedMesh& placed_mesh(const PictureBatch& batch, int picture, int mesh) {
  return batch.placed[static_cast<std::size_t>(picture) * batch.meshes + mesh];
}

/// The vertices of a mesh in a picture, as the camera sees them.
FLASH_HOST_DEVICE inline SeenVertex* seen_vertices(const PictureBatch& batch, int picture,
                                                   const DrawnMesh& mesh) {
  return batch.seen + static_cast<std::size_t>(picture) * batch.vertices + mesh.first_vertex;
}

FLASH_HOST_DEVICE inline void place_vertex(const PictureBatch& batch, int picture, int mesh, int vertex) {
  const PlacedMesh& placed = placed_mesh(batch, picture, mesh);
  if (placed.vertices != nullptr)
    seen_vertices(batch, picture, batch.drawn[mesh])[vertex] =
        seen_vertex(batch.camera, placed.frame, placed.vertices + 3L * vertex);
}

/// The corners of a triangle.
struct SeenTriangle {
  const SeenVertex &a, &b, &c;
};

FLASH_HOST_DEVICE inline SeenTriangle seen_triangle(const PictureBatch& batch, int picture,
                                                    const DrawnMesh& mesh, int triangle) {
  const int* corners = mesh.corners + 3L * triangle;
  const SeenVertex* seen = seen_vertices(batch, picture, mesh);
  return {seen[corners[0]], seen[corners[1]], seen[corners[2]]};
}

/// A triangle that is left for many threads together.
struct LargeTriangle {
  int picture, mesh, triangle;
};
inline constexpr int few_pixels = 256;  ///< which one thread looks at by itself

/// Draws a triangle within a window. `raise(key, to)` makes a key at least `to`.
template <class Raise>
FLASH_HOST_DEVICE void draw_window(const PictureBatch& batch, const LargeTriangle& which,
                                   const SeenTriangle& seen, const PixelWindow& within, const Raise& raise) {
  const DrawnMesh& mesh = batch.drawn[which.mesh];
  std::uint64_t* keys = (mesh.yields > 0 ? batch.yielding : batch.solid) +
                        static_cast<std::size_t>(which.picture) * batch.pixels();
  const auto hit = [&](int column, int row, double inverse_depth) {
    raise(keys[static_cast<std::size_t>(row) * batch.camera.width + column],
          nearest_key(inverse_depth, mesh.first + static_cast<std::uint32_t>(which.triangle)));
  };
  cover(batch.camera, within, seen.a, seen.b, seen.c, hit);
}

/// The pixels that a triangle may cover.
FLASH_HOST_DEVICE inline PixelWindow window_of(const Pinhole& camera, const SeenTriangle& seen) {
  const PixelWindow whole = whole_picture(camera), none{0, -1, 0, -1};
  const int before = seen.a.is_before() + seen.b.is_before() + seen.c.is_before();
  if (before == 0) return none;
  if (before < 3) return whole;
  const ImageCorner &a = seen.a.corner, &b = seen.b.corner, &c = seen.c.corner;
  return image_area(a, b, c) == 0 ? none : sim::window_of(whole, a, b, c);
}

/// Draws a triangle that covers few pixels, or calls `leave(triangle)`.
template <class Raise, class Leave>
FLASH_HOST_DEVICE void draw_triangle(const PictureBatch& batch, const LargeTriangle& which,
                                     const Raise& raise, const Leave& leave) {
  if (placed_mesh(batch, which.picture, which.mesh).vertices == nullptr) return;
  const SeenTriangle seen = seen_triangle(batch, which.picture, batch.drawn[which.mesh], which.triangle);
  const PixelWindow window = window_of(batch.camera, seen);
  const int columns = window.last_column - window.first_column + 1,
            rows = window.last_row - window.first_row + 1;
  if (columns <= 0 || rows <= 0) return;
  if (columns * rows > few_pixels)
    leave(which);
  else
    draw_window(batch, which, seen, window, raise);
}

inline constexpr int tile_columns = 8, tile_rows = 4;  ///< of a large triangle, for one thread

/// Of a band of rows of a large triangle the tiles first, first + step, ... Bands are the same parts of the
/// window's rows each.
template <class Raise>
FLASH_HOST_DEVICE void draw_tiles(const PictureBatch& batch, const LargeTriangle& which, int band, int bands,
                                  int first, int step, const Raise& raise) {
  const SeenTriangle seen = seen_triangle(batch, which.picture, batch.drawn[which.mesh], which.triangle);
  const PixelWindow window = window_of(batch.camera, seen);
  const int rows = window.last_row - window.first_row + 1, first_row = window.first_row + rows * band / bands,
            end_row = window.first_row + rows * (band + 1) / bands,
            across = (window.last_column - window.first_column + tile_columns) / tile_columns,
            tiles = across * ((end_row - first_row + tile_rows - 1) / tile_rows);
  for (int tile = first; tile < tiles; tile += step) {
    const int column = window.first_column + tile % across * tile_columns,
              row = first_row + tile / across * tile_rows;
    const PixelWindow within{
        column,
        column + tile_columns - 1 < window.last_column ? column + tile_columns - 1 : window.last_column, row,
        row + tile_rows < end_row ? row + tile_rows - 1 : end_row - 1};
    draw_window(batch, which, seen, within, raise);
  }
}

/// A hit in double precision again, and the share by which its mesh yields.
struct ExactHit {
  PixelHit hit;
  double share = 1;
};

FLASH_HOST_DEVICE inline ExactHit exact_hit(const PictureBatch& batch, int picture, int column, int row,
                                            std::uint64_t key) {
  ExactHit exact;
  if (key == no_key) return exact;
  const std::uint32_t number = triangle_of(key);
  int m = 0;
  while (m + 1 < batch.meshes && number >= batch.drawn[m + 1].first) ++m;
  const DrawnMesh& mesh = batch.drawn[m];
  const int triangle = static_cast<int>(number - mesh.first);
  const SeenTriangle seen = seen_triangle(batch, picture, mesh, triangle);
  const auto hit = [&](int, int, double inverse_depth) {
    if (is_nearer(inverse_depth, exact.hit.inverse_depth)) exact.hit = {inverse_depth, m, triangle};
  };
  cover(batch.camera, {column, column, row, row}, seen.a, seen.b, seen.c, hit);
  if (mesh.yields > 0) exact.share = yielding_share(seen.a.place, seen.b.place, seen.c.place, mesh.yields);
  return exact;
}

/// What a pixel sees goes to the pictures.
FLASH_HOST_DEVICE inline void finish_pixel(const PictureBatch& batch, int picture, int pixel) {
  const int row = pixel / batch.camera.width, column = pixel % batch.camera.width;
  const std::size_t at = static_cast<std::size_t>(picture) * batch.pixels() + pixel;
  const ExactHit solid = exact_hit(batch, picture, column, row, batch.solid[at]),
                 yielding = exact_hit(batch, picture, column, row, batch.yielding[at]);
  // What shows through needs a hit of its own.
  const bool through =
      solid.hit.mesh >= 0 && (is_nearer(solid.hit.inverse_depth, yielding.hit.inverse_depth) ||
                              solid.hit.inverse_depth > yielding.hit.inverse_depth * yielding.share);
  write_pixel(batch.camera, batch.camera_frames[picture], through ? solid.hit : yielding.hit, column, row, at,
              batch.to);
}

}  // namespace flash::sim::cuda
