#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace flash {

/// Of a folder of grid or fit, the files that other verbs read.
extern const std::vector<std::string> kSearchFiles;

/// What input_there says of an asset, the one input that a verb writes as a file: export.
extern const std::string kIsAsset;

// What cannot be asked is neither.
bool is_file(const std::filesystem::path& path);
bool is_folder(const std::filesystem::path& path);

/// The files that these files and folders, those that are there, stand for as inputs: they themselves, the
/// files which JSON documents among them name (the meshes of an asset or a scene, all of a recording), the
/// frames of a folder and the tables, the answer and the motions of a search. Each once.
std::vector<std::string> input_files(const std::vector<std::string>& values);

/// What a result at `path` would take away that other runs read, as "is part of the recording in /data/lift"
/// or "is an asset"; empty where nothing or a former result is there. Looked for are recordings and searches
/// in the folders above it, and documents that other verbs start from: a recording, a scene or an asset.
std::string input_there(const std::string& path);

/// Whether a folder is that of a recording: its recording.json says so, or is no JSON document.
bool holds_recording(const std::filesystem::path& folder);

/// The folder of the search that has this folder of its motions; empty where none has.
std::string search_of(const std::filesystem::path& folder);

/// Whatever links and folders lead to a file that may not be there yet.
std::string whole_path(const std::string& path);

}  // namespace flash
