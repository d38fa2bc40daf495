#pragma once
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "data/files/error.h"

namespace flash::fuzz {

/// The input as a file of this process, under `name`; the same path every time.
inline const std::string& as_file(const char* name, const std::uint8_t* bytes, std::size_t size) {
  static const std::string path = [name] {
    const auto folder = std::filesystem::temp_directory_path() / ("flash_fuzz_" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder);
    std::atexit([] {
      std::filesystem::remove_all(std::filesystem::temp_directory_path() /
                                  ("flash_fuzz_" + std::to_string(::getpid())));
    });
    return (folder / name).string();
  }();
  std::ofstream(path, std::ios::binary).write(reinterpret_cast<const char*>(bytes), std::streamsize(size));
  return path;
}

/// A loader returns, or throws an InputError of one line that begins with the file or one beside it;
/// anything else is a finding.
template <class Load>
int load_or_refuse(const std::string& path, const Load& load) {
  try {
    load(path);
  } catch (const data::InputError& error) {
    const std::string message = error.what();
    const std::string folder = std::filesystem::path(path).parent_path().string();
    if (message.starts_with(folder) && message.find('\n') == message.npos) return 0;
    std::fprintf(stderr, "not one line that names the file: %s\n", message.c_str());
    std::abort();
  }
  return 0;
}

}  // namespace flash::fuzz

/// The entry of libFuzzer for a function of a path, fed through a file called `name`.
#define FLASH_FUZZ_LOADER(name, load)                                                  \
  extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) { \
    return flash::fuzz::load_or_refuse(flash::fuzz::as_file(name, bytes, size), load); \
  }
