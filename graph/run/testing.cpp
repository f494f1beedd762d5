// SPDX-License-Identifier: Apache-2.0
#include "graph/testing.hpp"

#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <map>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include "graph/run/run.hpp"
#include "rt/sched/plan.hpp"
#include "rt/shm/follower.hpp"
#include "rt/testing.hpp"

namespace takt {
namespace {

using Json = nlohmann::ordered_json;

/// Nodes, chains and devices of the report have a name, edges two ends.
std::string name_of(const Json& entry) {
  if (!entry.is_object()) return "";
  if (entry.contains("name")) return entry["name"].get<std::string>();
  if (entry.contains("from") && entry.contains("to") && entry["from"].is_string())
    return entry["from"].get<std::string>() + " -> " + entry["to"].get<std::string>();
  return "";
}

/// The entry behind one key; throws with the keys that there are.
const Json& step(const Json& at, std::string_view key, std::string_view path) {
  std::string choices;
  for (const auto& [name, value] : at.items()) {
    const std::string called = at.is_array() ? name_of(value) : name;
    if (called == key) return value;
    choices += (choices.empty() ? "" : ", ") + called;
  }
  throw std::logic_error("the report has no figure " + std::string(path) + ": no " + std::string(key) + " among " +
                         (choices.empty() ? "nothing" : choices));
}

/// A folder of its own for what nodes write; goes with its content.
class Scratch {
 public:
  Scratch() {
    std::string name = (std::filesystem::temp_directory_path() / "takt_graph_test.XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("cannot make a folder " + name);
    path_ = name;
  }
  ~Scratch() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace

struct GraphTest::State final : command::RunWitness {
  const Registry* registry = nullptr;
  struct Message {
    int64_t stamp_ns;
    test::Chunk chunk;
  };
  struct Watched {
    const MessageType* type = nullptr;
    std::optional<Follower> follower;
    Capacity capacity;
    uint64_t lost = 0;
    std::vector<Message> messages;
  };

  command::RunOptions options;
  std::map<std::string, Watched, std::less<>> watched;
  Json report;
  std::string wrong;  ///< with what is watched; the run itself would take an exception for a failure of its own

  void begin(const Plan& plan, Transport& transport) override {
    for (auto& [name, port] : watched) {
      std::string choices;
      for (size_t p = 0; p < plan.ports.size(); ++p) {
        const PortPlan& planned = plan.ports[p];
        const std::string called = planned.node + "." + planned.port;
        choices += (choices.empty() ? "" : ", ") + called;
        if (called != name) continue;
        port.type = planned.type, port.capacity = planned.capacity;
        port.follower.emplace(transport.make_reader(p));
      }
      if (!port.follower) wrong = "the graph has no output " + name + "; it has " + choices;
    }
  }
  void look() override {
    if (!wrong.empty()) return;
    for (auto& [name, port] : watched)
      port.lost += port.follower->take([&port = port](const Held& held) {
        Message& kept = port.messages.emplace_back(Message{held.stamp_ns, {*port.type, port.capacity}});
        std::memcpy(kept.chunk.message(), held.message(), port.type->bytes(port.capacity));
      });
  }
  void end(const Json& told) override {
    look();
    for (auto& [name, port] : watched) port.follower.reset();  // before the pools go
    report = told;
  }
  const Watched& find(std::string_view name) const {
    const auto found = watched.find(name);
    if (found == watched.end()) throw std::logic_error("watch(\"" + std::string(name) + "\") before the run");
    if (found->second.lost > 0)
      throw std::logic_error(std::to_string(found->second.lost) + " messages of " + std::string(name) + " were lost");
    return found->second;
  }
  const Message& find(std::string_view name, size_t i) const {
    const Watched& port = find(name);
    if (i < port.messages.size()) return port.messages[i];
    throw std::logic_error(std::string(name) + " sent " + std::to_string(port.messages.size()) +
                           " messages; there is no message " + std::to_string(i));
  }
};

GraphTest::GraphTest(std::filesystem::path graph, const Registry& registry) : state_(std::make_unique<State>()) {
  state_->registry = &registry;
  state_->options.graph = std::move(graph);
  state_->options.clock = "virtual";
  state_->options.isolate = "none";
  state_->options.duration_asked = true;
  state_->options.output.clear();
  state_->options.witness = state_.get();
}

GraphTest::~GraphTest() = default;

void GraphTest::profile(std::string name) { state_->options.load.profile = std::move(name); }
void GraphTest::schedule(std::filesystem::path file) { state_->options.load.schedule = std::move(file); }
void GraphTest::mode(std::string name) { state_->options.load.mode = std::move(name); }
void GraphTest::set(std::string setting) { state_->options.load.set.push_back(std::move(setting)); }
void GraphTest::faults(std::filesystem::path scenario) { state_->options.faults = std::move(scenario); }
void GraphTest::seed(uint64_t value) { state_->options.seed = value; }
void GraphTest::output(std::filesystem::path folder) { state_->options.output = std::move(folder); }
void GraphTest::watch(std::string port) { state_->watched[std::move(port)]; }

int GraphTest::run_for(double seconds) {
  state_->report = nullptr;
  for (auto& [name, port] : state_->watched) port = {};
  command::RunOptions options = state_->options;
  options.duration_s = seconds;
  std::optional<Scratch> scratch;
  if (options.output.empty()) options.output = scratch.emplace().path();
  const int code = command::run_graph(*state_->registry, options);
  if (!state_->wrong.empty()) throw std::logic_error(std::exchange(state_->wrong, {}));
  return code;
}

size_t GraphTest::count(std::string_view port) const { return state_->find(port).messages.size(); }

int64_t GraphTest::stamp_ns(std::string_view port, size_t i) const { return state_->find(port, i).stamp_ns; }

const void* GraphTest::message(std::string_view port, size_t i, const MessageType& type) const {
  const State::Message& found = state_->find(port, i);
  const std::string_view carried = state_->find(port).type->name;
  if (carried != type.name)
    throw std::logic_error(std::string(port) + " carries " + std::string(carried) + ", not " + std::string(type.name));
  return const_cast<test::Chunk&>(found.chunk).message();
}

double GraphTest::figure(std::string_view path) const {
  if (state_->report.is_null()) throw std::logic_error("there is no report: no run has come to its end");
  const Json* at = &state_->report;
  for (size_t from = 0; from <= path.size();) {
    const size_t to = std::min(path.find('/', from), path.size());
    at = &step(*at, path.substr(from, to - from), path);
    from = to + 1;
  }
  if (at->is_boolean()) return at->get<bool>() ? 1 : 0;
  if (at->is_number()) return at->get<double>();
  throw std::logic_error("the report has no number at " + std::string(path) + " but " + at->dump());
}

std::string GraphTest::report() const { return state_->report.dump(2); }

}  // namespace takt
