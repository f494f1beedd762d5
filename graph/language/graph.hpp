// SPDX-License-Identifier: Apache-2.0
// The graph language as plain data: what a graph file and its schedule say, with the position of each word.
#pragma once
#include <algorithm>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "hal/settings/json.hpp"
#include "rt/machine/identity.hpp"
#include "rt/param.hpp"
#include "rt/record/port_rule.hpp"
#include "rt/sched/plan.hpp"
#include "rt/time/rate.hpp"

namespace takt::graph {

/// Where a word stands; line and column count from 1 (0: no position, e.g. the command line).
struct Position {
  std::string file;
  int line = 0, column = 0;
  std::string use = {};  ///< of a value that came from a constant: "constant `speed`, used at FILE:LINE:COLUMN"
};
/// "file:line:column"; the file alone where there is no line.
std::string to_string(const Position& position);

/// One thing wrong with the input. `text` names the id at fault, the value and the valid choices.
struct Problem {
  Position position;
  std::string text;
};
/// "file:line:column: error: text", and where the value is used if it stands elsewhere.
std::string to_string(const Problem& problem);

/// node.port or device.port.
struct PortName {
  std::string node, port;
  bool operator==(const PortName&) const = default;
  std::string text() const { return node + "." + port; }
};

struct EdgeSpec {
  PortName from;
  std::string input;
  int depth = 1;
  std::optional<int64_t> max_age_ns;
  Position position;
};

/// Who chose a value: the graph's file, `takt set --keep` (overlay.hpp), --set.
enum class ChosenBy : uint8_t { file, kept, command_line };

struct ParamSpec {
  ParamValue value;  ///< converted to the unit the parameter declares
  Position position;
  ChosenBy by = ChosenBy::file;
};

/// The values that `takt set --keep` left for this graph.
struct KeptValues {
  struct Value {
    std::string name, text;   ///< "node.param", as it is written
    bool overridden = false;  ///< by --set
  };
  std::filesystem::path file;  ///< empty: there is none
  std::vector<Value> values;
};

struct NodeSpec {
  std::string id, type, subsystem;
  std::vector<EdgeSpec> edges;
  std::vector<std::vector<std::string>> joins;  ///< groups of input names
  std::map<std::string, ParamSpec> params;
  Position position;
};

/// What a node or device of another machine gives, as a device of this one (part_of_machine.hpp).
struct RemoteSpec {
  std::string machine;
  std::string type;  ///< of the node there, or kind of the device; empty: it stands for the machine
  bool of_device = false;
  std::vector<std::string> ports;  ///< outputs that nodes here read
  /// A stamp lies at most so long before the release of the job that hands it on. Nothing: the graph does not say.
  std::optional<int64_t> lag_ns = {};
};

/// A device with the driver and settings of the chosen profile. Settings are converted to SI units.
struct DeviceSpec {
  std::string id, kind, driver;
  std::optional<Rate> rate;
  nlohmann::json settings = nlohmann::json::object();
  std::vector<EdgeSpec> edges;  ///< commands to the device, such as a velocity
  Position position;
  std::optional<RemoteSpec> remote = {};  ///< then kind and driver say nothing
};

using takt::Criticality;
using takt::OnMiss;
using takt::OnOverrun;
using takt::Policy;
using takt::PublishAt;

/// What the schedule says of one node or device.
struct ScheduleEntry {
  std::optional<Rate> rate;
  std::optional<PortName> on;
  int every = 1;
  int64_t min_interval_ns = 0;
  int64_t offset_ns = 0;
  int64_t deadline_ns = 0;  ///< 0: one period
  int64_t budget_ns = 0;    ///< 0: not stated
  Criticality criticality = Criticality::low;
  OnOverrun on_overrun = OnOverrun::proceed;
  OnMiss on_miss = OnMiss::proceed;
  PublishAt publish = PublishAt::asap;
  int64_t memory_bytes = kDefaultMemory;
  int core = -1;  ///< under `fixed`; -1: chosen
  Position position;
};

/// How the budgets of a schedule were measured: its block `measured`, which `takt profile` writes.
struct MeasuredSpec {
  struct Exec {
    int64_t exec_ns = 0;  ///< the quantile of the execution time
    int64_t samples = 0;
  };
  machine::Identity machine;
  std::string at, policy;  ///< UTC; the policy that was granted when all nodes ran together
  double quantile = 0;     ///< 0..1
  double margin = 0;       ///< budget = margin * quantile of the execution time
  std::map<std::string, Exec> nodes;
  Position position;
};

struct ScheduleSpec {
  std::string name, file;
  Policy policy = Policy::deadline;
  std::vector<int> cores;  ///< empty: all that the process may use
  Position cores_position;
  int64_t anticipate_ns = kDefaultAnticipate_ns;  ///< 0..kLongestAnticipate_ns
  std::map<std::string, ScheduleEntry> entries;   ///< by node or device id
  std::optional<MeasuredSpec> measured;           ///< nothing: the budgets are estimates
};

struct ChainSpec {
  std::string name;
  PortName from, to;
  int64_t max_age_ns = 0;
  Position position;
};

struct ModeSpec {
  std::string name;
  std::vector<std::string> without;
  Position position;
  std::vector<std::string> lost = {};  ///< devices whose loss leads to this mode
  bool defined = true;                 ///< false: only a rule for the implied safe_stop, which has no `without`

