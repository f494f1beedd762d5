// SPDX-License-Identifier: Apache-2.0
#include "graph/plugins/plugins.hpp"

#include <dlfcn.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <iterator>
#include <optional>

#include "graph/cli/graph_file.hpp"
#include "graph/cli/outcome.hpp"
#include "graph/log/recorded_plan.hpp"
#include "graph/plugin.hpp"
#include "graph/plugins/child.hpp"
#include "graph/plugins/description.hpp"
#include "rt/file/input_file.hpp"
#include "rt/machine/limits.hpp"

namespace takt::plugin {
namespace {

using Result = tl::expected<void, std::string>;
using Clock = std::chrono::steady_clock;
constexpr char kNot = '!';

size_t threads() {
  size_t count = 0;
  for ([[maybe_unused]] const auto& task : std::filesystem::directory_iterator("/proc/self/task")) ++count;
  return count;
}

/// Where it is asked for, what the plug-in adds: a node of each new type is made, since constructors declare ports, and
/// may fail, too.
Result load_here(const std::filesystem::path& file, Registry& registry, std::string* description = nullptr) {
  const size_t threads_before = threads();
  void* const library = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) {
    const char* why = dlerror();
    return tl::make_unexpected(fmt::format("cannot be loaded: {}", why != nullptr ? why : "the linker says no more"));
  }
  const auto add = reinterpret_cast<void (*)(Registry&)>(dlsym(library, "takt_plugin_register"));
  if (add == nullptr) return tl::make_unexpected("has no function takt_plugin_register: TAKT_PLUGIN is missing");
  try {
    const std::optional<Registry> before = description ? std::optional(registry) : std::nullopt;
    add(registry);
    if (description) *description = describe(*before, registry);
  } catch (const std::exception& error) {
    return tl::make_unexpected(fmt::format("registers nothing: {}", error.what()));
  } catch (...) {
    return tl::make_unexpected("registers nothing: it throws what is no std::exception");
  }
  if (const size_t now = threads(); now > threads_before)
    return tl::make_unexpected(
        fmt::format("leaves {} thread{} behind, and processes must still be forked; a node makes "
                    "its threads in start()",
                    now - threads_before, now - threads_before == 1 ? "" : "s"));
  return {};
}

/// Ends the process: the answer in the pipe is the description, or kNot and the error, then a zero. Those `before` it
/// have passed their trial.
[[noreturn]] void try_in_child(const std::filesystem::path& file, const std::vector<Plugin>& before, Registry& registry,
                               int answer) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  const rlimit no_core{0, 0};
  setrlimit(RLIMIT_CORE, &no_core);
  dup2(STDERR_FILENO, STDOUT_FILENO);  // what it prints is no part of this command's output
  Result result;
  std::string text;
  for (size_t i = 0; i < before.size() && result; ++i) result = load_here(before[i].file, registry);
  if (result) result = load_here(file, registry, &text);
  if (!result) text = kNot + result.error();
  for (size_t done = 0; done <= text.size();) {
    const ssize_t more = write(answer, text.c_str() + done, text.size() + 1 - done);
    if (more < 0 && errno != EINTR) _exit(1);
    done += more > 0 ? static_cast<size_t>(more) : 0;
  }
  _exit(0);
}

/// What the child says, without its zero; nothing if it never ends its answer. `late` if it had no time left.
std::optional<std::string> answer_of(int pipe, std::chrono::milliseconds patience, bool& late) {
  std::string text;
  const auto until = Clock::now() + patience;
  while (true) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(until - Clock::now()).count();
    pollfd ready{pipe, POLLIN, 0};
    const int polled = poll(&ready, 1, left > 0 ? static_cast<int>(left) : 0);
    if (polled < 0 && errno == EINTR) continue;
    late = polled == 0;
    if (polled <= 0) return std::nullopt;
    char bytes[4096];
    const ssize_t got = read(pipe, bytes, sizeof bytes);
    if (got <= 0) return std::nullopt;
    text.append(bytes, static_cast<size_t>(got));
    if (text.back() == '\0') return text.substr(0, text.size() - 1);
  }
}

std::string ending(int status) {
  if (WIFSIGNALED(status))
    return fmt::format("crashes while it is loaded: signal {} ({})", WTERMSIG(status), strsignal(WTERMSIG(status)));
  return fmt::format("ends the process while it is loaded (exit {})", WEXITSTATUS(status));
}

/// The description.
tl::expected<std::string, std::string> try_out(const std::filesystem::path& file, const std::vector<Plugin>& before,
                                               Registry& registry, std::chrono::milliseconds patience) {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) return tl::make_unexpected(machine::explain("no pipe", errno));
  std::fflush(nullptr);
  const Orphans orphans;
  const pid_t child = fork();
  if (child == 0) try_in_child(file, before, registry, ends[1]);
  const int fork_error = errno;
  close(ends[1]);
  bool late = false;
  const auto answer = child > 0 ? answer_of(ends[0], patience, late) : std::nullopt;
  close(ends[0]);
  if (child < 0) return tl::make_unexpected(machine::explain("no process to try it in", fork_error));
  if (late) kill(child, SIGKILL);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (late)
    return tl::make_unexpected(
        fmt::format("is still not loaded after {} s: an endless loop in an initialiser or in its function?",
                    std::chrono::duration<double>(patience).count()));
  if (!answer) return tl::make_unexpected(ending(status));
  if (answer->starts_with(kNot)) return tl::make_unexpected(answer->substr(1));
  return *answer;
}

