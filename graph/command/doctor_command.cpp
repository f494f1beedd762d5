// SPDX-License-Identifier: Apache-2.0
#include "graph/command/doctor_command.hpp"

#include <cstdio>

#include "graph/check/doctor_text.hpp"
#include "graph/check/figures_file.hpp"
#include "graph/cli/outcome.hpp"
#include "rt/machine/checks.hpp"
#include "rt/machine/measure.hpp"

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

int run_doctor(const DoctorOptions& options) {
  const std::filesystem::path file = graph::figures_file();
  if (options.measure && file.empty())
    return refuse("--measure: no place for the figures; set TAKT_MACHINE to a file, or HOME", kBadInput);
  // Before half a minute of measuring.
  if (const std::string why = options.measure ? graph::cannot_write(file) : ""; !why.empty())
    return refuse(file.string() + ": " + why + "; set TAKT_MACHINE to a file that can be written", kDeviceOrSystem);
  const machine::SystemFacts facts;
  const auto identity = machine::Identity::of(facts);
  const auto findings = machine::examine(facts, machine::try_machine());
  auto json = graph::doctor_json(identity, findings);
  if (!options.json) std::fputs(graph::doctor_text(identity, findings).c_str(), stdout);
  std::string refused;
  if (options.measure) {
    std::fflush(stdout);
    const auto measured = machine::measure_all(
        [](const std::string& what) { std::fprintf(stderr, "takt doctor: measuring %s\n", what.c_str()); });
    const auto figures = graph::measured_json(identity, graph::utc_now(), measured);
    json["measured"] = figures;
    refused = graph::write_whole(file, figures.dump(2) + "\n");
    if (!options.json) std::printf("\n%s", graph::measured_text(measured).c_str());
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
  doctor->add_flag("--json", o.json, "prints the result as JSON");
  doctor->add_flag("--require-rt", o.require_rt, "exit 1 where SCHED_DEADLINE or locked memory is refused");
  doctor->footer("Example: takt doctor --measure");
  doctor->callback([&] { exit_code = run_doctor(o); });
}

}  // namespace takt::command
