#include "apps/command_line/spared_inputs.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <system_error>
#include <vector>

#include "apps/command_line/result_files.h"
#include "data/files/atomic_file.h"
#include "data/files/error.h"
#include "data/files/json_reader.h"
#include "data/files/text.h"

namespace flash {
namespace {

namespace fs = std::filesystem;

/// Options that name results. Every other one that names a file or a folder that is there names an input.
const std::set<std::string> kOutputs = {"--out", "--flat", "--truth-out"};
/// What a search keeps for the next: read and written.
const std::set<std::string> kKept = {"--rollouts", "--cache"};

/// Of a folder of grid or fit, what other verbs read.
constexpr const char* kSearchFiles[] = {"grid.json",         "summary.json",  "results.csv",
                                        "registrations.csv", "keyframes.csv", "residuals.csv"};
constexpr const char* kSearchFolders[] = {"best", "motions"};
/// Where the frames of a camera stand, in its folder.
constexpr const char* kFrameFolders[] = {"", "depth", "clouds", "frames", "masks"};

bool is_file(const fs::path& path) {
  std::error_code error;
  return fs::is_regular_file(path, error);
}

bool is_folder(const fs::path& path) {
  std::error_code error;
  return fs::is_directory(path, error);
}

std::string whole_path(const fs::path& path) {
  std::error_code error;
  const fs::path whole = fs::weakly_canonical(fs::absolute(path, error), error);
  return error ? path.string() : whole.string();
}

bool is_beneath(const std::string& path, const std::string& folder) {
  return path == folder || path.starts_with(folder == "/" ? folder : folder + '/');
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
    const bool recorded = is_file(folder / "recording.json");
    const bool searched = is_file(folder / "grid.json") || is_file(folder / "summary.json");
    if (recorded) add_file(folder / "recording.json");
    if (searched) {
      for (const char* name : kSearchFiles) add_file(folder / name);
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
    if (!is_file(path) || !known_.insert(whole_path(path)).second) return;
    files_.push_back(path.string());
    if (!begins_an_object(path)) return;  // whatever its ending: a scene may have any
    try {
      add_named(data::load_json(path.string()), path.string());
    } catch (const std::exception&) {
      return;  // its reader says what is wrong with it
    }
  }

  static bool begins_an_object(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    for (const char mark : {'\xEF', '\xBB', '\xBF'})  // a byte order mark, which readers pass over
      if (file.peek() == std::char_traits<char>::to_int_type(mark)) file.get();
    char first = 0;
    return file >> first && first == '{';  // after white space
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

struct CommandLine {
  std::vector<std::string> outputs, inputs;
  std::string out;  ///< the output that may be a folder
  bool resumes = false;
};

void collect(const CLI::App& app, CommandLine& line) {
  for (const CLI::Option* option : app.get_options()) {
    const std::string name = option->get_name();
    if (option->count() == 0 || kKept.contains(name)) continue;
    if (name == "--resume") line.resumes = true;
    if (name == "--out") line.out = option->results().front();
    for (const std::string& value : option->results()) {
      if (kOutputs.contains(name))
        line.outputs.push_back(value);
      else if (!data::parse_number(value))  // 1 of --threads 1 is no file
        line.inputs.push_back(value);
    }
  }
  for (const CLI::App* part : app.get_subcommands()) collect(*part, line);  // the verb
  for (const CLI::App* group :
       app.get_subcommands([](const CLI::App* part) { return part->get_name().empty(); }))
    collect(*group, line);
}

/// The folder, and those that links in it lead to.
std::vector<std::string> folders_of(const std::string& out) {
  std::vector<std::string> folders = {whole_path(out)};
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(out, error))
    if (entry.is_symlink(error) && is_folder(entry.path())) folders.push_back(whole_path(entry.path()));
  return folders;
}

void check_folder(const std::string& out, const std::vector<std::string>& read, bool resumes) {
  std::vector<std::string> folders = folders_of(out);
  std::set<std::string> written;  // of --resume
  for (const char* name : kSearchFiles) written.insert(whole_path(fs::path(out) / name));
  for (const std::string& path : read) {
    const std::string whole = whole_path(path);
    const bool held = std::any_of(folders.begin(), folders.end(),
                                  [&](const std::string& folder) { return is_beneath(whole, folder); });
    if (resumes ? written.contains(whole) : held)
      throw data::InputError(out + ": holds " + path +
                             ", which is read by this run; expected another folder for the result");
  }
}

}  // namespace

void expect_spared_inputs(const CLI::App& app) {
  CommandLine line;
  collect(app, line);
  expect_own_files(line.outputs, {});
  std::erase_if(line.outputs, [](const std::string& path) { return !is_file(path); });
  if (line.outputs.empty() && !is_folder(line.out)) return;  // nothing is there to be written over
  Inputs inputs;
  for (const std::string& value : line.inputs) inputs.add(value);
  expect_own_files(line.outputs, inputs.files());
  if (is_folder(line.out)) check_folder(line.out, inputs.files(), line.resumes);
}

}  // namespace flash
