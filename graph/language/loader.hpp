// SPDX-License-Identifier: Apache-2.0
// Internal to graph/language: what the stages of load() share. Each stage appends to `problems` and goes on with what
// is sound, so that one run shows everything.
#pragma once
#include <functional>
#include <map>
#include <memory>
#include <set>

#include "graph/language/catalogue.hpp"
#include "graph/language/document.hpp"
#include "graph/language/words.hpp"

namespace takt::graph {

struct PortInfo {
  std::string name;
  const MessageType* type = nullptr;
  Need need = Need::required;
};

/// A node or a device as the edges see it.
struct Part {
  bool device = false;
  bool known = false;  ///< its type (kind) exists, so that its ports are known
  bool sound = true;   ///< none of its edges was reported, so that what follows from them may be
  std::string subsystem;
  Layer layer = Layer::sensor;
  std::vector<PortInfo> inputs, outputs;
  const std::vector<EdgeSpec>* edges = nullptr;
  Position position;

  const PortInfo* input(std::string_view name) const;
  const PortInfo* output(std::string_view name) const;
  std::vector<std::string> input_names() const;
  std::vector<std::string> output_names() const;
};

/// A value as given in a file or with --set.
struct Given {
  nlohmann::json value;
  std::string raw;
  Position key, position;
  bool from_device = false;   ///< of a device: it stands in its entry, which all profiles share
  bool from_default = false;  ///< ... or in a profile's `default`, which all devices share
  ChosenBy by = ChosenBy::file;
  std::string remedy = {};  ///< what to do if it is wrong, where that is not plain
};

struct Setting {
  std::string id, name;  ///< node.param of --set, or of the profile's `set`
  Given given;
};

struct Constant {
  nlohmann::json value;
  std::string raw;
  Position position;
};

class Loader {
 public:
  Loader(const LoadOptions& options, const NodeTypes& types, const DeviceCatalogue& catalogue)
      : options_(options), types_(types), catalogue_(catalogue) {}

  Loaded load(const std::filesystem::path& file);

 private:
  // read_parts.cpp: the files of the graph as one document, with their constants
  void read_files(const std::filesystem::path& file);
  void take_constants(Document& document, bool of_robot);
  void fill_constants(Document& document);
  std::optional<nlohmann::json> filled_in(const std::string& text, Mark& mark);
  void read_robot();
  void read_robot_values(const std::string& id, const std::string& prefix, const nlohmann::json& values,
                         const std::string& pointer);
  /// In the order of the files.
  bool before(const Position& a, const Position& b) const;

  // read_graph.cpp: JSON -> GraphSpec
  void read_graph();
  void read_subsystem(const std::string& name, const nlohmann::json& value, const std::string& pointer);
  void read_node(const std::string& id, const std::string& subsystem, const nlohmann::json& value,
                 const std::string& pointer);
  std::vector<EdgeSpec> read_edges(const nlohmann::json& inputs, const std::string& pointer);
  void read_joins(NodeSpec& node, const nlohmann::json& value);
  void read_chains(const nlohmann::json& value);
  void read_modes(const nlohmann::json& value);
  bool claim_id(const std::string& id, const Position& at);

  // read_measured.cpp
  void read_measured(const nlohmann::json& value);

  // read_params.cpp: node types, parameters of nodes, `set` of the profile, values kept by `takt set --keep`, --set
  void make_instances();
  void read_profile_set();
  void read_kept();
  void read_set();
  void read_params();
  void read_param(NodeSpec& node, Node& instance, const std::string& name, const Given& given);

  // read_devices.cpp: devices with driver and settings of the chosen profile
  void read_devices();
  std::string choose_profile();
  void check_profile_ids();
  void read_device(DeviceSpec& device, std::set<std::string>& unclaimed_defaults);
  std::map<std::string, Given> merge_settings(const DeviceSpec& device);
  const DeviceDriver* choose_driver(const DeviceSpec& device, const DeviceKindEntry& kind,
                                    const std::map<std::string, Given>& settings);
  void fill_setting(DeviceSpec& device, const DeviceSetting& setting, const Given& given);

