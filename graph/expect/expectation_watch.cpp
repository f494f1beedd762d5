// SPDX-License-Identifier: Apache-2.0
#include "graph/expect/expectation_watch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "graph/language/words.hpp"

namespace takt::graph {
namespace {

bool about_world(const ConditionSpec& spec) {
  return spec.of == ConditionSpec::Of::attribute || spec.of == ConditionSpec::Of::distance;
}

}  // namespace

std::vector<Problem> unknown_objects(const ExpectSpec& expect, const WorldTruth& world) {
  std::vector<Problem> problems;
  for (const ConditionSpec& spec : expect.conditions) {
    if (!about_world(spec)) continue;
    for (const std::string& object : {spec.object, spec.other}) {
      if (object.empty() || std::find(world.objects.begin(), world.objects.end(), object) != world.objects.end())
        continue;
      problems.push_back({spec.position, fmt::format("the simulated world has no object {}{}", ticked(object),
                                                     alternatives(object, world.objects, "its objects"))});
    }
  }
  return problems;
}

ExpectationWatch::ExpectationWatch(const ExpectSpec& expect, const Plan& plan, Transport& transport, WorldTruth world)
    : world_(std::move(world)) {
  for (const ConditionSpec& spec : expect.conditions) {
    conditions_.emplace_back(spec);
    if (!about_world(spec)) hear(conditions_.size() - 1, spec, false, plan, transport);
    for (const ConditionSpec& exception : spec.unless) hear(conditions_.size() - 1, exception, true, plan, transport);
  }
}

void ExpectationWatch::hear(size_t condition, const ConditionSpec& spec, bool excepts, const Plan& plan,
                            Transport& transport) {
  for (size_t p = 0; p < plan.ports.size(); ++p) {
    if (plan.ports[p].node != spec.port.node || plan.ports[p].port != spec.port.port) continue;
    const auto field = find_field(*plan.ports[p].type, spec.field);
    auto known = ports_.find(p);
    if (known == ports_.end()) known = ports_.emplace(p, Port{Follower(transport.make_reader(p)), {}}).first;
    known->second.heard.push_back(
        {condition, excepts, field.value_or(MessageField{})});  // none where messages are counted
  }
}

void ExpectationWatch::look(int64_t now_ns, int64_t epoch_ns) {
  look_at_messages(epoch_ns);
  if (now_ns >= std::max(epoch_ns, next_world_ns_)) look_at_world(now_ns, epoch_ns);
}

void ExpectationWatch::look_at_messages(int64_t epoch_ns) {
  for (auto& [index, port] : ports_)
    gone_ += port.follower.take([&](const Held& held) {
      for (const Heard& heard : port.heard) {
        ConditionWatch& condition = conditions_[heard.condition];
        if (heard.excepts) {
          condition.see_exception(value_of(heard.field, held.message()));
          continue;
        }
        const bool counted = condition.spec().of == ConditionSpec::Of::messages;
        condition.see(counted ? std::nullopt : value_of(heard.field, held.message()),
                      held.header->published_ns - epoch_ns);
      }
    });
}

void ExpectationWatch::look_at_world(int64_t now_ns, int64_t epoch_ns) {
  next_world_ns_ = now_ns + kWorldPeriod_ns;
  for (ConditionWatch& condition : conditions_)
    if (about_world(condition.spec())) condition.see(truth(condition.spec(), now_ns), now_ns - epoch_ns);
}

std::optional<FieldValue> ExpectationWatch::truth(const ConditionSpec& spec, int64_t now_ns) const {
  if (spec.of == ConditionSpec::Of::attribute) return world_.attribute(spec.object, spec.attribute, now_ns);
  const auto place = world_.position(spec.object, now_ns);
  const auto other = spec.other.empty() ? std::array{spec.x_m, spec.y_m} : world_.position(spec.other, now_ns);
  if (!place || !other) return std::nullopt;
  return std::hypot((*place)[0] - (*other)[0], (*place)[1] - (*other)[1]);
}

bool ExpectationWatch::decided(int64_t now_ns, int64_t epoch_ns) const {
  const auto any = [&](auto is) { return std::any_of(conditions_.begin(), conditions_.end(), is); };
  if (any([](const ConditionWatch& c) { return c.broken(); })) return true;
  return any([](const ConditionWatch& c) { return c.must_come_true(); }) &&
         !any([&](const ConditionWatch& c) { return !c.satisfied(now_ns - epoch_ns); });
}

std::vector<Finding> ExpectationWatch::findings() const {
  std::vector<Finding> findings;
  for (const ConditionWatch& condition : conditions_) findings.push_back(condition.finding());
  if (gone_ > 0)
    findings.push_back(
        {"messages followed", "all", fmt::format("{} were gone before they could be read", gone_), false});
  return findings;
}

}  // namespace takt::graph
