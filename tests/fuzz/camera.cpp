#include "data/camera/camera.h"

#include "tests/fuzz/loader_fuzzer.h"

FLASH_FUZZ_LOADER("camera.yaml", [](const std::string& path) { flash::data::load_camera_intrinsics(path); })
