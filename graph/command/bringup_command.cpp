// SPDX-License-Identifier: Apache-2.0
#include "graph/command/bringup_command.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <iostream>

#include "graph/bringup/trials.hpp"
#include "graph/cli/file_option.hpp"
#include "graph/cli/graph_file.hpp"
#include "graph/cli/set_option.hpp"
#include "graph/command/graph_commands.hpp"
#include "graph/language/overlay.hpp"
#include "graph/language/words.hpp"
#include "graph/run/outputs.hpp"
#include "graph/run/prepare.hpp"
#include "graph/run/support.hpp"

namespace takt::command {
namespace {

using bringup::BroughtUp;
using bringup::Trial;

/// At the terminal, or whatever stdin is.
class Terminal final : public bringup::Person {
 public:
  void hears(const std::string& text) override { fmt::print("  {}\n", text), std::fflush(stdout); }
  std::optional<bool> agrees(const std::string& question) override {
    fmt::print("  {} [y/n] ", question);
    std::fflush(stdout);
    for (std::string line; std::getline(std::cin, line);) {
      if (line == "y" || line == "yes") return true;
      if (line == "n" || line == "no") return false;
      fmt::print("  y or n? "), std::fflush(stdout);
    }
    fmt::print("\n");
    return std::nullopt;
  }
};

std::filesystem::path file_of(const std::filesystem::path& asked, const std::string& graph) {
  return asked.empty() ? bringup::brought_up_file(graph::state_folder(), graph) : asked;
}

class BringingUp {
 public:
  BringingUp(const Registry& registry, const BringupOptions& options, const graph::GraphSpec& graph)
      : registry_(registry),
        options_(options),
        graph_(graph),
        devices_(bringup::real_devices(graph, registry, options.doubles)),
        base_(bringup::base_of(devices_)),
        file_(file_of(options.file, graph.name)) {}

  int run() {
    if (devices_.empty())
      return refuse(
          fmt::format("profile {} of {} has no real device: there is nothing to bring up; say which with --profile",
                      graph::ticked(graph_.profile), graph_.name),
          kBadInput);
    if (file_.empty()) return refuse("no place for what is found; name it: --file FILE", kBadInput);
    auto known = BroughtUp::read(file_);
    if (!known) return refuse(known.error(), kBadInput);
    known_ = std::move(*known);
    if (options_.list) return tell();
    if (const int code = try_devices(); code != kOk) return code;
    if (base_ != nullptr && all_pass() && (options_.devices.empty() || options_.again) &&
        !passes(known_.stop_chain, stop_of())) {
      fmt::print("the stop of {}\n", base_->id);
      if (const int code = keep(known_.stop_chain, bringup::try_stop(registry_, trial(), graph_, base_->id, person_));
          code != kOk)
        return code;
    }
    return tell();
  }

 private:
  static bool passes(const Trial& trial, const std::string& of) { return trial.passed && trial.of == of; }
  std::string stop_of() const { return bringup::stop_fingerprint(graph_, base_->id); }
  bool all_pass() const {
    return std::all_of(devices_.begin(), devices_.end(), [&](const graph::DeviceSpec* device) {
      const auto trial = known_.devices.find(device->id);
      return trial != known_.devices.end() && passes(trial->second, bringup::fingerprint(*device));
    });
  }
  bringup::TrialOptions trial() const {
    bringup::TrialOptions how;
    how.run = options_.run;
    how.patience_s = options_.patience_s;
    return how;
  }

  int try_devices() {
    std::vector<std::string> names;
    for (const graph::DeviceSpec* device : devices_) names.push_back(device->id);
    for (const std::string& id : options_.devices)
      if (std::find(names.begin(), names.end(), id) == names.end())
        return refuse(fmt::format("--device {}: there is no such real device{}", graph::ticked(id),
                                  graph::alternatives(id, names, "real devices of the profile")),
                      kBadInput);
    const auto& only = options_.devices;
    for (const graph::DeviceSpec* device : devices_) {
      const bool asked = std::find(only.begin(), only.end(), device->id) != only.end();
      const Trial& before = known_.devices[device->id];
      if (only.empty() ? !options_.again && passes(before, bringup::fingerprint(*device)) : !asked) continue;
      fmt::print("{} ({}, {})\n", device->id, device->kind, device->driver);
      if (const int code = keep(known_.devices[device->id], bringup::try_device(registry_, trial(), *device, person_));
          code != kOk)
        return code;
    }
    return kOk;
  }