/// On stderr; the exit code.
int tell(const std::vector<graph::Problem>& problems) {
  if (problems.empty()) return command::kOk;
  command::tell(problems);
  command::tell_problems(problems.size());
  return command::kBadInput;
}

}  // namespace

tl::expected<std::filesystem::path, std::string> find(const std::filesystem::path& file,
                                                      const std::vector<std::filesystem::path>& folders) {
  std::string looked;
  for (const auto& folder : folders) {
    const auto candidate = folder / file;  // an absolute file stays what it is
    std::error_code ignored;
    if (std::filesystem::is_regular_file(candidate, ignored)) return std::filesystem::absolute(candidate);
    if (file.is_absolute()) break;
    looked += fmt::format("{}{}", looked.empty() ? "; looked in " : ", ", folder.empty() ? "." : folder.string());
  }
  return tl::make_unexpected(fmt::format("plug-in {}: no such file{}", file.string(), looked));
}

bool are_named(const std::filesystem::path& graph, const graph::LoadOptions& options) {
  return !options.plugin_files.empty() || !graph::plugins_of(graph).empty();
}

std::filesystem::path folder() {
  std::error_code unreadable;
  return std::filesystem::read_symlink("/proc/self/exe", unreadable).parent_path().parent_path() / "lib/takt/plugins";
}

tl::expected<std::string, std::string> abi_of(const std::filesystem::path& file) {
  if (const std::string why = why_unreadable(file, kLargestText); !why.empty()) return tl::make_unexpected(why);
  std::ifstream stream(file, std::ios::binary);
  const std::string content{std::istreambuf_iterator<char>(stream), {}};
  const std::string begin = fmt::format("{}{}", kMark, "declarations=");
  const size_t at = content.find(begin);
  if (at == std::string::npos) return tl::make_unexpected("is no plug-in of Takt: TAKT_PLUGIN is missing");
  return std::string(content.c_str() + at + kMark.size());
}

tl::expected<std::string, std::string> judge(const std::filesystem::path& file, const std::vector<Plugin>& before,
                                             Registry& registry, std::chrono::milliseconds patience) {
  const auto named = [&](const std::string& why) {
    return tl::make_unexpected(fmt::format("plug-in {}: {}", file.string(), why));
  };
  const auto abi = abi_of(file);
  if (!abi) return named(abi.error());
  if (*abi != kAbi)
    return named(
        fmt::format("was built for another Takt: {}; build it again with this one", abi_difference(*abi, kAbi)));
  auto tried = try_out(file, before, registry, patience);
  if (!tried) return named(tried.error());
  return tried;
}

tl::expected<void, std::string> Plugins::add(const std::filesystem::path& file, const std::filesystem::path& beside,
                                             const graph::Position& position) {
  const std::string name = file.filename();
  if (std::any_of(found_.begin(), found_.end(), [&](const auto& plugin) { return plugin.fact.name == name; }))
    return {};
  const auto found = find(file, {beside, folder()});
  if (!found) return tl::make_unexpected(found.error());
  const auto description = judge(*found, found_, registry_);
  if (!description) return tl::make_unexpected(description.error());
  found_.push_back({*found, position, {name, log::file_hash(*found)}, *description});
  return {};
}

int Plugins::find_all(const std::filesystem::path& graph, graph::LoadOptions& options) {
  std::vector<graph::Problem> problems;
  const auto take = [&](const std::filesystem::path& file, const std::filesystem::path& beside,
                        const graph::Position& position) {
    if (const auto added = add(file, beside, position); !added) problems.push_back({position, added.error()});
  };
  for (const auto& file : options.plugin_files) take(file, "", {"--plugin", 0, 0});
  if (!graph.empty())
    for (const graph::PluginName& named : graph::plugins_of(graph)) take(named.file, named.directory, named.position);
  options.plugins.clear();
  for (const Plugin& plugin : found_) options.plugins.push_back(plugin.fact);
  return tell(problems);
}

std::vector<graph::Problem> Plugins::load_here() {
  std::vector<graph::Problem> problems;
  for (const Plugin& plugin : found_)
    if (const Result loaded = plugin::load_here(plugin.file, registry_); !loaded)
      problems.push_back({plugin.position, fmt::format("plug-in {}: {}", plugin.file.string(), loaded.error())});
  return problems;
}

int Plugins::supervise(const std::filesystem::path& graph, graph::LoadOptions& options,
                       const std::function<int(const Registry&)>& command) {
  if (const int code = find_all(graph, options); code != command::kOk) return code;
  if (found_.empty()) return command(registry_);
  Registry described = registry_;
  Descriptions descriptions(described);
  for (const Plugin& plugin : found_) descriptions.add(plugin.description);
  described.load_for_jobs = [this]() -> const Registry& {
    const auto problems = load_here();
    if (!problems.empty()) throw std::runtime_error(problems.front().text);
    return registry_;
  };
  return command(described);
}

int Plugins::carry_out(const std::filesystem::path& graph, graph::LoadOptions& options,
                       const std::function<int(const Registry&)>& command) {
  if (const int code = find_all(graph, options); code != command::kOk) return code;
  if (found_.empty()) return command(registry_);
  std::vector<std::string> names;
  for (const Plugin& plugin : found_) names.push_back(plugin.fact.name);
  return in_child(registry_, names, [&] {
    const int code = tell(load_here());
    return code == command::kOk ? command(registry_) : code;
  });
}

}  // namespace takt::plugin
