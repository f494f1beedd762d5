// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "nodes/mission/mission.hpp"
#include "nodes/mission/pointing.hpp"
#include "nodes/semantic/reports.hpp"
#include "nodes/semantic/script.hpp"
#include "rt/msg/ace/body_poses.hpp"
#include "rt/msg/ace/digital_state.hpp"
#include "rt/msg/ace/object_reports.hpp"
#include "rt/msg/ace/robot_task.hpp"
#include "rt/msg/grid.hpp"
#include "rt/msg/odometry.hpp"
#include "rt/msg/point.hpp"
#include "rt/msg/point_cloud.hpp"
#include "rt/msg/pose.hpp"
#include "rt/msg/requests.hpp"
#include "rt/msg/text_status.hpp"
#include "rt/node.hpp"

namespace takt {
namespace {

using namespace mission;
using drive_arbiter::VisionState;

class MissionNode final : public Node {
 public:
  void setup(Setup&) override {
    mission_.emplace(parameters(), ways(), grid_.capacity().pixels());
    set_nodes(VisionState::search, search_nodes_);
    set_nodes(VisionState::pose, pose_nodes_);
    set_nodes(VisionState::tracking, tracking_nodes_);
    requests_.reserve({0, 0, 1, static_cast<uint32_t>(std::max<size_t>(1, paced_.size()))});
    for (OutputPort* text : {static_cast<OutputPort*>(&task_), static_cast<OutputPort*>(&wanted_),
                             static_cast<OutputPort*>(&status_), static_cast<OutputPort*>(&speech_)})
      text->reserve({0, 0, 1, kCharacters});
  }

  void changed() override { mission_->tune(parameters(), ways()); }

  void start(int64_t) override {
    if (const RobotTask* last = task_.handed_over()) mission_->go_on_after(last->number);
  }

  void run(Job& job) override {
    RobotTask* task = task_.loan();
    TextStatus* wanted = wanted_.loan();
    TextStatus* status = status_.loan();
    Requests* requests = requests_.loan();
    if (!task || !wanted || !status || !requests) return job.no_result();
    const State before = mission_->state();
    const bool stepped = !odometry_.empty() && !odometry_.stale();
    if (stepped) step(job.release_ns());
    if (mission_->state() != before) say(job);

    const MissionTask told = mission_->task();
    task->number = told.number;
    write(told.text, task->text);
    task_.send(job.release_ns());
    const VisionState vision = vision_of(mission_->state());
    write(drive_arbiter::kVisionStates[static_cast<size_t>(vision)], wanted->text);
    wanted_.send(job.release_ns());
    for (const Paced& paced : paced_)
      if (paced.runs_in != vision) requests->wanted.push_back(paced.stop);
    requests_.send(job.release_ns());
    tell(*status);
    status_.send(job.release_ns());
    if (const std::string_view speech = mission_->speech(); stepped && !speech.empty()) {
      TextStatus* said = speech_.loan();
      if (!said) return job.no_result();
      write(speech, said->text);
      speech_.send(job.release_ns());
    }
  }

  void remember(StateArchive& archive) override { TAKT_STATE(archive, mission_, answered_); }

 private:
  /// A node that runs in one state of vision only.
  struct Paced {
    VisionState runs_in;
    Request stop;
  };

  MissionParameters parameters() const {
    MissionParameters p;
    p.view_m = view_;
    p.readings = static_cast<size_t>(readings_());
    p.stop_before_m = stop_before_;
    p.cross_least_m = cross_least_;
    p.patience_s = patience_;
    p.crossings = crossings_;
    p.beyond_m = beyond_;
    return p;
  }

  WayAheadParameters ways() const {
    WayAheadParameters ways;
    ways.path.clearance_m = clearance_;
    return ways;
  }

  void set_nodes(VisionState vision, const Param<std::string>& nodes) {
    const auto list = semantic::parse_node_list(nodes());
    if (!list) throw SetupError(std::string(nodes.name()) + ": " + list.error());
    for (const std::string& node : *list) {
      Paced paced{vision, {}};
      paced.stop.run = 0;
      node.copy(paced.stop.node, sizeof paced.stop.node - 1);
      paced_.push_back(paced);
    }
  }

