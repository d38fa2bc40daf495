#include "data/camera/depth_image.h"

#include "tests/fuzz/loader_fuzzer.h"

FLASH_FUZZ_LOADER("mask.png", [](const std::string& path) { flash::data::load_mask(path); })
