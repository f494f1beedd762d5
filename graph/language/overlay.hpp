// SPDX-License-Identifier: Apache-2.0
// Values of parameters that outlast a run: `takt set --keep stereo.max_range 12m` writes one, the next run reads it.
//
//   takt: 1
//   graph: ace
//   values:
//     stereo.max_range: 12m
#pragma once
#include <filesystem>
#include <map>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "graph/language/document.hpp"

namespace takt::graph {

/// Where such files lie: $TAKT_STATE_DIR, else $STATE_DIRECTORY (of a systemd unit), else $XDG_STATE_HOME/takt, else
/// ~/.local/state/takt. Empty if none is known; then nothing is read.
std::filesystem::path state_folder();
/// The same from the values of these variables; null: not set.
std::filesystem::path state_folder(const char* takt_state, const char* state_directory, const char* state_home,
                                   const char* home);
/// That of one graph: overlays/NAME.yaml in the folder. Empty if the folder is.
std::filesystem::path overlay_file(const std::filesystem::path& state_folder, const std::string& graph);

/// What a file says, with the place of each word.
struct Overlay {
  struct Value {
    std::string node, param, text;  ///< the text as parse_param() takes it
    nlohmann::json value;           ///< as the YAML file means it
    Position key, position;
  };
  std::vector<Value> values;
};
/// Reads a file. What is wrong is appended to `problems`, each with its position and the way out; nothing if there is
/// no such file.
Overlay read_overlay(const std::filesystem::path& file, const std::string& graph, std::vector<Problem>& problems);

/// By "node.param", the text of a value.
using OverlayChanges = std::map<std::string, std::string>;
/// Puts values into a file (an empty text takes one out) and leaves the others. Written next to it and renamed, so that
/// a reader finds the old file or the new one. Comments are not kept. Error: what went wrong, with the file's name; the
/// file is then what it was.
tl::expected<void, std::string> change_overlay(const std::filesystem::path& file, const std::string& graph,
                                               const OverlayChanges& changes);

/// Takes a value out. An error also if the file holds none of that name.
tl::expected<void, std::string> forget_value(const std::filesystem::path& file, const std::string& graph,
                                             const std::string& name);

/// "; edit the file, or: takt set --forget node.param"
std::string overlay_remedy(const std::string& param);

}  // namespace takt::graph
