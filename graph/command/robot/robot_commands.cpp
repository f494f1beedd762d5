// SPDX-License-Identifier: Apache-2.0
#include "graph/command/robot/robot_commands.hpp"

#include <CLI/CLI.hpp>
#include <opencv2/core/utils/logger.hpp>

#include "graph/cli/file_option.hpp"
#include "graph/cli/set_option.hpp"
#include "graph/command/robot/capture_command.hpp"
#include "graph/command/robot/devices_command.hpp"
#include "graph/command/robot/double_command.hpp"
#include "graph/command/robot/robot_command.hpp"

namespace takt::command {
namespace {

struct Options {
  RobotOptions robot;
  CaptureOptions capture;
  DoubleOptions device_double;
  bool devices_json = false;
};

void add_devices(CLI::App& app, bool& json, int& exit_code) {
  CLI::App* devices = app.add_subcommand("devices", "lists what is plugged in, and a line of the graph file for each");
  devices->add_flag("--json", json, "prints the list as JSON");
  devices->footer("Example: takt devices");
  devices->callback([&] { exit_code = list_devices(json); });
}

void add_capture(CLI::App& app, CaptureOptions& o, int& exit_code) {
  CLI::App* capture = app.add_subcommand("capture", "writes what a device says to a file");
  capture->add_option("device", o.device, "can0, /dev/ttyUSB0, or 192.168.0.1:2111")->required();
  writes_file(capture->add_option("file", o.file, "file to be written"))->required();
  capture->add_option("--for", o.duration_s, "how long, e.g. 20s (default 10s)")
      ->transform(CLI::Validator(duration, "DURATION"));
  capture->add_option("--scanner", o.scanner, "lms200 | lms400: it is asked for scans meanwhile");
  capture->add_option("--baud", o.baud, "of a serial line (default 38400)");
  capture->footer(
      "Example: takt capture /dev/ttyUSB0 scans.bin --scanner lms200\n"
      "Frames of a CAN bus are written as candump writes them, of a line or connection the bytes.");
  capture->callback([&] { exit_code = capture_device(o); });
}

}  // namespace

std::shared_ptr<void> add_robot_commands(CLI::App& app, int& exit_code) {
  // Files that cannot be read are reported by the commands themselves, with the next step.
  cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
  auto options = std::make_shared<Options>();
  add_robot(app, options->robot, exit_code);
  add_devices(app, options->devices_json, exit_code);
  add_capture(app, options->capture, exit_code);
  add_double(app, options->device_double, exit_code);
  return options;
}

}  // namespace takt::command
