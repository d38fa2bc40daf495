#include "data/motion/trajectory.h"

#include "tests/fuzz/loader_fuzzer.h"

FLASH_FUZZ_LOADER("gripper.tum", [](const std::string& path) { flash::data::load_trajectory(path); })
