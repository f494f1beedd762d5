// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstring>

#include "nodes/mapping_3d/pose.hpp"
#include "nodes/obstacle_stop/footprint.hpp"
#include "nodes/robot_client/client.hpp"
#include "nodes/semantic/network_file.hpp"
#include "rt/msg/ace/action.hpp"
#include "rt/msg/ace/object_reports.hpp"
#include "rt/msg/ace/robot_task.hpp"
#include "rt/msg/ace/stop_command.hpp"
#include "rt/msg/grid.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/msg/text_status.hpp"
#include "rt/msg/velocity_command.hpp"
#include "rt/node.hpp"
#include "rt/transform/transform_buffer.hpp"

namespace takt {
namespace {

using namespace robot_client;

template <size_t N>
std::string_view text_of(const char (&text)[N]) {
  return {text, strnlen(text, N)};
}
template <size_t N>
void write_text(std::string_view text, char (&into)[N]) {
  std::fill(std::begin(into), std::end(into), '\0');
  text.copy(into, N - 1);
}

class RobotClientNode final : public Node {
 public:
  RobotClientNode() { may(bit(JobCall::malloc), "a goal is made a task of its own size, and what is said is text"); }

  void setup(Setup& setup) override {
    semantic::MapParameters m;
    m.capacity = {static_cast<size_t>(capacity_()), 3 * static_cast<size_t>(capacity_())};
    knowledge_.emplace(m);
    if (!network_().empty())
      if (const auto read = semantic::read_network(setup.directory / network_(), knowledge_->map()); !read)
        throw SetupError(fmt::format("network: {}", fmt::join(read.error(), "\n")));
    client_.emplace(*knowledge_, parameters());
    map_.reserve({0, 0, 1, static_cast<uint32_t>(capacity_())});
    for (OutputPort* text : {static_cast<OutputPort*>(&plan_), static_cast<OutputPort*>(&status_),
                             static_cast<OutputPort*>(&speech_), static_cast<OutputPort*>(&taken_)})
      text->reserve({0, 0, 1, kCharacters});
  }

  void changed() override {
    client_->tune(parameters());
    expansions_ = static_cast<size_t>(expansions_a_job_());
    reserve_ns_ = std::llround(reserve_() * 1e9);
    odometry_age_ns_ = std::llround(odometry_age_() * 1e9);
  }

  void start(int64_t) override {
    if (const ObjectReports* known = map_.handed_over()) {
      std::vector<std::string_view> names;
      for (uint32_t i = 0; i < known->names.size; ++i) names.push_back(text_of(known->names[i].name));
      knowledge_->keep_only(names);  // not what of the network somebody has removed
      learn(*known, {}, 0);
    }
    if (const ActionCommand* last = action_.handed_over()) client_->go_on_after(last->number);
    if (const RobotTask* last = taken_.handed_over()) {
      task_number_ = last->number;
      restarted_ = true;
      const std::string text(last->text.data(), last->text.size);
      if (const auto task = text.empty() ? tl::make_unexpected(std::string()) : parse_task(text);
          task && names_an_end(task->verb))
        client_->take(text);
    }
  }

  void run(Job& job) override {
    const int64_t now_ns = job.release_ns();
    const bool first = last_ns_ == kNever;
    if (first && restarted_) last_words_ = words_();  // what the graph says was taken before
    for (size_t i = 0; i < odometry_.size(); ++i)
      track_.insert(odometry_.stamp_ns(i), {mapping_3d::robot_in_odometry(odometry_[i]), {}});
    for (size_t i = 0; i < objects_.size(); ++i) look(objects_[i], objects_.stamp_ns(i));
    look_at_grid(job);
    take_tasks();

    Percept percept;
    percept.now_ns = now_ns;
    percept.dt_s = first ? 0 : static_cast<double>(std::min(now_ns - last_ns_, kLongestStep_ns)) * 1e-9;
    percept.robot = robot(now_ns);
    const bool told = stop_.connected() && !stop_.empty() && !stop_.stale();  // by who may stop the robot
    percept.stop = job.mode() == kSafeStopMode || (stop_.connected() && (!told || stop_.newest()->stop()));
    percept.obstacle = told && stop_.newest()->reasons == stop_reason::obstacle;
    if (const ActionOutcome* o = outcome_.newest())
      percept.outcome = {o->number, o->state, o->duration_s, text_of(o->reason)};
    percept.effort = {expansions_, [&job, this] { return job.time_left_ns() < reserve_ns_; }};
    const navigation::Velocity velocity = client_->step(percept);
    last_ns_ = now_ns;

    send_velocity(velocity, now_ns);
    send_command(now_ns);
    send_texts(now_ns);
    if (map_sent_ != knowledge_->revision()) send_map(now_ns);
  }

