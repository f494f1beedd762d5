// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cmath>
#include <string>

#include "nodes/semantic/clock_generator.hpp"
#include "nodes/semantic/reports.hpp"
#include "nodes/semantic/status_line.hpp"
#include "rt/msg/ace/body_poses.hpp"
#include "rt/msg/ace/detections.hpp"
#include "rt/msg/ace/digital_state.hpp"
#include "rt/msg/ace/object_reports.hpp"
#include "rt/msg/ace/stop_command.hpp"
#include "rt/msg/ace/terrain.hpp"
#include "rt/msg/grid.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/msg/requests.hpp"
#include "rt/msg/text_status.hpp"
#include "rt/node.hpp"

namespace takt {
namespace {

using namespace semantic;

class SemanticNode final : public Node {
 public:
  void setup(Setup& setup) override {
    offset_ns_ = setup.offset_ns;
    read_texts();
    near_.reserve(reports_.capacity().count + bodies_.capacity().count);
    requests_.reserve({0, 0, 1, static_cast<uint32_t>(std::max(kNodes, generator_.nodes()))});
    status_.reserve({0, 0, 1, kStatusCharacters});
  }

  /// Another script or list is read anew, and the script goes on where it would be by now.
  void changed() override {
    if (texts_differ()) read_texts();
    else generator_.tune(idle_every(), needs());
  }

  void start(int64_t epoch_ns) override {
    if (requests_.handed_over()) first_ns_ = epoch_ns + offset_ns_;  // the script goes on, it does not begin anew
  }

  void run(Job& job) override {
    const int64_t now_ns = job.release_ns();
    if (!first_ns_) first_ns_ = now_ns;
    const bool stop_lost = stop_.connected() && (stop_.empty() || stop_.stale());
    const uint32_t stop_reasons = stop_.empty() ? 0 : stop_.newest()->reasons;
    generator_.request(request_());
    generator_.update(now_ns - *first_ns_, stop_lost || stop_reasons != 0, surroundings());

    Requests* requests = requests_.loan();
    TextStatus* status = status_.loan();
    if (!requests || !status) job.no_result();
    if (requests) {
      for (const Request& request : generator_.deviating()) requests->wanted.push_back(request);
      requests_.send(now_ns);
    }
    if (status) {
      status->text.resize(kStatusCharacters);
      status->text.resize(write_status(present(stop_reasons, stop_lost), status->text.items()).size());
      status_.send(now_ns);
    }
  }

  void remember(StateArchive& archive) override { TAKT_STATE(archive, generator_, first_ns_); }

 private:
  static constexpr std::string_view kPerson = "person";  ///< what bodies are
  static constexpr size_t kNodes = 16;                   ///< that may be named in a run, at least

  std::array<std::string, 4> texts() const { return {script_(), idle_(), on_request_(), rules_()}; }
  bool texts_differ() const {
    return script_() != texts_[0] || idle_() != texts_[1] || on_request_() != texts_[2] || rules_() != texts_[3];
  }
  uint8_t idle_every() const { return static_cast<uint8_t>(idle_every_()); }
  NeedParameters needs() const { return {rule_margin_, std::llround(rule_hold_ * 1e9)}; }

  void read_texts() {
    const auto texts = this->texts();
    auto script = parse_script(texts[0]);
    if (!script) throw SetupError("script: " + script.error());
    const auto idle = parse_node_list(texts[1]);
    if (!idle) throw SetupError("idle: " + idle.error());
    const auto on_request = parse_node_list(texts[2]);
    if (!on_request) throw SetupError("on_request: " + on_request.error());
    auto rules = parse_rules(texts[3]);
    if (!rules) throw SetupError("rules: " + rules.error());
    for (const Rule& rule : *rules) check_sources(rule);
    ClockGenerator generator(std::move(*script), *idle, idle_every(), Needs(std::move(*rules), needs()), *on_request);
    if (const size_t room = requests_.capacity().count; room > 0 && generator.nodes() > room)
      throw SetupError("script, idle, on_request and rules name " + std::to_string(generator.nodes()) +
                       " nodes, and memory was taken for " + std::to_string(room) + "; start with them");
    generator_ = std::move(generator);
    texts_ = texts;
  }

  static bool is_fresh(const InputPort& port) { return !port.empty() && !port.stale(); }

  /// A rule that nobody could ever tell anything of is a mistake.
  void check_sources(const Rule& rule) const {
    const std::string node = rule.otherwise.node;
    if (rule.type.empty() && !crossing_.connected() && !terrain_.connected())
      throw SetupError("rules: " + node + " when crossing: connect `crossing` or `terrain`");
    if (!rule.type.empty() && !reports_.connected() && !(bodies_.connected() && rule.type == kPerson))
      throw SetupError("rules: " + node + " when " + rule.type +
                       " within: connect `reports`, or `bodies` for a person");
  }

