// SPDX-License-Identifier: Apache-2.0
#include "nodes/robot_client/client.hpp"

#include <fmt/format.h>

#include <numbers>

#include "rt/msg/ace/action.hpp"

namespace takt::robot_client {
namespace {

constexpr double kMoved_m = 0.2;  // an object that was driven to, and is elsewhere now
constexpr size_t kMostRecords = 64, kMostExploringTroubles = 5;
constexpr size_t kMostText = 16'384, kMostValues = 10'000;  // that is remembered

}  // namespace

Client::Client(Knowledge& knowledge, const ClientParameters& parameters)
    : knowledge_(knowledge),
      parameters_(parameters),
      driving_(parameters.driving),
      deliberation_(knowledge, parameters.deliberation) {}

void Client::remember(StateArchive& archive) {
  TAKT_STATE(archive, driving_, deliberation_, costs_, mode_, robot_, now_ns_, time_s_, halted_, news_, shut_since_ns_,
             next_plan_ns_, task_, task_text_, trouble_, legs_, troubles_, nothing_left_, acted_, deed_, goals_, plans_,
             step_, first_record_, records_, expected_, driven_, settling_, acted_ns_, since_s_, targets_, command_,
             speech_, plan_revision_);
  archive.room(kMostText + kMostRecords * 2 * sizeof(StepRecord) + planner::kMostSteps * sizeof(StepRecord) +
               kMostFacts * sizeof(planner::Goal) + kMostValues * sizeof(uint32_t) + kMostRoles * sizeof(Place));
}

// Tasks ---------------------------------------------------------------------------------------------------------------

void Client::say(std::string_view text) {
  if (!speech_.empty()) speech_ += '\n';
  speech_ += text;
}

std::string_view Client::speech() {
  said_.swap(speech_);
  speech_.clear();
  return said_;
}

void Client::take(std::string_view text) {
  auto task = parse_task(text);
  if (!task) return say(task.error());
  if (informs(task->verb)) return task->verb == Verb::tell ? tell(*task) : edit(*task);
  if (task_) say(fmt::format("I leave off: {}", task_text_));
  forget_task();
  if (task->verb == Verb::stop) return say("I stop");
  task_ = std::move(*task);
  task_text_ = text;
  records_.clear();
  ++plan_revision_;
}

void Client::tell(const Task& task) {
  for (const FactText& text : task.facts) {
    const auto fact = knowledge_.understand(text);
    if (!fact) {
      say(fact.error());
    } else {
      knowledge_.believe(*fact);
      say(fmt::format("I believe that {}", knowledge_.to_text(*fact)));
    }
  }
  news_ = true;
}

/// What rests on an object is gone with it, as another may get its id.
void Client::edit(const Task& task) {
  const bool removes = task.verb == Verb::remove;
  if (removes && task_ && (task_->verb == Verb::goal || task_->verb == Verb::act))
    return say(fmt::format("{} stays until this is over: {}", task.words[0], task_text_));
  const auto object = knowledge_.object_named(task.words.back());
  const auto done = knowledge_.edit(task);
  if (!done) return say(done.error());
  say(fmt::format("I believe that {}", *done));
  news_ = true;
  if (!removes) return;
  const auto rests_on_it = [&](const Deed& deed) {
    return std::find(deed.objects.begin(), deed.objects.end(), *object) != deed.objects.end();
  };
  if (rests_on_it(command_.deed)) command_.deed = {};
  if (std::erase_if(records_, [&](const StepRecord& r) { return rests_on_it(r.deed); }) > 0) ++plan_revision_;
}

void Client::forget_task() {
  fire(Event::stop);
  driving_.stand();
  task_.reset();
  trouble_.clear();
  legs_ = troubles_ = 0;
  acted_ = nothing_left_ = driven_ = settling_ = false;
  deed_ = {};
  plans_ = 0;
}

/// The task is over, well or not.
void Client::end(std::string_view what) {
  say(fmt::format("{}: {}", task_text_, what));
  forget_task();
  ++plan_revision_;
}

// Steps ---------------------------------------------------------------------------------------------------------------

navigation::Velocity Client::step(const Percept& percept) {
  now_ns_ = percept.now_ns;
  halted_ = percept.stop || !percept.robot;
  navigation::Velocity velocity;
  if (percept.robot && percept.stop && percept.obstacle) {
    velocity = driving_.halt_before_obstacle(*percept.robot, percept.dt_s);
    if (driving_.progress() == Progress::under_way) return velocity;
  } else if (halted_) {
    driving_.halt();
    return {};
  } else {
    time_s_ += percept.dt_s;
    velocity = driving_.step(*percept.robot, percept.dt_s);
  }
  robot_ = *percept.robot;
  switch (mode_.state) {
    case State::idle: be_idle(); break;
    case State::planning: think(percept.effort); break;
    case State::execute: execute(); break;
    case State::drive: drive(); break;
    case State::action: act(percept.outcome); break;
  }
  news_ = false;
  return velocity;
}

void Client::be_idle() {
  if (!task_) return;
  switch (task_->verb) {
    case Verb::goal: return begin_goal();
    case Verb::act: return go_on_with_deed();
    case Verb::explore: return go_on_exploring();
    case Verb::drive: return single_leg([&] { driving_.to_place({task_->x_m, task_->y_m}); });
    case Verb::rotate: return single_leg([&] { driving_.rotate(task_->amount); });
    case Verb::ahead: return single_leg([&] { driving_.ahead(task_->amount); });
    case Verb::tell:
    case Verb::add:
    case Verb::move:
    case Verb::remove:
    case Verb::stop: return;
  }
}

template <class Begin>
void Client::single_leg(Begin begin) {
  if (!trouble_.empty()) return end(trouble_);
  if (legs_ > 0) return end("done");
  begin();
  since_s_ = time_s_;
  fire(Event::drive_to);
}

void Client::go_on_with_deed() {
  if (!trouble_.empty()) return end(trouble_);
  if (acted_) return end("done");
  if (deed_.action == kNoNode) {
    const auto deed = knowledge_.understand(std::span<const std::string>(task_->words));
    if (!deed) return end(deed.error());
    deed_ = *deed;
  }
  if (legs_ > 0 || in_reach(deed_)) return perform(deed_);
  drive_to_objects(deed_);
}

/// A turn to look around, what is unknown, a turn ...
void Client::go_on_exploring() {
  if (nothing_left_) return end("nothing unknown that can be got to is near");
  if (driving_.planner() == nullptr) return end("there is no grid that says what is unknown");
  if (legs_ == 0) driving_.begin_exploring(robot_);
  if (!trouble_.empty() && ++troubles_ == kMostExploringTroubles) return end(trouble_);
  trouble_.clear();
  since_s_ = time_s_;
  if (legs_ % 2 == 0) driving_.rotate(2 * std::numbers::pi);
  else driving_.to_unknown();
  fire(Event::drive_to);
}

// Goals ---------------------------------------------------------------------------------------------------------------

void Client::begin_goal() {
  goals_.clear();
  for (const FactText& text : task_->facts) {
    const auto goal = knowledge_.understand(text);
    if (!goal) return end(goal.error());
    goals_.push_back(*goal);
  }
  plans_ = 0;
  shut_since_ns_.reset();
  next_plan_ns_ = now_ns_;
  fire(Event::plan_task);
  begin_plan();
}

void Client::begin_plan() {
  ++plans_;
  trouble_.clear();
  driven_ = settling_ = false;
  if (const auto begun = deliberation_.begin(goals_, robot_, costs_); !begun) {
    fire(Event::no_plan);
    end(begun.error());
  }
}

/// True while it may still open: the plan is then looked for again, once a second, and the robot turns about, since the
/// map keeps whoever has gone where nobody looks any more.
bool Client::waits_for_way(const std::string& why) {
  if (parameters_.patience_s <= 0) return false;
  if (!shut_since_ns_) {
    shut_since_ns_ = now_ns_;
    say(why + "; I look around and wait");
    if (driving_.planner() != nullptr) driving_.rotate(2 * std::numbers::pi);
  }
  if (static_cast<double>(now_ns_ - *shut_since_ns_) >= parameters_.patience_s * 1e9) return false;
  next_plan_ns_ = now_ns_ + 1'000'000'000;
  return deliberation_.begin(goals_, robot_, costs_).has_value();
}

void Client::think(const planner::Effort& effort) {
  if (now_ns_ < next_plan_ns_) return fire(Event::wait);
  if (!deliberation_.go_on(driving_.planner(), effort)) return fire(Event::wait);
  const planner::Plan& plan = deliberation_.plan();
  if (!plan.exists() || plan.steps.empty()) {
    const std::string far = plan.exists() ? "" : deliberation_.out_of_reach();
    if (!far.empty() && waits_for_way(far)) return fire(Event::wait);
    fire(Event::no_plan);
    if (plan.exists()) return end(records_.empty() ? "it is so already" : "done");
    std::string why =
        plan.verdict == planner::Verdict::none ? "no plan leads there" : "no plan was found in the time that was left";
    if (!far.empty()) why += "; " + far;
    return end(why);
  }
  shut_since_ns_.reset();
  fire(Event::plan_found);
  step_ = 0;
  expected_.assign(deliberation_.domain().variables.size(), 0);
  std::erase_if(records_, [](const StepRecord& r) { return r.action_took_s < 0; });
  if (records_.size() > kMostRecords) records_.clear();
  first_record_ = records_.size();
  for (const planner::Step& step : plan.steps)
    records_.push_back({deed_of(deliberation_.domain().actions[step.action]), static_cast<double>(step.drive_ns) * 1e-9,
                        static_cast<double>(step.action_ns) * 1e-9});
  ++plan_revision_;
}

Deed Client::deed_of(const planner::GroundAction& action) const {
  Deed deed;
  deed.action = action.action;
  std::copy(action.objects.begin(), action.objects.end(), deed.objects.begin());
  return deed;
}

void Client::plan_again(std::string_view why) {
  if (plans_ >= parameters_.plans) {
    const std::string reason = fmt::format("given up after {} plans: {}", plans_, why);
    fire(Event::failed);
    return end(reason);
  }
  say(fmt::format("{}; I plan again", why));
  fire(Event::differs);
  begin_plan();
}

/// Between legs and actions: is the world as expected, and what comes next?
void Client::execute() {
  if (!trouble_.empty()) return plan_again(std::string(trouble_));
  if (settling_ && difference() && time_s_ - since_s_ < parameters_.settle_s) return fire(Event::wait);
  if (settling_) believe_what_is_not_seen();
  settling_ = false;
  if (const auto what = difference()) return plan_again(*what);
  if (step_ == deliberation_.plan().steps.size()) {
    fire(Event::goal_reached);
    return end("done");
  }
  const Deed deed = deed_of(ground_action());
  if (driven_) return perform(deed);
  drive_to_objects(deed);
}

std::optional<std::string> Client::difference() const {
  const auto& variables = deliberation_.domain().variables;
  const auto& map = knowledge_.map();
  for (size_t i = 0; i < variables.size(); ++i) {
    const planner::Variable& v = variables[i];
    const semantic::Value real = map.state(v.object, v.attribute), &expected = v.values[expected_[i]];
    if (real == expected) continue;
    const auto& attribute = map.attribute(v.attribute);
    return fmt::format("{}.{} is {}, and not {}", knowledge_.name(v.object), knowledge_.name(v.attribute),
                       semantic::to_text(attribute, real), semantic::to_text(attribute, expected));
  }
  return std::nullopt;
}

void Client::expect_results() {
  for (const planner::Fact& fact : ground_action().results) expected_[fact.variable] = fact.value;
}

/// Of what nobody has looked at since the action nothing else is known than what the action does.
void Client::believe_what_is_not_seen() {
  for (const semantic::Clause& c : knowledge_.map().action(command_.deed.action).results) {
    const NodeId object = command_.deed.objects[c.role];
    if (knowledge_.map().object(object).seen_ns <= acted_ns_) knowledge_.believe({object, c.attribute, c.value});
  }
}

// Legs ----------------------------------------------------------------------------------------------------------------

void Client::drive_to_objects(const Deed& deed) {
  targets_ = knowledge_.places(knowledge_.objects_of(deed));
  driving_.to_objects(targets_, parameters_.deliberation.reach_m);
  deed_ = deed;
  if (mode_.state == State::drive) return;  // another way for the same leg
  since_s_ = time_s_;
  fire(Event::drive_to);
}

bool Client::in_reach(const Deed& deed) const {
  const auto places = knowledge_.places(knowledge_.objects_of(deed));
  const Disc reach{{robot_.x_m, robot_.y_m}, parameters_.deliberation.reach_m};
  return std::all_of(places.begin(), places.end(), [&](const Place& place) { return reach.contains(place); });
}

bool Client::targets_moved() const {
  const auto places = knowledge_.places(knowledge_.objects_of(deed_));
  return !std::equal(places.begin(), places.end(), targets_.begin(), [](const Place& now, const Place& then) {
    return Disc{then, kMoved_m}.contains(now);
  });
}

void Client::drive() {
  if (news_ && deed_.action != kNoNode) {
    if (executing() && difference()) {
      driving_.stand();
      return fire(Event::failed);  // EXECUTE finds the same and plans again
    }
    if (targets_moved()) return drive_to_objects(deed_);
  }
  switch (driving_.progress()) {
    case Progress::under_way: return fire(Event::wait);
    case Progress::nothing_left: nothing_left_ = true; [[fallthrough]];
    case Progress::arrived:
      ++legs_;
      if (executing()) {
        driven_ = true;
        records_[first_record_ + step_].drive_took_s = time_s_ - since_s_;
        ++plan_revision_;
      }
      return fire(Event::arrived);
    case Progress::failed:
      ++legs_;
      trouble_ = driving_.reason();
      if (deed_.action != kNoNode)
        trouble_ = fmt::format("{} cannot be driven to: {}", knowledge_.to_text(deed_), trouble_);
      return fire(Event::failed);
  }
}

// Actions -------------------------------------------------------------------------------------------------------------

void Client::perform(const Deed& deed) {
  ++command_.number;
  command_.deed = deed;
  since_s_ = time_s_;
  fire(Event::perform_action);
}

void Client::act(const Outcome& outcome) {
  const double declared_s = knowledge_.map().action(command_.deed.action).cost_s;
  const double so_far_s = time_s_ - since_s_;
  const bool ours = outcome.number == command_.number;
  const auto fail = [&](std::string_view why) {
    trouble_ = fmt::format("{}: {}", knowledge_.to_text(command_.deed), why);
    fire(Event::failed);
  };
  if (ours && outcome.state == action_state::done) return finish_action(outcome.duration_s);
  if (ours && (outcome.state == action_state::refused || outcome.state == action_state::failed))
    return fail(outcome.reason.empty() ? "it has failed, nobody says why" : outcome.reason);
  if (!ours && so_far_s > parameters_.answer_s) return fail("nobody takes the action up");
  if (so_far_s > declared_s + parameters_.endless_s) return fail("the action has no end");
  fire(Event::wait);
}

void Client::finish_action(double took_s) {
  const NodeId action = command_.deed.action;
  costs_.learn(action, knowledge_.map().action(action).cost_s, took_s);
  acted_ = true;
  acted_ns_ = now_ns_;
  since_s_ = time_s_;
  if (executing()) {
    records_[first_record_ + step_].action_took_s = took_s;
    expect_results();
    ++step_;
    driven_ = false;
    settling_ = true;
    ++plan_revision_;
  } else {
    believe_what_is_not_seen();
  }
  fire(Event::action_done);
}

}  // namespace takt::robot_client
