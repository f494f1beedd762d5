// SPDX-License-Identifier: Apache-2.0
// takt-tools, which `takt calibrate`, `cloud`, `objects`, `terrain` and `train` become: work at a desk, apart from
// `takt` because no run needs it. Called by a link takt-NAME to it, it is the command NAME.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <opencv2/core/utils/logger.hpp>
#include <string>
#include <vector>

#include "graph/cli/boundary.hpp"
#include "graph/cli/outcome.hpp"
#include "graph/tools/calibrate_command.hpp"
#include "graph/tools/cloud_command.hpp"
#include "graph/tools/objects_command.hpp"
#include "graph/tools/terrain_command.hpp"
#include "graph/tools/train_command.hpp"

namespace {

int run(int argc, char** argv) {
  // Files that cannot be read are reported by the commands themselves, with the next step.
  cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
  CLI::App app{"Takt: tools for the desk", "takt"};
  app.require_subcommand(1);
  takt::command::CalibrateOptions calibrate;
  takt::command::CloudOptions cloud;
  takt::command::ObjectsOptions objects;
  takt::command::TerrainOptions terrain;
  takt::command::TrainOptions train;
  int exit_code = 0;
  takt::command::add_calibrate(app, calibrate, exit_code);
  takt::command::add_cloud(app, cloud, exit_code);
  takt::command::add_objects(app, objects, exit_code);
  takt::command::add_terrain(app, terrain, exit_code);
  takt::command::add_train(app, train, exit_code);
  std::vector<std::string> words(argv + 1, argv + argc);
  const std::string name = std::filesystem::path(argv[0]).filename();
  if (name.starts_with("takt-") && name != "takt-tools") words.insert(words.begin(), name.substr(5));
  std::reverse(words.begin(), words.end());  // CLI11 takes the last one first
  try {
    app.parse(std::move(words));
  } catch (const CLI::ParseError& error) {
    exit_code = app.exit(error) == 0 ? 0 : takt::command::kBadInput;
  }
  return exit_code;
}

}  // namespace

int main(int argc, char** argv) {
  return takt::command::at_boundary(argc, argv, [&] { return run(argc, argv); });
}