  /// What does not run while the mode is entered by a change: not the lost devices, whose jobs try to get them back.
  std::vector<std::string> pauses() const {
    std::vector<std::string> paused;
    for (const std::string& id : without)
      if (std::find(lost.begin(), lost.end(), id) == lost.end()) paused.push_back(id);
    return paused;
  }
};

struct SubsystemSpec {
  std::string name;
  std::vector<PortName> exports;
  Position position;
  std::optional<bool> spare = {};  ///< its process has one (compose/spares.hpp); nothing: as its chains need it
};

/// A figure lies within it, ends included.
struct Bound {
  std::optional<double> at_least, at_most;
  bool holds(double value) const { return (!at_least || value >= *at_least) && (!at_most || value <= *at_most); }
};

/// What the figures of a run's report must be. What is not stated is not asked for.
struct FigureExpectations {
  std::vector<std::string> modes;        ///< empty: not stated
  std::map<std::string, Bound> rates;    ///< by node: jobs completed per active second
  std::map<std::string, Bound> results;  ///< by node: of these, those that had a result
  std::map<std::string, Bound> misses;   ///< by node: deadlines
  std::map<std::string, Bound> stale;    ///< by node: inputs that were stale at a job
  std::map<std::string, Bound> ages;     ///< by chain: the oldest at its end, ns
};

/// When a condition must hold: at the end of the run, at some time, each time it can be judged, or not once.
enum class Holds : uint8_t { at_end, once, always, never };

/// One condition on what an output says or on what is true in the simulated world.
struct ConditionSpec {
  enum class Of : uint8_t {
    messages,   ///< how many there were
    field,      ///< of each message
    attribute,  ///< of an object of the world
    distance,   ///< of an object of the world from another one or from a place, m
  };
  Of of = Of::messages;
  PortName port;          ///< of messages and field
  std::string field;      ///< as find_field() takes it
  std::string unit;       ///< that `bound` is in; "": a pure number, or a text
  std::string object;     ///< of attribute and distance
  std::string attribute;  ///< of attribute
  std::string other;      ///< of distance; "": from the place (x, y) of the map
  double x_m = 0, y_m = 0;
  std::optional<std::string> is, contains;  ///< of a text; at most one of them
  Bound bound;                              ///< of a number
  Holds holds = Holds::at_end;
  int64_t from_ns = 0;           ///< what was said or true before does not count; since the epoch, as
  std::optional<int64_t> to_ns;  ///< this: what is said or true from then on
  /// Of attribute and distance, at most one, of a field: what is true while its newest message passes does not count.
  std::vector<ConditionSpec> unless;
  Position position;
};

/// The part `expect` of a graph.
struct ExpectSpec {
  int64_t within_ns = 0;  ///< the longest that the run lasts
  std::vector<ConditionSpec> conditions;
  FigureExpectations figures;
};

/// The part `record` of a graph: what its runs keep of themselves at any time, and for how long.
struct RecordSpec {
  struct Port {
    PortName port;
    record::PortRule rule;
    Position position;
  };
  bool ring = true;                      ///< runs in real time keep one unless they are told otherwise
  int64_t disk_bytes = 2'000'000'000;    ///< of all files of the ring, never more
  int64_t memory_bytes = 512'000'000;    ///< of images and clouds, which are kept in memory only
  int64_t frozen_bytes = 2'000'000'000;  ///< of all frozen files; the oldest go, but for the newest 20
  int64_t keep_ns = 3600'000'000'000;    ///< what is older goes
  int64_t before_ns = 3'000'000'000, after_ns = 2'000'000'000;  ///< around what freezes the ring
  int64_t snapshot_ns = 1'000'000'000;  ///< nodes say what they remember once in so much time; 0: never
  bool recorded = false;                ///< not of the file: this run is recorded, or replays what was
  std::vector<Port> ports;              ///< those that the graph has a rule for
  std::vector<ConditionSpec> freeze;    ///< conditions on ports that freeze the ring once they pass
  Position position;
  /// 0: nodes have no output for what they remember.
  int64_t state_every_ns() const { return recorded ? snapshot_ns : 0; }
};

/// The part `web` of a graph: where `takt run --web` shows its runs. Empty: as `takt web` has it.
struct WebSpec {
  int port = 0;
  std::string address;
  std::filesystem::path certificate, key, token_file;
  std::vector<std::string> hosts, origins;  ///< names of this server; pages of others that may connect
};
/// Whether only programs of this machine reach a server at this address.
bool is_loopback(std::string_view address);

/// A machine of a graph that may run on several.
struct MachineSpec {
  std::string name, address;
  std::vector<std::string> runs;            ///< subsystems and devices
  std::map<std::string, int64_t> ages;      ///< of outputs that others read, when they are published, at most
  std::map<std::string, std::string> wire;  ///< of outputs that others read: zstd, lz4, jpeg
  Position position;
};

/// The part `network` of a graph: what lies between its machines.
struct NetworkSpec {
  int64_t latency_ns = 20'000'000;     ///< of a message, at most
  int64_t clock_error_ns = 1'000'000;  ///< that two machines may be unsure of each other's clock
  int domain = 0;                      ///< of DDS
  bool trusted = false;                ///< whoever is on it may change the run
  std::optional<int64_t> bandwidth;    ///< bit/s that each machine can send and receive; nothing: not said
  std::filesystem::path keys;          ///< not of the file: those of this machine (`--keys`); empty: it has none
};
/// Whether an address is one of networks that are not reached from elsewhere: RFC 1918, link-local, ULA (RFC 4193),
/// loopback. What is no address is not.
bool is_private(const std::string& address);

struct GraphSpec {
  std::string name, file, profile, mode = "full";
  std::filesystem::path directory;
  std::vector<std::string> files;  ///< the graph's, those it includes, then the parameter file
  std::string params_file;         ///< of this robot; empty: none
  std::string isolation = "none";  ///< none | subsystem
  std::vector<DeviceSpec> devices;
  std::vector<NodeSpec> nodes;
  std::vector<SubsystemSpec> subsystems;
  std::vector<ChainSpec> chains;
  std::vector<ModeSpec> modes;
  std::optional<ExpectSpec> expect;
  RecordSpec record;
  WebSpec web;
  std::vector<MachineSpec> machines;
  NetworkSpec network;
  std::string machine;             ///< the one that this is the part of; empty: it is the whole graph
  std::vector<PortName> exported;  ///< outputs of this machine that others read
  std::map<std::string, std::set<std::string>> export_readers;  ///< by such an output: the machines that read it
  std::map<std::string, std::string> elsewhere;  ///< nodes and devices that another machine runs, and which
  std::vector<ConditionSpec> asked;              ///< LoadOptions::conditions
  ScheduleSpec schedule;
  KeptValues kept;
  std::vector<std::string> adjusted;  ///< what validation changed, for stderr and the report
};

/// A plug-in that a graph file asks for.
struct PluginName {
  std::filesystem::path file, directory;  ///< as it stands there; of the file that names it
  Position position;
};
/// A plug-in that was loaded: part of a record.
struct PluginFact {
  std::string name, hash;  ///< of the file
};

/// What the command line adds to the files.
struct LoadOptions {
  std::string profile;  ///< "": the graph's default_profile, else sim
  std::optional<std::filesystem::path> schedule;
  std::string policy;  ///< "": the schedule's
  std::string mode = "full";
  std::vector<std::string> set;  ///< "node.param=value"
  std::filesystem::path params;  ///< parameter file of this robot; empty: none
  std::filesystem::path state;   ///< folder whose overlay of the graph is read, see overlay.hpp; empty: none
  std::vector<std::filesystem::path> plugin_files = {};  ///< of --plugin
  std::string machine = {};                              ///< its part of the graph; empty: all of it
  std::vector<std::string> conditions = {};              ///< as in `expect`, on ports: GraphSpec::asked
  std::vector<PluginFact> plugins = {};                  ///< all that were loaded for this graph, see graph/plugins
};

}  // namespace takt::graph

namespace takt {
struct Registry;
}

namespace takt::graph {

struct Loaded {
  std::optional<GraphSpec> graph;  ///< present exactly if there is no problem
  std::vector<Problem> problems;
};

/// Those that `plugins` of the file and of all that it includes name; they are loaded before the file is. Nothing of a
/// file that cannot be read: load() says why.
std::vector<PluginName> plugins_of(const std::filesystem::path& file);

/// Reads the graph and its schedule, checks all of it (syntax, schema, ids, types, units, ranges, hierarchy, cycles)
/// and returns every problem, not just the first. Never throws.
Loaded load(const std::filesystem::path& file, const LoadOptions& options, const Registry& registry);

}  // namespace takt::graph
