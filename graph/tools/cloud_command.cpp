// SPDX-License-Identifier: Apache-2.0
#include "graph/tools/cloud_command.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cstdio>
#include <optional>

#include "graph/cli/file_option.hpp"
#include "graph/cli/outcome.hpp"
#include "hal/settings/json.hpp"
#include "nodes/cloud/cloud_file.hpp"
#include "rt/msg/point.hpp"
#include "rt/time/clock.hpp"

namespace takt::command {
namespace {

using Json = nlohmann::ordered_json;

constexpr size_t kLargestCloud = size_t{1} << 24;  // what a voxel grid holds

struct StepReport {
  std::string name;
  size_t points = 0, unusable = 0;
  double ms = 0;  ///< CPU time of this thread
};

struct CloudReport {
  std::filesystem::path file;
  size_t points = 0;
  bool coloured = false;
  std::vector<StepReport> steps;
  size_t room = 0, lost = 0;  ///< of the result; points that found none
  cloud::Cloud result;
  std::vector<std::string> left_out;
};

/// "0.2:10"; nothing if it is something else.
std::optional<cloud::OutlierParameters> parse_outliers(const std::string& text) {
  cloud::OutlierParameters p;
  const char* end = text.data() + text.size();
  const auto radius = std::from_chars(text.data(), end, p.radius_m);
  if (radius.ec != std::errc{} || radius.ptr == end || *radius.ptr != ':') return std::nullopt;
  const auto others = std::from_chars(radius.ptr + 1, end, p.n_min);
  if (others.ec != std::errc{} || others.ptr != end || !(p.radius_m >= 1e-3 && p.radius_m <= 1e3) || p.n_min < 1)
    return std::nullopt;
  return p;
}

/// Room for what interpolation and smoothing add: about three times a surface's points. Those beyond it are told.
constexpr size_t kGrowth = 4;

CloudReport filtered(const std::filesystem::path& file, const cloud::Cloud& cloud, const cloud::FilterSteps& steps) {
  const size_t room = std::min(kLargestCloud, kGrowth * cloud.points.size());
  CloudReport report{file, cloud.points.size(), !cloud.colours.empty(), {}, room, 0, {}, cloud.left_out};
  report.result.origin = cloud.origin;
  report.result.points.resize(room);
  if (report.coloured) report.result.colours.resize(room);
  cloud::CloudBuffer buffer(report.result.points, report.result.colours);
  for (size_t i = 0; i < cloud.points.size(); ++i)
    buffer.push(cloud.points[i], report.coloured ? cloud.colours[i] : Colour{});
  cloud::CloudFilter filter(room, steps);
  int64_t start_ns = thread_cpu_ns();
  filter.run(buffer, [&](const cloud::StepResult& result) {
    const int64_t now_ns = thread_cpu_ns();
    report.steps.push_back({std::string(cloud::to_string(result.step)), result.points, result.unusable,
                            static_cast<double>(now_ns - start_ns) / 1e6});
    start_ns = thread_cpu_ns();
  });
  report.lost = buffer.lost();
  report.result.points.resize(buffer.size());
  report.result.colours.resize(report.coloured ? buffer.size() : 0);
  return report;
}

Json to_json(const CloudReport& report) {
  Json steps = Json::array();
  for (const StepReport& step : report.steps)
    steps.push_back({{"step", step.name}, {"points", step.points}, {"unusable", step.unusable}, {"ms", step.ms}});
  return {{"file", report.file.string()},
          {"points", report.points},
          {"coloured", report.coloured},
          {"steps", steps},
          {"points_out", report.result.points.size()},
          {"lost", report.lost},
          {"origin", report.result.origin},
          {"left_out", report.left_out}};
}

void print(const CloudReport& report) {
  std::printf("%s: %zu points%s\n", report.file.string().c_str(), report.points, report.coloured ? ", coloured" : "");
  for (const std::string& left : report.left_out) std::printf("  %s\n", left.c_str());
  if (const auto& origin = report.result.origin; origin != std::array<double, 3>{})
    std::printf("  origin %.0f %.0f %.0f m: taken off, and added again where the cloud is written\n", origin[0],
                origin[1], origin[2]);
  for (const StepReport& step : report.steps)
    std::printf("  %-12s %9zu points %9.2f ms%s\n", step.name.c_str(), step.points, step.ms,
                step.unusable > 0 ? fmt::format("  {} not finite or too far away", step.unusable).c_str() : "");
  if (report.lost > 0) std::printf("  %zu points were lost: there is room for %zu\n", report.lost, report.room);
}

int run_cloud(const CloudOptions& options) {
  cloud::FilterSteps steps = options.steps;
  if (!options.outliers.empty()) {
    const auto outliers = parse_outliers(options.outliers);
    if (!outliers)
      return refuse(fmt::format("--outliers {}: write RADIUS:OTHERS, a radius in 0.001..1000 m and how many other "
                                "points must lie within it, for instance 0.2:10",
                                options.outliers),
                    kBadInput);
    steps.outliers = *outliers;
  }
  if (!options.out.empty() && options.files.size() > 1)
    return refuse(fmt::format("--out is for one cloud, there are {} files", options.files.size()), kBadInput);
  Json all = Json::array();
  for (const std::filesystem::path& file : options.files) {
    const auto cloud = cloud::read_cloud(file);
    if (!cloud) return refuse(cloud.error(), kBadInput);
    if (cloud->points.size() > kLargestCloud)
      return refuse(
          fmt::format("{}: {} points, at most {} can be filtered", file.string(), cloud->points.size(), kLargestCloud),
          kBadInput);
    const CloudReport report = filtered(file, *cloud, steps);
    if (options.json) all.push_back(to_json(report));
    else print(report);
    if (options.out.empty()) continue;
    const auto written = cloud::write_cloud(options.out, report.result.view(),
                                            options.ascii ? cloud::Encoding::ascii : cloud::Encoding::binary);
    if (!written) return refuse("--out " + written.error(), kBadInput);
  }
  if (options.json) std::printf("%s\n", all.dump(2).c_str());
  return kOk;
}

}  // namespace

void add_cloud(CLI::App& app, CloudOptions& o, int& exit_code) {
  CLI::App* command =
      app.add_subcommand("cloud", "filters point clouds in PLY and PCD files; the steps are done in the order listed");
  const CLI::Range edge(1e-3, 1e3);
  reads_file(command->add_option("files", o.files, "PLY or PCD files"))->required();
  command->add_option("--outliers", o.outliers, "RADIUS:OTHERS: drops points with fewer others within the radius (m)");
  command->add_option("--interpolate", o.steps.interpolate.edge_m, "fills gaps between voxels of this edge (m)")
      ->check(edge);
  command->add_option("--smooth", o.steps.smooth.edge_m, "convolves voxels of this edge (m)")->check(edge);
  command->add_option("--reduce", o.steps.reduce_edge_m, "one point for each voxel of this edge (m)")->check(edge);
  writes_file(command->add_option("--out", o.out, "writes the result to this file, .ply or .pcd"));
  command->add_flag("--ascii", o.ascii, "writes it as text instead of binary");
  command->add_flag("--json", o.json, "prints one JSON array, an object for each file");
  command->callback([&] { exit_code = run_cloud(o); });
}

}  // namespace takt::command
