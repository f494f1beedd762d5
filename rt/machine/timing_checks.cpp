// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <set>

#include "rt/machine/check_support.hpp"
#include "rt/machine/checks.hpp"
#include "rt/machine/parse.hpp"

namespace takt::machine {

Preemption preemption_of(const Facts& facts) {
  if (trimmed(facts.text("/sys/kernel/realtime").value_or("")) == "1") return {"rt", "/sys/kernel/realtime"};
  const std::string version = facts.text("/proc/sys/kernel/version").value_or("");
  if (version.find("PREEMPT_RT") != std::string::npos) return {"rt", "uname -v"};
  if (const auto debug = facts.text("/sys/kernel/debug/sched/preempt"))
    if (const std::string model = chosen_word(*debug); !model.empty()) return {model, "debugfs"};
  const std::string config = kernel_config(facts);
  const bool dynamic = kernel_option(config, "PREEMPT_DYNAMIC") == "y";
  const auto booted = boot_option(facts.text("/proc/cmdline").value_or(""), "preempt");
  if (dynamic && booted) return {*booted, "kernel command line"};
  for (const auto& [option, model] :
       {std::pair{"PREEMPT_RT", "rt"}, std::pair{"PREEMPT_NONE", "none"}, std::pair{"PREEMPT_VOLUNTARY", "voluntary"},
        std::pair{"PREEMPT_LAZY", "lazy"}, std::pair{"PREEMPT", "full"}})
    if (kernel_option(config, option) == "y") return {model, "kernel configuration"};
  if (version.find(" PREEMPT ") != std::string::npos) return {"full", "uname -v"};
  return {};
}

Finding check_cpu_dma_latency(const Facts& facts, const LatencyTrial& trial) {
  Finding f{"timing", "cpu_dma_latency", Need::every_run, Status::lacks, "", ""};
  f.meaning = "held at 0 us during a run: CPUs do not sleep deeply between jobs";
  if (!trial.answered) return not_answered(f), f;
  if (trial.error == ENOENT) {
    f.status = Status::warn;
    f.found = "no /dev/cpu_dma_latency: this kernel controls no idle states, a hypervisor may";
    return f;
  }
  if (trial.error != 0) {
    f.found = std::string("refused: ") + std::strerror(trial.error);
    f.meaning = "CPUs sleep deeply between jobs and take longer to wake up";
    f.fixes = {shell("sudo chmod 666 /dev/cpu_dma_latency"),
               {"/etc/udev/rules.d/99-takt.rules", "KERNEL==\"cpu_dma_latency\", MODE=\"0666\""}};
    if (facts.is_root()) f.fixes = {shell("docker run --device /dev/cpu_dma_latency ...")};
    return f;
  }
  f.status = trial.effective_us > 0 ? Status::warn : Status::ok;
  f.found = trial.effective_us < 0 ? "granted; it cannot be read back with these rights"
                                   : "granted, read back: " + std::to_string(trial.effective_us) + " us";
  return f;
}

Finding check_timer_slack(const SlackTrial& trial) {
  Finding f{"timing", "timer_slack", Need::every_run, Status::lacks, "", ""};
  f.meaning = "how late timers of ordinary threads may fire: 50 us unless set";
  if (!trial.answered) return not_answered(f), f;
  f.found = std::to_string(trial.slack_ns) + " ns after asking for 1 ns";
  if (trial.error == 0 && trial.slack_ns == 1) f.status = Status::ok;
  else f.fixes = {{"sandbox profile", "allow prctl(PR_SET_TIMERSLACK)"}};
  return f;
}

Finding check_tick(const Facts& facts, const TickTrial& trial) {
  Finding f{"timing", "tick", Need::advice, Status::unknown, "", ""};
  f.meaning = "budgets of policy `deadline` act on the tick: a job may overrun by one";
  const auto configured = kernel_option(kernel_config(facts), "HZ");
  const std::string said = configured ? "CONFIG_HZ=" + *configured : "kernel configuration not readable";
  if (!trial.answered || trial.tick_ns <= 0) {
    f.found = said + "; the clock does not tell";
    return f;
  }
  const double hz = 1e9 / static_cast<double>(trial.tick_ns);
  f.found = std::to_string(std::lround(hz)) + " Hz by the clock's resolution";
  if (trial.step_ns > 0) f.found += ", steps of " + std::to_string(trial.step_ns / 1000) + " us seen";
  f.found += ", " + said;
  f.status = hz > 900 ? Status::ok : Status::warn;
  if (f.status == Status::warn)
    f.fixes = {{"kernel configuration", "CONFIG_HZ_1000=y"},
               shell("echo HRTICK_DL | sudo tee /sys/kernel/debug/sched/features")};
  return f;
}

Finding check_preemption(const Facts& facts) {
  Finding f{"timing", "preemption", Need::advice, Status::unknown, "", ""};
  f.meaning = "whether a job waits for what another process does in the kernel";
  const Preemption found = preemption_of(facts);
  if (found.model.empty()) {
    f.found = "neither uname, debugfs nor the kernel configuration tells";
    return f;
  }
  f.found = found.model + " (" + found.source + ")";
  f.status = found.model == "rt" || found.model == "full" ? Status::ok : Status::warn;
  if (f.status == Status::ok) return f;
  const bool dynamic = kernel_option(kernel_config(facts), "PREEMPT_DYNAMIC") == "y" || found.source == "debugfs";
  if (dynamic) f.fixes = {shell("echo full | sudo tee /sys/kernel/debug/sched/preempt"), boot("preempt=full")};
  else f.fixes = {{"Debian package", "linux-image-rt-amd64"}};
  return f;
}

Finding check_clocksource(const Facts& facts) {
  Finding f{"timing", "clocksource", Need::advice, Status::ok, "", ""};
  const std::string folder = "/sys/devices/system/clocksource/clocksource0/";
  f.found = trimmed(facts.text(folder + "current_clocksource").value_or(""));
  constexpr std::array kFast{"tsc", "arch_sys_counter", "kvm-clock", "hyperv_clocksource_tsc_page"};
  f.meaning = "jobs read the clock often; a clock in a device is slow to read";
  if (f.found.empty()) {
    f.status = Status::unknown;
    f.found = "cannot be read";
  } else if (std::find(kFast.begin(), kFast.end(), f.found) == kFast.end()) {
    f.status = Status::warn;
    const std::string text = facts.text(folder + "available_clocksource").value_or("");
    const auto available = words_of(text);
    f.fixes = {boot("clocksource=tsc tsc=reliable")};
    if (std::find(available.begin(), available.end(), "tsc") != available.end())
      f.fixes.insert(f.fixes.begin(), shell("echo tsc | sudo tee " + folder + "current_clocksource"));
  }
  return f;
}

Finding check_governor(const Facts& facts) {
  Finding f{"timing", "governor", Need::advice, Status::ok, "", ""};
  f.meaning = "CPUs clocked down between jobs run them slower than was measured";
  std::set<std::string> governors;
  const std::string folder = "/sys/devices/system/cpu/cpufreq/";
  for (const std::string& policy : facts.list(folder))
    if (const auto governor = facts.text(folder + policy + "/scaling_governor")) governors.insert(trimmed(*governor));
  if (governors.empty()) {
    f.status = Status::unknown;
    f.found = "no frequency control here; under a hypervisor the host decides";
    return f;
  }
  for (const std::string& governor : governors) f.found += (f.found.empty() ? "" : ", ") + governor;
  if (governors == std::set<std::string>{"performance"}) return f;
  f.status = Status::warn;
  f.fixes = {shell("echo performance | sudo tee /sys/devices/system/cpu/cpufreq/*/scaling_governor"),
             boot("cpufreq.default_governor=performance")};
  return f;
}

}  // namespace takt::machine
