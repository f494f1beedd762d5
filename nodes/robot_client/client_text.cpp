// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <iterator>

#include "nodes/robot_client/client.hpp"

namespace takt::robot_client {

void Client::write_status(std::string& into) const {
  into.clear();
  const auto out = std::back_inserter(into);
  into += to_string(mode_.state);
  if (halted_) into += " | halted";
  if (task_) fmt::format_to(out, " | {}", task_text_);
  if (task_ && task_->verb == Verb::goal && executing())
    fmt::format_to(out, " | step {} of {}", std::min(step_ + 1, records_.size() - first_record_),
                   records_.size() - first_record_);
  if (task_ && task_->verb == Verb::goal) fmt::format_to(out, " | plan {} of {}", plans_, parameters_.plans);
  if (mode_.state == State::drive) {
    if (deed_.action != kNoNode) knowledge_.append(deed_, into.append(" | to "));
    fmt::format_to(out, " | {:.1f} m left", driving_.left_m(robot_));
  }
  if (mode_.state == State::action) {
    knowledge_.append(command_.deed, into.append(" | "));
    fmt::format_to(out, ", number {}", command_.number);
  }
}

void Client::write_plan(std::string& into) const {
  into.clear();
  const auto out = std::back_inserter(into);
  if (records_.empty()) {
    into += task_ ? "no plan yet" : "no plan";
    return;
  }
  const auto taken = [&](double s) {
    if (s >= 0) fmt::format_to(out, " (took {:.1f})", s);
  };
  for (size_t i = 0; i < records_.size(); ++i) {
    const StepRecord& r = records_[i];
    fmt::format_to(out, "{}. {}: drive {:.1f} s", i + 1, knowledge_.to_text(r.deed), r.drive_s);
    taken(r.drive_took_s);
    fmt::format_to(out, ", act {:.1f} s", r.action_s);
    taken(r.action_took_s);
    into += executing() && i == first_record_ + step_ ? "  <- now\n" : "\n";
  }
  costs_.each([&](NodeId action, double mean_s, uint32_t times) {
    fmt::format_to(out, "{} is taken to last {:.1f} s, declared {:.1f} s, done {} times\n", knowledge_.name(action),
                   mean_s, knowledge_.map().action(action).cost_s, times);
  });
  if (!executing()) return;
  const planner::Plan& plan = deliberation_.plan();
  fmt::format_to(out, "{:.1f} s in all{}", static_cast<double>(plan.cost_ns) * 1e-9,
                 plan.verdict == planner::Verdict::best ? "; no plan takes less" : "");
}

}  // namespace takt::robot_client
