// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <atomic>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "graph/machines/arrivals.hpp"
#include "graph/machines/frame.hpp"
#include "graph/machines/peer.hpp"
#include "graph/machines/questions.hpp"
#include "graph/machines/wire.hpp"
#include "hal/remote/remote_node.hpp"
#include "rt/own_thread.hpp"
#include "rt/shm/doorbell.hpp"
#include "rt/shm/follower.hpp"
#include "rt/time/clock.hpp"

namespace takt::machines {

/// The end of this machine of what a graph has between machines: sends what others read, and hands what they send to
/// the jobs of RemoteNodes. In a process of its own, so that what goes wrong with the network ends nothing else.
///
///   Link link(options, imports, exports, make_dds_wire({address}), board.published(), clock);
///   RemoteNode node(ports, link.source("vision", "stereo", ports));   // in compose; its setup waits for that machine
///   link.begin(outgoing);                                             // messages go out
///
/// A message may be seen from `latency` behind its publication on, plus what the clocks may be off. One that comes
/// later is late: it is counted, and may be seen from then on. How long they took, and what was not as it should be, is
/// said at the end.
class Link {
 public:
  struct Options {
    std::string graph, machine;  ///< names
    std::string same;            ///< what all machines must agree on: a hash of graph, schedule and parameters
    std::vector<std::string> peers;
    int64_t latency_ns = 0;                            ///< of the network, at most
    int64_t clock_error_ns = 0;                        ///< that two clocks may be unsure of each other
    std::function<void(const std::string&)> say = {};  ///< a line for people
    std::function<Json()> tells = {};                  ///< what this machine says of its run, ten times a second
    std::function<Json(const Json&)> answer = {};      ///< to questions of other machines; null: none is taken
  };
  /// An output of this machine that others read. `capacity`: nothing as long as its node is not set up.
  struct Export {
    std::string port;  ///< NODE.PORT
    std::function<std::optional<Capacity>()> capacity;
    std::optional<int64_t> age_ns = {};  ///< that others count on when it is published
    Coding coding = Coding::plain;
  };
  /// An output of another machine that nodes here read.
  struct ImportName {
    std::string machine, port;
    /// What that machine said before this process was started again; nothing: ask it. May be empty.
    std::function<std::optional<Capacity>()> remembered = {};
  };
  /// Where the messages of an export are.
  struct Outgoing {
    const MessageType* type = nullptr;
    std::unique_ptr<Reader> reader;
  };
  Link(Options options, const std::vector<ImportName>& imports, std::vector<Export> exports, std::unique_ptr<Wire> wire,
       Doorbell& bell, const Clock& clock);
  ~Link();
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;

  /// For a RemoteNode of these outputs of `node`, which are imports of `machine`; none: for the machine as such. It
  /// lives no longer than this.
  std::unique_ptr<RemoteSource> source(const std::string& machine, const std::string& node,
                                       const std::vector<RemoteNode::Port>& ports, const StampLaw& law);
  /// In the order of the exports: from here on they are sent.
  void begin(std::vector<Outgoing> outgoing);
  /// Setups that wait for another machine give up.
  void give_up();
  /// The answer of another machine's run; see Questions. Of one that is not there an error at once. Any thread.
  Json ask(const std::string& machine, const Json& question);
  /// What was seen of each other machine: [{name, state, clock_offset_ms, clock_error_ms, clock_jumps, outputs, told}].
  /// For the report. Any thread.
  Json report() const;

 private:
  struct Import;
  class Source;
  /// A line for each output of others that came, and of this one's that were not as they should be, once the threads
  /// have ended.
  std::vector<std::string> summary() const;
  Json outputs_of(const Peer& machine) const;
  void send(size_t export_index, const Held& held, Framer& framer);
  Peer& peer(std::string_view name);
  void send_on(const std::stop_token& end);
  void send_state();
  void take(size_t topic, std::span<const std::byte> bytes);
  void take_state(std::span<const std::byte> bytes);
  void take_message(Import& import, std::span<const std::byte> bytes);
  void fill(Import& import, int64_t stamp_ns, int64_t visible_ns, const Frame& frame);
  /// Waits.
  Capacity fact(const Peer& of, const std::string& port);

  const Options options_;
  const std::vector<Export> exports_;
  Doorbell& bell_;  ///< rings when there is something to send
  const Clock& clock_;
  const uint64_t run_;
  std::unique_ptr<Wire> wire_;
  std::vector<std::unique_ptr<Peer>> peers_;
  std::vector<std::unique_ptr<Import>> imports_;
  std::unique_ptr<Questions> questions_;
  mutable std::mutex taking_;  ///< what comes, one at a time; never taken in a job
  mutable std::mutex mutex_;   ///< states of peers; never taken in a job
  std::condition_variable changed_;
  std::vector<Outgoing> outgoing_;
  std::vector<size_t> out_topics_;  ///< by export
  std::vector<uint64_t> older_;     ///< messages of it, of the sending thread: than others count on
  size_t state_topic_ = 0, words_topic_ = 0;
  bool gave_up_ = false;
  std::atomic<bool> begun_{false};
  OwnThread sending_;
};

}  // namespace takt::machines
