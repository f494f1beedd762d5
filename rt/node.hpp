// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/node.hpp>: core, stable.
// What a node author needs: Node, Input<T>, Output<T>, Param<T>, Setup, Job. A node declares its ports and parameters
// as members; the runtime calls setup() and start() once, run() once per job on one thread at a time, finish() after
// the last job.
#pragma once
#include <algorithm>
#include <array>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <type_traits>
#include <vector>

#include "rt/level.hpp"
#include "rt/log_line.hpp"
#include "rt/memory/job_calls.hpp"
#include "rt/msg/field.hpp"
#include "rt/param.hpp"
#include "rt/sched/append_log.hpp"
#include "rt/shm/transport.hpp"
#include "rt/source_state.hpp"
#include "rt/state_archive.hpp"
#include "rt/time/clock.hpp"
#include "rt/time/rate.hpp"

namespace takt {

class LogWriter;   // rt/sched/node_log.hpp
struct NodeState;  // rt/msg/node_state.hpp
struct Requests;   // rt/msg/requests.hpp

/// Thrown by Node::setup: what the node cannot work with. The graph adds file, line and id.
struct SetupError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Given to Node::setup. Only here may a node allocate, read files and throw SetupError.
struct Setup {
  const Clock& clock;
  std::filesystem::path directory;  ///< of the graph file; relative paths start here
  std::filesystem::path output;     ///< where a node may write files in finish(); exists
  uint64_t seed = 0;
  std::optional<Rate> rate;  ///< none: released by messages
  int64_t offset_ns = 0;     ///< the first release comes this long after the epoch
};

/// CPU time that a job may use.
struct CpuBudget {
  int64_t budget_ns = 0;           ///< 0: not stated
  int64_t used_before_ns = 0;      ///< reading of `used_ns` from which on this job is charged
  int64_t (*used_ns)() = nullptr;  ///< CPU clock of the calling thread; null: this job has used nothing yet
  int64_t left_ns() const { return budget_ns - (used_ns != nullptr ? used_ns() - used_before_ns : 0); }
};

/// What a job may ask the runtime, beside its inputs: Job::now_ns, Job::time_left_ns, a chunk to loan (noted only where
/// there was none), and Job::is_done.
enum class Question : uint8_t { now, time_left, chunk, done };

/// The answers that a job was given, in the same order, for its replay.
class RecordedAnswers {
 public:
  virtual ~RecordedAnswers() = default;
  virtual int64_t next(Question question) = 0;
};

/// What a job says of the results of its node.
struct ResultNotice {
  bool wrong = false;  ///< else doubtful
  BoundedText<160> why;
};

/// The mode in which the robot stands and stays where it is; `on_miss: safe_stop` and `on_overrun: safe_stop` enter it.
inline constexpr std::string_view kSafeStopMode = "safe_stop";

/// One activation of a node. All a job may observe besides its inputs comes from here (and is recorded).
class Job {
 public:
  int64_t release_ns() const { return release_ns_; }    ///< planned release
  int64_t deadline_ns() const { return deadline_ns_; }  ///< absolute
  uint64_t index() const { return index_; }             ///< 0, 1, 2 ... per node, skipped releases counted
  int64_t now_ns() const { return answer(Question::now, clock_->now_ns()); }
  /// How long the job may go on: to its deadline, and if the schedule gives it a budget, until that is used up,
  /// whichever comes first. Negative once it is over. In virtual time nothing has been used while a job runs. An
  /// anytime node asks between two portions of its work and publishes the best so far; each question costs a system
  /// call where there is a budget (0.2 us), so portions should take longer than that.
  int64_t time_left_ns() const {
    const int64_t to_deadline = deadline_ns_ - clock_->now_ns();
    return answer(Question::time_left, cpu_.budget_ns > 0 ? std::min(to_deadline, cpu_.left_ns()) : to_deadline);
  }
  /// Whether work that another thread does for this node is done, which only the node knows: noted, so that a replay is
  /// told the same. If the answer is true and the work is not done, this is a replay, and the job waits for it.
  bool is_done(bool done) const { return answer(Question::done, done ? 1 : 0) != 0; }
  int level() const { return level_; }  ///< index into the node's Levels; 0 full quality (on_overrun: degrade)
  std::string_view mode() const { return mode_; }
  /// Says that this device's recorded data are used up; the run ends after the jobs under way.
  void end_of_data() { end_of_data_ = true; }
  /// Says that the job could not do its work (device silent, input unusable); counted, the run goes on.
  void no_result() { no_result_ = true; }
  /// Says how what this job reads from outside the run stands; the mode of the run may depend on it. Said by each job
  /// that knows; without a word the state stays as it was.
  void source_state(const SourceReport& report) { source_ = report; }
  /// How late its source was, at most, since the job before, if that needs a processor of this machine as real ones do
  /// not. No proof allows for it.
  void source_late(int64_t late_ns) { source_late_ns_ = late_ns; }
  /// Says that what this node publishes is worse than it looks, or wrong, and why: kept among the faults of the run.
  /// Once when it begins, not in each job. One word a job, cut at 160 characters.
  void results_doubtful(std::string_view why) { notice_.emplace(ResultNotice{false, BoundedText<160>(why)}); }
  void results_wrong(std::string_view why) { notice_.emplace(ResultNotice{true, BoundedText<160>(why)}); }
  /// Says something in the log of the run, as std::printf takes it:
  ///
  ///   job.log(LogLevel::warning, "only %zu of %zu points fit", fitting, points.size());
  ///
  /// The line is in records, in `takt top`, on the page of `takt web`, and from `info` on in the output of `takt run`;
  /// under systemd in the journal with its level. It allocates nothing, takes 0.4 us (a dropped one 0.1), and is cut at 199
  /// bytes. A node may say ten lines at once and five a second on average (`warning` and `error`; the others count
  /// apart); more are dropped and counted, and the next line tells how many. What a replayed job says is passed over.
  [[gnu::format(printf, 3, 4)]] void log(LogLevel level, const char* format, ...);

