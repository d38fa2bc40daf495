// Writes a dataset that flash-calib reads, drawn by the tests' renderer, with the truth beside it:
//   rendered_dataset OUT SETUP TARGET VIEWS WIDTHxHEIGHT ROBOT_DEG ROBOT_MM [SEED] [NAME=VALUE ...]
//   rendered_dataset demo eye-in-hand chessboard:9x6:0.025 40 1280x720 0.05 0.5
//   rendered_dataset neck eye-in-hand chessboard:9x6:0.025 40 640x480 0.02 0.2 1 motion=pan-tilt depth_mm=1
//   rendered_dataset late eye-in-hand chessboard:9x6:0.025 25 640x480 0.02 0.2 1 motion=stream
//   time_offset=0.03
// Names: motion (random, pan-tilt, one-axis, stream), depth_mm, depth_factor, time_offset, exposure,
// pixel_noise, jpeg_quality, near, far.
#include <cstdio>
#include <iostream>
#include <string>

#include "calib/calibrate/extrinsics.h"
#include "tests/calib/rendered_set.h"

namespace flash::calib {
namespace {

void set(RenderedSetSettings& settings, const std::string& option) {
  const std::size_t equals = option.find('=');
  const std::string name = option.substr(0, equals),
                    value = equals == std::string::npos ? "" : option.substr(equals + 1);
  if (name == "motion")
    settings.motion = parse_motion(value);
  else if (name == "depth_mm")
    settings.depth_mm = std::stod(value);
  else if (name == "depth_factor")
    settings.depth_factor = std::stod(value);
  else if (name == "exposure")
    settings.exposure = std::stod(value);
  else if (name == "time_offset")
    settings.time_offset = std::stod(value);
  else if (name == "pixel_noise")
    settings.pixel_noise = std::stod(value);
  else if (name == "jpeg_quality")
    settings.jpeg_quality = std::stoi(value);
  else if (name == "near")
    settings.least_distance = std::stod(value);
  else if (name == "far")
    settings.most_distance = std::stod(value);
  else
    throw std::runtime_error(option + ": unknown");
}

}  // namespace
}  // namespace flash::calib

int main(int argc, char** argv) try {
  using namespace flash::calib;
  if (argc < 8) {
    std::cerr << "usage: rendered_dataset OUT SETUP TARGET VIEWS WIDTHxHEIGHT ROBOT_DEG ROBOT_MM [SEED] "
                 "[NAME=VALUE ...]\n";
    return 2;
  }
  RenderedSetSettings settings{.setup = parse_setup(argv[2], "command line", "SETUP"),
                               .target = argv[3],
                               .views = std::stoi(argv[4]),
                               .robot_deg = std::stod(argv[6]),
                               .robot_mm = std::stod(argv[7])};
  if (std::sscanf(argv[5], "%dx%d", &settings.width, &settings.height) != 2)
    throw std::runtime_error("WIDTHxHEIGHT: expected as 1280x720");
  if (argc > 8) settings.seed = static_cast<unsigned>(std::stoul(argv[8]));
  for (int i = 9; i < argc; ++i) set(settings, argv[i]);
  write_rendered_set(settings, argv[1]);
  return 0;
} catch (const std::exception& error) {
  std::cerr << "rendered_dataset: " << error.what() << '\n';
  return 1;
}
