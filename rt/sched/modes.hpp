// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <mutex>
#include <vector>

#include "rt/hot.hpp"
#include "rt/sched/mode_log.hpp"

namespace takt {

/// The modes that one process asks for, in pages that only this process can write to. Each carries a check, so that a
/// stray store of that process asks for nothing. The newest kKept are there.
struct alignas(kCacheLine) ModeRequests {
  static constexpr size_t kKept = 16;
  struct Request {
    std::atomic<uint64_t> word{0};  ///< mode, origin, number of the request, check of all; 0 while it is written
    std::atomic<int64_t> from_ns{0};
    BoundedText<120> reason;
  };
  std::atomic<uint64_t> count{0};
  std::array<Request, kKept> requests;
};

/// What the supervisor has entered into the log of these; in its pages.
struct alignas(kCacheLine) EnteredRequests {
  std::array<std::atomic<uint64_t>, ModeRequests::kKept> words{};
};

/// The modes of a run, as one of its processes sees them: the log, which the supervisor writes (or a run without one),
/// and what other processes asked for since it last looked. A request holds for every process from its instant on,
/// whether it is in the log by then or not.
///
///   modes.request(safe_stop, now_ns + ModeLog::kLead_ns, "guard: missed its deadline");
///   const uint32_t mode = modes.at(release_ns);
///
/// Any thread, none waits but what the supervisor asks for while another of its threads gathers. See ModeLog for the
/// rules.
class Modes {
 public:
  /// `log` and `entered` are the supervisor's; `requests` and `entered` by process.
  Modes(ModeLog& log, std::vector<ModeRequests*> requests, std::vector<EnteredRequests*> entered)
      : log_(log), requests_(std::move(requests)), entered_(std::move(entered)) {}

  /// From here on this process is one of those that ask. Before there is a second thread.
  void speak_as(size_t process) { own_ = requests_[process]; }
  /// By the supervisor, every few ms: enters into the log what processes have asked for. Does not wait for another of
  /// its threads that is at it.
  void gather();

  uint32_t at(int64_t release_ns) const;
  template <class Visitor>
  void for_each_part(int64_t from_ns, int64_t to_ns, const Visitor& visit) const {
    const Unmerged asked = unmerged();
    log_.for_each_part(from_ns, to_ns, visit, std::span(asked.changes.data(), asked.count));
  }
  uint32_t newest() const { return at(INT64_MAX); }
  ModeInForce in_force() const;
  bool request(uint32_t mode, int64_t from_ns, std::string_view reason, bool by_hand = false);
  bool request_by_rule(uint32_t mode, int64_t from_ns, std::string_view reason);

  /// Of the log.
  size_t size() const { return log_.size(); }
  const ModeLog::Change* change(size_t i) const { return log_.change(i); }
  std::string reason(size_t i) const { return log_.reason(i); }
  bool repeats(size_t i) const { return log_.repeats(i); }

 private:
  struct Unmerged {
    std::array<ModeEntry, 32> changes;  ///< in the order of their instants; more at once are a matter of the log
    size_t count = 0;
  };
  template <class Visitor>
  void for_each_unmerged(const Visitor& visit) const;
  Unmerged unmerged() const;
  uint64_t news(size_t process, size_t request) const;
  bool any_news() const;
  void enter_all(std::unique_lock<std::mutex> turn);
  bool ask(uint32_t mode, int64_t from_ns, std::string_view reason, ModeOrigin origin);

  ModeLog& log_;
  const std::vector<ModeRequests*> requests_;
  const std::vector<EnteredRequests*> entered_;
  ModeRequests* own_ = nullptr;  ///< null: this process writes the log itself
  std::mutex gathering_;
};

}  // namespace takt
