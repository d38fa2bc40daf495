#pragma once
#include <array>
#include <optional>
#include <string>

#include "sysid/capture/import.h"

namespace flash {

/// Options of `import` whose texts become values, as on the command line; empty where they are not given.
struct ImportOptions {
  std::string clouds;            ///< folder of .ply or .pcd, taken in order of name, 2 before 10; or
  std::string depth;             ///< folder of .png
  std::string lens;              ///< of depth images: "stated", "solved", a file; empty: they have to agree
  std::string trajectory;        ///< T_base_gripper, TUM or CSV; empty: that of segment.json
  std::string times;             ///< as frame_times reads them; empty: those of segment.json
  std::string mesh;              ///< mesh spec or file
  std::string grasp = "corner";  ///< as parse_grasp reads it
  std::optional<double> within;  ///< of the grasp [m]; empty: 0.02
  std::optional<double> from, until;  ///< by the clock of the recording [s]; empty: all of it
  std::array<std::string, 3> crop;    ///< along x, y and z "LOW:HIGH" [m], either side may be empty
};

/// "corner", "corner:I,J", "vertices:A,B,..." or "position": what is near the gripper. Throws
/// data::InputError that names --grasp.
data::Selection parse_grasp(const std::string& text);

/// The box of the three ranges "LOW:HIGH". Throws data::InputError that names --crop-x, --crop-y or --crop-z.
data::CropBox parse_crop(const std::array<std::string, 3>& ranges);

/// The same of --NAME-x, --NAME-y and --NAME-z.
data::CropBox parse_box(const std::array<std::string, 3>& ranges, const std::string& name);

/// Puts sheet, grasp, crop, trajectory, frames and their times into `settings`. Where `segment` made the
/// clouds, trajectory, times and table height that are not given are those of its segment.json. Throws
/// data::InputError that names the option, also where a folder holds no frames, where `settings` has no
/// camera for depth images, and, unless settings.accept_unusable, where what is given is not what the clouds
/// were segmented with.
void read_options(const ImportOptions& options, sysid::ImportSettings& settings);

}  // namespace flash
