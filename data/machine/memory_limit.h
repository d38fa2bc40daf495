#pragma once

namespace flash::data {

/// Memory that this process may take: the machine's, or less where its control group or `ulimit -v` say so
/// [bytes]; 0 where nothing is known.
double memory_limit();

}  // namespace flash::data
