// SPDX-License-Identifier: Apache-2.0
// Plug-ins of a program (graph/plugin.hpp): found, judged, tried in a child process, then loaded.
//
//   Plugins plugins(registry);
//   if (const int code = plugins.load(file, options.load); code != command::kOk) return code;
//   return run_graph(registry, options);
#pragma once
#include <chrono>
#include <filesystem>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "graph/language/graph.hpp"
#include "graph/language/registry.hpp"

namespace takt::plugin {

/// How long a plug-in may take to register what it has.
inline constexpr std::chrono::milliseconds kPatience{10'000};

/// Where `file` is: as it stands if it is absolute, else in the first of the folders that has it. The error names
/// `file` and the folders.
tl::expected<std::filesystem::path, std::string> find(const std::filesystem::path& file,
                                                      const std::vector<std::filesystem::path>& folders);

/// The plug-in folder of the installation: lib/takt/plugins beside the bin/ of this program.
std::filesystem::path folder();

/// The ABI that a plug-in was built with; none of its code runs. The error says why `file` is no plug-in.
tl::expected<std::string, std::string> abi_of(const std::filesystem::path& file);

/// Loads `file` into this process for the rest of its life, and lets it add to `registry`. A child process does so
/// first: a plug-in that crashes, ends the process, throws, takes longer than `patience`, or leaves threads behind is
/// an error, and this process never runs it. The calling thread must be the only one that uses `registry`.
tl::expected<void, std::string> load(const std::filesystem::path& file, Registry& registry,
                                     std::chrono::milliseconds patience = kPatience);

/// The plug-ins of this program; what they register lands in `registry`. One thread.
class Plugins {
 public:
  explicit Plugins(Registry& registry) : registry_(registry) {}
  /// Loads those of `options.plugin_files` (looked for from the working folder), then those that the graph file names
  /// (beside it), unless one of that file name is loaded already; each else from folder(). An empty graph names none.
  /// Fills `options.plugins`. The exit code; what is wrong stands on stderr then.
  int load(const std::filesystem::path& graph, graph::LoadOptions& options);
  const Registry& registry() const { return registry_; }

 private:
  tl::expected<void, std::string> add(const std::filesystem::path& file, const std::filesystem::path& beside);

  Registry& registry_;
  std::vector<graph::PluginFact> loaded_;
};

}  // namespace takt::plugin
