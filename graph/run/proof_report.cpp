// SPDX-License-Identifier: Apache-2.0
#include "graph/run/proof_report.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <tuple>

#include "rt/node.hpp"
#include "rt/time/units.hpp"

namespace takt::command {
namespace {

using graph::Proven;
using Json = nlohmann::ordered_json;

constexpr double kShareAbove = 0.01;        // of a 99th percentile
constexpr double kUnlikely = 1e-3;          // a chance below it is no chance
constexpr int64_t kHangNs = 1'000'000'000;  // a job that hangs is told that late at most after its deadline

Json ms(const std::optional<int64_t>& ns) { return ns ? Json(to_ms(*ns)) : Json(nullptr); }

std::string edge_name(const Plan& plan, size_t task, size_t edge) {
  const TaskPlan& reader = plan.tasks[task];
  const PortPlan& port = plan.ports[reader.edges[edge].port];
  return port.node + "." + port.port + " -> " + reader.name + "." +
         std::string(reader.node->inputs()[reader.edges[edge].input]->name());
}

bool is_end(const graph::ChainSpec& chain, const PortPlan& port) {
  return chain.to.node == port.node && chain.to.port == port.port;
}

/// What is seen at an output is the age of one stamp, whichever of its chains that went along: the longest bound
/// counts.
Proven at_output(const graph::GraphSpec& graph, const PortPlan& port, const graph::Proofs& proofs, size_t mode) {
  Proven longest{std::nullopt, "no chain ends there"};
  for (const graph::ChainSpec& chain : graph.chains) {
    if (!is_end(chain, port)) continue;
    const Proven proven = proofs.chain(mode, chain.name);
    if (!proven.bound_ns) return proven;
    if (!longest.bound_ns || *proven.bound_ns > *longest.bound_ns) longest = proven;
  }
  return longest;
}

}  // namespace

std::string_view to_string(ExcessCause cause) {
  switch (cause) {
    case ExcessCause::quantile: return "quantile";
    case ExcessCause::host_stall: return "host_stall";
    case ExcessCause::restart: return "restart";
    case ExcessCause::budget_overrun: return "budget_overrun";
    case ExcessCause::mode_change: return "mode_change";
    case ExcessCause::double_late: return "double_late";
    case ExcessCause::no_message: return "no_message";
    case ExcessCause::unexplained: return "unexplained";
  }
  return "";
}

void tell_bounds(const graph::GraphSpec& graph, const Plan& plan, const graph::Proofs& proofs, RunBoard& board) {
  if (proofs.policy == Policy::cooperative) return;
  const auto tell = [](ProofBound& bound, const Proven& proven) {
    if (proven.bound_ns) bound.set(*proven.bound_ns);
  };
  for (size_t t = 0; t < plan.tasks.size(); ++t) {
    tell(board.task(t).response_bound, proofs.response(0, t));
    for (size_t e = 0; e < plan.tasks[t].edges.size(); ++e)
      tell(board.edge(t, e).age_bound, proofs.edge(0, edge_name(plan, t, e)));
  }
  for (size_t p = 0; p < plan.ports.size(); ++p)
    tell(board.port(p).age_bound, at_output(graph, plan.ports[p], proofs, 0));
}

ProofReport::ProofReport(const ProofFacts& facts) : facts_(facts), modes_{0} {
  const graph::Proofs& proofs = facts_.proofs;
  if (proofs.policy == Policy::cooperative) not_compared_ = "the policy cooperative promises no deadline";
  else if (proofs.modes.empty()) not_compared_ = proofs.why;
  else if (!facts_.virtual_time && facts_.result.policy_granted != proofs.policy)
    not_compared_ = "the policy " + std::string(takt::to_string(proofs.policy)) + " was not granted";
  for (size_t i = 0; i < facts_.board.modes().size(); ++i)
    if (const ModeLog::Change* change = facts_.board.modes().change(i);
        change != nullptr && change->mode < facts_.plan.modes.size() && change->from_ns < facts_.result.end_ns)
      modes_.push_back(change->mode);
  for (const TaskPlan& task : facts_.plan.tasks)
    lookback_ns_ = std::max({lookback_ns_, task.deadline_ns, task.rate ? task.rate->period_ns() : 0});
  if (!compared()) return;
  std::map<std::tuple<uint32_t, uint32_t, uint32_t>, std::vector<Excess>> by_figure;
  for (size_t i = 0; i < facts_.board.excesses().size(); ++i)
    if (const Excess* sample = facts_.board.excesses().at(i); sample != nullptr && names_a_figure(*sample))
      by_figure[{sample->figure, sample->index, sample->edge}].push_back(*sample);
  for (const auto& [figure, samples] : by_figure)
    for (const Row& row : rows_of(samples)) rows_.push_back(row);
  std::stable_sort(rows_.begin(), rows_.end(), [](const Row& a, const Row& b) { return a.cause > b.cause; });
}

/// Any process may have written into the log by mistake.
bool ProofReport::names_a_figure(const Excess& sample) const {
  if (sample.figure == Excess::output_age) return sample.index < facts_.plan.ports.size();
  if (sample.index >= facts_.plan.tasks.size()) return false;
  return sample.figure == Excess::response ||
         (sample.figure == Excess::input_age && sample.edge < facts_.plan.tasks[sample.index].edges.size());
}

Proven ProofReport::largest(const std::function<Proven(size_t)>& of_mode) const {
  Proven result = of_mode(0);
  for (const size_t mode : modes_) {
    const Proven other = of_mode(mode);
    if (result.bound_ns && other.bound_ns && *other.bound_ns > *result.bound_ns) result = other;
  }
  return result;
}

Proven ProofReport::bound_of(const Excess& sample) const {
  const graph::Proofs& proofs = facts_.proofs;
  switch (sample.figure) {
    case Excess::response: return largest([&](size_t mode) { return proofs.response(mode, sample.index); });
    case Excess::input_age: {
      const std::string name = edge_name(facts_.plan, sample.index, sample.edge);
      return largest([&](size_t mode) { return proofs.edge(mode, name); });
    }
    case Excess::output_age:
      return largest(
          [&](size_t mode) { return at_output(facts_.graph, facts_.plan.ports[sample.index], proofs, mode); });
  }
  return {};
}

Json ProofReport::beside_max(const Proven& proven) const {
  if (compared() && proven.bound_ns) return {{"proven_ms", ms(proven.bound_ns)}};
  Json json{{"proven_ms", nullptr}, {"not_proven", compared() ? proven.why : not_compared_}};
  if (facts_.proofs.policy == Policy::cooperative) json["estimated_ms"] = ms(proven.bound_ns);
  return json;
}

Json ProofReport::of_response(size_t task) const {
  return beside_max(largest([&](size_t mode) { return facts_.proofs.response(mode, task); }));
}

Json ProofReport::of_edge(size_t task, size_t edge) const {
  const std::string name = edge_name(facts_.plan, task, edge);
  return beside_max(largest([&](size_t mode) { return facts_.proofs.edge(mode, name); }));
}

Json ProofReport::of_chain(const std::string& name) const {
  return beside_max(largest([&](size_t mode) { return facts_.proofs.chain(mode, name); }));
}

/// One figure's samples by their causes. Those that were only counted belong to the worst of these causes.
std::vector<ProofReport::Row> ProofReport::rows_of(const std::vector<Excess>& samples) const {
  const Proven proven = bound_of(samples.front());
  if (!proven.bound_ns) return {};
  std::map<ExcessCause, Row> rows;
  for (const Excess& sample : samples) {
    if (sample.observed_ns <= *proven.bound_ns) continue;  // within the bound of another mode
    const ExcessCause cause = cause_of(sample, *proven.bound_ns);
    Row& row = rows[cause];
    row.cause = cause;
    row.bound_ns = *proven.bound_ns;
    ++row.samples;
    row.of = kept_of(sample).samples.count();
    if (sample.observed_ns > row.largest.observed_ns) row.largest = sample;
    const int64_t stall_ns = away_ns(facts_.stalls.stalls(), begin_ns(sample), sample.at_ns);
    row.stall_ns = std::max(row.stall_ns, stall_ns);
    row.without_stalls_ns = std::max(row.without_stalls_ns, sample.observed_ns - stall_ns);
  }
  std::vector<Row> result;
  for (auto& [cause, row] : rows) result.push_back(row);
  if (result.empty()) return result;
  Row& worst = result.back();  // in the order of the causes
  worst.samples += kept_of(samples.front()).bound.above() - samples.size();
  if (worst.cause == ExcessCause::unexplained && facts_.proofs.basis != graph::OverheadBasis::worst) {
    worst.chance = graph::chance_of(worst.samples, worst.of, kShareAbove);
    if (worst.chance >= kUnlikely) worst.cause = ExcessCause::quantile;
  }
  return result;
}

ExcessCause ProofReport::cause_of(const Excess& sample, int64_t bound_ns) const {
  const int64_t from_ns = begin_ns(sample), to_ns = sample.at_ns;
  const bool is_age = sample.figure != Excess::response;
  if (away_ns(facts_.stalls.stalls(), from_ns, to_ns) > facts_.proofs.stall_ns) return ExcessCause::host_stall;
  // They went on, and found no place in the log.
  if (facts_.stalls.lost() > 0 && to_ns >= facts_.stalls.stalls().back().to_ns) return ExcessCause::host_stall;
  if (restarted(from_ns, to_ns)) return ExcessCause::restart;
  if (overran(from_ns, to_ns)) return ExcessCause::budget_overrun;
  if (is_age && changed_mode(from_ns, to_ns)) return ExcessCause::mode_change;
  if (is_age && double_late(sample, bound_ns)) return ExcessCause::double_late;
  if (is_age && message_missing(sample)) return ExcessCause::no_message;
  return ExcessCause::unexplained;
}

bool ProofReport::overran(int64_t from_ns, int64_t to_ns) const {
  const OverrunLog& log = facts_.board.overruns();
  int64_t last_ns = INT64_MAX;
  for (size_t i = 0; i < log.size(); ++i) {
    const Overrun* job = log.at(i);
    if (job == nullptr) continue;
    if (job->release_ns <= to_ns && job->finish_ns >= from_ns) return true;
    last_ns = job->finish_ns;
  }
  if (log.lost() > 0 && to_ns >= last_ns) return true;  // they went on, and found no place in the log
  for (size_t i = 0; i < facts_.board.faults().size(); ++i)
    if (const Fault* fault = facts_.board.faults().at(i);
        fault != nullptr && fault->kind == Fault::hang && fault->at_ns - kHangNs <= to_ns)
      return true;
  return false;
}

bool ProofReport::restarted(int64_t from_ns, int64_t to_ns) const {
  const auto outages = facts_.board.outages().in_order();
  return std::any_of(outages.begin(), outages.end(), [&](const Outage& outage) {
    return outage.from_ns <= to_ns && (outage.back_ns == 0 || outage.back_ns >= from_ns);
  });
}

bool ProofReport::changed_mode(int64_t from_ns, int64_t to_ns) const {
  for (size_t i = 0; i < facts_.board.modes().size(); ++i)
    if (const ModeLog::Change* change = facts_.board.modes().change(i);
        change != nullptr && change->from_ns >= from_ns && change->from_ns <= to_ns)
      return true;
  return false;
}

/// A real device needs no processor of this machine. Only as much as its double was late is excused.
bool ProofReport::double_late(const Excess& sample, int64_t bound_ns) const {
  const LateSourceLog& log = facts_.board.late_sources();
  for (size_t i = 0; i < log.size(); ++i) {
    const LateSource* late = log.at(i);
    if (late != nullptr && late->late_ns >= sample.observed_ns - bound_ns && late->at_ns >= begin_ns(sample) &&
        late->at_ns <= sample.at_ns)
      return true;
  }
  return log.lost() > 0 && log.size() > 0 && log.at(log.size() - 1) != nullptr &&
         sample.at_ns >= log.at(log.size() - 1)->at_ns;
}

/// Whether some job that the age depends on published nothing: upstream of the place, up to devices.
bool ProofReport::message_missing(const Excess& sample) const {
  const Plan& plan = facts_.plan;
  const PortProducers producers(plan);
  std::vector<char> seen(plan.tasks.size(), 0);
  std::vector<size_t> todo;
  const auto look_behind = [&](size_t port) {
    const size_t producer = producers.find(port);
    if (producer == kNone) return false;
    if (silent(producer, port)) return true;
    if (!seen[producer] && !plan.tasks[producer].device) todo.push_back(producer);
    seen[producer] = 1;
    return false;
  };
  if (sample.figure == Excess::input_age) {
    if (look_behind(plan.tasks[sample.index].edges[sample.edge].port)) return true;
  } else if (const size_t producer = producers.find(sample.index); producer != kNone) {
    todo.push_back(producer);
  }
  while (!todo.empty()) {
    const TaskPlan& task = plan.tasks[todo.back()];
    todo.pop_back();
    for (const EdgePlan& edge : task.edges)
      if (task.node->inputs()[edge.input] != task.node->control() && look_behind(edge.port)) return true;
  }
  return false;
}

bool ProofReport::silent(size_t task, size_t port) const {
  const TaskStatistics& s = facts_.board.task(task);
  // One job may be under way at the end.
  return facts_.board.port(port).published.load() + 1 < facts_.result.released[task] || s.paused.load() > 0 ||
         s.reused.load() > 0;
}

ProofReport::Kept ProofReport::kept_of(const Excess& sample) const {
  switch (sample.figure) {
    case Excess::response: {
      const TaskStatistics& task = facts_.board.task(sample.index);
      return {task.response_bound, task.response};
    }
    case Excess::input_age: {
      const EdgeStatistics& edge = facts_.board.edge(sample.index, sample.edge);
      return {edge.age_bound, edge.age};
    }
    case Excess::output_age: break;
  }
  const PortStatistics& port = facts_.board.port(sample.index);
  return {port.age_bound, port.age};
}

std::string ProofReport::name_of(const Excess& sample) const {
  switch (sample.figure) {
    case Excess::response: return "response of " + facts_.plan.tasks[sample.index].name;
    case Excess::input_age: return "age at " + edge_name(facts_.plan, sample.index, sample.edge);
    case Excess::output_age: break;
  }
  std::string names;
  for (const graph::ChainSpec& chain : facts_.graph.chains)
    if (is_end(chain, facts_.plan.ports[sample.index])) names += (names.empty() ? "" : ", ") + chain.name;
  return "age of chain " + names;
}

uint64_t ProofReport::figures() const {
  uint64_t count = 0;
  const auto add = [&](Excess::Figure figure, size_t index, size_t edge) {
    const Excess sample{figure, static_cast<uint32_t>(index), static_cast<uint32_t>(edge), 0, 0};
    count += bound_of(sample).bound_ns && kept_of(sample).samples.count() > 0;
  };
  for (size_t t = 0; t < facts_.plan.tasks.size(); ++t) {
    add(Excess::response, t, 0);
    for (size_t e = 0; e < facts_.plan.tasks[t].edges.size(); ++e) add(Excess::input_age, t, e);
  }
  for (size_t p = 0; p < facts_.plan.ports.size(); ++p) add(Excess::output_age, p, 0);
  return count;
}

bool ProofReport::unexplained() const { return !rows_.empty() && rows_.front().cause == ExcessCause::unexplained; }

Json ProofReport::json() const {
  const graph::Proofs& proofs = facts_.proofs;
  const bool broken =
      std::any_of(rows_.begin(), rows_.end(), [](const Row& r) { return r.cause != ExcessCause::quantile; });
  Json json;
  json["verdict"] = !compared() ? "none" : unexplained() ? "unexplained" : broken ? "assumption_broken" : "held";
  if (!compared()) json["why"] = not_compared_;
  json["assumptions"] = {{"policy", takt::to_string(proofs.policy)},
                         {"overheads", graph::to_string(proofs.basis)},
                         {"overheads_from", proofs.overheads_from},
                         {"stall_ms", to_ms(proofs.stall_ns)},
                         {"budgets", "kept"},
                         {"messages", "one of every job"},
                         {"doubles", "on time"},
                         {"other_programs", "no real-time threads"}};
  int64_t longest_ns = 0;
  for (const Stall& stall : facts_.stalls.stalls()) longest_ns = std::max(longest_ns, stall.away_ns);
  json["stalls"] = {{"count", facts_.stalls.stalls().size() + facts_.stalls.lost()},
                    {"longest_ms", to_ms(longest_ns)},
                    {"lost", facts_.stalls.lost()}};
  json["compared"] = compared() ? figures() : 0;
  json["above_proof"] = Json::array();
  for (const Row& row : rows_) {
    Json entry{{"what", name_of(row.largest)},
               {"proven_ms", to_ms(row.bound_ns)},
               {"observed_ms", to_ms(row.largest.observed_ns)},
               {"samples_above", row.samples},
               {"of", row.of},
               {"cause", to_string(row.cause)},
               {"stall_ms", to_ms(row.stall_ns)},
               {"without_stalls_ms", to_ms(row.without_stalls_ns)},
               {"at_s", static_cast<double>(row.largest.at_ns - facts_.result.epoch_ns) / 1e9}};
    if (row.chance > 0) entry["chance"] = row.chance;
    json["above_proof"].push_back(std::move(entry));
  }
  json["not_kept"] = facts_.board.excesses().lost();
  return json;
}

}  // namespace takt::command
