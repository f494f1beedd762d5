// SPDX-License-Identifier: Apache-2.0
#include "graph/bringup/trials.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>
#include <numbers>
#include <thread>
#include <vector>

#include "graph/bringup/altered.hpp"
#include "graph/check/figures_file.hpp"
#include "rt/msg/ace/stop_command.hpp"

namespace takt::bringup {
namespace {

using Json = TrialRun::Json;

constexpr double kStands_m_s = 0.02, kStops_s = 1.0, kDrives_s = 2.0;
constexpr double kLeastShare = 0.8;  ///< of the messages that a device should have sent

void wait_s(double s) { std::this_thread::sleep_for(std::chrono::duration<double>(s)); }

/// What a trial says at its end.
struct Verdict {
  bool passed = false;
  std::string said;
};

Verdict failed(std::string said) { return {false, std::move(said)}; }

Verdict told(const std::optional<bool>& agreed, const std::string& seen, const std::string& otherwise) {
  if (!agreed) return failed("nobody answered");
  return *agreed ? Verdict{true, seen} : failed(otherwise + ", says who stood there: " + seen);
}

/// The device is there and sends as often as it should.
Verdict watch(const TrialRun& run, const TrialOptions& options, const graph::DeviceSpec& device) {
  const Json before = run.device(device.id);
  wait_s(options.watched_s);
  const Json after = run.device(device.id);
  if (!before.contains("received") || !after.contains("received")) return failed("the run ended: " + run.why());
  // Lines send nothing by themselves: their node asks for the levels.
  const char* counted = device.kind == "digital_lines" ? "completed" : "received";
  const double rate_hz =
      static_cast<double>(after[counted].get<uint64_t>() - before[counted].get<uint64_t>()) / options.watched_s;
  const std::string seen = fmt::format("{}, {:.1f} messages a second", after.value("state", ""), rate_hz);
  if (after.value("state", "") != "ok" || after.value("losses", uint64_t{0}) > before.value("losses", uint64_t{0}))
    return failed(seen + ", lost meanwhile");
  if (device.rate && rate_hz < kLeastShare * device.rate->hz())
    return failed(fmt::format("{}, of {:.1f}", seen, device.rate->hz()));
  return {true, seen};
}

double number(const std::optional<Json>& message, const char* field) {
  return message ? message->value(field, std::nan("")) : std::nan("");
}

/// Straight ahead, m; of the beams there the middle one.
std::optional<double> range_ahead(const std::optional<Json>& scan) {
  if (!scan) return std::nullopt;
  const Json ranges = scan->value("range_m", Json::object()).value("first", Json::array());
  const auto ahead = std::lround(-scan->value("first_angle_rad", 0.0) / scan->value("step_rad", 1.0));
  std::vector<double> near;
  for (long i = ahead - 2; i <= ahead + 2; ++i)
    if (i >= 0 && static_cast<size_t>(i) < ranges.size() && ranges[static_cast<size_t>(i)].is_number())
      near.push_back(ranges[static_cast<size_t>(i)].get<double>());
  if (near.empty()) return std::nullopt;
  std::sort(near.begin(), near.end());
  return near[near.size() / 2];
}

Verdict try_scanner(const TrialRun& run, const graph::DeviceSpec& device, Person& person) {
  const auto ahead = range_ahead(run.message(device.id + ".scan", 2000));
  if (!ahead) return failed("a scan has no beam straight ahead");
  const std::string seen = *ahead > 0 ? fmt::format("{:.2f} m straight ahead", *ahead) : "nothing straight ahead";
  return told(person.agrees(fmt::format("{} measures {}. Is that so?", device.id, seen)), seen, "that is not so");
}

Verdict try_camera(const TrialRun& run, const TrialOptions& options, const graph::DeviceSpec& device, Person& person) {
  const auto picture = run.picture(device.id + ".pair");
  const auto file = options.run.output / (device.id + ".png");
  if (!picture || !(std::ofstream(file, std::ios::binary) << *picture))
    return failed("there is no picture in " + file.string());
  return told(person.agrees(
                  fmt::format("{} shows what {} sees. Is it upright and sharp, and the left eye's picture on the left?",
                              file.string(), device.id)),
              file.string(), "the picture is wrong");
}

Verdict try_head(const TrialRun& run, const graph::DeviceSpec& device, Person& person) {
  const auto state = run.message(device.id + ".state");
  constexpr double kDegree = std::numbers::pi / 180;
  const std::string seen = fmt::format("pan {:.1f} deg, tilt {:.1f} deg", number(state, "pan_rad") / kDegree,
                                       number(state, "tilt_rad") / kDegree);
  return told(person.agrees(fmt::format("{} says {} (left and up are positive). Does it look there?", device.id, seen)),
              seen, "it does not look there");
}

Verdict try_lines(const TrialRun& run, const TrialOptions& options, const graph::DeviceSpec& device, Person& person) {
  const auto levels = [&] {
    return run.message(device.id + ".state").value_or(Json::object()).value("levels", uint64_t{0});
  };
  const uint64_t before = levels();
  person.hears(fmt::format("Press the emergency stop, or change another input of {} ({:.0f} s).", device.id,
                           options.patience_s));
  uint64_t pressed = before;
  if (!comes_to_be(options.patience_s, [&] { return (pressed = levels()) != before; }))
    return failed("no input changed");
  person.hears("Release it.");
  if (!comes_to_be(options.patience_s, [&] { return levels() == before; })) return failed("it did not change back");
  return {true, fmt::format("levels {:#x}, pressed {:#x}", before, pressed)};
}

/// Commands a speed, and whether it was taken.
bool drive(const TrialRun& run, double speed_m_s) {
  return run
      .ask({{"do", "set"}, {"param", std::string(kDriver) + ".speed"}, {"value", fmt::format("{} m/s", speed_m_s)}})
      .contains("ok");
}

Verdict try_base(const TrialRun& run, const TrialOptions& options, const graph::DeviceSpec& device, Person& person) {
  const auto lifted = person.agrees(fmt::format(
      "{} will turn its wheels forward at {:g} m/s. Are they lifted off the ground?", device.id, options.speed_m_s));
  if (!lifted || !*lifted) return failed("its wheels were not lifted");
  const auto odometry = [&] { return run.message(device.id + ".odometry"); };
  const auto begin = odometry();
  if (!drive(run, options.speed_m_s)) return failed("it cannot be commanded");
  wait_s(kDrives_s);
  const auto driving = odometry();
  drive(run, 0);
  const double speed = number(driving, "speed_m_s");
  const double way =
      std::hypot(number(driving, "x_m") - number(begin, "x_m"), number(driving, "y_m") - number(begin, "y_m"));
  const std::string seen = fmt::format("{:.2f} m/s, {:.2f} m", speed, way);
  if (!(std::abs(speed - options.speed_m_s) < 0.5 * options.speed_m_s) || !(way > 0.25 * kDrives_s * options.speed_m_s))
    return failed("it was to drive, and says " + seen);
  if (!comes_to_be(kStops_s, [&] { return std::abs(number(odometry(), "speed_m_s")) < kStands_m_s; }))
    return failed("it does not stand when it is told to");
  return told(person.agrees("Did both wheels turn forward, and stand again?"), seen, "they did not");
}

Verdict try_kind(const TrialRun& run, const TrialOptions& options, const graph::DeviceSpec& device, Person& person) {
  if (device.kind == "laser_scanner") return try_scanner(run, device, person);
  if (device.kind == "stereo_camera") return try_camera(run, options, device, person);
  if (device.kind == "camera_head") return try_head(run, device, person);
  if (device.kind == "digital_lines") return try_lines(run, options, device, person);
  if (device.kind == "mobile_base") return try_base(run, options, device, person);
  return {true, ""};
}

Trial noted(const std::string& of, const Verdict& verdict) {
  return {of, graph::utc_now(), verdict.said, verdict.passed};
}

/// The run of a trial, with what is to be different in it.
command::RunOptions trial(const TrialOptions& options, const std::string& name,
                          std::function<void(graph::GraphSpec&)> alter) {
  command::RunOptions run = options.run;
  run.duration_s = 0;
  run.unchecked = true;
  run.ring = "off";
  run.isolate = "none";
  run.output = options.run.output / name;
  run.alter = std::move(alter);
  return run;
}

/// On the ground.
class StopTrial {
 public:
  StopTrial(const TrialRun& run, const TrialOptions& options, const graph::GraphSpec& graph, const std::string& base)
      : run_(run), options_(options), graph_(graph), base_(base) {
    for (const graph::DeviceSpec& device : graph.devices)
      if (device.id == base)
        for (const graph::EdgeSpec& edge : device.edges)
          if (edge.input == "stop") stop_ = edge.from.text();
  }

