#pragma once
#include <string>

#include "data/recording/recording.h"

namespace flash::data {

/// SHA-256 over recording.json and every file it names, in the order they are named, each as its own digest.
std::string recording_sha256(const Recording& recording);

/// The same of a recording that lies on another mesh: `mesh` is the specification or the file that it names.
std::string recording_sha256(const Recording& recording, const std::string& mesh);

/// SHA-256 of what was observed alone: the files of the keyframes and their forces. It stays the same where
/// the recording is named or described anew, or its trajectory is written anew.
std::string observed_sha256(const Recording& recording);

}  // namespace flash::data
