#include "data/scene/scene.h"

#include "data/asset/asset.h"
#include "tests/fuzz/loader_fuzzer.h"

FLASH_FUZZ_LOADER("scene.json", [](const std::string& path) {
  // The asset that the objects name stands beside it.
  static const bool written = [&] {
    const std::filesystem::path folder = std::filesystem::path(path).parent_path();
    flash::data::save_asset(flash::data::asset_from_sheet({}, 0.001, "sheet:0.1x0.1:0.05"),
                            folder / "asset.json");
    return true;
  }();
  if (written) flash::data::load_scene(path);
})
