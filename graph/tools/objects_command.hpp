// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>
#include <vector>

namespace takt::command {

struct ObjectsOptions {
  std::filesystem::path database;
  int size_px = 48;  ///< edge of the views: parameter `reference` of the node
  std::string name;
  std::vector<std::string> attributes;  ///< NAME=VALUE
  std::vector<std::filesystem::path> images, positives, negatives;
  bool test_view = false;
  std::string object;  ///< label of one entry; empty: all
  double miss = 0.05;
  uint64_t seed = 1;
  int scenes = 30;  ///< generated where no images are given
  std::string roc;
  bool write = false;
  std::filesystem::path maps;
  double min_score = 0.3;
};

/// `takt objects list | add | tune | test | publish`: the database of the node object_detection. 0 done, 2 bad input.
void add_objects(CLI::App& app, ObjectsOptions& options, int& exit_code);

}  // namespace takt::command
