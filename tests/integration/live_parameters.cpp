// SPDX-License-Identifier: Apache-2.0
// Walks all live parameters of all nodes of some records: a node that is given a value while it runs, before its first
// job, makes what a node makes that is set up with that value.
//
//   takt_live_parameters RECORD...      exit 1 if one does not, or if a parameter of a node type was not tried
//
// Each node is made anew for each value and runs its jobs of the record. A value that changes nothing of what it makes
// shows nothing; so several are tried, and what none of them changed is listed.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "graph/ace/ace_registry.hpp"
#include "graph/language/param_text.hpp"
#include "graph/rewind/recorded_run.hpp"
#include "rt/memory/memory_use.hpp"
#include "rt/record/packed_message.hpp"
#include "rt/sched/param_mail.hpp"

using namespace takt;

namespace {

constexpr uint64_t kJobs = 10;  ///< of a node, at most
constexpr size_t kValues = 3;   ///< that are tried with one node

/// Values of texts, which have no range, and of what takes as much memory as it says; by "type.parameter".
const std::map<std::string, std::vector<ParamValue>> kGiven{
    {"load.allocate", {int64_t{2}}},
    {"load.flood", {false}},  // a replay of a record without one would never refuse it
    {"robot_client.task", {std::string("2 explore"), std::string("3 rotate 1")}},
    {"object_detection.revision", {std::string("none_of_that_name")}},
    {"semantic.script", {std::string("0s stop stereo")}},
    {"semantic.idle", {std::string("stereo")}},
    {"semantic.on_request", {std::string("stereo")}},
    {"semantic.request", {std::string("body_pose object_detection traffic_signs")}},
    {"semantic.rules", {std::string("stereo when crossing else stop")}},
    {"mission.pedestrian", {std::string("nobody")}},
    {"laser_fusion.locked", {std::string("z,pitch,roll")}},
    {"picture.directory", {std::string("elsewhere")}},
    {"moments.directory", {std::string("elsewhere")}},
};

/// What is found out about one parameter of one type.
struct Finding {
  bool accepted = false, mattered = false;
  std::string refused;
};

struct Tally {
  std::map<std::string, Finding> params;  ///< live ones, by "type.parameter"
  std::map<std::string, std::string> fixed;
  size_t wrong = 0;

  void tell(const std::string& what) {
    ++wrong;
    fmt::print("WRONG: {}\n", what);
  }
};

double in_range(double value, double low, double high) { return std::min(high, std::max(low, value)); }

/// Values other than the present one, the likeliest to change something first.
std::vector<ParamValue> values_for(const ParamBase& param, const std::string& name) {
  std::vector<ParamValue> values;
  const std::string range = param.range_text(), kind = param.kind();
  if (const auto given = kGiven.find(name); given != kGiven.end()) return given->second;
  if (kind == "text") return values;
  if (kind == "flag") {
    values.emplace_back(param.value_text() != "true");
  } else if (kind == "choice") {
    for (size_t from = 0, to = 0; from <= range.size(); from = to + 3) {
      to = std::min(range.find(" | ", from), range.size());
      if (const std::string word = range.substr(from, to - from); word != param.value_text()) values.emplace_back(word);
    }
  } else {
    const double now = std::stod(param.value_text());
    const size_t dots = range.find("..");
    const double low = range.empty() ? now - 1 : std::stod(range),
                 high = range.empty() ? now + 1 : std::stod(range.substr(dots + 2));
    std::set<double> tried{now};
    for (const double value : {in_range(now * 0.5, low, high), in_range(now * 2, low, high), low, high,
                               low + (high - low) / 2, in_range(now - 2, low, high), in_range(now + 2, low, high)}) {
      const double exact = kind == "integer" ? std::round(value) : value;
      if (!tried.insert(exact).second) continue;
      if (kind == "integer") values.emplace_back(static_cast<int64_t>(exact));
      else values.emplace_back(exact);
    }
  }
  return values;
}

class Walk {
 public:
  Walk(const std::string& log, const Registry& registry, Tally& tally)
      : registry_(registry), options_(options_for(log)), run_(options_), tally_(tally) {
    seed_ = run_.open().seed;
    if (run_.compose(registry) != 0) throw std::runtime_error(log + " cannot be composed");
    plan_ = run_.plan();
  }

