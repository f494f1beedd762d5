// SPDX-License-Identifier: Apache-2.0
// What changes a device while the graph runs: faults of simulated devices and doubles, answers on a screen.
#include <fmt/format.h>

#include <algorithm>

#include "graph/attach/server.hpp"
#include "graph/language/words.hpp"
#include "hal/device_node.hpp"
#include "rt/sched/param_mail.hpp"

namespace takt::attach {
namespace {

using Json = nlohmann::ordered_json;

Json refusal(const std::string& text) { return {{"error", text}}; }

size_t param_called(const TaskPlan& task, std::string_view name) {
  const auto& params = task.node->params();
  const auto found = std::find_if(params.begin(), params.end(), [&](const ParamBase* p) { return p->name() == name; });
  return static_cast<size_t>(found - params.begin());
}

size_t fault_param(const TaskPlan& task) { return param_called(task, FaultParam::kName); }

/// What is switched on; "none": nothing.
std::string switched_on(const RunBoard& board, const Plan& plan, size_t task) {
  const KeptParam::Value* const newest = board.kept(task, fault_param(plan.tasks[task])).newest();
  return newest != nullptr ? std::string(newest->words.text()) : std::string(to_text(Misbehaviour::none));
}

std::vector<std::string> names(uint32_t fault_bits) {
  std::vector<std::string> all;
  for (const Misbehaviour fault : faults_of(fault_bits)) all.emplace_back(to_text(fault));
  return all;
}

}  // namespace

Json Server::not_switchable(const std::string& device) const {
  const auto spec = std::find_if(subject_.graph.devices.begin(), subject_.graph.devices.end(),
                                 [&](const graph::DeviceSpec& d) { return d.id == device; });
  std::vector<std::string> able;
  for (const TaskPlan& task : subject_.plan.tasks)
    if (task.source.faults != 0) able.push_back(task.name);
  if (spec == subject_.graph.devices.end())
    return refusal(fmt::format("there is no device {}{}", graph::ticked(device),
                               graph::alternatives(device, able, "devices with faults to switch")));
  return refusal(fmt::format("device {} (driver {}) has no faults to switch: only simulated devices and doubles have{}",
                             device, spec->driver, graph::alternatives("", able, "devices that have some")));
}

Json Server::faults(const std::string& device) const {
  Json devices = Json::array();
  for (size_t t = 0; t < subject_.plan.tasks.size(); ++t) {
    const TaskPlan& task = subject_.plan.tasks[t];
    if (task.source.faults == 0 || (!device.empty() && task.name != device)) continue;
    devices.push_back({{"device", task.name},
                       {"on", switched_on(subject_.board, subject_.plan, t)},
                       {"faults", names(task.source.faults)}});
  }
  if (devices.empty() && !device.empty()) return not_switchable(device);
  return {{"ok", true}, {"devices", devices}};
}

Json Server::switch_fault(const std::string& device, const std::string& fault, bool on, uint32_t by_user) {
  const auto& tasks = subject_.plan.tasks;
  const auto task = std::find_if(tasks.begin(), tasks.end(),
                                 [&](const TaskPlan& t) { return t.name == device && t.source.faults != 0; });
  if (task == tasks.end()) return not_switchable(device);
  const std::vector<std::string> known = names(task->source.faults);
  if (std::find(known.begin(), known.end(), fault) == known.end())
    return refusal(
        fmt::format("device {} has no fault {}{}", device, graph::ticked(fault), graph::alternatives(fault, known)));
  const auto index = static_cast<size_t>(task - tasks.begin());
  // Another one that is on stays on.
  if (!on && switched_on(subject_.board, subject_.plan, index) != fault) return {{"ok", true}};
  const std::string value(on ? std::string_view(fault) : to_text(Misbehaviour::none));
  return post_and_wait(index, fault_param(*task), value, by_user);
}

Json Server::give_answer(const std::string& device, const std::string& text, uint32_t by_user) {
  const auto& tasks = subject_.plan.tasks;
  const auto task =
      std::find_if(tasks.begin(), tasks.end(), [&](const TaskPlan& t) { return t.name == device && t.source.answers; });
  if (task == tasks.end()) {
    std::vector<std::string> able;
    for (const TaskPlan& t : tasks)
      if (t.source.answers) able.push_back(t.name);
    const auto spec = std::find_if(subject_.graph.devices.begin(), subject_.graph.devices.end(),
                                   [&](const graph::DeviceSpec& d) { return d.id == device; });
    if (spec == subject_.graph.devices.end())
      return refusal(fmt::format("there is no device {}{}", graph::ticked(device),
                                 graph::alternatives(device, able, "devices that take answers")));
    return refusal(fmt::format("device {} (kind {}, driver {}) takes no answers: only those with the driver web do{}",
                               device, spec->kind, spec->driver,
                               graph::alternatives("", able, "devices that take answers")));
  }
  constexpr size_t kMost = sizeof(ParamMail::words.characters) - 1;
  if (text.empty()) return refusal(fmt::format("an answer to device {} needs words", device));
  if (text.size() > kMost)
    return refusal(
        fmt::format("an answer has at most {} bytes; this one to device {} has {}", kMost, device, text.size()));
  if (std::any_of(text.begin(), text.end(), [](unsigned char c) { return c < ' ' || c == 0x7f; }))
    return refusal(fmt::format("an answer is one line of text; this one to device {} has control characters", device));
  return post_and_wait(static_cast<size_t>(task - tasks.begin()), param_called(*task, DeviceNode::kAnswer), text,
                       by_user);
}

}  // namespace takt::attach
