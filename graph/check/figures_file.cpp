// SPDX-License-Identifier: Apache-2.0
#include "graph/check/figures_file.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <fstream>

#include "graph/check/machine_figures.hpp"
#include "rt/file/output_file.hpp"

namespace takt::graph {
namespace {

using Json = nlohmann::ordered_json;
using machine::Spread;
using machine::TransferCosts;

bool given(const char* value) { return value != nullptr && *value != '\0'; }

Json to_json(const Spread& spread) {
  return {{"p50", spread.p50_us},
          {"p99", spread.has_p99() ? Json(spread.p99_us) : Json(nullptr)},
          {"max", spread.max_us},
          {"samples", spread.samples}};
}
Json to_json(const TransferCosts& costs) {
  Json list = Json::array();
  for (const auto& cost : costs)
    list.push_back({{"bytes", cost.bytes}, {"publish_us", to_json(cost.publish)}, {"take_us", to_json(cost.take)}});
  return list;
}
Json to_json(const machine::Stalls& stalls) {
  return {{"observed_ms", static_cast<double>(stalls.observed_ns) / 1e6},
          {"count", stalls.count},
          {"over_1ms", stalls.over_1ms},
          {"sum_ms", static_cast<double>(stalls.sum_ns) / 1e6},
          {"max_ms", static_cast<double>(stalls.max_ns) / 1e6},
          {"preempted", stalls.preempted},
          {"preempted_max_ms", static_cast<double>(stalls.preempted_max_ns) / 1e6},
          {"stolen_ms", static_cast<double>(stalls.stolen_ns) / 1e6}};
}

template <class Value>
Json to_json(const std::optional<Value>& value) {
  return value ? to_json(*value) : Json(nullptr);
}

/// Growth of the medians from the smallest to the largest message.
double per_mb_us(const TransferCosts& costs) {
  const auto both = [](const machine::TransferCost& cost) { return cost.publish.p50_us + cost.take.p50_us; };
  const double mb = static_cast<double>(costs.back().bytes - costs.front().bytes) / 1e6;
  return std::max(0.0, (both(costs.back()) - both(costs.front())) / mb);
}

/// The dearer of the two transports, as far as they were measured.
template <class Figure>
std::optional<double> dearer(const machine::Measured& m, const Figure& figure) {
  std::optional<double> result;
  for (const auto* costs : {&m.local, &m.iceoryx})
    if (*costs) result = std::max(result.value_or(0), figure(**costs));
  return result;
}

/// The largest samples of what is charged with every job.
MachineFigures worst_figures(const machine::Measured& m) {
  MachineFigures worst;
  if (m.release) worst.release = m.release->lateness.max_us;
  if (m.context_switch) worst.context_switch = m.context_switch->one_way.max_us;
  worst.publish = dearer(m, [](const TransferCosts& costs) { return costs[0].publish.max_us; });
  worst.take = dearer(m, [](const TransferCosts& costs) { return costs[0].take.max_us; });
  return worst;
}

std::string row(const std::string& name, const Spread& spread) {
  return fmt::format("  {:<34} {:>9.2f} {:>9} {:>9.2f} {:>8}\n", name, spread.p50_us,
                     spread.has_p99() ? fmt::format("{:.2f}", spread.p99_us) : "-", spread.max_us, spread.samples);
}

std::string rows(const std::string& transport, const TransferCosts& costs) {
  std::string text;
  for (const auto& cost : costs) {
    text += row(fmt::format("publish, {} B, {}", cost.bytes, transport), cost.publish);
    text += row(fmt::format("take, {} B, {}", cost.bytes, transport), cost.take);
  }
  return text;
}

std::string stalls_text(const machine::Stalls& s) {
  const auto ms = [](int64_t ns) { return static_cast<double>(ns) / 1e6; };
  return fmt::format(
      "  stalls of 20 us and more while spinning for {:.1f} s: {} ({} above 1 ms), sum\n"
      "  {:.1f} ms, longest {:.2f} ms; the host says it took {:.0f} ms. Preempted by other\n"
      "  threads {} times, longest {:.2f} ms.\n",
      ms(s.observed_ns) / 1e3, s.count, s.over_1ms, ms(s.sum_ns), ms(s.max_ns), ms(s.stolen_ns), s.preempted,
      ms(s.preempted_max_ns));
}

}  // namespace

std::filesystem::path figures_file(const char* takt_machine, const char* cache_home, const char* home) {
  if (given(takt_machine)) return takt_machine;
  if (given(cache_home)) return std::filesystem::path(cache_home) / "takt/machine.json";
  if (given(home)) return std::filesystem::path(home) / ".cache/takt/machine.json";
  return {};
}

std::filesystem::path figures_file() {
  return figures_file(std::getenv("TAKT_MACHINE"), std::getenv("XDG_CACHE_HOME"), std::getenv("HOME"));
}

Json measured_json(const machine::Identity& machine, const std::string& measured_at, const machine::Measured& m) {
  graph::MachineFigures figures;
  if (m.release) figures.release = m.release->lateness.charged_us();
  if (m.context_switch) figures.context_switch = m.context_switch->one_way.charged_us();
  figures.publish = dearer(m, [](const TransferCosts& costs) { return costs[0].publish.charged_us(); });
  figures.take = dearer(m, [](const TransferCosts& costs) { return costs[0].take.charged_us(); });
  figures.per_mb = dearer(m, per_mb_us);
  if (m.reservation_overrun) figures.enforcement = m.reservation_overrun->max_us;
  if (m.watchdog_overrun) figures.demotion = m.watchdog_overrun->max_us;
  if (m.watchdog_look) figures.look = m.watchdog_look->p50_us;  // a pass has many
  figures.tick = m.tick_us;
  if (m.bandwidth) figures.deadline_bandwidth = m.bandwidth->accepted;
  Json json = graph::measured_machine_json({machine, measured_at, figures, worst_figures(m)});
  if (m.release) json["policy"] = to_string(m.release->policy);
  Json& details = json["details"];
  details["release_us"] = m.release ? to_json(m.release->lateness) : Json(nullptr);
  details["switch_us"] = m.context_switch ? to_json(m.context_switch->one_way) : Json(nullptr);
  if (m.context_switch) details["switch_policy"] = m.context_switch->fixed ? "fixed" : "cooperative";
  details["local"] = to_json(m.local);
  details["iceoryx"] = to_json(m.iceoryx);
  details["overrun_us"] = {{"budget", static_cast<double>(machine::kEnforcedBudget_ns) / 1e3},
                           {"reservation", to_json(m.reservation_overrun)},
                           {"watchdog", to_json(m.watchdog_overrun)},
                           {"cpu_timer", to_json(m.cpu_timer_overrun)}};
  details["look_us"] = to_json(m.watchdog_look);
  details["other_deadline_threads"] = m.bandwidth ? Json(m.bandwidth->others) : Json(nullptr);
  details["stalls"] = to_json(m.stalls);
  return json;
}

std::string measured_text(const machine::Measured& m) {
  std::string text = fmt::format("  {:<34} {:>9} {:>9} {:>9} {:>8}\n", "measured, us", "p50", "p99", "max", "samples");
  std::string missing;
  const auto add = [&](const std::string& name, const std::optional<Spread>& spread) {
    if (spread) text += row(name, *spread);
    else missing += "    " + name + "\n";
  };
  if (m.release) text += row(fmt::format("release under {}", to_string(m.release->policy)), m.release->lateness);
  else add("release", std::nullopt);
  add("context switch", m.context_switch ? std::optional(m.context_switch->one_way) : std::nullopt);
  if (m.local) text += rows("local", *m.local);
  else add("local", std::nullopt);
  if (m.iceoryx) text += rows("iceoryx", *m.iceoryx);
  else add("iceoryx", std::nullopt);
  add("1 ms reservation overrun by", m.reservation_overrun);
  add("1 ms with a watchdog overrun by", m.watchdog_overrun);
  add("1 ms thread-CPU timer late by", m.cpu_timer_overrun);
  add("look of a watchdog", m.watchdog_look);
  if (m.tick_us) text += fmt::format("  tick {:.0f} us\n", *m.tick_us);
  if (m.bandwidth)
    text +=
        fmt::format("  SCHED_DEADLINE reservations accepted: {:.4f} cores{}\n", m.bandwidth->accepted,
                    m.bandwidth->others == 0 ? "" : fmt::format(" beside those of {} threads", m.bandwidth->others));
  else missing += "    SCHED_DEADLINE bandwidth\n";
  if (m.stalls) text += stalls_text(*m.stalls);
  if (!missing.empty()) text += "  not measured with these rights:\n" + missing;
  return text;
}

std::string cannot_write(const std::filesystem::path& file) {
  std::error_code error;
  const auto folder = file.has_parent_path() ? file.parent_path() : std::filesystem::path(".");
  std::filesystem::create_directories(folder, error);
  if (error) return error.message();
  return access(folder.c_str(), W_OK) == 0 ? "" : std::strerror(errno);
}

std::string write_whole(const std::filesystem::path& file, const std::string& text) {
  if (std::string why = cannot_write(file); !why.empty()) return why;
  const auto done = takt::write_file(file, text);
  return done ? "" : done.error().what.substr(file.string().size() + 2);
}

std::string utc_now() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &utc);
  return text;
}

}  // namespace takt::graph