  void all() {
    for (size_t t = 0; t < plan_.tasks.size(); ++t)
      if (!plan_.tasks[t].device) node(t);
  }

 private:
  static constexpr const char *kRefused = "refused: ", *kIdle = "no job";

  static rewind::ReplayOptions options_for(const std::string& log) {
    rewind::ReplayOptions options;
    options.log = log;
    return options;
  }

  void node(size_t t) {
    const graph::NodeSpec& spec = spec_of(t);
    fmt::print("{} (type {})\n", spec.id, spec.type);
    const auto plain = made(t, nullptr, {});
    if (!plain && plain.error() == kIdle) return;  // another record has jobs of its type, or report() tells
    if (!plain) return tally_.tell(spec.type + ": " + plain.error());
    for (size_t p = 0; p < plan_.tasks[t].node->params().size(); ++p) {
      const ParamBase& param = *plan_.tasks[t].node->params()[p];
      const std::string name = spec.type + "." + std::string(param.name());
      if (!param.live()) {
        tally_.fixed[name] = param.fixed();
        if (param.fixed().empty()) tally_.tell(name + " is not live, and does not say why");
        continue;
      }
      Finding& finding = tally_.params[name];
      std::vector<ParamValue> values = values_for(param, name);
      values.resize(std::min(values.size(), kValues));
      for (const ParamValue& value : values)
        if (!finding.mattered) one(t, p, name, value, *plain, finding);
    }
  }

  void one(size_t t, size_t p, const std::string& name, const ParamValue& value, uint64_t plain, Finding& finding) {
    const auto from_start = made(t, &p, value), while_running = made(t, nullptr, value, p);
    const std::string text = std::visit([](const auto& v) { return fmt::format("{}", v); }, value);
    if (!while_running) {
      finding.refused = text + " " + while_running.error();
      // What takes memory may be refused in a run alone.
      return;
    }
    if (!from_start)
      return tally_.tell(fmt::format("{} = {} is taken in a run, but {}", name, text, from_start.error()));
    finding.accepted = true;
    finding.mattered = finding.mattered || *from_start != plain;
    if (*from_start != *while_running)
      tally_.tell(fmt::format("{} = {}: what was set in a run makes something else than from the start", name, text));
  }

  /// Hash of all that the node makes of its jobs. `at_start`: its parameter with that value from the start; `in_run`:
  /// set before its first job.
  tl::expected<uint64_t, std::string> made(size_t t, const size_t* at_start, const ParamValue& value,
                                           std::optional<size_t> in_run = {}) {
    graph::GraphSpec graph = run_.graph();
    if (at_start != nullptr) {
      const ParamBase& param = *plan_.tasks[t].node->params()[*at_start];
      for (graph::NodeSpec& spec : graph.nodes)
        if (spec.id == plan_.tasks[t].name) spec.params[std::string(param.name())] = {value, {}, {}};
    }
    const VirtualClock clock;
    std::unique_ptr<Node> node;
    try {
      node = graph::make_again(graph, registry_, clock, {.output = "out", .seed = seed_}, plan_, t);
    } catch (const SetupError& refused) {
      return tl::unexpected(kRefused + std::string(refused.what()));
    }
    node->start(run_.epoch_ns());
    if (in_run) {
      ParamMail mail;
      if (!post(mail, *in_run, value)) return tl::unexpected(std::string(kRefused) + "too long");
      const bool text = node->params()[*in_run]->kind() == "text" || node->params()[*in_run]->kind() == "choice";
      const MemoryUse before = thread_memory_use();
      const bool taken = deliver(mail, *node);
      const uint64_t allocations = (thread_memory_use() - before).allocations;
      if (!taken) return tl::unexpected(kRefused + std::string(mail.refusal.text()));
      if (!text && allocations > 0)
        tally_.tell(fmt::format("{}.{} allocates {} times when it is set", spec_of(t).type,
                                node->params()[*in_run]->name(), allocations));
    }
    const auto hash = replayed(t, *node);
    return hash ? tl::expected<uint64_t, std::string>(*hash) : tl::unexpected(std::string(kIdle));
  }

