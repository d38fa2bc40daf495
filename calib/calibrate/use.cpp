#include "calib/calibrate/use.h"

namespace flash::calib {

const char* to_string(Use use) {
  switch (use) {
    case Use::image:
      return "image";
    case Use::two_arms:
      return "two-arms";
    case Use::workspace:
      break;
  }
  return "workspace";
}

std::optional<Use> use_named(const std::string& name) {
  for (const Use use : {Use::workspace, Use::image, Use::two_arms})
    if (name == to_string(use)) return use;
  return std::nullopt;
}

UseError use_error(Use use, const HeldOut& held_out, const std::optional<Halves>& halves) {
  if (use == Use::image) return {use, "corners of views left out are predicted to", "px", held_out.px};
  if (use == Use::workspace)
    return {use, "the middle of the target in views left out is predicted to", "mm", held_out.mm};
  UseError error{use, "halves of the views, taken for two arms, put the middle of the workspace apart by",
                 "mm"};
  if (halves) error.value = halves->rms();
  return error;
}

}  // namespace flash::calib