  Verdict judge(Person& person) {
    const auto ready =
        person.agrees(fmt::format("{} will drive forward at {:g} m/s, on the ground, until it is stopped. Is the way "
                                  "free, and does somebody stand at the "
                                  "emergency stop?",
                                  base_, options_.speed_m_s));
    if (!ready || !*ready) return failed("nobody was ready");
    if (!drive(run_, options_.speed_m_s)) return failed("it cannot be commanded");
    if (!comes_to_be(options_.patience_s, [&] { return speed() > options_.speed_m_s / 2; }))
      return failed("it does not drive");
    person.hears("Step in its way.");
    if (!comes_to_be(options_.patience_s, [&] { return stopped(); }))
      return failed("it did not stop for who stepped in its way");
    const double took_s = stands_after();
    if (took_s > kStops_s) return failed("it was told to stop, and drove on");
    person.hears("Step aside.");
    if (!comes_to_be(options_.patience_s, [&] { return speed() > options_.speed_m_s / 2; }))
      return failed("it did not drive on");
    std::string seen = fmt::format("stood {:.2f} s after it was told to", took_s);
    if (has_lines()) {
      person.hears("Press the emergency stop.");
      if (!comes_to_be(options_.patience_s, [&] { return std::abs(speed()) < kStands_m_s; }))
        return failed("the emergency stop did not stop it");
      seen += "; the emergency stop stopped it";
    }
    drive(run_, 0);
    return told(person.agrees("Did it stop as it should, each time?"), seen, "it did not stop as it should");
  }