  Surroundings surroundings() {
    Surroundings around;
    near_.clear();
    const bool reports = add_reports(), bodies = add_bodies();
    if (reports || bodies) around.objects = near_;
    if (is_fresh(crossing_)) around.crossing = (crossing_.newest()->levels & 1) != 0;
    if (is_fresh(terrain_))
      around.crossing = around.crossing.value_or(false) || terrain_.newest()->kind == terrain_kind::crossing;
    return around;
  }

  /// False: nobody tells, or not where the robot is among them.
  bool add_reports() {
    if (!is_fresh(reports_)) return false;
    const ObjectReports& reports = *reports_.newest();
    if (reports.in_map && !is_fresh(odometry_)) return false;
    const double x_m = reports.in_map ? odometry_.newest()->x_m : 0, y_m = reports.in_map ? odometry_.newest()->y_m : 0;
    for_each_report(reports, [&](const Report& report) {
      near_.push_back({report.type, std::hypot(report.place.x_m - x_m, report.place.y_m - y_m)});
    });
    return true;
  }
  bool add_bodies() {
    if (!is_fresh(bodies_)) return false;
    for (const Body& body : bodies_.newest()->bodies.items())
      near_.push_back({kPerson, std::hypot(body.joints[0].x, body.joints[0].y)});
    return true;
  }

  Status present(uint32_t stop_reasons, bool stop_lost) const {
    Status status{stop_reasons, stop_lost, generator_.deviating(), {}, {}, {}};
    if (is_fresh(detections_)) status.objects = detections_.newest()->boxes.size;
    if (is_fresh(obstacles_)) status.obstacle_m = way(*obstacles_.newest());
    if (is_fresh(ground_)) status.ground_m = way(*ground_.newest());
    return status;
  }

  /// None where the message is not as large as it says.
  std::optional<double> way(const Grid& grid) const {
    if (grid.width < 0 || grid.height < 0 ||
        grid.cells.size != static_cast<size_t>(grid.width) * static_cast<size_t>(grid.height))
      return std::nullopt;
    return free_way_m(grid, strip_);
  }

  static constexpr uint32_t kStatusCharacters = 240;

  Input<Detections> detections_{this, "detections", "objects seen", Need::optional};
  Input<Grid> ground_{this, "ground", "where the ground can be driven on; robot frame", Need::optional};
  Input<Grid> obstacles_{this, "obstacles", "obstacles around the robot; robot frame", Need::optional};
  Input<StopCommand> stop_{this, "stop", "while it says stop or is silent, the idle nodes are paced", Need::optional};
  Input<ObjectReports> reports_{this, "reports", "what is around, for the rules", Need::optional};
  Input<Odometry> odometry_{this, "odometry", "the robot in the map, if the reports' places are", Need::optional};
  Input<BodyPoses> bodies_{this, "bodies", "persons, for the rules", Need::optional};
  Input<DigitalState> crossing_{this, "crossing", "line 0: a crossing is near, as traffic_signs tells", Need::optional};
  Input<takt::Terrain> terrain_{this, "terrain", "another who may tell of a crossing", Need::optional};
  Output<Requests> requests_{this, "requests", "nodes that are not to run at their full rate, with every job"};
  Output<TextStatus> status_{this, "status", "one line: what is stopped or paced, objects, way ahead"};
  Param<std::string> script_{this, "script", "", "",
                             "timed requests: \"5s stop object_detection; 10s pace ground_map 2\""};
  Param<std::string> idle_{this, "idle", "", "", "nodes that need not run at full rate while the robot is stopped"};
  Param<int> idle_every_{this,     "idle_every", 1,
                         {1, 255}, "",           "idle nodes run at every n-th release while the robot is stopped"};
  Param<std::string> on_request_{this, "on_request", "", "",
                                 "nodes that are stopped until the script starts them or `request` names them"};
  Param<std::string> request_{this, "request", "", "", "nodes that run now, whatever the script says"};
  Param<std::string> rules_{this, "rules", "", "", "what runs where: \"body_pose when person within 4m else stop\""};
  Param<double> rule_margin_{this,        "rule_margin", NeedParameters{}.margin_m,
                             {0.0, 20.0}, "m",           "so much farther away what is needed still counts"};
  Param<double> rule_hold_{this, "rule_hold", 2.0, {0.0, 3600.0}, "s", "a need lasts so long after it was last seen"};
  Param<double> strip_{this, "strip", 0.8, {0.1, 5.0}, "m", "width of the way ahead that the status tells of"};

  ClockGenerator generator_;
  std::array<std::string, 4> texts_;  ///< that it was made of
  std::vector<Neighbour> near_;
  int64_t offset_ns_ = 0;
  std::optional<int64_t> first_ns_;
};

}  // namespace

void register_semantic(NodeTypes& types) {
  types.add<SemanticNode>("semantic", Layer::processing, "Clock generator: starts, stops and paces the other nodes");
}

}  // namespace takt
