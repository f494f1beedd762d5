// SPDX-License-Identifier: Apache-2.0
#include "graph/check/machine_figures.hpp"

#include <fmt/format.h>

#include <array>
#include <stdexcept>

namespace takt::graph {
namespace {

using analysis::Overheads;
using nlohmann::json;
using Json = nlohmann::ordered_json;

struct TimeFigure {
  const char* key;
  std::optional<double> MachineFigures::*us;
  int64_t Overheads::*ns;
};
constexpr std::array kTimes{
    TimeFigure{"release_us", &MachineFigures::release, &Overheads::release_ns},
    TimeFigure{"switch_us", &MachineFigures::context_switch, &Overheads::switch_ns},
    TimeFigure{"publish_us", &MachineFigures::publish, &Overheads::publish_ns},
    TimeFigure{"take_us", &MachineFigures::take, &Overheads::take_ns},
    TimeFigure{"per_mb_us", &MachineFigures::per_mb, &Overheads::per_mb_ns},
    TimeFigure{"enforcement_us", &MachineFigures::enforcement, &Overheads::enforcement_ns},
    TimeFigure{"demotion_us", &MachineFigures::demotion, &Overheads::demotion_ns},
    TimeFigure{"look_us", &MachineFigures::look, &Overheads::look_ns},
    TimeFigure{"tick_us", &MachineFigures::tick, &Overheads::tick_ns},
};
constexpr std::array kPercentiles{kTimes[0], kTimes[1], kTimes[2], kTimes[3]};  // the others are extremes, or medians
constexpr const char* kWorst = "worst";
constexpr const char *kMachine = "machine", *kCpu = "cpu", *kCores = "cores", *kKernel = "kernel",
                     *kMeasuredAt = "measured_at", *kBandwidth = "deadline_bandwidth";
constexpr double kMost_us = 1e9, kMostCores = 1e6;

std::optional<double> figure(const json& file, const char* key, double limit) {
  if (!file.contains(key) || file.at(key).is_null()) return std::nullopt;
  const auto value = file.at(key).get<double>();
  if (!(value >= 0 && value < limit)) throw std::invalid_argument(fmt::format("`{}` is {:g}", key, value));
  return value;
}

machine::Identity read_identity(const json& machine) {
  const json& cores = machine.at(kCores);
  if (!cores.is_number_integer() || cores < 0 || cores >= kMostCores)
    throw std::invalid_argument(fmt::format("`{}` is no number of cores", kCores));
  return {machine.at(kCpu).get<std::string>(), cores.get<int>(), machine.at(kKernel).get<std::string>()};
}

}  // namespace

Json identity_json(const machine::Identity& machine) {
  return {{kCpu, machine.cpu}, {kCores, machine.cores}, {kKernel, machine.kernel}};
}

Json measured_machine_json(const MeasuredMachine& measured) {
  const MachineFigures& figures = measured.figures;
  Json file{{kMachine, identity_json(measured.machine)}, {kMeasuredAt, measured.measured_at}};
  for (const TimeFigure& time : kTimes)
    if (const auto& us = figures.*time.us) file[time.key] = *us;
  if (figures.deadline_bandwidth) file[kBandwidth] = *figures.deadline_bandwidth;
  for (const TimeFigure& time : kPercentiles)
    if (const auto& us = measured.worst.*time.us) file[kWorst][time.key] = *us;
  return file;
}

MeasuredMachine read_measured_machine(const json& file) {
  MeasuredMachine measured;
  measured.machine = read_identity(file.at(kMachine));
  if (const json when = file.value(kMeasuredAt, json()); when.is_string()) measured.measured_at = when;
  for (const TimeFigure& time : kTimes) measured.figures.*time.us = figure(file, time.key, kMost_us);
  measured.figures.deadline_bandwidth = figure(file, kBandwidth, kMostCores);
  if (const json worst = file.value(kWorst, json::object()); worst.is_object())
    for (const TimeFigure& time : kPercentiles) measured.worst.*time.us = figure(worst, time.key, kMost_us);
  return measured;
}

Overheads overheads_of(const MachineFigures& figures, Overheads otherwise) {
  for (const TimeFigure& time : kTimes)
    if (const auto& us = figures.*time.us) otherwise.*time.ns = static_cast<int64_t>(*us * 1e3);
  otherwise.deadline_bandwidth = figures.deadline_bandwidth.value_or(otherwise.deadline_bandwidth);
  return otherwise;
}

std::optional<Overheads> worst_overheads(const MeasuredMachine& measured, const Overheads& otherwise, double margin) {
  Overheads worst = overheads_of(measured.figures, otherwise);
  for (const TimeFigure& time : kPercentiles) {
    const auto& us = measured.worst.*time.us;
    if (!us) return std::nullopt;
    worst.*time.ns = static_cast<int64_t>(*us * (1 + margin) * 1e3);
  }
  return worst;
}

Json overheads_json(const Overheads& overheads) {
  Json json;
  for (const TimeFigure& time : kTimes) json[time.key] = static_cast<double>(overheads.*time.ns) / 1e3;
  json[kBandwidth] = overheads.deadline_bandwidth;
  json["ordinary_ms"] = static_cast<double>(overheads.ordinary_runtime_ns) / 1e6;
  json["ordinary_period_ms"] = static_cast<double>(overheads.ordinary_period_ns) / 1e6;
  return json;
}

}  // namespace takt::graph