 private:
  double speed() const { return number(run_.message(base_ + ".odometry"), "speed_m_s"); }
  /// By what the scanners see or do not see: whoever presses the emergency stop is not in the way.
  bool stopped() const {
    const uint64_t reasons = run_.message(stop_).value_or(Json::object()).value("reasons", uint64_t{0});
    return (reasons & (stop_reason::obstacle | stop_reason::scan_lost)) != 0;
  }
  double stands_after() const {
    const auto since = std::chrono::steady_clock::now();
    comes_to_be(2 * kStops_s, [&] { return std::abs(speed()) < kStands_m_s; });
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - since).count();
  }
  bool has_lines() const {
    return std::any_of(graph_.devices.begin(), graph_.devices.end(),
                       [](const auto& d) { return d.kind == "digital_lines"; });
  }

  const TrialRun& run_;
  const TrialOptions& options_;
  const graph::GraphSpec& graph_;
  const std::string base_;
  std::string stop_;
};

}  // namespace

Trial try_device(const Registry& registry, const TrialOptions& options, const graph::DeviceSpec& device,
                 Person& person) {
  const bool drives = device.kind == "mobile_base";
  const auto alone = [id = device.id, drives](graph::GraphSpec& graph) {
    leave_only(graph, id);
    if (drives) drive_by_hand(graph, id);
  };
  TrialRun run(registry, trial(options, device.id, alone), options.run.output / (device.id + ".log"));
  const auto judge = [&] {
    if (!run.begun()) return failed(run.why());
    const Verdict there = watch(run, options, device);
    if (!there.passed) return there;
    const Verdict kind = try_kind(run, options, device, person);
    return Verdict{kind.passed, kind.said.empty() ? there.said : there.said + "; " + kind.said};
  };
  return noted(fingerprint(device), judge());
}

Trial try_stop(const Registry& registry, const TrialOptions& options, const graph::GraphSpec& graph,
               const std::string& base, Person& person) {
  const std::string of = stop_fingerprint(graph, base);
  if (of.empty())
    return noted("nothing", failed(fmt::format("nothing stops {}: its input `stop` is not connected", base)));
  const auto driven = [base](graph::GraphSpec& altered) { drive_by_hand(altered, base); };
  TrialRun run(registry, trial(options, "stop", driven), options.run.output / "stop.log");
  if (!run.begun()) return noted(of, failed(run.why()));
  return noted(of, StopTrial(run, options, graph, base).judge(person));
}

}  // namespace takt::bringup
