// SPDX-License-Identifier: Apache-2.0
#include "graph/flight/triggers.hpp"

#include <fmt/format.h>

#include <utility>

#include "graph/expect/condition_watch.hpp"

namespace takt::flight {
namespace {

double ms(int64_t ns) { return static_cast<double>(ns) / 1e6; }

}  // namespace

Triggers::Triggers(const graph::GraphSpec& graph, const Plan& plan) : plan_(plan) {
  for (const graph::ChainSpec& chain : graph.chains)
    for (size_t p = 0; p < plan.ports.size(); ++p)
      if (plan.ports[p].node == chain.to.node && plan.ports[p].port == chain.to.port)
        chains_[p].push_back({chain.name, chain.max_age_ns});
  for (const graph::ConditionSpec& spec : graph.record.freeze)
    for (size_t p = 0; p < plan.ports.size(); ++p) {
      if (plan.ports[p].node != spec.port.node || plan.ports[p].port != spec.port.port) continue;
      const graph::ConditionWatch watch(spec);
      Condition condition{spec, {}, watch.what() + " " + watch.test_text()};
      if (spec.of == graph::ConditionSpec::Of::field)
        condition.field = graph::find_field(*plan.ports[p].type, spec.field).value();  // read_expect.cpp looked
      conditions_[p].push_back(std::move(condition));
    }
}

std::optional<Cause> Triggers::of(const record::RecordedJob& job) const {
  if (!job.late || job.task >= plan_.tasks.size()) return std::nullopt;
  const TaskPlan& task = plan_.tasks[job.task];
  if (task.criticality != Criticality::high) return std::nullopt;
  return Cause{"miss", task.name,
               fmt::format("{} missed the deadline of job {} by {:.1f} ms", task.name, job.index,
                           ms(job.finish_ns - job.deadline_ns)),
               job.finish_ns, job.index};
}

std::optional<Cause> Triggers::look(Condition& condition, const Held& held) const {
  std::optional<graph::FieldValue> value = ++condition.messages;
  if (condition.field) value = graph::value_of(*condition.field, held.message());
  const bool passed = value && graph::ConditionWatch::passes(condition.spec, *value);
  if (std::exchange(condition.passed, passed) || !passed) return std::nullopt;
  const auto* const number = std::get_if<double>(&*value);
  return Cause{"condition", condition.spec.port.text(),
               fmt::format("{}: {}", condition.text,
                           number != nullptr ? fmt::format("{:g}", *number) : std::get<std::string>(*value)),
               held.header->published_ns};
}

std::optional<Cause> Triggers::of(size_t port, const Held& held) {
  if (const auto conditions = conditions_.find(port); conditions != conditions_.end())
    for (Condition& condition : conditions->second)
      if (auto cause = look(condition, held)) return cause;
  const auto chains = chains_.find(port);
  if (chains == chains_.end()) return std::nullopt;
  const int64_t age_ns = std::max(held.header->published_ns, held.visible_at_ns) - held.stamp_ns;
  for (const Chain& chain : chains->second)
    if (age_ns > chain.most_ns)
      return Cause{"age", chain.name,
                   fmt::format("chain {}: {}.{} was {:.1f} ms old, bound {:.1f} ms", chain.name, plan_.ports[port].node,
                               plan_.ports[port].port, ms(age_ns), ms(chain.most_ns)),
                   held.header->published_ns};
  return std::nullopt;
}

std::optional<Cause> Triggers::of(const record::RecordedEvent& event) const {
  if (const auto* change = std::get_if<record::ModeChange>(&event.what)) {
    const std::string name = change->mode < plan_.modes.size() ? plan_.modes[change->mode].name : "";
    return Cause{"mode", name, fmt::format("mode {}: {}", name, change->reason), event.at_ns};
  }
  if (const auto* mark = std::get_if<record::MarkSet>(&event.what))
    return Cause{"mark", mark->words, fmt::format("mark: {}", mark->words), event.at_ns};
  return std::nullopt;
}

Cause Triggers::of(const Outage& outage, const std::string& process) const {
  return {"outage", process, fmt::format("process {} {}", process, outage.cause.text()), outage.from_ns};
}

}  // namespace takt::flight
