// SPDX-License-Identifier: Apache-2.0
#include "graph/command/service_commands.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "graph/cli/outcome.hpp"
#include "graph/flight/remote_shell.hpp"

namespace takt::command {
namespace {

constexpr std::string_view kPrefix = "takt@", kSuffix = ".service";

bool sound(std::string_view name) {
  return std::all_of(name.begin(), name.end(),
                     [](unsigned char c) { return std::isalnum(c) || c == '_' || c == '-' || c == '.'; });
}

int wrong_name(const std::string& name) {
  return refuse(
      fmt::format("`{}` is no name of a service; those of takt@NAME are letters, digits, `_`, `-` and `.`", name),
      kBadInput);
}

std::string pattern(const ServiceOptions& options) {
  return fmt::format("{}{}{}", kPrefix, options.name.empty() ? "*" : options.name, kSuffix);
}

int print_status(const ServiceOptions& options) {
  if (!sound(options.name)) return wrong_name(options.name);
  auto shell = flight::RemoteShell::here();
  if (!shell) return refuse(shell.error(), kDeviceOrSystem);
  shell->say(
      fmt::format("systemctl show {} "
                  "--property=Id,LoadState,ActiveState,SubState,StatusText,ActiveEnterTimestamp,Result,NRestarts; exit",
                  flight::shell_word(pattern(options))));
  std::string shown;
  while (const auto line = shell->line()) shown += *line + "\n";
  if (const int code = shell->end(); code != 0)
    return refuse(
        fmt::format("systemctl ended with {}: no systemd runs here; `takt top` shows what this user runs", code),
        kDeviceOrSystem);
  const std::vector<ServiceState> all = services(shown);
  if (all.empty())
    return refuse(
        fmt::format("there is no service {}\n  fix: sudo systemctl enable --now takt@NAME runs /etc/takt/NAME.yaml",
                    pattern(options)),
        kDeviceOrSystem);
  nlohmann::ordered_json json = nlohmann::ordered_json::array();
  for (const ServiceState& service : all) {
    if (!options.json) fmt::print("{}\n", service_text(service));
    json.push_back({{"name", service.name},
                    {"active", service.active},
                    {"sub", service.sub},
                    {"since", service.since},
                    {"result", service.result},
                    {"restarts", service.restarts},
                    {"status", service.status}});
  }
  if (options.json) fmt::print("{}\n", json.dump(2));
  return std::all_of(all.begin(), all.end(), [](const ServiceState& service) { return service.runs(); }) ? kOk : kNotOk;
}

int print_logs(const ServiceOptions& options) {
  if (!sound(options.name)) return wrong_name(options.name);
  std::string command =
      "exec journalctl --unit=" + flight::shell_word(pattern(options)) + " --output=short-iso --no-hostname";
  if (options.follow) command += " --follow";
  if (!options.since.empty()) command += " --since=" + flight::shell_word(options.since);
  auto shell = flight::RemoteShell::here();
  if (!shell) return refuse(shell.error(), kDeviceOrSystem);
  shell->say(command);
  while (const auto line = shell->line()) {
    fmt::print("{}\n", *line);
    // A reader that left, as `head` does, ends it; main tells what could not be written.
    if (std::fflush(stdout) != 0) return kDeviceOrSystem;
  }
  if (const int code = shell->end(); code != 0)
    return refuse(fmt::format("journalctl ended with {}", code), kDeviceOrSystem);
  return kOk;
}

}  // namespace

std::vector<ServiceState> services(std::string_view shown) {
  std::vector<ServiceState> all;
  ServiceState service;
  bool known = true;
  const auto take = [&] {
    if (!service.name.empty() && known) all.push_back(service);
    service = {}, known = true;
  };
  while (!shown.empty()) {
    const size_t end = std::min(shown.find('\n'), shown.size());
    const std::string_view line = shown.substr(0, end);
    shown.remove_prefix(std::min(end + 1, shown.size()));
    if (line.empty()) {
      take();
      continue;
    }
    const size_t equals = std::min(line.find('='), line.size());
    const std::string_view key = line.substr(0, equals), value = line.substr(std::min(equals + 1, line.size()));
    if (key == "Id" && value.starts_with(kPrefix) && value.ends_with(kSuffix))
      service.name = value.substr(kPrefix.size(), value.size() - kPrefix.size() - kSuffix.size());
    else if (key == "LoadState") known = value != "not-found";
    else if (key == "ActiveState") service.active = value;
    else if (key == "SubState") service.sub = value;
    else if (key == "StatusText") service.status = value;
    else if (key == "ActiveEnterTimestamp") service.since = value;
    else if (key == "Result") service.result = value;
    else if (key == "NRestarts") std::from_chars(value.data(), value.data() + value.size(), service.restarts);
  }
  take();
  return all;
}

std::string service_text(const ServiceState& service) {
  std::string text = fmt::format("{}: {} ({})", service.name, service.active,
                                 service.runs() || service.result == "success" ? service.sub : service.result);
  if (service.runs() && !service.since.empty()) text += " since " + service.since;
  if (service.restarts > 0)
    text += fmt::format(", restarted {} time{}", service.restarts, service.restarts == 1 ? "" : "s");
  if (!service.status.empty()) text += "; " + service.status;
  return text;
}

void add_service_commands(CLI::App& app, ServiceOptions& o, int& exit_code) {
  CLI::App* status = app.add_subcommand("status", "how the services takt@NAME of this machine do");
  status->add_option("name", o.name, "only this one");
  status->add_flag("--json", o.json, "prints the result as JSON");
  status->footer("Example: takt status ace\nExit 0: all run, 1: one does not, 3: no systemd, or no such service.");
  status->callback([&] { exit_code = print_status(o); });
  CLI::App* logs = app.add_subcommand("logs", "what the services takt@NAME of this machine said, from the journal");
  logs->add_option("name", o.name, "only this one");
  logs->add_flag("--follow", o.follow, "goes on as they say more");
  logs->add_option("--since", o.since, "an instant as journalctl takes it: today, -1h, 2026-11-30");
  logs->footer("Example: takt logs ace --since -1h");
  logs->callback([&] { exit_code = print_logs(o); });
}

}  // namespace takt::command
