// SPDX-License-Identifier: Apache-2.0
#include "graph/command/log_pull.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <string>

#include "graph/cli/file_option.hpp"
#include "graph/cli/outcome.hpp"
#include "graph/command/stop_asked.hpp"
#include "graph/language/quantity.hpp"
#include "hal/settings/json.hpp"

namespace takt::command {
namespace {

using flight::PulledFile;
using Json = nlohmann::ordered_json;

double in_mb(uint64_t bytes) { return static_cast<double>(bytes) / 1e6; }

std::string what_happened(const PulledFile& file) {
  switch (file.state) {
    case PulledFile::there: return "on the robot";
    case PulledFile::here: return "already here";
    case PulledFile::open: return "left out: the run writes it, or was killed meanwhile (takt log rescue)";
    case PulledFile::gone: return "gone: the run has removed it meanwhile, or it may not be read";
    case PulledFile::other: return "left out: here is another file of that name";
    case PulledFile::fetched: break;
  }
  if (file.again) return "fetched again, as its .part was damaged";
  return file.resumed_at > 0 ? fmt::format("fetched from {:.1f} MB on", in_mb(file.resumed_at)) : "fetched";
}

void print_file(const PulledFile& file) {
  std::printf("%s\n", fmt::format("{:<44} {:>8.1f} MB  {}", file.name, in_mb(file.bytes), what_happened(file)).c_str());
  std::fflush(stdout);
}

Json pulled_json(const flight::Pulled& pulled) {
  Json files = Json::array();
  for (const PulledFile& file : pulled.files)
    files.push_back({{"name", file.name},
                     {"from", file.of_ring ? "ring" : "frozen"},
                     {"bytes", file.bytes},
                     {"state", flight::word(file.state)},
                     {"resumed_at", file.resumed_at},
                     {"again", file.again},
                     {"sha256", file.sha256}});
  return {{"host", pulled.host},
          {"folder", pulled.folder},
          {"files", files},
          {"fetched_bytes", pulled.fetched_bytes},
          {"error", pulled.error}};
}

/// For CLI::Validator: "2MB/s" is made bytes a second.
std::string byte_rate(std::string& text) {
  const auto bytes_s = graph::parse_in_unit(text, "B/s");
  if (!bytes_s) return bytes_s.error();
  if (*bytes_s < 1) return "is " + text + ", less than 1B/s";
  text = fmt::format("{}", *bytes_s);
  return "";
}

}  // namespace

int log_pull(const LogPullOptions& options) {
  const StopAsked stop;
  flight::PullOptions how = options.pull;
  if (!options.json) how.told = print_file;
  how.stopped = [] { return StopAsked::asked(); };
  const flight::Pulled pulled = flight::pull(how);
  if (options.json)
    std::printf("%s\n", pulled_json(pulled).dump(2, ' ', false, Json::error_handler_t::replace).c_str());
  if (pulled.fault != flight::Pulled::none) {
    constexpr Exit kCodes[] = {kOk, kBadInput, kDeviceOrSystem, kNotOk};
    return refuse(pulled.error, kCodes[pulled.fault]);
  }
  if (options.json) return kOk;
  const auto count = [&](PulledFile::State state) {
    return std::count_if(pulled.files.begin(), pulled.files.end(),
                         [&](const auto& file) { return file.state == state; });
  };
  if (pulled.files.empty()) std::printf("nothing is frozen in %s:%s\n", pulled.host.c_str(), pulled.folder.c_str());
  else if (!how.list)
    std::printf("%s\n", fmt::format("{} of {} files fetched, {:.1f} MB; {} were here", count(PulledFile::fetched),
                                    pulled.files.size(), in_mb(pulled.fetched_bytes), count(PulledFile::here))
                            .c_str());
  return kOk;
}

void add_log_pull(CLI::App& log, LogPullOptions& o, int& exit_code) {
  CLI::App* pull = log.add_subcommand("pull", "takes what a robot has frozen to this machine, over ssh");
  pull->add_option("from", o.pull.from, "HOST:FOLDER, as for scp; FOLDER is OUTPUT of a run, or OUTPUT/flight")
      ->required();
  CLI::Option* to = writes_folder(pull->add_option("-o,--output", o.pull.to, "the folder to put the files into"));
  pull->add_flag("--all", o.pull.ring, "also the files of the ring that the run does not write any more");
  pull->add_flag("--list", o.pull.list, "lists the files, and fetches none");
  pull->add_flag("--json", o.json, "prints JSON");
  pull->add_option("--limit", o.pull.most_bytes_s, "such as 2MB/s: leaves the rest of the link to others")
      ->type_name("RATE")
      ->transform(CLI::Validator(byte_rate, ""));
  pull->add_option("--ssh", o.pull.ssh, "instead of ssh: a program that takes a host and a command, with its options")
      ->type_name("COMMAND");
  pull->footer(
      "Example: takt log pull user@robot:out -o frozen\n"
      "What was cut off goes on where it ended. Nothing is removed from the robot.");
  pull->callback([&, to] {
    if (to->count() == 0 && !o.pull.list) throw CLI::RequiredError("--output");
    exit_code = log_pull(o);
  });
}

}  // namespace takt::command
