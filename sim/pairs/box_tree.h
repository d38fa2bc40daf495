#pragma once
#include "data/mesh/box_tree.h"

namespace flash::sim {

using data::Bounds;
using data::BoxTree;

}  // namespace flash::sim
