// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <numbers>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>

#include "graph/cli/boundary.hpp"
#include "graph/cli/file_option.hpp"
#include "graph/cli/outcome.hpp"
#include "graph/tools/calibrate_command.hpp"
#include "hal/settings/json.hpp"
#include "nodes/calibration/generated_sweeps.hpp"
#include "nodes/calibration/picture.hpp"
#include "nodes/picture/image_file.hpp"
#include "rt/quantile.hpp"

namespace takt::command {
namespace {

using namespace calibration;
using Json = nlohmann::ordered_json;

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kNoises_m[] = {0, 0.001, 0.005};

// A recording --------------------------------------------------------------------------------------------------------

/// As graphs have it.
std::string mount_text(const PoseParameters& m) {
  return fmt::format("{{x: {:.4f}m, y: {:.4f}m, z: {:.4f}m, yaw: {:.3f}deg, pitch: {:.3f}deg, roll: {:.3f}deg}}", m[0],
                     m[1], m[2], m[3] / kDegree, m[4] / kDegree, m[5] / kDegree);
}

Json to_json(const PoseParameters& m) {
  return {{"x_m", m[0]},
          {"y_m", m[1]},
          {"z_m", m[2]},
          {"yaw_deg", m[3] / kDegree},
          {"pitch_deg", m[4] / kDegree},
          {"roll_deg", m[5] / kDegree}};
}

Json to_json(const LaserRecording& recording, const std::vector<CalibratedScanner>& scanners) {
  Json json{{"object_height_m", recording.object_height_m}, {"scanners", Json::array()}};
  for (size_t s = 0; s < scanners.size(); ++s) {
    const CalibratedScanner& found = scanners[s];
    json["scanners"].push_back({{"name", found.name},
                                {"returns", recording.sweeps[s].returns.size()},
                                {"beforehand", to_json(recording.sweeps[s].mount)},
                                {"mount", to_json(found.mount)},
                                {"object_bottom_m", found.height.bottom_m},
                                {"object_height_error_m", found.height.height_error_m},
                                {"converged", found.converged}});
    if (s == 0) continue;
    json["scanners"].back()["residual_m"] = found.residual_m;
    json["scanners"].back()["paired_share"] = found.paired;
  }
  return json;
}

void print(const LaserRecording& recording, const std::vector<CalibratedScanner>& scanners) {
  std::printf("object %g m high\n%-12s %-11s %9s %9s %9s %9s %9s %9s\n", recording.object_height_m, "scanner", "",
              "x m", "y m", "z m", "yaw deg", "pitch deg", "roll deg");
  const auto row = [](const std::string& name, const char* which, const PoseParameters& m) {
    std::printf("%-12s %-11s %9.4f %9.4f %9.4f %9.3f %9.3f %9.3f\n", name.c_str(), which, m[0], m[1], m[2],
                m[3] / kDegree, m[4] / kDegree, m[5] / kDegree);
  };
  for (size_t s = 0; s < scanners.size(); ++s) {
    row(scanners[s].name, "beforehand", recording.sweeps[s].mount);
    row("", "found", scanners[s].mount);
  }
  for (const CalibratedScanner& s : scanners) {
    std::printf("%s: the object's lower end is at %.2f mm, its height off by %.2f mm", s.name.c_str(),
                1e3 * s.height.bottom_m, 1e3 * s.height.height_error_m);
    if (&s != &scanners.front())
      std::printf("; %.0f %% of its returns lie on flat pieces of %s's room, %.2f mm off on average", 100 * s.paired,
                  scanners.front().name.c_str(), 1e3 * s.residual_m);
    std::printf("\n");
  }
}

void write_results(const CalibrateLasersOptions& o, const LaserRecording& recording,
                   const std::vector<CalibratedScanner>& scanners) {
  if (!o.out.empty()) {
    std::string out = "# takt calibrate lasers: `mount` of each scanner\n";
    for (const CalibratedScanner& s : scanners) out += fmt::format("{}: {}\n", s.name, mount_text(s.mount));
    require_written(write_file(o.out, out));
  }
  if (!o.picture.empty()) require_written(picture::write_image(o.picture, draw_calibration(recording, scanners)));
}

int calibrate_recording(const CalibrateLasersOptions& o) {
  const LaserRecording recording = read_laser_recording(o.recording);
  LaserCalibrationParameters p;
  p.seed = o.seed;
  const std::vector<CalibratedScanner> scanners = calibrate_lasers(recording, p);
  write_results(o, recording, scanners);
  if (o.json) std::printf("%s\n", to_json(recording, scanners).dump(2).c_str());
  else print(recording, scanners);
  int exit_code = kOk;
  for (const CalibratedScanner& s : scanners) {
    if (s.converged) continue;
    exit_code = kNotOk;
    std::fprintf(
        stderr,
        "takt: warning: %s did not settle: check the object's height, which returns are marked as its, and what is "
        "known beforehand\n",
        s.name.c_str());
  }
  return exit_code;
}

// Generated sweeps ---------------------------------------------------------------------------------------------------

Json to_json(const MountErrors& e) {
  return {{"error_m", median(e.position_m)},
          {"error_m_worst", *std::max_element(e.position_m.begin(), e.position_m.end())},
          {"error_deg", median(e.rotation_rad) / kDegree},
          {"error_deg_worst", *std::max_element(e.rotation_rad.begin(), e.rotation_rad.end()) / kDegree}};
}

int sweep_noise(const CalibrateLasersOptions& o) {
  if (!o.json)
    std::printf("%8s %6s %8s %-12s %9s %9s %9s %9s %12s\n", "noise mm", "seeds", "settled", "mount of", "mm p50",
                "mm worst", "deg p50", "deg worst", "residual mm");
  Json rows = Json::array();
  for (const double noise_m : kNoises_m) {
    const CalibrationErrors e = measure_calibration({.noise_m = noise_m}, o.runs, o.seed);
    const double residual_m = median(e.residual_m);
    rows.push_back({{"noise_m", noise_m},
                    {"seeds", o.runs},
                    {"settled", e.converged},
                    {"first", to_json(e.reference)},
                    {"second", to_json(e.second)},
                    {"second_in_first", to_json(e.between)},
                    {"residual_m", residual_m}});
    if (o.json) continue;
    for (const auto& [name, key] :
         {std::pair("first", "first"), std::pair("second", "second"), std::pair("2nd in 1st", "second_in_first")}) {
      const Json& row = rows.back()[key];
      std::printf("%8g %6zu %8zu %-12s %9.2f %9.2f %9.3f %9.3f %12.2f\n", 1e3 * noise_m, o.runs, e.converged, name,
                  1e3 * row["error_m"].get<double>(), 1e3 * row["error_m_worst"].get<double>(),
                  row["error_deg"].get<double>(), row["error_deg_worst"].get<double>(), 1e3 * residual_m);
    }
    std::fflush(stdout);
  }
  if (o.json) std::printf("%s\n", Json{{"seed", o.seed}, {"noise", rows}}.dump(2).c_str());
  return kOk;
}

int generate(const CalibrateLasersOptions& o) {
  const GeneratedSweeps generated = generate_sweeps({}, o.seed);
  write_laser_recording(o.generate, generated.recording, generated.beams);
  for (size_t s = 0; s < generated.truth.size(); ++s)
    std::printf("%s: %s\n", generated.recording.sweeps[s].name.c_str(), mount_text(generated.truth[s]).c_str());
  return kOk;
}

int calibrate(const CalibrateLasersOptions& o) {
  try {
    if (!o.sweep.empty()) return sweep_noise(o);
    if (!o.generate.empty()) return generate(o);
    if (o.recording.empty())
      throw std::invalid_argument("lasers wants a recording, or --sweep noise or --generate FILE");
    return calibrate_recording(o);
  } catch (const std::exception& error) {
    return refuse(error);
  }
}

}  // namespace

void add_calibrate_lasers(CLI::App& calibrate_app, CalibrateLasersOptions& o, int& exit_code) {
  CLI::App* app = calibrate_app.add_subcommand(
      "lasers", "mounts of laser scanners, from their sweeps of a room while the robot turns on the spot");
  reads_file(app->add_option("recording", o.recording, "text file with the sweeps (docs/calibration.md)"));
  app->add_option("--sweep", o.sweep, "noise: errors on generated sweeps with 0, 1 and 5 mm of noise")
      ->check(CLI::IsMember({"noise"}));
  app->add_option("--runs", o.runs, "of the sweep, for each noise (default 20)")->check(CLI::Range(1, 10000));
  writes_file(
      app->add_option("--generate", o.generate, "writes a generated recording to this file and tells its true mounts"));
  app->add_option("--seed", o.seed, "of the search and of generated sweeps (default 1)");
  writes_file(app->add_option("--out", o.out, "writes the mounts to this file, as graphs want them"))
      ->excludes("--sweep")
      ->excludes("--generate");
  writes_file(app->add_option(
      "--picture", o.picture,
      "PNG: the room with the mounts known beforehand, with those found, and the distances that are left"));
  app->add_flag("--json", o.json, "one JSON object on stdout");
  app->callback([&] { exit_code = calibrate(o); });
}

}  // namespace takt::command
