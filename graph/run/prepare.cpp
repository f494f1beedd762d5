// SPDX-License-Identifier: Apache-2.0
#include "graph/run/prepare.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>

#include "graph/run/record.hpp"
#include "rt/capability.hpp"

namespace takt::command {
namespace {

int refuse(Prepared& prepared, std::vector<graph::Problem> problems, Exit code) {
  tell(problems);
  prepared.problems = std::move(problems);
  return code;
}

tl::expected<std::unique_ptr<Node>, graph::ComposeError> remote_device(const Prepared& prepared,
                                                                       const graph::DeviceSpec& spec) {
  if (prepared.remote_source) {
    auto ports = graph::remote_ports(prepared.registry, *spec.remote);
    auto source = prepared.remote_source(spec, ports);
    return std::make_unique<RemoteNode>(std::move(ports), std::move(source));
  }
  graph::ComposeError error;
  error.problems.push_back({spec.position, fmt::format("{} comes from machine {}: a part of a graph runs in real time "
                                                       "and in several processes only",
                                                       spec.id, spec.remote->machine)});
  return tl::make_unexpected(std::move(error));
}

graph::DeviceFactory device_factory(Prepared& prepared, uint64_t seed) {
  return [&prepared, seed](const graph::DeviceSpec& spec) -> tl::expected<std::unique_ptr<Node>, graph::ComposeError> {
    if (spec.remote) return remote_device(prepared, spec);
    const hal::DeviceConfig config{spec.id, spec.kind,       spec.driver, spec.settings, prepared.graph->directory,
                                   seed,    prepared.plugged};
    auto node = hal::make_device(prepared.registry.devices, config, prepared.devices, *prepared.clock);
    if (node) return std::move(*node);
    graph::ComposeError error;
    error.problems.push_back({spec.position, node.error().text()});
    error.device_failed = !node.error().bad_input;
    return tl::make_unexpected(std::move(error));
  };
}

/// What a node of another machine can give, as the whole graph says where nothing is run.
class ComposedElsewhere final : public RemoteSource {
 public:
  ComposedElsewhere(const graph::DeviceSpec& device, const Plan& whole)
      : id_(device.id), law_(graph::remote_law(*device.remote)), whole_(whole) {}
  StampLaw stamp_law(const JobTimes&) const override { return law_; }
  Capacity capacity(std::string_view output) override {
    return std::find_if(whole_.ports.begin(), whole_.ports.end(),
                        [&](const PortPlan& port) { return port.node == id_ && port.port == output; })
        ->capacity;
  }
  Inbox& inbox(size_t) override { throw std::logic_error("nothing is run"); }
  ReadStatus status(int64_t) override { return ReadStatus::no_data; }

 private:
  const std::string id_;
  const StampLaw law_;
  const Plan& whole_;
};

}  // namespace

int load(const RunOptions& options, Prepared& prepared) {
  graph::Loaded loaded = graph::load(graph_file(options.graph), options.load, prepared.registry);
  if (!loaded.graph) return refuse(prepared, std::move(loaded.problems), kBadInput);
  prepared.graph = std::move(loaded.graph);
  if (options.alter) options.alter(*prepared.graph);
  tell_kept(*prepared.graph);
  if (options.clock == "virtual") prepared.clock = std::make_unique<VirtualClock>(1'000'000'000);
  else prepared.clock = std::make_unique<MonotonicClock>();
  return kOk;
}

int compose(const RunOptions& options, const graph::ComposeOptions& how, Prepared& prepared) {
  int code = kOk;
  without_rights([&] {  // what devices and libraries start here has none
    auto composition = graph::compose(*prepared.graph, prepared.registry, device_factory(prepared, options.seed),
                                      *prepared.clock, how);
    if (composition) {
      prepared.composition = std::move(*composition);
      for (const std::string& left : prepared.composition->left_out)
        if (!how.quiet) std::fprintf(stderr, "takt: %s\n", left.c_str());
    } else
      code = refuse(prepared, std::move(composition.error().problems),
                    composition.error().device_failed ? kDeviceOrSystem : kBadInput);
  });
  return code;
}

int prepare_check(const RunOptions& options, Prepared& prepared) {
  prepared.plugged = false;
  int code = load(options, prepared);
  std::optional<Prepared> whole;
  if (code == kOk && !prepared.graph->machine.empty()) {
    whole.emplace(prepared.registry);
    RunOptions of_all = options;
    of_all.load.machine.clear();
    code = prepare_check(of_all, *whole);
    prepared.remote_source = [&whole](const graph::DeviceSpec& device, const auto&) {
      return std::make_unique<ComposedElsewhere>(device, whole->composition->plan);
    };
    if (code != kOk) return code;
  }
  if (code == kOk) {
    // As a run would, so that what is checked is what runs.
    RunOptions as_run = options;
    as_run.keep_ring = keeps_ring(options, *prepared.graph);
    prepared.graph->record.recorded = as_run.keep_ring;
    graph::ComposeOptions how;
    how.output = options.output;
    how.seed = options.seed;
    how.observers = observers(as_run, *prepared.graph);
    code = compose(options, how, prepared);
  }
  if (code != kOk) tell_problems(prepared.problems.size());
  return code;
}

}  // namespace takt::command