  void remember(StateArchive& archive) override {
    TAKT_STATE(archive, knowledge_, client_, track_, looked_ns_, last_words_, last_ns_, task_number_, plan_sent_,
               map_sent_, restarted_, told_of_grid_);
    archive.room(kCharacters);
  }

 private:
  ClientParameters parameters() const {
    ClientParameters p;
    p.driving.pilot.limits.speed_m_s = speed_;
    p.driving.pilot.limits.turn_rad_s = turn_;
    p.driving.path.clearance_m = obstacle_stop::footprint(width_, length_, margin_).clearance_m();
    p.driving.most_cells = p.deliberation.most_cells = grid_.connected() ? grid_.capacity().pixels() : 0;
    p.driving.explore_far_m = explore_far_;
    p.deliberation.pilot = p.driving.pilot;
    p.deliberation.reach_m = reach_;
    p.plans = plans_;
    p.patience_s = patience_;
    p.settle_s = settle_;
    return p;
  }

  /// Reports in the robot frame count once the robot's pose is known at their stamp.
  void look(const ObjectReports& reports, int64_t stamp_ns) {
    if (stamp_ns <= looked_ns_) return;
    mapping_3d::Affine to_map;
    if (reports.in_map == 0) {
      const auto robot = track_.at(stamp_ns);
      if (!robot) return;
      to_map = mapping_3d::to_affine(robot->transform);
    }
    looked_ns_ = stamp_ns;
    learn(reports, to_map, stamp_ns);
    client_->note_news();
  }

  void learn(const ObjectReports& reports, const mapping_3d::Affine& to_map, int64_t stamp_ns) {
    size_t next = 0;
    for (uint32_t i = 0; i < std::min(reports.names.size, reports.places.size); ++i) {
      const ObjectPlace& place = reports.places[i];
      states_.clear();
      const size_t end = next + (place.attributes > 0 ? static_cast<size_t>(place.attributes) : 0);
      for (; next < std::min<size_t>(end, reports.attributes.size); ++next)
        states_.push_back({text_of(reports.attributes[next].name), text_of(reports.attributes[next].value)});
      const auto at = transformed(to_map, place.x_m, place.y_m, place.z_m);
      knowledge_->see(
          {text_of(reports.names[i].name), text_of(reports.names[i].type), at.x_m, at.y_m, place.score, stamp_ns},
          states_);
    }
  }

  void look_at_grid(Job& job) {
    const Grid* grid = grid_.newest();
    if (grid == nullptr || !grid_.is_new()) return;
    const bool in_map = grid->grid_in_map.qw == 1 && grid->cell_m > 0 && grid->width > 0 && grid->height > 0 &&
                        grid->cells.size == static_cast<size_t>(grid->width) * static_cast<size_t>(grid->height);
    if (in_map && client_->look({grid->view(), grid->cell_m, grid->origin_x_m + grid->grid_in_map.x,
                                 grid->origin_y_m + grid->grid_in_map.y}))
      return;
    if (!std::exchange(told_of_grid_, true)) job.results_doubtful("the grid is not one of the map, and is not used");
  }

  /// From the port, and from the parameter that another process sets in a running graph.
  void take_tasks() {
    if (const RobotTask* task = task_.newest(); task != nullptr && task->number != 0 && task->number != task_number_) {
      task_number_ = task->number;
      client_->take({task->text.data(), task->text.size});
    }
    const std::string& words = words_();
    if (words == last_words_) return;
    last_words_ = words;
    if (const size_t begin = words.find_first_not_of("0123456789 "); begin != std::string::npos)
      client_->take(std::string_view(words).substr(begin));
  }

