// SPDX-License-Identifier: Apache-2.0
// What has happened in a run, in words: for programs that show it.
#include <fmt/format.h>

#include <algorithm>

#include "graph/attach/describe.hpp"
#include "graph/attach/parameters.hpp"

namespace takt::attach {
namespace {

using Json = nlohmann::ordered_json;

constexpr size_t kKeptSentences = 64;

}  // namespace

struct EventsSince::Event {
  int64_t at_ns;
  const char* kind;
  std::string node, text, level = {};
};

EventsSince::EventsSince(const Subject& subject) : subject_(subject) {
  for (size_t t = 0; t < subject.plan.tasks.size(); ++t) sets_.emplace_back(subject.board.param_count(t), 0);
  logs_.resize(subject.plan.tasks.size());
}

Json EventsSince::take() {
  std::vector<Event> all;
  take_faults(all);
  take_modes(all);
  take_marks(all);
  take_outages(all);
  take_parameters(all);
  take_frozen(all);
  take_logs(all);
  std::stable_sort(all.begin(), all.end(), [](const Event& a, const Event& b) { return a.at_ns < b.at_ns; });
  Json events = Json::array();
  const int64_t epoch_ns = subject_.board.epoch_ns().load();
  for (const Event& event : all) {
    events.push_back({{"at_s", static_cast<double>(event.at_ns - epoch_ns) / 1e9},
                      {"kind", event.kind},
                      {"node", event.node},
                      {"text", event.text}});
    if (!event.level.empty()) events.back()["level"] = event.level;
  }
  return events;
}

void EventsSince::take_faults(std::vector<Event>& all) {
  const FaultLog& faults = subject_.board.faults();
  for (; faults_ < faults.size(); ++faults_) {
    const Fault* fault = faults.at(faults_);
    if (fault == nullptr) return;  // it is being written
    if (fault->task >= subject_.plan.tasks.size()) continue;
    all.push_back({fault->at_ns, "fault", subject_.plan.tasks[fault->task].name, std::string(fault->what.text())});
  }
}

void EventsSince::take_modes(std::vector<Event>& all) {
  const Modes& modes = subject_.board.modes();
  for (; modes_ < modes.size(); ++modes_) {
    const ModeLog::Change* change = modes.change(modes_);
    if (change == nullptr) return;
    if (modes.repeats(modes_) || change->mode >= subject_.plan.modes.size()) continue;
    all.push_back({change->from_ns, "mode", "",
                   fmt::format("{}: {}", subject_.plan.modes[change->mode].name, modes.reason(modes_))});
  }
}

void EventsSince::take_marks(std::vector<Event>& all) {
  const MarkLog& marks = subject_.board.marks();
  for (; marks_ < marks.size(); ++marks_) {
    const Mark* mark = marks.at(marks_);
    if (mark == nullptr) return;
    all.push_back({mark->at_ns, "mark", "", std::string(mark->words.text())});
  }
}

void EventsSince::take_outages(std::vector<Event>& all) {
  int64_t newest_ns = outage_ns_;
  const auto tell = [&](int64_t at_ns, const std::string& text) {
    if (at_ns <= outage_ns_) return;
    all.push_back({at_ns, "outage", "", text});
    newest_ns = std::max(newest_ns, at_ns);
  };
  for (const Outage& outage : subject_.board.outages().in_order()) {
    const std::string name = outage.process < subject_.processes.size() ? subject_.processes[outage.process] : "?";
    tell(outage.from_ns, fmt::format("process {} {}", name, outage.cause.text()));
    if (outage.back_ns > 0)
      tell(outage.back_ns, fmt::format("process {} is back after {:.2f} s", name,
                                       static_cast<double>(outage.back_ns - outage.from_ns) / 1e9));
  }
  outage_ns_ = newest_ns;
}

void EventsSince::take_parameters(std::vector<Event>& all) {
  for (size_t t = 0; t < sets_.size(); ++t)
    for (size_t p = 0; p < sets_[t].size(); ++p) {
      const KeptParam& kept = subject_.board.kept(t, p);
      const uint32_t count = kept.count.load(std::memory_order_acquire);
      if (count == std::exchange(sets_[t][p], count)) continue;
      if (const KeptParam::Value* value = kept.newest())
        all.push_back({value->at_ns, "parameter", subject_.plan.tasks[t].name,
                       parameter_text(parameter_json(subject_.registry.nodes, subject_.graph, subject_.plan,
                                                     subject_.board, t, p))});
    }
}

void EventsSince::take_frozen(std::vector<Event>& all) {
  if (!subject_.frozen) return;
  for (const std::string& sentence : subject_.frozen()) {
    if (std::find(frozen_.begin(), frozen_.end(), sentence) != frozen_.end()) continue;
    all.push_back({MonotonicClock().now_ns(), "frozen", "", sentence});
    frozen_.push_back(sentence);
  }
  if (frozen_.size() > kKeptSentences)
    frozen_.erase(frozen_.begin(), frozen_.end() - static_cast<std::ptrdiff_t>(kKeptSentences));
}

void EventsSince::take_logs(std::vector<Event>& all) {
  for (size_t t = 0; t < logs_.size(); ++t)
    logs_[t].take(subject_.board.log(t), [&](const LogLine& line) {
      all.push_back({line.at_ns, "log", subject_.plan.tasks[t].name, with_dropped(line.text.text(), line.dropped),
                     std::string(to_string(line.level))});
    });
}

}  // namespace takt::attach
