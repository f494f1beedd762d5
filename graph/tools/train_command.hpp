// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>
#include <vector>

namespace takt::command {

struct TrainCascadeOptions {
  std::vector<std::string> signs;  ///< empty: all
  std::filesystem::path out = ".";
  int stages = 16;
  int positives = 3000;
  int images = 300;  ///< to take negatives from
  uint64_t seed = 1;
};

struct SignPictureOptions {
  std::string sign;
  std::filesystem::path file;
  int size = 128;
  uint64_t seed = 1;
};

struct TrainOptions {
  TrainCascadeOptions cascade;
  SignPictureOptions picture;
};

/// `takt train picture`: a sign as cascades learn it, seen from the front, for a board of a simulated world.
/// `takt train cascade`: one cascade file a sign class, learnt from generated signs, with a picture and a table of
/// misses and false positives against stages (thesis Fig. 3.18). 0 done, 2 bad input.
void add_train(CLI::App& app, TrainOptions& options, int& exit_code);

}  // namespace takt::command