  std::optional<PlanarPose> robot(int64_t now_ns) const {
    if (odometry_.empty() || odometry_.stale() || now_ns - odometry_.stamp_ns() > odometry_age_ns_) return std::nullopt;
    const Odometry& o = *odometry_.newest();
    return PlanarPose{o.x_m, o.y_m, o.theta_rad};
  }

  void send_velocity(const navigation::Velocity& velocity, int64_t now_ns) {
    VelocityCommand* message = velocity_.loan();
    if (message == nullptr) return;
    message->speed_m_s = velocity.speed_m_s;
    message->turn_rad_s = velocity.turn_rad_s;
    velocity_.send(now_ns);
  }

  void send_command(int64_t now_ns) {
    ActionCommand* message = action_.loan();
    if (message == nullptr) return;
    const Command& command = client_->command();
    message->number = command.number;
    write_text("", message->action);
    for (auto& object : message->objects) write_text("", object);
    if (command.deed.action != kNoNode) {
      write_text(knowledge_->name(command.deed.action), message->action);
      const auto objects = knowledge_->objects_of(command.deed);
      for (size_t i = 0; i < objects.size(); ++i) write_text(knowledge_->name(objects[i]), message->objects[i]);
    }
    action_.send(now_ns);
  }

  static void write(std::string_view text, Array<char>& into) {
    into.resize(text.size());
    std::copy_n(text.begin(), into.size, into.data());
  }
  void send(Output<TextStatus>& output, std::string_view text, int64_t now_ns) {
    TextStatus* message = output.loan();
    if (message == nullptr) return;
    write(text, message->text);
    output.send(now_ns);
  }

  void send_texts(int64_t now_ns) {
    client_->write_status(text_);
    send(status_, text_, now_ns);
    if (const std::string_view said = client_->speech(); !said.empty()) send(speech_, said, now_ns);
    if (plan_sent_ != client_->plan_revision()) {
      plan_sent_ = client_->plan_revision();
      client_->write_plan(text_);
      send(plan_, text_, now_ns);
    }
    RobotTask* taken = taken_.loan();
    if (taken == nullptr) return;
    taken->number = task_number_;
    write(client_->task(), taken->text);
    taken_.send(now_ns);
  }

  void send_map(int64_t now_ns) {
    ObjectReports* message = map_.loan();
    if (message == nullptr) return;
    const auto& map = knowledge_->map();
    const auto& network = map.network();
    message->in_map = 1;
    for (NodeId node = 0; node < network.end(); ++node) {
      if (!network.exists(node) || network.kind(node) != semantic::Kind::object) continue;
      const semantic::Object& object = map.object(node);
      ObjectName name;
      write_text(network.name(node), name.name);
      const auto types = network.omega(node, semantic::Kind::type);
      if (!types.empty()) write_text(network.name(types[0]), name.type);
      if (!message->names.push_back(name)) break;
      uint32_t states = 0;
      for (const semantic::State& state : std::span(object.states).first(object.state_count)) {
        ObjectAttribute attribute;
        write_text(network.name(state.attribute), attribute.name);
        write_text(semantic::to_text(map.attribute(state.attribute), state.value), attribute.value);
        states += message->attributes.push_back(attribute) ? 1 : 0;
      }
      message->places.push_back({static_cast<float>(object.x_m), static_cast<float>(object.y_m), 0, 0,
                                 static_cast<float>(object.confidence), static_cast<float>(states)});
    }
    map_.send(now_ns);
    map_sent_ = knowledge_->revision();
  }

  static constexpr uint32_t kCharacters = 2000;
  static constexpr int64_t kLongestGap_ns = 500'000'000;  ///< between two poses of the odometry
  static constexpr int64_t kNever = INT64_MIN, kLongestStep_ns = 500'000'000;

