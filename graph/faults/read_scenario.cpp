// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "graph/faults/scenario.hpp"
#include "graph/language/document.hpp"
#include "graph/language/figure_reader.hpp"
#include "graph/language/quantity.hpp"
#include "graph/language/schema.hpp"
#include "graph/language/words.hpp"

namespace takt::graph {
namespace {

using nlohmann::json;

constexpr int64_t kMostStrikes = 10'000;      ///< of one fault
constexpr int64_t kRestart_ns = 300'000'000;  ///< of a killed process in virtual time, where `for` does not say any

std::vector<std::string> words(const std::vector<std::string_view>& keys) { return {keys.begin(), keys.end()}; }

/// Reads one file; each stage appends to the problems and goes on with what is sound.
class ScenarioReader {
 public:
  ScenarioReader(const GraphSpec& graph, const Plan& plan, const RunKind& run)
      : graph_(graph), plan_(plan), run_(run) {}

  LoadedScenario read(const std::filesystem::path& file) {
    scenario_.file = file.string();
    document_ = read_document(file, {"--faults", 0, 0}, problems_);
    if (!document_.root.is_null()) validate(document_, Schema::faults, problems_);
    if (document_.root.is_object()) read_root(document_.root);
    const auto key = [](const Problem& p) { return std::tuple(p.position.line, p.position.column, p.text); };
    std::sort(problems_.begin(), problems_.end(), [&](const auto& a, const auto& b) { return key(a) < key(b); });
    LoadedScenario loaded;
    if (problems_.empty()) loaded.scenario = std::move(scenario_);
    loaded.problems = std::move(problems_);
    return loaded;
  }

 private:
  // What is missing, of another type or out of range was reported by the schema, and is passed over here.
  void read_root(const json& root) {
    if (root.contains("name") && root["name"].is_string()) scenario_.name = root["name"].get<std::string>();
    if (root.contains("seed") && root["seed"].is_number_integer() && root["seed"] >= 0)
      scenario_.seed = root["seed"].get<uint64_t>();
    const json list = root.value("faults", json::array());
    if (list.is_array())
      for (size_t i = 0; i < list.size(); ++i)
        if (list[i].is_object()) read_fault(list[i], child("/faults", i));
    const json expect = root.value("expect", json::object());
    if (expect.is_object()) read_expectations(expect);
  }

  void read_fault(const json& value, const std::string& pointer) {
    if (!value.contains("kind") || !value["kind"].is_string()) return;
    const FaultKindInfo* kind = find_fault_kind(value["kind"].get<std::string>());
    if (kind == nullptr) return;
    FaultSpec fault;
    fault.kind = kind->kind;
    fault.position = document_.value_at(child(pointer, "kind"));
    check_keys(*kind, value, pointer);
    check_run(*kind, fault.position);
    if (value.contains("target") && value["target"].is_string()) fault.target = value["target"].get<std::string>();
    check_target(*kind, fault, document_.value_at(child(pointer, "target")));
    read_times(fault, value, pointer);
    read_amounts(fault, value);
    if (fault.kind == FaultKind::kill_at_step) read_step(fault, value, pointer);
    scenario_.faults.push_back(std::move(fault));
  }

  void check_keys(const FaultKindInfo& kind, const json& value, const std::string& pointer) {
    std::vector<std::string> valid = words(kind.required);
    for (const auto key : kind.optional) valid.emplace_back(key);
    if (kind.target != FaultTarget::none) valid.emplace_back("target");
    static const json schema = json::parse(schema_text(Schema::faults))["definitions"]["fault"]["properties"];
    for (const auto& [key, ignored] : value.items())
      if (key != "kind" && schema.contains(key) && std::find(valid.begin(), valid.end(), key) == valid.end())
        problem(document_.key_at(child(pointer, key)),
                fmt::format("{} takes no {}{}", ticked(kind.name), ticked(key), alternatives(key, valid)));
    std::vector<std::string> required = words(kind.required);
    if (kind.target != FaultTarget::none) required.emplace_back("target");
    for (const auto& key : required)
      if (!value.contains(key) && !document_.broken.contains(child(pointer, key)))
        problem(document_.value_at(pointer), fmt::format("{} lacks {}", ticked(kind.name), ticked(key)));
  }

