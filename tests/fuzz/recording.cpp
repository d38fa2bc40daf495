#include "data/recording/recording.h"

#include "tests/fuzz/good_files.h"
#include "tests/fuzz/loader_fuzzer.h"

FLASH_FUZZ_LOADER("recording.json", [](const std::string& path) {
  // What recording.json refers to stands beside it.
  static const bool written = [&] {
    const std::filesystem::path folder = std::filesystem::path(path).parent_path();
    flash::fuzz::write_good_files(folder / "good");
    for (const char* name : {"gripper.tum", "cloud.ply", "camera.yaml"})
      std::filesystem::copy_file(folder / "good" / "recording" / name, folder / name);
    return true;
  }();
  const flash::data::Recording recording = flash::data::load_recording(path);
  std::vector<std::string> notices;
  if (written) flash::data::load_keyframes(recording, notices);
})
