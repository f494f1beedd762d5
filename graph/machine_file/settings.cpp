// SPDX-License-Identifier: Apache-2.0
#include "graph/machine_file/settings.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "graph/language/words.hpp"
#include "rt/machine/parse.hpp"

namespace takt::graph {
namespace {

constexpr const char* kFrom = "# By `takt machine apply`, from the machine file; `takt machine undo` removes it.\n";

std::string list(const std::vector<int>& cpus) { return machine::cpu_list_text(cpus); }

std::string device_rule(const MachineFile::Device& device) {
  std::string rule = fmt::format("SUBSYSTEM==\"{}\"", device.subsystem);
  // A camera has a second node, of metadata.
  if (device.subsystem == "video4linux") rule += ", ATTR{index}==\"0\"";
  if (!device.serial.empty()) rule += fmt::format(", ENV{{ID_SERIAL_SHORT}}==\"{}\"", device.serial);
  if (!device.path.empty()) rule += fmt::format(", ENV{{ID_PATH}}==\"{}\"", device.path);
  if (!device.kernel_name.empty()) rule += fmt::format(", KERNEL==\"{}\"", device.kernel_name);
  std::string text = fmt::format("{}, SYMLINK+=\"takt/{}\", TAG+=\"systemd\"\n", rule, device.name);
  if (device.low_latency)
    text += fmt::format("{}, RUN+=\"/bin/sh -c 'echo 1 > /sys/bus/usb-serial/devices/%k/latency_timer'\"\n", rule);
  return text;
}

std::string interface_text(const MachineFile::Interface& interface) {
  std::string text = fmt::format("{}[Match]\nName={}\n\n", kFrom, interface.name);
  if (interface.bitrate > 0)
    return text +
           fmt::format("[CAN]\nBitRate={}\nRestartSec=100ms\n\n[Link]\nRequiredForOnline=no\n", interface.bitrate);
  if (interface.dhcp) return text + "[Network]\nDHCP=yes\n";
  text += fmt::format("[Network]\nAddress={}\n", interface.address);
  if (!interface.gateway.empty()) text += fmt::format("Gateway={}\n", interface.gateway);
  return text;
}

std::string manager_text(const MachineFile& machine) {
  std::string text;
  // All other services stay away from isolated CPUs; Takt's has all of them, below.
  if (!machine.isolated.empty()) text += fmt::format("CPUAffinity={}\n", list(common_cpus(machine)));
  if (machine.watchdog_s > 0)
    text += fmt::format("RuntimeWatchdogSec={0}s\nRebootWatchdogSec={1}s\n", machine.watchdog_s,
                        std::max<int64_t>(machine.watchdog_s, 120));
  return text.empty() ? text : kFrom + ("[Manager]\n" + text);
}

std::string service_text(const MachineFile& machine) {
  std::string unit, service;
  // A device that does not appear delays the run by systemd's time limit, and does not prevent it.
  for (const MachineFile::Device& device : machine.devices) {
    const std::string name = fmt::format("dev-takt-{}.device", device.name);
    unit += fmt::format("Wants={0}\nAfter={0}\n", name);
  }
  // Against the manager's CPUAffinity=, above.
  if (!machine.isolated.empty()) service += fmt::format("CPUAffinity=0-{}\n", machine.cores - 1);
  if (machine.options) service += fmt::format("Environment=\"TAKT_OPTIONS={}\"\n", join_words(*machine.options, " "));
  if (!machine.service_watchdog) service += "WatchdogSec=0\n";
  if (unit.empty() && service.empty()) return "";
  return kFrom + (unit.empty() ? "" : "[Unit]\n" + unit) + (service.empty() ? "" : "[Service]\n" + service);
}

}  // namespace

std::vector<std::string> kernel_arguments(const MachineFile& machine) {
  std::vector<std::string> words;
  if (!machine.isolated.empty()) {
    words.push_back("nohz_full=" + list(machine.isolated));
    words.push_back("rcu_nocbs=" + list(machine.isolated));
    words.push_back("irqaffinity=" + list(machine.interrupts.empty() ? common_cpus(machine) : machine.interrupts));
  } else if (!machine.interrupts.empty()) {
    words.push_back("irqaffinity=" + list(machine.interrupts));
  }
  if (machine.deepest_idle) {
    words.push_back(fmt::format("processor.max_cstate={}", *machine.deepest_idle));
    words.push_back(fmt::format("intel_idle.max_cstate={}", *machine.deepest_idle));
  }
  // Armed before the root is there, by images (packaging/image/initramfs); nobody else knows the word.
  if (machine.watchdog_s > 0) words.emplace_back("takt.watchdog");
  if (!machine.mitigations) words.emplace_back("mitigations=off");
  words.insert(words.end(), machine.kernel_arguments.begin(), machine.kernel_arguments.end());
  return words;
}

std::vector<SystemFile> system_files(const MachineFile& machine) {
  std::vector<SystemFile> files;
  if (!machine.time_zone.empty()) files.push_back({"/etc/localtime", "", "/usr/share/zoneinfo/" + machine.time_zone});
  for (const MachineFile::Interface& interface : machine.network)
    files.push_back({fmt::format("/etc/systemd/network/61-takt-{}.network", interface.name), interface_text(interface),
                     "", "networkctl reload"});
  if (const std::string text = manager_text(machine); !text.empty())
    files.push_back({"/etc/systemd/system.conf.d/61-takt-machine.conf", text, "", "systemctl daemon-reexec"});
  if (const std::string text = service_text(machine); !text.empty())
    files.push_back({"/etc/systemd/system/takt@.service.d/61-takt-machine.conf", text, "", "systemctl daemon-reload"});
  if (!machine.time_servers.empty())
    files.push_back({"/etc/systemd/timesyncd.conf.d/61-takt-machine.conf",
                     fmt::format("{}[Time]\nNTP={}\n", kFrom, join_words(machine.time_servers, " ")), "",
                     "systemctl try-restart systemd-timesyncd"});
  if (!machine.governor.empty())
    files.push_back({"/etc/tmpfiles.d/61-takt-machine.conf",
                     fmt::format("{}w- /sys/devices/system/cpu/cpu*/cpufreq/scaling_governor - - - - {}\n", kFrom,
                                 machine.governor),
                     "", "systemd-tmpfiles --create /etc/tmpfiles.d/61-takt-machine.conf"});
  std::string rules;
  for (const MachineFile::Device& device : machine.devices) rules += device_rule(device);
  if (!rules.empty())
    files.push_back(
        {"/etc/udev/rules.d/61-takt-machine.rules", kFrom + rules, "", "udevadm control --reload && udevadm trigger"});
  std::sort(files.begin(), files.end(), [](const auto& a, const auto& b) { return a.path < b.path; });
  return files;
}

SystemFile grub_file(const MachineFile& machine) {
  return {"/etc/default/grub.d/61-takt-machine.cfg",
          fmt::format("{}GRUB_CMDLINE_LINUX_DEFAULT=\"$GRUB_CMDLINE_LINUX_DEFAULT {}\"\n", kFrom,
                      join_words(kernel_arguments(machine), " ")),
          "", "update-grub"};
}

}  // namespace takt::graph
