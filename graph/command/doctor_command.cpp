// SPDX-License-Identifier: Apache-2.0
#include "graph/command/doctor_command.hpp"

#include <fmt/format.h>

#include <cstdio>
#include <fstream>
#include <optional>
#include <stdexcept>

#include "graph/check/doctor_text.hpp"
#include "graph/check/figures_file.hpp"
#include "graph/check/network.hpp"
#include "graph/cli/outcome.hpp"
#include "graph/machines/way.hpp"
#include "hal/dds/socket_buffer.hpp"
#include "nodes/cuda/card_check.hpp"
#include "rt/machine/checks.hpp"
#include "rt/machine/measure.hpp"
#include "rt/machine/parse.hpp"

namespace takt::command {
namespace {

/// Names of what a run under a real-time policy asks for and is refused here, with commas.
std::string real_time_lacks(const std::vector<machine::Finding>& findings) {
  using machine::Need;
  std::string names;
  for (const machine::Finding& f : findings)
    if (f.status == machine::Status::lacks && (f.need == Need::every_run || f.need == Need::deadline))
      names += (names.empty() ? "" : ", ") + f.name;
  return names;
}

/// What was measured of the ways to other machines, which a new measurement of this one says nothing about.
nlohmann::ordered_json kept_peers(const std::filesystem::path& file) {
  std::ifstream in(file);
  const auto json = nlohmann::ordered_json::parse(in, nullptr, false);
  return json.is_object() ? json.value("peers", nlohmann::ordered_json::object()) : nlohmann::ordered_json::object();
}

/// Receive buffers as `link` of a run asks for them.
std::string buffers_text() {
  const machine::SystemFacts facts;
  const auto of = [&](const char* name) {
    return machine::trimmed(facts.text(std::string("/proc/sys/net/core/") + name).value_or("not known"));
  };
  const std::string cure = graph::small_buffers(dds::kSocketBuffer / graph::kBufferedMessages, facts);
  return fmt::format("  receive buffers: {} bytes at most (net.core.rmem_max), {} without asking (rmem_default)\n{}",
                     of("rmem_max"), of("rmem_default"), cure.empty() ? "" : fmt::format("  fix, shell: {}\n", cure));
}

std::string way_text(const machines::Way& way, const std::string& peer) {
  const auto speed = [](const std::optional<double>& mbit_s) {
    return mbit_s ? fmt::format("{:.0f} Mbit/s", *mbit_s) : std::string("not known, too much was lost");
  };
  return fmt::format(
      "\n{}: there and back {:.2f} ms (p50), {:.2f} (p99), {:.2f} at most, {} of {} lost\n"
      "  its clock is {:.3f} ms ahead of this one, to {:.3f} ms\n"
      "  sends {}, receives {}; packets of up to {} bytes\n{}  for the graph:\n{}\n{}",
      peer, way.there_and_back.p50_us / 1e3, way.there_and_back.p99_us / 1e3, way.there_and_back.max_us / 1e3, way.lost,
      way.lost + way.there_and_back.samples, static_cast<double>(way.clock.offset_ns) / 1e6,
      static_cast<double>(way.clock.error_ns) / 1e6, speed(way.sends_mbit_s), speed(way.receives_mbit_s), way.mtu,
      buffers_text(), machines::network_line(way),
      graph::is_private(peer) ? ""
                              : fmt::format("  warning: {} is no address of a private network: make keys with `takt "
                                            "keys`, and run with --keys\n",
                                            peer));
}

nlohmann::ordered_json way_json(const machines::Way& way) {
  const auto number = [](const std::optional<double>& value) {
    return value ? nlohmann::ordered_json(*value) : nlohmann::ordered_json(nullptr);
  };
  return {{"measured_at", graph::utc_now()},
          {"there_and_back_us",
           {{"p50", way.there_and_back.p50_us},
            {"p99", way.there_and_back.p99_us},
            {"max", way.there_and_back.max_us},
            {"samples", way.there_and_back.samples}}},
          {"lost", way.lost},
          {"clock_offset_ms", static_cast<double>(way.clock.offset_ns) / 1e6},
          {"clock_error_ms", static_cast<double>(way.clock.error_ns) / 1e6},
          {"sends_mbit_s", number(way.sends_mbit_s)},
          {"receives_mbit_s", number(way.receives_mbit_s)},
          {"mtu", way.mtu},
          {"network", machines::network_line(way)}};
}

int run_doctor(const DoctorOptions& options) {
  const std::filesystem::path file = graph::figures_file();
  if (options.measure && file.empty())
    return refuse("--measure: no place for the figures; set TAKT_MACHINE to a file, or HOME", kBadInput);
  // Before half a minute of measuring.
  if (const std::string why = options.measure ? graph::cannot_write(file) : ""; !why.empty())
    return refuse(file.string() + ": " + why + "; set TAKT_MACHINE to a file that can be written", kDeviceOrSystem);
  if (!options.peer.empty() && !options.measure)
    return refuse("--peer: the way to another machine is measured; add --measure, here and there", kBadInput);
  std::optional<machines::Way> way;
  if (!options.peer.empty()) try {
      std::fprintf(stderr, "takt doctor: measuring the way to %s, once it measures as well\n", options.peer.c_str());
      way = machines::measure_way({options.peer, options.port});
    } catch (const std::runtime_error& problem) {
      return refuse(std::string("--peer: ") + problem.what(), kDeviceOrSystem);
    }
  const machine::SystemFacts facts;
  const auto identity = machine::Identity::of(facts);
  auto findings = machine::examine(facts, machine::try_machine());
  findings.push_back(cuda::check_card());
  auto json = graph::doctor_json(identity, findings);
  if (!options.json) std::fputs(graph::doctor_text(identity, findings).c_str(), stdout);
  std::string refused;
  if (options.measure) {
    std::fflush(stdout);
    const auto measured = machine::measure_all(
        [](const std::string& what) { std::fprintf(stderr, "takt doctor: measuring %s\n", what.c_str()); });
    auto figures = graph::measured_json(identity, graph::utc_now(), measured);
    figures["peers"] = kept_peers(file);
    if (way) figures["peers"][options.peer] = way_json(*way);
    json["measured"] = figures;
    refused = graph::write_whole(file, figures.dump(2) + "\n");
    if (!options.json) std::printf("\n%s", graph::measured_text(measured).c_str());
    if (!options.json && way) std::fputs(way_text(*way, options.peer).c_str(), stdout);
    if (!options.json && refused.empty()) std::printf("  written to %s for `takt check`\n", file.c_str());
  }
  if (options.json) std::printf("%s\n", json.dump(2).c_str());
  if (!refused.empty())
    return refuse(file.string() + ": " + refused + "; set TAKT_MACHINE to a file that can be written", kDeviceOrSystem);
  const std::string lacks = real_time_lacks(findings);
  return options.require_rt && !lacks.empty() ? refuse("--require-rt: this machine lacks " + lacks, kNotOk) : kOk;
}

}  // namespace

void add_doctor(CLI::App& app, DoctorOptions& o, int& exit_code) {
  CLI::App* doctor = app.add_subcommand("doctor", "tries what Takt asks of this machine, and says what to change");
  doctor->add_flag("--measure", o.measure, "measures what the checks of a schedule charge (about 20 s)");
  doctor->add_option("--peer", o.peer,
                     "address of another machine that runs `takt doctor --measure --peer` with this one's: latency, "
                     "clocks and bandwidth between them");
  doctor->add_option("--port", o.port, "UDP port for that, the same on both (default 7390)");
  doctor->add_flag("--json", o.json, "prints the result as JSON");
  doctor->add_flag("--require-rt", o.require_rt, "exit 1 where SCHED_DEADLINE or locked memory is refused");
  doctor->footer("Example: takt doctor --measure");
  doctor->callback([&] { exit_code = run_doctor(o); });
}

}  // namespace takt::command
