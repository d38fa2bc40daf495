#pragma once
#include <functional>
#include <vector>

#include "calib/dataset/dataset.h"
#include "calib/detect/detect.h"
#include "calib/detect/finder.h"

namespace flash::calib {

/// What each picture of a set shows of the target, or why it shows nothing; a picture that cannot be read
/// says so. Throws data::InputError where they show a chessboard of other counts than those stated.
///
/// A chessboard is looked for thoroughly, which takes seconds for every picture that does not show it, in all
/// pictures only where one of them shows it. Where none does, six are asked.
std::vector<Found> find_in_all(const Dataset& dataset, const Target& target, const Rectifier& rectifier,
                               const DetectSettings& settings, const std::function<void(int, int)>& progress);

}  // namespace flash::calib
