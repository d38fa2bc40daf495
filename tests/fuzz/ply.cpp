#include "data/mesh/mesh_io.h"

#include "tests/fuzz/loader_fuzzer.h"

FLASH_FUZZ_LOADER("mesh.ply", [](const std::string& path) { flash::data::load_triangle_mesh(path); })