  /// After each trial, so that an end in between loses nothing.
  int keep(Trial& place, Trial found) {
    place = std::move(found);
    fmt::print("  {}: {}\n", place.passed ? "passed" : "NOT PASSED", place.said);
    if (const auto written = known_.write(file_, graph_.name); !written)
      return refuse(written.error(), kDeviceOrSystem);
    return kOk;
  }

  void tell_one(const std::string& what, const Trial& trial, const std::string& of) const {
    const char* word = trial.of.empty() ? "not tried"
                       : !trial.passed  ? "NOT PASSED"
                       : trial.of != of ? "other settings now"
                                        : "passed";
    fmt::print("{:20} {:20} {:21} {}\n", what, word, trial.at, trial.said);
  }

  int tell() const {
    for (const graph::DeviceSpec* device : devices_) {
      const auto trial = known_.devices.find(device->id);
      tell_one(device->id, trial == known_.devices.end() ? Trial{} : trial->second, bringup::fingerprint(*device));
    }
    if (base_ != nullptr) tell_one("stop of " + base_->id, known_.stop_chain, stop_of());
    const bool well = all_pass() && (base_ == nullptr || passes(known_.stop_chain, stop_of()));
    fmt::print("{}: {}\n", file_.string(), well ? "all of it was tried and is well" : "not yet all");
    return well ? kOk : kNotOk;
  }

  const Registry& registry_;
  const BringupOptions& options_;
  const graph::GraphSpec& graph_;
  const std::vector<const graph::DeviceSpec*> devices_;
  const graph::DeviceSpec* base_;
  const std::filesystem::path file_;
  BroughtUp known_;
  Terminal person_;
};

}  // namespace

int bring_up(const Registry& registry, const BringupOptions& options) {
  std::vector<WriterLock> locks;
  if (const int code = options.list ? int{kOk} : claim_folder(options.run.output, locks); code != kOk) return code;
  Prepared prepared(registry);
  prepared.plugged = false;
  if (const int code = load(options.run, prepared); code != kOk) return tell_problems(prepared.problems.size()), code;
  return BringingUp(registry, options, *prepared.graph).run();
}

int may_drive(const Registry& registry, const RunOptions& options) {
  const graph::Loaded loaded = graph::load(graph_file(options.graph), options.load, registry);
  if (!loaded.graph) return kOk;  // the run says what is wrong
  const std::filesystem::path file = file_of({}, loaded.graph->name);
  const auto known = BroughtUp::read(file);
  if (!known) return refuse(known.error(), kBadInput);
  std::string text;
  for (const std::string& lack : bringup::lacks(*loaded.graph, registry, *known)) text += "\n  " + lack;
  if (text.empty()) return kOk;
  return refuse(fmt::format("--brought-up: {} may not drive yet:{}\n  fix: takt bringup {} --profile {} --file {}",
                            loaded.graph->name, text, loaded.graph->file, loaded.graph->profile, file.string()),
                kBadInput);
}

void add_bringup(CLI::App& app, plugin::Plugins& plugins, BringupOptions& o, int& exit_code) {
  CLI::App* command =
      app.add_subcommand("bringup", "tries the devices of a robot one by one, then its stop, with a person beside it");
  add_load_options(*command, o.run.graph, o.run.load);
  CLI::Option* devices = command->add_option("--device", o.devices, "only this one, also if it passed; repeatable");
  command->add_flag("--again", o.again, "all, also what passed")->excludes(devices);
  command->add_flag("--list", o.list, "what was tried, and what was not; tries nothing");
  command->add_flag("--doubles", o.doubles, "devices with the driver `double` count as real: a rehearsal");
  command->add_option("--patience", o.patience_s, "how long it waits for what a person is to do, e.g. 60s")
      ->transform(CLI::Validator(duration, "DURATION"));
  writes_file(command->add_option("--file", o.file, "what is known (default: bringup/GRAPH.json of the state folder)"));
  writes_folder(command->add_option("--output", o.run.output, "folder for logs and pictures (default out)"));
  command->footer(
      "Example: takt bringup /etc/takt/ace.yaml --profile robot\n"
      "Each device runs alone: first those that move nothing, then the base with its wheels lifted, at 0.1 m/s. At "
      "last the base\n"
      "drives on the ground, and must stop for who steps in its way. `takt run --brought-up` drives only after that.");
  command->callback([&] {
    exit_code = plugins.carry_out(graph_file(o.run.graph), o.run.load,
                                  [&](const Registry& known) { return bring_up(known, o); });
  });
}

}  // namespace takt::command
