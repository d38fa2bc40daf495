#include "data/mesh/mesh_io.h"

#include "tests/fuzz/loader_fuzzer.h"

FLASH_FUZZ_LOADER("cloud.pcd", [](const std::string& path) { flash::data::load_point_cloud(path); })