  Job(const Clock& clock, uint64_t index, int64_t release_ns, int64_t deadline_ns, int level, std::string_view mode,
      const CpuBudget& cpu = {})
      : clock_(&clock),
        index_(index),
        release_ns_(release_ns),
        deadline_ns_(deadline_ns),
        cpu_(cpu),
        level_(level),
        mode_(mode) {}
  bool ended() const { return end_of_data_; }
  bool without_result() const { return no_result_; }
  const std::optional<SourceReport>& source_report() const { return source_; }
  int64_t source_late_ns() const { return source_late_ns_; }
  const std::optional<ResultNotice>& result_notice() const { return notice_; }
  /// In a replay.
  void answer_from(RecordedAnswers& recorded) { recorded_ = &recorded; }
  /// Where log() writes; nowhere until then.
  void log_to(LogWriter& log) { log_ = &log; }

 private:
  int64_t answer(Question question, int64_t value) const;

  const Clock* clock_;
  uint64_t index_;
  int64_t release_ns_, deadline_ns_;
  CpuBudget cpu_;
  int level_;
  std::string_view mode_;
  RecordedAnswers* recorded_ = nullptr;
  LogWriter* log_ = nullptr;
  bool end_of_data_ = false, no_result_ = false;
  int64_t source_late_ns_ = 0;
  std::optional<SourceReport> source_;
  std::optional<ResultNotice> notice_;
};

enum class Need : uint8_t { required, optional };

/// Type-erased input of a node. The runtime fills it before a job and empties it afterwards.
class InputPort {
 public:
  static constexpr uint32_t kMaxDepth = 64;
  InputPort(Node* owner, std::string_view name, const MessageType& type, std::string_view doc, Need need);
  InputPort(const InputPort&) = delete;
  InputPort& operator=(const InputPort&) = delete;

  std::string_view name() const { return name_; }
  std::string_view doc() const { return doc_; }
  const MessageType& type() const { return *type_; }
  Need need() const { return need_; }

  bool connected() const { return connected_; }
  /// In setup: how large the messages of this input can become.
  const Capacity& capacity() const { return capacity_; }
  /// In a job: number of latched messages, at most the edge's depth.
  size_t size() const { return held_count_; }
  bool empty() const { return held_count_ == 0; }
  /// In a job: nothing latched, older than max_age, or no complete set of a join.
  bool stale() const { return stale_; }
  int64_t stamp_ns(size_t i) const { return held_[i].stamp_ns; }
  int64_t stamp_ns() const { return held_[held_count_ - 1].stamp_ns; }  ///< of the newest; size() > 0
  /// True if message i was not latched by an earlier job.
  bool is_new(size_t i) const { return held_[i].sequence > last_seen_before_; }
  bool is_new() const { return held_count_ > 0 && is_new(held_count_ - 1); }
  /// Quality level of the job that made message i.
  int level(size_t i) const { return held_[i].header->level; }