  // read_schedule.cpp
  void read_schedule();
  std::optional<std::filesystem::path> schedule_path(Position& wanted_from);
  void read_entry(const std::string& id, const nlohmann::json& value, const std::string& pointer);
  void read_core(ScheduleEntry& entry, const std::string& id, const nlohmann::json& value, const std::string& pointer);
  void read_memory(ScheduleEntry& entry, const std::string& id, const nlohmann::json& value,
                   const std::string& pointer);
  void read_release(ScheduleEntry& entry, const std::string& id, const nlohmann::json& value,
                    const std::string& pointer);
  void check_times(const ScheduleEntry& entry, const std::string& id, const std::string& pointer);
  void check_schedule();
  void check_on(const std::string& id, const ScheduleEntry& entry);
  void check_on_cycles();

  // check_edges.cpp
  void make_parts();
  void check_edges();
  void check_edge(const std::string& id, const Part& to, const EdgeSpec& edge);
  void check_layer(const std::string& id, const Part& from, const Part& to, const EdgeSpec& edge);
  void check_hierarchy(const Part& from, const Part& to, const EdgeSpec& edge);
  void check_exports();
  void check_unconnected(const std::string& id, const Part& part);
  void check_joins();

  // read_expect.cpp: what the run must show
  void read_expect();
  std::optional<ConditionSpec> read_condition(const nlohmann::json& value, const std::string& pointer);
  /// Of a run that may have no world, and goes on: one on a port.
  std::optional<ConditionSpec> read_plain_condition(const nlohmann::json& value, const std::string& pointer);
  void read_asked();
  bool read_port_condition(ConditionSpec& condition, const nlohmann::json& value, const std::string& pointer);
  bool read_world_condition(ConditionSpec& condition, const nlohmann::json& value, const std::string& pointer);
  bool read_distance(ConditionSpec& condition, const nlohmann::json& value, const std::string& pointer);
  bool read_number_test(ConditionSpec& condition, const nlohmann::json& value, const std::string& pointer);
  bool read_text_test(ConditionSpec& condition, const nlohmann::json& value, const std::string& pointer);
  bool read_window(ConditionSpec& condition, const nlohmann::json& value, const std::string& pointer);
  bool read_unless(ConditionSpec& condition, const nlohmann::json& value, const std::string& pointer);
  bool check_keys(const nlohmann::json& value, const std::string& pointer, std::string_view what,
                  const std::vector<std::string>& valid);

  // read_record.cpp: what runs keep of themselves
  void read_record();
  void read_record_size(const nlohmann::json& value, std::string_view key, int64_t least, int64_t& bytes);
  void read_record_port(const std::string& name);

  // read_machines.cpp: which machine runs what
  void read_machines();
  void read_machine(const std::string& name, const nlohmann::json& value);
  void read_network();
  void check_machines();
  void check_start_order(const std::function<std::string(const std::string&)>& home_of);
  void check_outputs(const std::function<std::string(const std::string&)>& home_of);
  void choose_machine();

  // read_web.cpp: where runs are shown
  void read_web();

  // check_graph.cpp
  void check_chains();
  void check_modes();
  void tell_what_is_not_enforced();
  void apply_mode();
  void check_mode(const ModeSpec& mode);
  void check_lost(const ModeSpec& mode);

  void problem(const Position& at, std::string text) { problems_.push_back({at, std::move(text)}); }
  std::vector<std::string> ids() const;
  Given given(const std::string& pointer, const nlohmann::json& value) const { return given(graph_, pointer, value); }
  static Given given(const Document& document, const std::string& pointer, const nlohmann::json& value);
  /// Position of the last item of a list (or of a list in it) that reads `text`.
  Position item_at(const std::string& pointer, std::string_view text) const;
  /// Position of the value of a key of the schedule.
  Position schedule_at(const std::string& id, std::string_view key) const;
  /// A time at `key` of a map, in ns; nothing if absent or wrong (then reported, as `what`).
  std::optional<int64_t> read_time(const Document& document, const nlohmann::json& value, const std::string& pointer,
                                   std::string_view key, const std::string& what);

  const LoadOptions& options_;
  const NodeTypes& types_;
  const DeviceCatalogue& catalogue_;
  Document graph_, schedule_, params_;
  GraphSpec spec_;
  std::vector<Problem> problems_;
  bool layers_ = false;                      ///< the graph asks for `layers: thesis`
  std::map<std::string, Position> claimed_;  ///< ids of nodes and devices
  std::map<std::string, Part> parts_;
  std::map<std::string, std::unique_ptr<Node>> instances_;  ///< by node id, with default parameters
  std::vector<Setting> set_;
  std::map<std::string, Constant> constants_;
};

}  // namespace takt::graph
