// SPDX-License-Identifier: Apache-2.0
// takt-eval, which `takt eval` becomes: a program of its own, because no run needs what stands here.
#include <CLI/CLI.hpp>
#include <opencv2/core/utils/logger.hpp>

#include "graph/cli/boundary.hpp"
#include "graph/cli/outcome.hpp"
#include "graph/evaluate/command_line.hpp"

namespace {

int run(int argc, char** argv) {
  // Files that cannot be read are reported by the evaluations themselves, with the next step.
  cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
  CLI::App eval{"measures quality against ground truth", "takt eval"};
  takt::command::Evaluations options;
  int exit_code = 0;
  takt::command::add_evaluations(eval, options, exit_code);
  try {
    eval.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    exit_code = eval.exit(error) == 0 ? 0 : takt::command::kBadInput;
  }
  return exit_code;
}

}  // namespace

int main(int argc, char** argv) {
  return takt::command::at_boundary(argc, argv, [&] { return run(argc, argv); });
}
