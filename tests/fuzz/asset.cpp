#include "data/asset/asset.h"

#include "tests/fuzz/loader_fuzzer.h"

FLASH_FUZZ_LOADER("asset.json", [](const std::string& path) {
  flash::data::resolve_sheet(flash::data::load_asset(path), 0.04);
})
