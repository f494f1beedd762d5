// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>
#include <vector>

namespace takt::command {

struct TerrainOptions {
  std::filesystem::path maps;    ///< measured ones
  std::filesystem::path record;  ///< from which to pick them; neither: those of a generated drive
  std::string port = "ground_map.around";
  std::vector<std::string> pick;   ///< "KIND=FROM..TO", s from the port's first message on
  std::filesystem::path out;       ///< one of each kind
  std::filesystem::path measured;  ///< those that were learnt from; empty: not written
  bool allow_damage = false;       ///< of the record
  int each = 20;                   ///< maps of each kind from the generated drive
  uint64_t seed = 1;
};

/// `takt terrain learn`: from measured maps of each kind of terrain the one that ground_map compares with.
/// 0 done, 2 bad input.
void add_terrain(CLI::App& app, TerrainOptions& options, int& exit_code);

}  // namespace takt::command