  void check_run(const FaultKindInfo& kind, const Position& at) {
    if (run_.virtual_time && !kind.in_virtual_time)
      problem(at, fmt::format("{} exists in real time only: the machine has no part in virtual time; run with --clock "
                              "real",
                              ticked(kind.name)));
    if (!run_.virtual_time && !run_.processes && !kind.in_one_process)
      problem(at, fmt::format("{} needs a process to strike; run with --isolate subsystem{}", ticked(kind.name),
                              kind.in_virtual_time ? ", or with --clock virtual" : ""));
    if (run_.iceoryx && kind.kind == FaultKind::exhausted_pool)
      problem(at, fmt::format("{} cannot strike over iceoryx, which lets no reader hold more than its share of a pool; "
                              "run with --transport local",
                              ticked(kind.name)));
    if (kind.needs_record && !run_.records)
      problem(at, fmt::format("{} strikes the record of the run; run with --record FILE", ticked(kind.name)));
  }

  void check_target(const FaultKindInfo& kind, const FaultSpec& fault, const Position& at) {
    if (kind.target == FaultTarget::none || fault.target.empty()) return;
    std::vector<std::string> valid;
    const char* what = "";
    switch (kind.target) {
      case FaultTarget::output: valid = outputs(), what = "an output"; break;
      case FaultTarget::node: valid = nodes(false), what = "a node or device"; break;
      case FaultTarget::device: valid = nodes(true), what = "a device"; break;
      default:
        valid = processes_of(graph_), what = "a subsystem, node or device";
        if (!process_of(graph_, fault.target).empty()) return;
        if (fault.kind == FaultKind::kill) valid.emplace_back("any");
    }
    if (std::find(valid.begin(), valid.end(), fault.target) == valid.end())
      return problem(at, fmt::format("{} strikes {}, but graph {} has no {}{}", ticked(kind.name), what,
                                     ticked(graph_.name), ticked(fault.target), alternatives(fault.target, valid)));
    if (fault.kind == FaultKind::truncate && !has_arrays(fault.target))
      problem(at, fmt::format("messages of {} have no array that could be truncated", ticked(fault.target)));
  }

  bool has_arrays(const std::string& output) const {
    for (const PortPlan& port : plan_.ports)
      if (port.node + "." + port.port == output)
        return std::any_of(port.type->fields.begin(), port.type->fields.end(),
                           [](const Field& field) { return field.is_array(); });
    return false;
  }

  std::vector<std::string> outputs() const {
    std::vector<std::string> names;
    for (const PortPlan& port : plan_.ports) names.push_back(port.node + "." + port.port);
    return names;
  }

  std::vector<std::string> nodes(bool devices_only) const {
    std::vector<std::string> names;
    for (const TaskPlan& task : plan_.tasks)
      if (task.device || !devices_only) names.push_back(task.name);
    return names;
  }

  void read_times(FaultSpec& fault, const json& value, const std::string& pointer) {
    const auto read = [&](const char* key, int64_t& ns, int64_t low) {
      if (const auto time = read_time(value, pointer, key, low)) ns = *time;
    };
    fault.for_ns = fault.kind == FaultKind::kill || fault.kind == FaultKind::kill_at_step ? kRestart_ns : 0;
    read("from", fault.from_ns, 0);
    read("to", fault.to_ns, 1);
    read("at", fault.at_ns, 0);
    read("every", fault.every_ns, 1'000'000);
    read("for", fault.for_ns, fault.kind == FaultKind::hang ? 0 : 1);
    read("by", fault.by_ns, fault.kind == FaultKind::clock_step ? INT64_MIN : 1);
    if (fault.to_ns <= fault.from_ns)
      problem(document_.value_at(child(pointer, "to")), "`to` is not after `from`: the fault would never strike");
    if (fault.kind == FaultKind::kill || fault.kind == FaultKind::kill_at_step) check_kill(fault, value, pointer);
  }

  void check_kill(const FaultSpec& fault, const json& value, const std::string& pointer) {
    const Position& at = document_.value_at(pointer);
    const std::string kind = ticked(info(fault.kind).name);
    if (value.contains("at") == value.contains("every"))
      return problem(at, fmt::format("{} takes either `at`, or `every` with `to` (and `from`)", kind));
    if (value.contains("every") && !value.contains("to"))
      return problem(at, fmt::format("{} with `every` lacks `to`", kind));
    if (fault.every_ns > 0 && (fault.to_ns - fault.from_ns) / fault.every_ns > kMostStrikes)
      problem(document_.value_at(child(pointer, "every")),
              fmt::format("{} would strike more than {} times; shorten the window", kind, kMostStrikes));
    if (value.contains("at") && (value.contains("from") || value.contains("to")))
      problem(at, fmt::format("{} with `at` takes no `from` and `to`: they go with `every`", kind));
  }

