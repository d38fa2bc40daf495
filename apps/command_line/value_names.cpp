#include "apps/command_line/value_names.h"

#include <CLI/CLI.hpp>
#include <map>
#include <string>

namespace flash {

void name_values(CLI::App& app) {
  static const std::map<std::string, std::string> names = {
      {"recording", "FOLDER"},     {"recordings", "FOLDER"},  {"run", "FOLDER"},
      {"--run", "FOLDER"},         {"--start", "FOLDER"},     {"--rollouts", "FOLDER"},
      {"--depth", "FOLDER"},       {"--masks", "FOLDER"},     {"dataset", "FOLDER"},
      {"clouds", "FOLDER"},        {"views", "FOLDER"},       {"--cache", "FOLDER"},
      {"--cameras", "FOLDER"},     {"--asset", "FILE"},       {"scene", "FILE"},
      {"--trajectory", "FILE"},    {"--intrinsics", "FILE"},  {"--extrinsics", "FILE"},
      {"--markers", "FILE"},       {"--placed", "FILE"},      {"meshes", "FILE"},
      {"calibrations", "FILE"},    {"--config", "FILE"},      {"--truth-out", "FILE"},
      {"--robot", "FILE"},         {"--ros", "FILE"},         {"--urdf", "FILE"},
      {"--easy-handeye2", "FILE"}, {"--camera-info", "FILE"}, {"--report", "FILE"},
      {"--out", "PATH"},           {"--like", "PATH"},        {"--poses", "PATH"},
      {"--mesh", "MESH"},          {"--hold", "NAME=VALUE"},  {"--sigma", "NAME=VALUE"},
      {"--offset-bound", "X,Y,Z"}, {"--gravity", "X,Y,Z"},    {"--resolution", "WIDTHxHEIGHT"},
      {"--crop-x", "LOW:HIGH"},    {"--crop-y", "LOW:HIGH"},  {"--crop-z", "LOW:HIGH"},
      {"--clamp-x", "LOW:HIGH"},   {"--clamp-y", "LOW:HIGH"}, {"--clamp-z", "LOW:HIGH"},
      {"--device", "DEVICE"},      {"--map", "NAME"},         {"--name", "NAME"},
      {"--on-support", "NAME"},    {"--kind", "KIND"},        {"--target", "TARGET"}};
  for (CLI::App* verb : app.get_subcommands([](const CLI::App*) { return true; })) name_values(*verb);
  for (CLI::Option* option : app.get_options()) {
    const auto name = names.find(option->get_name());
    if (name != names.end() && option->get_items_expected_max() > 0 && option->get_type_size_max() > 0)
      option->type_name(name->second);
  }
}

}  // namespace flash