  Input<ObjectReports> objects_{this, "objects", "objects by name, map or robot frame; depth 4", Need::optional};
  Input<Odometry> odometry_{this, "odometry", "the robot's pose in the map; without a new one it stands"};
  Input<Grid> grid_{this, "grid", "what is free, axes of the map frame; none: ways are straight lines", Need::optional};
  Input<RobotTask> task_{this, "task", "what somebody wants", Need::optional};
  Input<ActionOutcome> outcome_{this, "outcome", "how far the commanded action is", Need::optional};
  Input<StopCommand> stop_{this, "stop", "while it says stop or is silent the robot stands", Need::optional};
  Output<VelocityCommand> velocity_{this, "velocity", "what the base is to do, with every job"};
  Output<ActionCommand> action_{this, "action", "the newest action to be carried out, with every job"};
  Output<TextStatus> plan_{this, "plan", "the plan, what its steps were to take and took; when it changes"};
  Output<TextStatus> status_{this, "status", "one line: state, task, step, what is left"};
  Output<TextStatus> speech_{this, "speech", "what it says to the giver of the task"};
  Output<RobotTask> taken_{this, "taken", "number of the newest task taken; its text while it is under way"};
  Output<ObjectReports> map_{this, "map", "all that it knows of objects; when it changes"};

  Param<std::string> network_{this, "network", "", kPath, "predefined network (YAML): types, actions, objects"};
  Param<std::string> words_{this, "task", "", "", "a task, for `takt robot`: a number before it makes it another"};
  Param<double> reach_{this, "reach", 0.78, {0.1, 5.0}, "m", "so near to all objects of an action the robot drives"};
  Param<double> width_{this, "robot_width", obstacle_stop::kRobotWidth_m, {0.1, 5.0}, "m", "as obstacle_stop has it"};
  Param<double> length_{this, "robot_length",           obstacle_stop::kRobotLength_m, {0.1, 5.0},
                        "m",  "as obstacle_stop has it"};
  Param<double> margin_{this,       "margin", obstacle_stop::kMargin_m,
                        {0.0, 1.0}, "m",      "as obstacle_stop has it: ways keep it however the robot turns"};
  Param<double> speed_{this, "speed", 0.8, {0.05, 3.0}, "m/s", "largest speed"};
  Param<double> turn_{this, "turn", 0.8, {0.05, 3.0}, "rad/s", "largest turn rate"};
  Param<int> plans_{this, "plans", 3, {1, 100}, "", "for one goal, until it is given up"};
  Param<double> patience_{this, "patience",
                          20.0, {0.0, 3600.0},
                          "s",  "while no way leads to an object: the plan is looked for again once a second"};
  Param<double> settle_{this, "settle", 3.0, {0.0, 60.0}, "s", "after an action, until what it changed must be seen"};
  Param<double> explore_far_{this, "explore_far", 8.0, {1.0, 1000.0}, "m", "from where exploring began"};
  Param<double> odometry_age_{this, "odometry_age", 0.5, {0.05, 10.0}, "s", "an older pose is none"};
  Param<int> expansions_a_job_{this, "expansions", 2000, {10, 1000000}, "", "states that planning looks at in one job"};
  Param<double> reserve_{this, "reserve", 0.002, {0.0, 1.0}, "s", "of a job's time that planning leaves"};
  Param<int> capacity_{this,        "capacity", 500, {50, 20000}, "", "nodes of the network, objects among them",
                       kSizesMemory};

  std::optional<Knowledge> knowledge_;
  std::optional<Client> client_;
  PoseTrack track_{InputPort::kMaxDepth, kLongestGap_ns};
  int64_t looked_ns_ = INT64_MIN;
  std::vector<ReportedState> states_;
  std::string text_, last_words_;
  size_t expansions_ = 0;
  int64_t reserve_ns_ = 0, odometry_age_ns_ = 0, last_ns_ = kNever;
  uint32_t task_number_ = 0;
  uint32_t plan_sent_ = 0, map_sent_ = 0;  ///< revisions of what was sent; 0: nothing
  bool restarted_ = false, told_of_grid_ = false;
};

}  // namespace

void register_robot_client(NodeTypes& types) {
  types.add<RobotClientNode>("robot_client", Layer::storage,
                             "Tasks to drives and actions: plans, and looks what came of it");
}

}  // namespace takt
