// SPDX-License-Identifier: Apache-2.0
#include "graph/rewind/seen_condition.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "graph/expect/condition_watch.hpp"

namespace takt::rewind {

SeenCondition::SeenCondition(const graph::ConditionSpec& spec, const RecordedRun& run) : spec_(spec) {
  const graph::ConditionWatch watch(spec);
  text_ = watch.what() + " " + watch.test_text();
  if (spec.of != graph::ConditionSpec::Of::field)
    throw Refused{text_ + ": a replay looks at single messages; name a `field` of " + spec.port.text()};
  const Plan& plan = run.plan();
  for (size_t t = 0; t < plan.tasks.size(); ++t)
    for (size_t i = 0; i < plan.tasks[t].ports.size(); ++i)
      if (const PortPlan& port = plan.ports[plan.tasks[t].ports[i]];
          port.node == spec.port.node && port.port == spec.port.port)
        task_ = t, output_ = static_cast<uint16_t>(i), port_ = plan.tasks[t].ports[i];
  if (plan.tasks[task_].device)
    throw Refused{
        fmt::format("{} is a device, which a replay does not run; its messages are in the record: takt log "
                    "echo RECORD {}",
                    spec.port.node, spec.port.text())};
  field_ = graph::find_field(*plan.ports[port_].type, spec.field).value();  // the graph's loader has looked
}

std::optional<SeenCondition::Seen> SeenCondition::behind(const record::Replayer& replayer,
                                                         const record::RecordedJob& job) const {
  const auto sent = std::find_if(job.outputs.begin(), job.outputs.end(),
                                 [this](const auto& output) { return output.output == output_ && !output.repeated; });
  const MessageHeader* const message = replayer.newest(port_);
  if (job.task != task_ || sent == job.outputs.end() || message == nullptr || message->sequence != sent->sequence)
    return std::nullopt;
  const auto value = graph::value_of(field_, message + 1);
  if (!value) return std::nullopt;
  const auto* const number = std::get_if<double>(&*value);
  return Seen{graph::ConditionWatch::passes(spec_, *value),
              number != nullptr ? fmt::format("{:g}", *number) : std::get<std::string>(*value)};
}

}  // namespace takt::rewind
