// SPDX-License-Identifier: Apache-2.0
// Plug-ins of a program (graph/plugin.hpp): found, judged, tried in a child process, then loaded: in a child process,
// too, or in this one.
//
//   Plugins plugins(registry);
//   return plugins.carry_out(file, options.load, [&](const Registry& known) { return check_graph(known, options); });
#pragma once
#include <chrono>
#include <filesystem>
#include <functional>
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

/// Whether the command line or the graph file names any.
bool are_named(const std::filesystem::path& graph, const graph::LoadOptions& options);

/// The plug-in folder of the installation: lib/takt/plugins beside the bin/ of this program.
std::filesystem::path folder();

/// The ABI that a plug-in was built with; none of its code runs. The error says why `file` is no plug-in.
tl::expected<std::string, std::string> abi_of(const std::filesystem::path& file);

/// A plug-in that has passed its trial.
struct Plugin {
  std::filesystem::path file;
  graph::Position position;  ///< that named it
  graph::PluginFact fact;
  std::string description;  ///< graph/plugins/description.hpp
};

/// Whether `file` can be loaded after those `before` it: its ABI is read, then a child process loads it. A plug-in that
/// crashes there, ends the process, throws, takes longer than `patience`, or leaves threads behind is an error. This
/// process, which has one thread, never runs it. What it adds, as data. `registry` is that of the program, and stays as
/// it is.
tl::expected<std::string, std::string> judge(const std::filesystem::path& file, const std::vector<Plugin>& before,
                                             Registry& registry, std::chrono::milliseconds patience = kPatience);

/// The plug-ins of this program. One thread.
class Plugins {
 public:
  explicit Plugins(Registry& registry) : registry_(registry) {}
  /// Carries out a command with the plug-ins of `options.plugin_files` (looked for from the working folder), then those
  /// that the graph file names (beside it), unless there is one of that file name already; each else from folder(). An
  /// empty graph names none. Fills `options.plugins`. Where there are any, the command happens in a child process, and
  /// nothing of them is ever loaded here. The exit code; what is wrong stands on stderr then.
  int carry_out(const std::filesystem::path& graph, graph::LoadOptions& options,
                const std::function<int(const Registry&)>& command);
  /// Carries out a command that makes processes for jobs. It is given a registry with descriptions of the plug-ins;
  /// each process that runs jobs loads them by of_jobs().
  int supervise(const std::filesystem::path& graph, graph::LoadOptions& options,
                const std::function<int(const Registry&)>& command);
  const Registry& registry() const { return registry_; }

 private:
  tl::expected<void, std::string> add(const std::filesystem::path& file, const std::filesystem::path& beside,
                                      const graph::Position& position);
  int find_all(const std::filesystem::path& graph, graph::LoadOptions& options);
  std::vector<graph::Problem> load_here();

  Registry& registry_;
  std::vector<Plugin> found_;
};

}  // namespace takt::plugin
