#include "apps/command_line/input_files.h"

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <system_error>
#include <utility>

#include "data/files/atomic_file.h"
#include "data/files/json_reader.h"

namespace flash {

const std::vector<std::string> kSearchFiles = {"grid.json",         "summary.json",  "results.csv",
                                               "registrations.csv", "keyframes.csv", "residuals.csv"};

const std::string kIsAsset = "is an asset";

namespace {

namespace fs = std::filesystem;

constexpr const char* kSearchFolders[] = {"best", "motions"};
/// Where the frames of a camera stand, in its folder.
constexpr const char* kFrameFolders[] = {"", "depth", "clouds", "frames", "masks"};

bool begins_an_object(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  for (const char mark : {'\xEF', '\xBB', '\xBF'})  // a byte order mark, which readers pass over
    if (file.peek() == std::char_traits<char>::to_int_type(mark)) file.get();
  char first = 0;
  return file >> first && first == '{';  // after white space
}

/// Whether a document of that name is there which does not say that it is of another kind.
bool has_document(const fs::path& path, const std::string& schema) {
  if (!is_file(path)) return false;
  if (!begins_an_object(path)) return true;
  try {
    const nlohmann::json document = data::load_json(path.string());
    const auto own = document.find("schema");
    return own != document.end() && own->is_string() && own->get<std::string>().starts_with(schema);
  } catch (const std::exception&) {
    return true;  // a broken one
  }
}

bool holds_search(const fs::path& folder) {
  return has_document(folder / "grid.json", "flash-sysid-grid/") ||
         has_document(folder / "summary.json", "flash-sysid-summary/");
}

/// What a run reads, as it is reached from the command line.
class Inputs {
 public:
  void add(const std::string& value) {
    if (is_folder(value))
      add_folder(value);
    else
      add_file(value);
  }
  const std::vector<std::string>& files() const { return files_; }

 private:
  void add_folder(const fs::path& folder) {
    const bool recorded = holds_recording(folder);
    const bool searched = holds_search(folder);
    if (recorded) add_file(folder / "recording.json");
    if (searched) {
      for (const std::string& name : kSearchFiles) add_file(folder / name);
      for (const char* name : kSearchFolders) add_all(folder / name, true);
    }
    if (recorded || searched) return;
    for (const char* name : kFrameFolders) add_all(folder / name, false);
  }

  void add_all(const fs::path& folder, bool deep) {
    std::error_code error;
    std::set<fs::path> paths;  // the message names the first
    for (const auto& entry : fs::directory_iterator(folder, error)) paths.insert(entry.path());
    for (const fs::path& path : paths) {
      if (is_folder(path) && deep)
        add_all(path, true);
      else
        add_file(path);
    }
  }

  void add_file(const fs::path& path) {
    if (!is_file(path) || !known_.insert(whole_path(path.string())).second) return;
    files_.push_back(path.string());
    if (!begins_an_object(path)) return;  // whatever its ending: a scene may have any
    try {
      add_named(data::load_json(path.string()), path.string());
    } catch (const std::exception&) {
      return;  // its reader says what is wrong with it
    }
  }

  /// Files that a document names. What an asset tells of the search behind it is not read again.
  void add_named(const nlohmann::json& value, const std::string& file) {
    if (value.is_string()) {
      const std::string text = value.get<std::string>();
      if (!text.empty() && text.size() < 4096) add_file(data::resolve_path(text, file));
    } else if (value.is_structured()) {
      for (const auto& [name, item] : value.items())
        if (name != "identification") add_named(item, file);
    }
  }

  std::vector<std::string> files_;
  std::set<std::string> known_;
};

/// "is a scene" of a document that verbs start from.
std::string document_there(const std::string& path) {
  const std::pair<const char*, std::string> kKinds[] = {
      {"flash-recording/", "is a recording"}, {"flash-scene/", "is a scene"}, {"flash-asset/", kIsAsset}};
  if (!begins_an_object(path)) return {};
  try {
    const nlohmann::json document = data::load_json(path);
    const auto schema = document.find("schema");
    const auto properties = document.find("mechanical_props");
    if (schema == document.end() && properties != document.end() && properties->is_object())
      return kIsAsset;  // as published
    if (schema == document.end() || !schema->is_string()) return {};
    for (const auto& [prefix, kind] : kKinds)
      if (schema->get<std::string>().starts_with(prefix)) return kind;
  } catch (const std::exception&) {
    return {};  // no document of ours
  }
  return {};
}

}  // namespace

bool is_file(const fs::path& path) {
  std::error_code error;
  return fs::is_regular_file(path, error);
}

bool is_folder(const fs::path& path) {
  std::error_code error;
  return fs::is_directory(path, error);
}

std::vector<std::string> input_files(const std::vector<std::string>& values) {
  Inputs inputs;
  for (const std::string& value : values) inputs.add(value);
  return inputs.files();
}

std::string input_there(const std::string& path) {
  const fs::path whole = whole_path(path);
  if (!is_file(whole)) return {};
  for (fs::path folder = whole.parent_path();; folder = folder.parent_path()) {
    if (holds_recording(folder))
      for (const std::string& file : input_files({(folder / "recording.json").string()}))
        if (whole_path(file) == whole) return "is part of the recording in " + folder.string();
    if (holds_search(folder) && folder == whole.parent_path() &&
        std::find(kSearchFiles.begin(), kSearchFiles.end(), whole.filename()) != kSearchFiles.end())
      return "is part of the search in " + folder.string();
    if (folder == folder.parent_path()) break;
  }
  return document_there(whole.string());
}

bool holds_recording(const fs::path& folder) {
  return has_document(folder / "recording.json", "flash-recording/");
}

std::string search_of(const fs::path& folder) {
  const bool of_search = std::find(std::begin(kSearchFolders), std::end(kSearchFolders), folder.filename()) !=
                         std::end(kSearchFolders);
  return of_search && holds_search(folder.parent_path()) ? folder.parent_path().string() : std::string();
}

std::string whole_path(const std::string& path) {
  std::error_code error;
  const fs::path whole = fs::weakly_canonical(fs::absolute(path, error), error);
  return error ? path : whole.string();
}

}  // namespace flash