 protected:
  const void* message(size_t i) const { return held_[i].message(); }

 private:
  friend class PortAccess;
  std::string_view name_, doc_;
  const MessageType* type_;
  Need need_;
  bool connected_ = false, stale_ = false;
  Capacity capacity_;
  std::array<Held, kMaxDepth> held_{};
  size_t held_count_ = 0;
  uint64_t last_seen_before_ = 0;
};

/// In a job: the newest `depth` messages visible at the job's release, oldest first. They do not change and stay valid
/// until run() returns.
template <class T>
class Input final : public InputPort {
 public:
  Input(Node* owner, std::string_view name, std::string_view doc, Need need = Need::required)
      : InputPort(owner, name, MessageType::of<T>(), doc, need) {}
  const T& operator[](size_t i) const { return *static_cast<const T*>(message(i)); }
  /// The newest message, null if there is none.
  const T* newest() const { return empty() ? nullptr : static_cast<const T*>(message(size() - 1)); }
};

/// Type-erased output of a node.
class OutputPort {
 public:
  OutputPort(Node* owner, std::string_view name, const MessageType& type, std::string_view doc);
  OutputPort(const OutputPort&) = delete;
  OutputPort& operator=(const OutputPort&) = delete;

  std::string_view name() const { return name_; }
  std::string_view doc() const { return doc_; }
  const MessageType& type() const { return *type_; }
  /// In setup: fixes how large the messages of this output can become. Types without arrays need no call.
  void reserve(const Capacity& capacity) { capacity_ = capacity; }
  const Capacity& capacity() const { return capacity_; }
  /// In the node's constructor: the stamps sent are those of these inputs; what comes by the others is only heeded, and
  /// adds nothing to the age of this output. Without a word they may be any input's, `control` apart.
  void stamped_by(std::initializer_list<const InputPort*> inputs) { stamped_by_ = inputs; }
  bool stamped_by(const InputPort& input) const {
    return stamped_by_.empty() || std::find(stamped_by_.begin(), stamped_by_.end(), &input) != stamped_by_.end();
  }
  /// False if nobody reads this output; a node may then save itself the work.
  bool connected() const { return connected_; }
  /// In a job: the loaned message is complete; the runtime publishes it when run() returns.
  /// `stamp_ns` is the time of validity, carried over from the input the result belongs to.
  void send(int64_t stamp_ns);

 protected:
  void* loan_message();
  void* loan_chunk();  ///< without a note if there is none
  const void* handed_over_ = nullptr;

 private:
  friend class Node;
  friend class PortAccess;
  std::string_view name_, doc_;
  const MessageType* type_;
  Capacity capacity_;
  std::vector<const InputPort*> stamped_by_;
  Writer* writer_ = nullptr;
  MessageHeader* loaned_ = nullptr;
  int64_t stamp_ns_ = 0;
  bool sent_ = false, connected_ = false;
};

template <class T>
class Output final : public OutputPort {
 public:
  Output(Node* owner, std::string_view name, std::string_view doc)
      : OutputPort(owner, name, MessageType::of<T>(), doc) {}
  /// In a job: an empty message to fill in place; null if every chunk is still held by consumers (counted).
  /// Again in one job: the same message until it is sent; then null, since a job has one for each output (counted).
  T* loan() { return static_cast<T*>(loan_message()); }
  /// In start: what this output published last, before the process of this node died and was started again; null at an
  /// ordinary start. So what a node needs to go on (a pose, a map) it gives as an output, which nobody need read.
  const T* handed_over() const { return static_cast<const T*>(handed_over_); }
};

/// Base of all nodes. Constructed on the main thread; not copyable.
class Node {
 public:
  Node() = default;
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;
  virtual ~Node() = default;