  void step(int64_t now_ns) {
    const Odometry& odometry = *odometry_.newest();
    Percept percept;
    percept.now_ns = now_ns;
    percept.robot = {odometry.x_m, odometry.y_m, odometry.theta_rad};
    percept.speed_m_s = odometry.speed_m_s;
    look_for_pedestrian(percept);
    percept.sign = sign(percept.robot);
    percept.leader = !leader_.connected() || (!leader_.empty() && !leader_.stale());
    if (const RobotTask* taken = taken_.newest(); taken != nullptr && taken->text.size == 0)
      percept.over = taken->number;
    navigation::OccupancyView view;
    if (const Grid* grid = grid_.newest(); grid != nullptr && is_map(*grid)) {
      view = {grid->view(), grid->cell_m, grid->origin_x_m + grid->grid_in_map.x,
              grid->origin_y_m + grid->grid_in_map.y};
      percept.grid = &view;
    }
    percept.answer = new_answer();
    mission_->step(percept);
  }

  /// What was touched since the last step. What had been touched before the first one belongs to an earlier mission.
  std::string_view new_answer() {
    const RobotTask* answer = answers_.newest();
    if (answer == nullptr || answered_ == answer->number) return {};
    const bool first = !answered_;
    answered_ = answer->number;
    return first ? std::string_view{} : std::string_view{answer->text.data(), answer->text.size};
  }

  /// The nearest one, and where he points.
  void look_for_pedestrian(Percept& percept) {
    const ObjectReports* reports = objects_.stale() ? nullptr : objects_.newest();
    if (reports == nullptr || reports->in_map != 0) return;
    double nearest = std::numeric_limits<double>::infinity();
    ObjectPlace place{};
    semantic::for_each_report(*reports, [&](const semantic::Report& report) {
      const double distance = std::hypot(report.place.x_m, report.place.y_m);
      if (report.type != std::string_view(pedestrian_()) || report.name.empty() || distance >= nearest) return;
      nearest = distance;
      place = report.place;
      percept.pedestrian = report.name;
    });
    percept.pedestrian_at = seen_from(percept.robot, place.y_m, place.x_m);
    if (percept.pedestrian.empty() || bodies_.empty() || !bodies_.is_new()) return;
    if (const auto pointed = pointed_direction(*bodies_.newest(), place.x_m, place.y_m))
      percept.pointed_rad = wrapped(percept.robot.theta_rad + *pointed);
  }

  /// What is so far ahead of the robot, and to its right; its x axis here is the driving direction.
  static navigation::Place seen_from(const PlanarPose& robot, double ahead_m, double right_m) {
    const PlanarPose at = compose(robot, {ahead_m, -right_m, 0});
    return {at.x_m, at.y_m};
  }

  /// The nearest sign that the newest image shows while a crossing is told.
  std::optional<navigation::Place> sign(const PlanarPose& robot) const {
    if (signs_.empty() || !signs_.is_new() || crossing_.empty() || (crossing_.newest()->levels & 1) == 0)
      return std::nullopt;
    const Point* nearest = nullptr;
    const auto distance = [](const Point& p) { return std::hypot(p.x, p.z); };  // camera frame: x right, z ahead
    for (const Point& p : signs_.newest()->points.items())
      if (distance(p) > 0 && (nearest == nullptr || distance(p) < distance(*nearest))) nearest = &p;
    if (nearest == nullptr) return std::nullopt;
    return seen_from(robot, nearest->z, nearest->x);
  }

  bool is_map(const Grid& grid) const {
    return grid.grid_in_map.qw == 1 && grid.cell_m > 0 && grid.width > 0 && grid.height > 0 &&
           grid.cells.size == static_cast<size_t>(grid.width) * static_cast<size_t>(grid.height);
  }

  static void write(std::string_view text, Array<char>& into) {
    into.resize(text.size());
    std::copy_n(text.begin(), into.size, into.data());
  }

  void say(Job& job) const {
    const std::string_view state = to_string(mission_->state()), trouble = mission_->trouble();
    const std::string_view why = trouble.empty() ? mission_->task().text : trouble;
    job.log(mission_->state() == State::failed ? LogLevel::warning : LogLevel::info, "%.*s | %.*s",
            static_cast<int>(state.size()), state.data(), static_cast<int>(why.size()), why.data());
  }

