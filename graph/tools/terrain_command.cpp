// SPDX-License-Identifier: Apache-2.0
#include "graph/tools/terrain_command.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <sstream>

#include "graph/cli/boundary.hpp"
#include "graph/cli/file_option.hpp"
#include "graph/cli/outcome.hpp"
#include "graph/log/damages.hpp"
#include "graph/log/recorded_plan.hpp"
#include "graph/log/recorded_type.hpp"
#include "nodes/ground_map/terrain_drive.hpp"
#include "nodes/ground_map/terrain_file.hpp"
#include "rt/file/output_file.hpp"
#include "rt/memory/aligned_bytes.hpp"
#include "rt/msg/grid.hpp"
#include "rt/record/log_file.hpp"
#include "rt/record/packed_message.hpp"

namespace takt::command {
namespace {

using namespace ground_map;

/// Cells around the robot, by what they show.
struct MeasuredMaps {
  TerrainShape shape;
  std::array<std::vector<std::vector<int16_t>>, kTerrainKinds> of;
};

/// So many of each kind, spread evenly over those of the drive.
MeasuredMaps generated_maps(const TerrainOptions& options) {
  MeasuredMaps all, some;
  TerrainDriveOptions drive;
  drive.seed = options.seed;
  TerrainDrive(drive).run(all.shape, [&](std::span<const int16_t> around, std::optional<size_t> kind) {
    if (kind && *kind < kTerrainKinds) all.of[*kind].emplace_back(around.begin(), around.end());
  });
  for (size_t kind = 0; kind < kTerrainKinds; ++kind)
    for (size_t i = 0, n = std::min(static_cast<size_t>(options.each), all.of[kind].size()); i < n; ++i)
      some.of[kind].push_back(std::move(all.of[kind][i * all.of[kind].size() / n]));
  return some;
}

struct Pick {
  size_t kind;
  double from_s, to_s;
};

/// "left=12..15.5"
Pick pick_of(const std::string& text) {
  const size_t equals = text.find('='), dots = text.find("..");
  const auto end = kTerrainNames.begin() + kTerrainKinds,
             found = std::find(kTerrainNames.begin(), end, text.substr(0, equals));
  try {
    if (found != end && equals != std::string::npos && dots != std::string::npos)
      return {static_cast<size_t>(found - kTerrainNames.begin()), std::stod(text.substr(equals + 1)),
              std::stod(text.substr(dots + 2))};
  } catch (const std::exception&) {
  }
  throw std::runtime_error(
      fmt::format("--pick {}: must be KIND=FROM..TO in seconds; kinds are left, right, middle, crossing", text));
}

/// The recorded maps within the times that are named, counted from the port's first message.
MeasuredMaps recorded_maps(const TerrainOptions& options) {
  std::vector<Pick> picks;
  for (const std::string& text : options.pick) picks.push_back(pick_of(text));
  auto log = record::LogFile::open(options.record);
  if (!log) throw std::runtime_error(log.error());
  if (const std::string damages = log::damages_text(options.record, *log); !damages.empty() && !options.allow_damage)
    throw std::runtime_error(damages + "; --allow-damage goes on with what is left");
  const MessageType& type = MessageType::of<Grid>();
  const mcap::Channel* recorded = log::channel_of(*log, options.port);
  const auto plan = log::Json::parse(log->attached("plan.json").value_or("{\"ports\": []}"));
  const auto& ports = plan.at("ports");
  const auto port =
      std::find_if(ports.begin(), ports.end(), [&](const log::Json& p) { return p.value("name", "") == options.port; });
  const auto described = recorded != nullptr ? log::type_of(*log, *recorded) : tl::make_unexpected(std::string());
  if (port == ports.end() || !described || !described->is(type))
    throw std::runtime_error(fmt::format("{}: has no grids of {}", options.record.string(), options.port));
  const Capacity capacity = log::capacity_of(plan, static_cast<size_t>(port - ports.begin()));
  const AlignedBytes memory = aligned_bytes(type.bytes(capacity));
  const uint16_t channel = log->channel(options.port);
  const auto& messages = log->messages(channel);
  MeasuredMaps maps;
  for (const auto& [sequence, known] : messages) {
    const double at_s = static_cast<double>(known.stamp_ns - messages.begin()->second.stamp_ns) * 1e-9;
    const auto message = known.whole ? log->message(channel, sequence) : std::nullopt;
    type.place(memory.get(), capacity);
    if (!message || !record::unpack(type, message->data, memory.get())) continue;
    const Grid& grid = *reinterpret_cast<const Grid*>(memory.get());
    const auto cells = [&](double length_m) { return static_cast<int>(std::lround(length_m / grid.cell_m)); };
    maps.shape = {grid.width, grid.height, cells(-grid.origin_x_m), cells(-grid.origin_y_m), grid.cell_m};
    for (const Pick& pick : picks)
      if (at_s >= pick.from_s && at_s <= pick.to_s)
        maps.of[pick.kind].emplace_back(grid.cells.items().begin(), grid.cells.items().end());
  }
  for (size_t kind = 0; kind < kTerrainKinds; ++kind)
    if (maps.of[kind].empty())
      throw std::runtime_error(fmt::format(
          "{}: no whole message of {} lies where --pick says that it shows `{}`; record with --record-port {}",
          options.record.string(), options.port, kTerrainNames[kind], options.port));
  return maps;
}

TerrainLearning learning(const TerrainOptions& options) {
  if (!options.maps.empty()) return read_terrain(options.maps);
  const MeasuredMaps maps = options.record.empty() ? generated_maps(options) : recorded_maps(options);
  TerrainLearning learning(maps.shape);
  for (size_t kind = 0; kind < kTerrainKinds; ++kind)
    for (const auto& map : maps.of[kind]) learning.add(kind, map);
  if (!options.measured.empty()) {
    std::ostringstream out;
    write_terrain_shape(out, maps.shape);
    for (size_t kind = 0; kind < kTerrainKinds; ++kind)
      for (const auto& map : maps.of[kind]) write_terrain_map(out, maps.shape, kind, map);
    require_written(write_file(options.measured, out.str()));
  }
  return learning;
}

int learn(const TerrainOptions& options) {
  try {
    const TerrainLearning learnt_from = learning(options);
    const TerrainMaps maps = learnt_from.learnt();
    std::ostringstream out;
    out << "# takt terrain learn: the mean of each cell over measured maps of a kind\n";
    write_terrain_shape(out, maps.shape);
    std::printf("%-10s %6s %14s\n", "kind", "maps", "known cells %");
    for (size_t kind = 0; kind < kTerrainKinds; ++kind) {
      write_terrain_map(out, maps.shape, kind, maps.cells[kind]);
      const auto unknown = std::count(maps.cells[kind].begin(), maps.cells[kind].end(), kUnknown);
      std::printf("%-10s %6d %14.1f\n", std::string(kTerrainNames[kind]).c_str(), learnt_from.maps(kind),
                  100 - 100 * static_cast<double>(unknown) / static_cast<double>(maps.shape.cells()));
    }
    require_written(write_file(options.out, out.str()));
    return kOk;
  } catch (const std::exception& error) {
    return refuse(error);
  }
}

}  // namespace

void add_terrain(CLI::App& app, TerrainOptions& o, int& exit_code) {
  CLI::App* terrain = app.add_subcommand("terrain", "kinds of terrain that ground_map tells apart");
  terrain->require_subcommand(1);
  CLI::App* learn_app = terrain->add_subcommand("learn", "learns the map of each kind from measured ones");
  CLI::Option* maps =
      reads_file(learn_app->add_option("maps", o.maps, "file with measured maps (default: a drive is generated)"));
  writes_file(learn_app->add_option("--out", o.out, "file for parameter terrain_maps of ground_map"))->required();
  CLI::Option* record =
      reads_file(learn_app->add_option("--record", o.record, "takes maps from this record of a run"), UINT64_MAX);
  learn_app->add_flag("--allow-damage", o.allow_damage, "a record that is damaged or cut off is no failure");
  learn_app->add_option("--port", o.port, "of the record (default ground_map.around)")->needs(record);
  CLI::Option* pick = learn_app->add_option("--pick", o.pick, "KIND=FROM..TO: when it shows what, in s; repeatable");
  pick->needs(record);
  record->needs(pick)->excludes(maps);
  writes_file(learn_app->add_option("--measured", o.measured, "writes all maps that it learns from, to choose by hand"))
      ->excludes(maps);
  learn_app->add_option("--each", o.each, "maps of each kind from the generated drive (default 20)")
      ->check(CLI::Range(1, 1000))
      ->excludes(maps)
      ->excludes(record);
  learn_app->add_option("--seed", o.seed, "of the generated drive (default 1)")->excludes(maps)->excludes(record);
  learn_app->callback([&] { exit_code = learn(o); });
}

}  // namespace takt::command
