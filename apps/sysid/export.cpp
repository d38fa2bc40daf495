#include <cstdio>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "apps/command_line/command_line.h"
#include "apps/command_line/option_checks.h"
#include "apps/sysid/options.h"
#include "apps/sysid/verbs.h"
#include "data/asset/asset_mesh.h"
#include "data/files/error.h"
#include "data/files/json_reader.h"
#include "data/files/text.h"
#include "data/files/writable.h"
#include "data/mesh/mesh_io.h"
#include "data/mesh/procedural_mesh.h"
#include "sim/scene/sheet.h"
#include "sim/scene/solid.h"
#include "sysid/report/export_asset.h"
#include "sysid/report/next_steps.h"
#include "sysid/report/search_folder.h"
#include "sysid/report/searched_mesh.h"

namespace flash {
namespace {

struct ExportOptions {
  CommonOptions common;
  std::string run;
  std::string asset;
  std::string format = "flash";
  std::string out;
};

int run_export(const ExportOptions& options) {
  expect_ending("--out", options.out, {".json"});
  const sysid::Summary summary = sysid::load_search_folder(options.run).summary;
  const data::Asset base = data::load_asset(options.asset.empty() ? summary.asset : options.asset);
  data::check_file_free(options.out, options.common.force);
  for (const sysid::SummaryRecording& recording : summary.recordings)
    sysid::expect_as_searched({.mesh = recording.mesh, .digest = recording.mesh_sha256},
                              options.run + "/summary.json", "recordings." + recording.name + ".mesh");
  const data::Asset tuned = sysid::tuned_asset(base, summary);
  std::vector<std::string> notices;
  const bool solid = tuned.element_type == data::ElementType::tetrahedron;
  const double area = solid ? 0 : sim::make_sheet(data::load_asset_mesh(tuned)).vertex_area.sum();
  if (tuned.mesh != base.mesh) {
    const double mass =
        solid ? *tuned.density * sim::make_solid(data::load_asset_tet_mesh(tuned), {}, tuned.element_order)
                                     .vertex_volume.sum()
              : area * *tuned.areal_density;
    say(options.common, std::string("mesh and mass are those of the ") + (solid ? "solid" : "sheet") +
                            " in the recording, " + tuned.mesh + " (" + data::format_short(mass) +
                            " kg), not those of " + base.source);
  }
  const auto format =
      options.format == "published" ? data::AssetFormat::published : data::AssetFormat::flash_1;
  data::save_asset(data::express_as(tuned, format, area, notices), options.out);

  for (const std::string& notice : notices) warn(notice);
  for (const std::string& caveat : sysid::caveats(summary)) warn(caveat);
  if (summary.exit_code != 0) warn("the search behind this asset ended with: " + summary.warnings.front());
  if (options.common.json) {
    std::cout << data::format_json(nlohmann::ordered_json{{"schema", "flash-sysid-export/1"},
                                                          {"asset", options.out},
                                                          {"not_expressed", notices},
                                                          {"caveats", sysid::caveats(summary)},
                                                          {"exit_code", summary.exit_code}});
  } else {
    std::printf("%s\n", options.out.c_str());
  }
  return summary.exit_code == 0 ? exit_done : exit_unusable;
}

}  // namespace

void add_export_verb(CLI::App& app, Action& action) {
  const auto options = std::make_shared<ExportOptions>();
  CLI::App* verb = app.add_subcommand("export", "Write the tuned asset of a search, with its intervals");
  verb->add_option("run", options->run, "Folder of the search")->required();
  verb->add_option("--asset", options->asset, "In place of the asset the search started from");
  verb->add_option("--as", options->format, "flash: all of it; published: what the published format can say")
      ->check(CLI::IsMember({"flash", "published"}))
      ->capture_default_str();
  verb->add_option("-o,--out", options->out, "The asset file")->required();
  add_common_options(*verb, options->common);
  verb->footer(
      "Exit code 3: the asset is written, but the search behind it ended with 3, for the reason that is "
      "said.\n"
      "Example:\n  flash-sysid export run -o tuned.json");
  verb->callback([options, &action] { action = [options] { return run_export(*options); }; });
}

}  // namespace flash