  void tell(TextStatus& status) const {
    const MissionTask task = mission_->task();
    std::array<char, kCharacters> line{};
    auto* end = fmt::format_to_n(line.data(), line.size(), "{} | {} | crossed {}", to_string(mission_->state()),
                                 mission_->trouble().empty() ? task.text : mission_->trouble(), mission_->crossed())
                    .out;
    if (const auto direction = mission_->direction_rad())
      end = fmt::format_to_n(end, static_cast<size_t>(line.data() + line.size() - end), " | direction {:.0f} deg",
                             *direction * 180 / std::numbers::pi)
                .out;
    write({line.data(), static_cast<size_t>(end - line.data())}, status.text);
  }

  static constexpr uint32_t kCharacters = 200;

  Input<ObjectReports> objects_{this, "objects", "people around, by name, robot frame; give the edge a max_age"};
  Input<Odometry> odometry_{this, "odometry", "the robot in the frame of the grid; without it nothing goes on"};
  Input<BodyPoses> bodies_{this, "bodies", "where people point"};
  Input<DigitalState> crossing_{this, "crossing", "line 0: a crossing is near, as traffic_signs tells"};
  Input<PointCloud> signs_{this, "signs", "where its signs are, as traffic_signs tells"};
  Input<Pose> leader_{this, "leader",
                      "who is followed, as person_tracking tells while it sees him; give the edge a max_age",
                      Need::optional};
  Input<Grid> grid_{this, "grid", "of the ground: what is occupied is no pavement; axes of the map frame"};
  Input<RobotTask> taken_{this, "taken", "of the robot client: its newest task, without text when it is over"};
  Input<RobotTask> answers_{this, "answers",
                            "touched on the robot's screen: left, ahead, right; yes, no; stop; of an interaction",
                            Need::optional};
  Output<RobotTask> task_{this, "task", "for the robot client, with every job"};
  Output<TextStatus> wanted_{this, "wanted", "search, pose or tracking, for drive_arbiter; with every job"};
  Output<Requests> requests_{this, "requests", "nodes that this state of vision does not need; with every job"};
  Output<TextStatus> status_{this, "status", "one line: state, task or trouble, crossings, direction"};
  Output<TextStatus> speech_{this, "speech", "what it says to who stands before it, when it does"};
  Param<std::string> pedestrian_{this, "pedestrian", "human", "", "type of those that can be asked"};
  Param<std::string> search_nodes_{this,        "search_nodes", "", "", "nodes that run in the state search only",
                                   kSizesMemory};
  Param<std::string> pose_nodes_{this, "pose_nodes", "", "", "nodes that run in the state pose only", kSizesMemory};
  Param<std::string> tracking_nodes_{this,        "tracking_nodes", "", "", "nodes that run in the state tracking only",
                                     kSizesMemory};
  Param<double> view_{this,       "view", MissionParameters{}.view_m,
                      {0.0, 5.0}, "m",    "from so far off the whole person asked is seen; nearer, it steps back"};
  Param<int> readings_{this, "readings", 8, {1, kMostReadings}, "", "of his arm, until the direction counts"};
  Param<double> stop_before_{this,        "stop_before", MissionParameters{}.stop_before_m,
                             {0.5, 20.0}, "m",           "so far from the sign of a crossing it waits"};
  Param<double> cross_least_{this,        "cross_least", MissionParameters{}.cross_least_m,
                             {0.5, 50.0}, "m",           "no crossing is narrower; counts from its sign on"};
  Param<double> patience_{this,         "patience", MissionParameters{}.patience_s,
                          {1.0, 600.0}, "s",        "without getting on along the direction"};
  Param<int> crossings_{this, "crossings", 1, {0, 20}, "", "on the way"};
  Param<double> beyond_{this,         "beyond", MissionParameters{}.beyond_m,
                        {0.5, 100.0}, "m",      "past the last crossing is the end"};
  Param<double> clearance_{this, "clearance", 0.75, {0.3, 2.0}, "m", "by which what is no pavement is kept off"};

  std::optional<Mission> mission_;
  std::optional<uint32_t> answered_;  ///< number of the newest answer that was looked at
  std::vector<Paced> paced_;
};

}  // namespace

void register_mission(NodeTypes& types) {
  types.add<MissionNode>("mission", Layer::storage,
                         "Finds its way through a town: asks, reads where people point, drives, is led across streets");
}

}  // namespace takt