  /// Who reads: an edge of the plan from the output to a node.
  std::vector<std::string> readers_of(const std::string& output) const {
    std::vector<std::string> readers;
    for (const TaskPlan& task : plan_.tasks)
      for (const EdgePlan& edge : task.edges)
        if (plan_.ports[edge.port].node + "." + plan_.ports[edge.port].port == output) readers.push_back(task.name);
    return readers;
  }

  void read_step(FaultSpec& fault, const json& value, const std::string& pointer) {
    if (!value.contains("step") || !value["step"].is_string()) return;
    fault.step = message_step(value["step"].get<std::string>()).value_or(MessageStep::none);
    const bool of_reader = is_of_reader(fault.step);
    if (run_.iceoryx && (fault.step == MessageStep::inside_loan || fault.step == MessageStep::inside_take))
      return problem(document_.value_at(child(pointer, "step")),
                     fmt::format("iceoryx has no step {}; run with --transport local", ticked(to_string(fault.step))));
    if (of_reader != value.contains("reader"))
      return problem(document_.value_at(child(pointer, "step")),
                     fmt::format("{} is a step of {}", ticked(to_string(fault.step)),
                                 of_reader ? "a reader: name it as `reader`" : "the writer: leave `reader` out"));
    if (!of_reader) return;
    fault.reader = value["reader"].is_string() ? value["reader"].get<std::string>() : "";
    const std::vector<std::string> readers = readers_of(fault.target);
    if (std::find(readers.begin(), readers.end(), fault.reader) == readers.end())
      problem(document_.value_at(child(pointer, "reader")),
              fmt::format("{} does not read {}{}", ticked(fault.reader), ticked(fault.target),
                          alternatives(fault.reader, readers, "its readers")));
  }

  void read_amounts(FaultSpec& fault, const json& value) const {
    const auto number = [&](const char* key) {
      return value.contains(key) && value[key].is_number() && value[key] >= 0;
    };
    if (number("probability")) fault.probability = value["probability"].get<double>();
    if (number("threads") && value["threads"] <= 64) fault.threads = value["threads"].get<uint32_t>();
    if (number("megabytes") && value["megabytes"] <= 1e6)
      fault.bytes = static_cast<uint64_t>(std::llround(value["megabytes"].get<double>() * 1e6));
    if (number("bytes_per_s")) fault.bytes_per_s = value["bytes_per_s"].get<uint64_t>();
    fault.fixed_policy = value.value("policy", json()) == "fixed";
  }

  void read_expectations(const json& expect) {
    Expectations& e = scenario_.expect;
    FigureReader::Names names{graph_.name, nodes(false), {}, {graph_.mode}};
    for (const ModeSpec& mode : graph_.modes) names.modes.push_back(mode.name);
    for (const ModePlan& mode : plan_.modes) names.modes.push_back(mode.name);
    for (const ChainSpec& chain : graph_.chains) names.chains.push_back(chain.name);
    FigureReader figures(document_, names, problems_);
    figures.read(expect, e);
    figures.read_bounds(expect, "restarts", processes_of(graph_), "subsystems", nullptr, e.restarts);
    if (expect.contains("lost")) e.lost = figures.read_bound(expect["lost"], "/expect/lost", &Bound::at_most);
    if (expect.contains("exit") && expect["exit"].is_number_integer()) e.exit = expect["exit"].get<int>();
    e.recovery_ns = read_time(expect, "/expect", "recovery", 0);
  }

  std::optional<int64_t> read_time(const json& value, const std::string& pointer, const char* key, int64_t low) {
    if (!value.contains(key) || !(value[key].is_string() || value[key].is_number())) return std::nullopt;
    const auto ns = read_duration(document_, child(pointer, key), key, problems_);
    if (!ns || *ns >= low) return ns;
    problem(document_.value_at(child(pointer, key)),
            fmt::format("{} is {}; wanted: at least {}", ticked(key), duration_text(*ns), duration_text(low)));
    return std::nullopt;
  }

  void problem(const Position& at, std::string text) { problems_.push_back({at, std::move(text)}); }

  const GraphSpec& graph_;
  const Plan& plan_;
  const RunKind run_;
  Document document_;
  Scenario scenario_;
  std::vector<Problem> problems_;
};

}  // namespace

LoadedScenario load_scenario(const std::filesystem::path& file, const GraphSpec& graph, const Plan& plan,
                             const RunKind& run) {
  return ScenarioReader(graph, plan, run).read(file);
}

}  // namespace takt::graph