  /// None: the record has no job of it.
  std::optional<uint64_t> replayed(size_t t, Node& node) {
    Plan plan = plan_;
    plan.tasks[t].node = &node;
    uint64_t hash = 14695981039346656037ull, jobs = 0;
    const auto take = [&](std::span<const std::byte> bytes) {
      for (const std::byte b : bytes) hash = (hash ^ static_cast<uint64_t>(b)) * 1099511628211ull;
    };
    std::vector<std::byte> packed;
    record::Replayer::Options how;
    how.run.assign(plan.tasks.size(), 0);
    how.run[t] = 1;
    how.epoch_ns = run_.epoch_ns();
    how.visit = [&](const record::Replayer& replayer, const record::RecordedJob& job) {
      if (job.task != t) return true;
      for (size_t i = 0; i < plan.tasks[t].ports.size(); ++i) {
        const size_t port = plan.tasks[t].ports[i];
        if (node.outputs()[i] == node.state()) continue;
        const MessageHeader* const message = replayer.newest(port);
        if (message == nullptr) continue;
        packed.clear();
        record::pack(*plan.ports[port].type, message + 1, packed);
        take(packed);
      }
      return ++jobs < kJobs;
    };
    record::Replayer replayer(plan, run_.log(), how);
    replayer.run();
    if (jobs == 0) return std::nullopt;
    return hash;
  }

  const graph::NodeSpec& spec_of(size_t t) const {
    for (const graph::NodeSpec& spec : run_.graph().nodes)
      if (spec.id == plan_.tasks[t].name) return spec;
    throw std::logic_error(plan_.tasks[t].name + " is no node of the graph");
  }

  const Registry& registry_;
  const rewind::ReplayOptions options_;
  rewind::RecordedRun run_;
  uint64_t seed_ = 0;
  Plan plan_;
  Tally& tally_;
};

int report(const Registry& registry, Tally& tally) {
  size_t all = 0, mattered = 0;
  for (const auto& [type, info] : registry.nodes.all()) {
    const auto node = info.make();
    for (const ParamBase* param : node->params()) {
      const std::string name = type + "." + std::string(param->name());
      ++all;
      const auto found = tally.params.find(name);
      if (found == tally.params.end()) {
        if (!tally.fixed.contains(name)) tally.tell(name + " was not tried: no record has a node of its type");
        continue;
      }
      if (!found->second.accepted)
        tally.tell(fmt::format("{} takes no value in a run: {}", name, found->second.refused));
      if (found->second.mattered) ++mattered;
      else fmt::print("no value of {} changed what the records' jobs make\n", name);
    }
  }
  fmt::print("{} of {} parameters are live, values of {} changed what was made\n", tally.params.size(), all, mattered);
  if (mattered * 10 < tally.params.size() * 3) tally.tell("that is too few");
  return tally.wrong == 0 ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  try {
    Registry registry = ace_registry();
    Tally tally;
    for (int i = 1; i < argc; ++i) Walk(argv[i], registry, tally).all();
    return report(registry, tally);
  } catch (const rewind::Refused& refused) {
    std::fprintf(stderr, "%s\n", refused.why.c_str());
  } catch (const std::exception& problem) {
    std::fprintf(stderr, "%s\n", problem.what());
  }
  return 2;
}