  virtual void setup(Setup& setup) = 0;
  /// Once the epoch (first planned instant of the run, shortly ahead) is fixed, before the first job, on the main
  /// thread: a hardware node starts its device here, a node that was restarted takes up what Output::handed_over() has.
  virtual void start(int64_t epoch_ns) { static_cast<void>(epoch_ns); }
  /// One job. No allocation, lock, file or socket call, logging or exception in here.
  virtual void run(Job& job) = 0;
  /// Makes anew what setup() made of parameters, and keeps all else; reads each such parameter, which makes it live:
  ///
  ///   void setup(Setup&) override { limits_ = Limits(speed_, turn_); }
  ///   void changed() override { limits_ = Limits(speed_, turn_); }
  ///
  /// Called once after setup(), then when a value was set: between two jobs, on the thread of these. It takes no memory
  /// (a parameter that is a text may), and its time is part of the next job. What it throws says why the values do not
  /// go together: the new one is refused, and it is called again with the one before.
  virtual void changed() {}
  /// What the node carries from one job to the next (rt/state_archive.hpp); nothing, if it is declared with nothing in
  /// it. Saved behind a job every few seconds of a run that is recorded, and loaded where a replay begins in the
  /// middle: after start(), without allocating while it saves. A node that does not declare this begins there as after
  /// a restart.
  virtual void remember(StateArchive& state) { state.fail(); }
  /// CPU time that threads of the node have taken beside its jobs, ns; asked after the last job.
  virtual int64_t helper_cpu_ns() const { return 0; }
  /// After the last job, on the main thread. Files may be written.
  virtual void finish() {}

  /// After setup(): calls changed(), and finds out which parameters are live. Throws what changed() does.
  void end_setup();
  /// Sets parameter `index` of params() between two jobs; or says why not, and all is as before.
  tl::expected<void, std::string> change(size_t index, const ParamValue& value);

  /// Gives the node its last input, `control`: requests to stop, start or pace it, which the runtime obeys.
  void accept_requests();
  /// Null if the node takes no requests.
  const Input<Requests>* control() const { return control_.get(); }
  /// The class of this node declares what it remembers.
  void declare_state() { declares_state_ = true; }
  bool declares_state() const { return declares_state_; }
  /// Gives such a node its last output, `state`, which the runtime fills. Before setup.
  void publish_state();
  /// After setup: sizes that output.
  void size_state();
  /// In a job: saves into that output. False: it is not sent, since no chunk is free.
  bool save_state(int64_t stamp_ns);
  /// After start(), in a replay. Error: why these bytes are not those of such a node.
  tl::expected<void, std::string> load_state(const NodeState& state);
  /// Null if there is none.
  const Output<NodeState>* state() const { return state_.get(); }

  /// In the constructor or in setup: jobs of this node make calls that no job should, and why. They are not counted as
  /// violations.
  void may(uint32_t calls, std::string_view reason);                     ///< bits of JobCall
  uint32_t allowed_calls() const { return allowed_calls_; }              ///< bits of JobCall
  std::string_view reason_of_calls() const { return reason_of_calls_; }  ///< empty if it declares none

  const std::vector<InputPort*>& inputs() const { return inputs_; }
  const std::vector<OutputPort*>& outputs() const { return outputs_; }
  const std::vector<ParamBase*>& params() const { return params_; }
  /// Best first, at least one.
  const std::vector<QualityLevel>& levels() const { return levels_; }

 private:
  friend class InputPort;
  friend class OutputPort;
  friend class ParamBase;
  friend class Levels;
  std::vector<InputPort*> inputs_;
  std::vector<OutputPort*> outputs_;
  std::vector<ParamBase*> params_;
  std::vector<QualityLevel> levels_{{"full", 1.0}};
  std::unique_ptr<Input<Requests>> control_;
  std::unique_ptr<Output<NodeState>> state_;
  uint64_t state_layout_ = 0;
  bool declares_state_ = false;
  uint32_t allowed_calls_ = 0;
  std::string_view reason_of_calls_;
};

/// Layers of the thesis (Sec. 2.2): an edge goes to the same, the next or the storage layer, or from storage to any.
enum class Layer : uint8_t { sensor, perception, processing, storage };
std::string_view to_string(Layer layer);

/// A registered node class.
struct NodeType {
  std::string name;
  Layer layer = Layer::perception;
  std::string doc;
  std::function<std::unique_ptr<Node>()> make;
};

/// The node types a graph may name.
class NodeTypes {
 public:
  /// Registers T under `name`; throws std::logic_error if the name is taken.
  template <class T>
  void add(std::string name, Layer layer, std::string doc) {
    insert({std::move(name), layer, std::move(doc), [] {
              auto node = std::make_unique<T>();
              node->accept_requests();
              if constexpr (requires { &T::remember; })
                if constexpr (!std::is_same_v<decltype(&T::remember), void (Node::*)(StateArchive&)>)
                  node->declare_state();
              return node;
            }});
  }
  const NodeType* find(std::string_view name) const;
  const std::map<std::string, NodeType, std::less<>>& all() const { return types_; }

 private:
  void insert(NodeType type);
  std::map<std::string, NodeType, std::less<>> types_;
};

}  // namespace takt
