// SPDX-License-Identifier: Apache-2.0
// The semantic robot client (thesis Sec. 5.3.3; ): takes tasks, plans, drives, acts,
// compares what it finds with what it expects, and says what it does. Plain data in and out, one step a job.
#pragma once
#include "nodes/robot_client/deliberation.hpp"
#include "nodes/robot_client/driving.hpp"
#include "nodes/robot_client/state_machine.hpp"
#include "rt/state_archive.hpp"

namespace takt::robot_client {

struct ClientParameters {
  DrivingParameters driving;
  DeliberationParameters deliberation;
  int plans = 3;           ///< for one goal, until it is given up
  double patience_s = 20;  ///< while no way leads to the objects: somebody may stand in it who goes on
  double settle_s = 3;     ///< after an action, until what it changed must be seen
  double answer_s = 3;     ///< until somebody must have taken an action up
  double endless_s = 120;  ///< an action beyond its time by so much has no end
};

/// How far an action is; as the message ActionOutcome.
struct Outcome {
  uint32_t number = 0;
  uint8_t state = 0;  ///< action_state
  double duration_s = 0;
  std::string_view reason;
};

/// What a step goes by.
struct Percept {
  int64_t now_ns = 0;
  double dt_s = 0;                  ///< since the step before
  std::optional<PlanarPose> robot;  ///< in the map; none: not known, and the robot has to stand
  bool stop = false;                ///< the robot has to stand
  bool obstacle = false;            ///< and that for nothing but an obstacle
  Outcome outcome;
  planner::Effort effort;  ///< of this step's thinking
};

struct Command {
  uint32_t number = 0;  ///< 0: none yet
  Deed deed;
};

/// Foreseen and taken, s; -1: not yet.
struct StepRecord {
  Deed deed;
  double drive_s = 0, action_s = 0;
  double drive_took_s = -1, action_took_s = -1;
};

/// Memory for the searches is taken by the constructor; tasks, plans and what is said take more. One thread at a time.
class Client {
 public:
  explicit Client(Knowledge& knowledge, const ClientParameters& parameters);

  /// From the next step() on, but for what its parts leave as it was.
  void tune(const ClientParameters& parameters) {
    parameters_ = parameters;
    driving_.tune(parameters.driving);
    deliberation_.tune(parameters.deliberation);
  }

  /// The newest grid of the map. False: larger than the constructor was told.
  bool look(const navigation::OccupancyView& grid) { return driving_.look(grid); }
  /// After objects were reported.
  void note_news() { news_ = true; }
  /// A task in words; it ends what is under way, unless it says something of the world.
  void take(std::string_view text);
  /// The numbers of commands go on after this one.
  void go_on_after(uint32_t command) { command_.number = command; }

  /// What the base is to do.
  navigation::Velocity step(const Percept& percept);

  const Mode& mode() const { return mode_; }
  const Command& command() const { return command_; }
  /// What it is at; empty: nothing.
  std::string_view task() const { return task_ ? std::string_view(task_text_) : std::string_view(); }
  /// Steps done for the task, and those of the present plan.
  std::span<const StepRecord> records() const { return records_; }
  const planner::ActionCosts& costs() const { return costs_; }

  /// What was said since the last call, line by line; what it returns stays valid until the next step.
  std::string_view speech();
  /// One line.
  void write_status(std::string& into) const;
  /// The plan with its times and how far it is.
  void write_plan(std::string& into) const;
  /// Rises whenever the plan's text has changed.
  uint32_t plan_revision() const { return plan_revision_; }
  /// After the knowledge.
  void remember(StateArchive& archive);

 private:
  void fire(Event event) { mode_ = next(mode_, event).value_or(mode_); }
  void say(std::string_view text);
  void tell(const Task& task);
  void edit(const Task& task);
  void end(std::string_view what);
  void forget_task();

  void be_idle();
  void begin_goal();
  void think(const planner::Effort& effort);
  void begin_plan();
  bool waits_for_way(const std::string& why);
  void plan_again(std::string_view why);
  void execute();
  void drive();
  void act(const Outcome& outcome);

  void go_on_with_deed();
  void go_on_exploring();
  /// A leg of the task's own, out of IDLE; then what is said.
  template <class Begin>
  void single_leg(Begin begin);
  void drive_to_objects(const Deed& deed);
  bool in_reach(const Deed& deed) const;
  bool targets_moved() const;
  void perform(const Deed& deed);
  void finish_action(double took_s);
  void expect_results();
  void believe_what_is_not_seen();
  std::optional<std::string> difference() const;
  bool executing() const { return mode_.state == State::execute || mode_.caller == State::execute; }
  const planner::GroundAction& ground_action() const {
    return deliberation_.domain().actions[deliberation_.plan().steps[step_].action];
  }
  Deed deed_of(const planner::GroundAction& action) const;

  Knowledge& knowledge_;
  ClientParameters parameters_;
  Driving driving_;
  Deliberation deliberation_;
  planner::ActionCosts costs_;

  Mode mode_;
  PlanarPose robot_;
  int64_t now_ns_ = 0;
  double time_s_ = 0;  ///< that the robot was not made to stand
  bool halted_ = false, news_ = false;
  std::optional<int64_t> shut_since_ns_;  ///< since when no way leads to the objects of the plan that is looked for
  int64_t next_plan_ns_ = 0;              ///< then the next one is looked for

  std::optional<Task> task_;
  std::string task_text_;
  std::string trouble_;  ///< why the newest leg or action failed; empty: it did not
  size_t legs_ = 0;      ///< of a task out of IDLE that are over
  size_t troubles_ = 0;  ///< of exploring
  bool nothing_left_ = false;
  bool acted_ = false;
  Deed deed_;  ///< of a task that names one

  std::vector<planner::Goal> goals_;
  int plans_ = 0;
  size_t step_ = 0, first_record_ = 0;  ///< of the present plan
  std::vector<StepRecord> records_;
  std::vector<uint32_t> expected_;  ///< values by the domain's variables
  bool driven_ = false, settling_ = false;
  int64_t acted_ns_ = 0;
  double since_s_ = 0;  ///< time_s_ at which the leg, the action or settling began
  std::vector<Place> targets_;

  Command command_;
  std::string speech_, said_;
  uint32_t plan_revision_ = 1;
};

}  // namespace takt::robot_client
