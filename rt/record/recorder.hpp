// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "rt/own_thread.hpp"
#include "rt/record/job_assembler.hpp"
#include "rt/record/mcap/writer.hpp"
#include "rt/record/picture_codec.hpp"
#include "rt/record/port_rule.hpp"
#include "rt/record/snapshots.hpp"
#include "rt/record/splits.hpp"
#include "rt/record/write_queue.hpp"
#include "rt/sched/run_board.hpp"
#include "rt/shm/follower.hpp"
#include "rt/time/clock.hpp"

namespace takt::record {

/// What stands in a record before its first message.
struct Head {
  mcap::Metadata facts;
  std::vector<mcap::Attachment> files;  ///< their data must live as long as the recorder
};

/// What a record lacks, and what it cost.
struct RecordResult {
  uint64_t messages = 0, jobs = 0, events = 0;  ///< written
  uint64_t overwritten = 0;                     ///< messages that were gone before they were read
  uint64_t no_room = 0;                         ///< messages and jobs that found the queue full
  uint64_t not_written = 0;                     ///< ... that the file did not take
  uint64_t incomplete_jobs = 0;                 ///< of which an event was lost, and restarts
  uint64_t unheard_threads = 0;   ///< that ran jobs and had nowhere to note them: none of these jobs is there
  uint64_t bytes = 0, files = 0;  ///< of all files, and how many there were
  int64_t longest_pause_ns = 0;   ///< between two looks at the outputs; 0 in virtual time
  int64_t capture_cpu_ns = 0, write_cpu_ns = 0;
  std::string refused;  ///< why the file did not take something; empty: it took all
  uint64_t lost() const { return overwritten + no_room + not_written + incomplete_jobs + unheard_threads; }
};

/// Writes the messages of all ports and what each job was given into an MCAP file, as well as it can: it reads beside
/// the consumers of a port and holds a message only while it copies it; no job ever waits for it. What it could not
/// keep up with is counted.
///
/// Every message stands in the file with its header and hash, those of the chosen ports with all fields. Channels:
/// "NODE.PORT" for the ports, kJobs for the jobs, kEvents for what happened beside them.
class Recorder {
 public:
  static constexpr const char* kJobs = "takt/jobs";
  static constexpr const char* kEvents = "takt/events";
  static constexpr const char* kEncoding = "takt";
  static constexpr const char* kFacts = "takt";    ///< metadata: those of the head
  static constexpr const char* kEnd = "takt end";  ///< metadata: those given at the end, and what was lost

  /// Who is told of what is recorded, at once and on the threads that copy it: jobs and restarts on the one that
  /// calls take(), the rest on the recorder's. Each may be empty.
  struct Listener {
    std::function<void(const RecordedJob&)> job = {};
    std::function<void(size_t port, const Held&)> message = {};
    std::function<void(const RecordedEvent&)> event = {};
  };
  struct Options {
    std::vector<PortRule> ports = {};  ///< by port; empty: all of all
    bool jobs = true;                  ///< jobs and events, too
    size_t queue_bytes = 128 << 20;
    bool by_caller = false;  ///< virtual time: nothing is done but in capture(), which waits for the file
    /// SCHED_FIFO priority of the thread that copies. With 0, or where the kernel refuses, it is an ordinary one, which
    /// a loaded machine may keep waiting until messages are overwritten.
    int priority = 0;
    mcap::Writer::Options file = {};
    Listener listener = {};
    VirtualClock* written_at = nullptr;  ///< moved to when what is being written was published
    int64_t snapshot_every_ns = 0;       ///< 0: the record has no places where a replay could begin
  };

  /// Before the first job, after the ports have their memory. The splits must live until finish().
  Recorder(const Plan& plan, const RunBoard& board, Transport& transport, Splits& splits, Head head, Options options);
  /// Into one file, whose sink must live until finish().
  Recorder(const Plan& plan, const RunBoard& board, Transport& transport, mcap::Sink& sink, Head head, Options options);
  ~Recorder();
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  /// The next event of a ring. One thread at a time.
  void take(int32_t ring, const trace::Event& event) { jobs_.add(ring, event); }
  /// Copies what has been published since. Only with `by_caller`; after every job.
  void capture() { take_ports(); }
  /// After the last job: copies what is left, so that those who published it may go.
  void take_rest();
  /// After the last job, and after the last event was given: ends the file. `facts` are what is known only now.
  RecordResult finish(mcap::Metadata facts, uint64_t unheard_threads = 0);

 private:
  /// A channel whose pictures become JPEG.
  struct Coded {
    const MessageType* type;
    PictureCoder coder;
  };
  struct Port {
    std::optional<Follower> follower;
    const MessageType* type = nullptr;
    uint16_t channel = 0;
    PortRule rule;
    int64_t whole_ns = INT64_MIN;  ///< publication of the last one with all fields
    int64_t seen_ns = INT64_MIN;   ///< publication of the newest one
    uint64_t told = 0;             ///< the newest that a job says it has published or held
    size_t bytes = 0;              ///< of the last message, packed
  };
  Recorder(const Plan& plan, const RunBoard& board, Transport& transport, std::unique_ptr<Splits> own, Splits* splits,
           Head head, Options options);
  void define_channels(const Plan& plan);
  uint16_t define(uint16_t schema, std::string topic, mcap::Metadata metadata);
  uint16_t define_schema(std::string name, std::string encoding, std::string data);
  void take_ports();
  void take_port(Port& port);
  void repeat_old();
  void take_job(const RecordedJob& job);
  void take_event(const RecordedEvent& event);
  void take_modes();
  void take_marks();
  void take_logs();
  void tell(size_t port, uint64_t sequence);
  void push(uint16_t channel, uint64_t sequence, int64_t at_ns, std::vector<std::byte> data);
  void capture_on();
  void write_on();
  void begin_file(int64_t at_ns);
  void end_file();
  void write(const WriteQueue::Entry& entry);
  std::span<const std::byte> as_kept(const WriteQueue::Entry& entry);
  bool note(const mcap::Writer::Done& done);

  const Options options_;
  const RunBoard& board_;
  const std::unique_ptr<Splits> own_splits_;
  Splits& splits_;
  Head head_;
  std::vector<mcap::Schema> schemas_;
  std::vector<mcap::Channel> channels_;
  std::optional<mcap::Writer> file_;  ///< none: it could not be begun
  int64_t file_began_ns_ = 0;
  mcap::Metadata last_facts_;             ///< for the end of each file
  std::map<uint16_t, uint64_t> written_;  ///< messages by channel, in all files
  std::vector<std::byte> kept_;           ///< of the message in hand, with its pictures as JPEG
  WriteQueue queue_;
  JobAssembler jobs_;
  Snapshots snapshots_;
  std::vector<Port> ports_;
  std::map<uint16_t, Coded> coded_;
  std::vector<std::vector<size_t>> ports_of_, edges_of_;  ///< by task: ports written and read
  uint16_t jobs_channel_ = 0, events_channel_ = 0;
  size_t modes_taken_ = 0, marks_taken_ = 0;
  std::vector<LogReader> logs_;  ///< by task
  size_t job_bytes_ = 0;         ///< of the last job, packed
  std::atomic<uint64_t> no_room_{0};
  RecordResult result_;
  std::atomic<bool> ending_{false};
  std::atomic<int64_t> file_begun_ns_{0};  ///< a file whose first messages are still to come: since when; 0: none
  OwnThread capturing_, writing_;
};

}  // namespace takt::record
