#include "apps/command_line/spared_inputs.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <set>
#include <string>
#include <system_error>
#include <vector>

#include "apps/command_line/input_files.h"
#include "apps/command_line/result_files.h"
#include "data/files/error.h"
#include "data/files/folder_lock.h"
#include "data/files/text.h"

namespace flash {
namespace {

namespace fs = std::filesystem;

/// Options that name results. Every other one that names a file or a folder that is there names an input.
const std::set<std::string> kOutputs = {"--out", "--flat", "--truth-out"};
/// Whose values are words, whatever stands under that name.
const std::set<std::string> kWords = {"--name", "--device", "--shard"};
/// What a search keeps for the next: read and written.
const std::set<std::string> kKept = {"--rollouts", "--cache"};

bool is_beneath(const std::string& path, const std::string& folder) {
  return path == folder || path.starts_with(folder == "/" ? folder : folder + '/');
}

struct CommandLine {
  std::vector<std::string> outputs, inputs;
  std::string out;  ///< the output that may be a folder
  bool resumes = false;
  bool adds = false;       ///< to what is there, and removes nothing
  bool is_shared = false;  ///< by several programs, each of which holds a part of it
  bool writes_asset = false, writes_recording = false;
};

bool takes_words(const CLI::Option& option) {
  return kWords.contains(option.get_name()) || option.get_type_name().find(":{") != std::string::npos;
}

void collect(const CLI::App& app, CommandLine& line) {
  for (const CLI::Option* option : app.get_options()) {
    const std::string name = option->get_name();
    if (name == "--shard" && option->count() > 0) line.is_shared = true;
    if (option->count() == 0 || kKept.contains(name) || takes_words(*option)) continue;
    if (name == "--resume") line.resumes = true;
    if (name == "--out") line.out = option->results().front();
    for (const std::string& value : option->results()) {
      if (kOutputs.contains(name))
        line.outputs.push_back(value);
      else if (!data::parse_number(value))  // 1 of --threads 1 is no file
        line.inputs.push_back(value);
    }
  }
  if (app.get_name() == "merge") line.adds = true;
  if (app.get_name() == "export") line.writes_asset = true;
  if (app.get_name() == "import" || app.get_name() == "synth") line.writes_recording = true;
  for (const CLI::App* part : app.get_subcommands()) collect(*part, line);  // the verb
  for (const CLI::App* group :
       app.get_subcommands([](const CLI::App* part) { return part->get_name().empty(); }))
    collect(*group, line);
}

/// The folder, and those that links in it lead to.
std::vector<std::string> folders_of(const std::string& out) {
  std::vector<std::string> folders = {whole_path(out)};
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(whole_path(out), error))
    if (entry.is_symlink(error) && is_folder(entry.path()))
      folders.push_back(whole_path(entry.path().string()));
  return folders;
}

void check_folder(const std::string& out, const std::vector<std::string>& read, bool resumes) {
  std::vector<std::string> folders = folders_of(out);
  std::set<std::string> written;  // of --resume
  for (const std::string& name : kSearchFiles) written.insert(whole_path((fs::path(out) / name).string()));
  for (const std::string& path : read) {
    const std::string whole = whole_path(path);
    const bool held = std::any_of(folders.begin(), folders.end(),
                                  [&](const std::string& folder) { return is_beneath(whole, folder); });
    if (resumes ? written.contains(whole) : held)
      throw data::InputError(out + ": holds " + path +
                             ", which is read by this run; expected another folder for the result");
  }
}

void expect_no_recording(const CommandLine& line) {
  if (!line.writes_recording && holds_recording(whole_path(line.out)))
    throw data::InputError(line.out + ": holds a recording, expected another folder for the result");
}

}  // namespace

void expect_spared_inputs(const CLI::App& app) {
  CommandLine line;
  collect(app, line);
  if (line.adds) return expect_no_recording(line);
  const Replaced replaced = line.writes_asset ? Replaced::assets : Replaced::results;
  expect_own_files(line.outputs, {}, Replaced::anything);
  std::erase_if(line.outputs, [](const std::string& path) { return !is_file(whole_path(path)); });
  if (line.outputs.empty() && !is_folder(whole_path(line.out)))
    return;  // nothing is there to be written over
  if (is_folder(whole_path(line.out)) && !line.is_shared) {
    data::expect_not_held(line.out);
    if (const std::string search = search_of(whole_path(line.out)); !search.empty())
      data::expect_not_held(search);
  }
  const std::vector<std::string> read = input_files(line.inputs);
  expect_own_files(line.outputs, read, replaced);
  if (!is_folder(whole_path(line.out))) return;
  check_folder(line.out, read, line.resumes);
  expect_no_recording(line);
}

}  // namespace flash
