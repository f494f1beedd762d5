// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <span>
#include <string>
#include <utility>

#include "rt/sched/append_log.hpp"
#include "rt/sched/mode_rules.hpp"

namespace takt {

struct ModeEntry {
  uint32_t mode = 0;  ///< index into Plan::modes
  int64_t from_ns = 0;
  ModeOrigin origin = ModeOrigin::other;
};

/// The mode of a run over time. A change holds for every job released at or after its instant: each task looks it up
/// at its own planned release, as it latches messages, and nobody is interrupted. What a mode leaves out keeps its
/// reservation, so a change asks nothing of the kernel and cannot be refused.
///
/// Bound: a job released before the instant ends by its deadline; the first job of the new mode comes at most one
/// period after it. So a change is complete, for each task, `lead + max(deadline, period)` after it was asked for.
class ModeLog {
 public:
  /// A device that is lost and back takes two of them: one a minute can go on for almost three days. All are kept,
  /// since how many jobs were to be released is counted from them; when they are used up, the run is in safe_stop for
  /// good.
  static constexpr size_t kMost = 8192;
  /// A request made while the run goes on takes effect this much later, so that it is on the board before the first
  /// release it is to hold for.
  static constexpr int64_t kLead_ns = 1'000'000;

  /// Of so many changes, the newest ones, the reason is kept. A record has all of them.
  static constexpr size_t kReasons = 512;

  struct Change : ModeEntry {
    uint32_t words = 0;  ///< number of its reason
  };

  /// Mode of a job released then; 0, the mode of the start, before the first change.
  uint32_t at(int64_t release_ns) const {
    for (size_t i = log_.size(); i-- > 0;)
      if (const Change* change = log_.at(i); change != nullptr && change->from_ns <= release_ns) return change->mode;
    return 0;
  }
  /// Calls visit(mode, from_ns, to_ns) for each part of [from_ns, to_ns) in which one mode holds, in order. `later`:
  /// what is to come after all of the log.
  template <class Visitor>
  void for_each_part(int64_t from_ns, int64_t to_ns, const Visitor& visit,
                     std::span<const ModeEntry> later = {}) const {
    uint32_t mode = 0;
    const auto follow = [&](const ModeEntry& change) {
      if (change.from_ns >= to_ns) return;
      if (change.from_ns > from_ns) visit(mode, std::exchange(from_ns, change.from_ns), change.from_ns);
      mode = change.mode;
    };
    for (size_t i = 0; i < log_.size(); ++i)
      if (const Change* change = log_.at(i); change != nullptr) follow(*change);
    for (const ModeEntry& change : later) follow(change);
    visit(mode, from_ns, to_ns);
  }
  /// The mode that will be in force once all requests have taken effect.
  uint32_t newest() const { return at(INT64_MAX); }
  /// ... with who entered it, and the newest mode that no rule did.
  ModeInForce in_force() const {
    for (size_t i = log_.size(); i-- > 0;) {
      const Change* change = log_.at(i);
      if (change == nullptr) continue;
      if (change->origin != ModeOrigin::rule) return {change->mode, change->origin, change->mode};
      return {change->mode, change->origin, static_cast<uint32_t>(without_rule_.load(std::memory_order_acquire))};
    }
    return {};
  }
  /// Nothing happens if that mode is the newest one already, unless a rule entered it. False if there were too many
  /// changes; those that a person asks for are refused earlier, so that a safe stop always has its place.
  bool request(uint32_t mode, int64_t from_ns, std::string_view reason, bool by_hand = false) {
    // A mode that a rule entered is taken over: the rule will not leave it then.
    if (const ModeInForce now = in_force(); now.mode == mode && now.origin == ModeOrigin::other) return true;
    if (by_hand && !has_room()) return false;
    return enter({mode, from_ns, ModeOrigin::other}, reason);
  }
  /// The same, asked for by a rule; refused as early as what a person asks for.
  bool request_by_rule(uint32_t mode, int64_t from_ns, std::string_view reason) {
    if (newest() == mode) return true;
    return has_room() && enter({mode, from_ns, ModeOrigin::rule}, reason);
  }
  /// Whatever mode is in force. False if it is full.
  bool enter(const ModeEntry& wanted, std::string_view reason) {
    const int64_t from_ns = std::max(wanted.from_ns, newest_ns_.load());  // instants never go back
    const uint32_t words = words_.fetch_add(1, std::memory_order_acq_rel);
    reasons_[words % kReasons] = BoundedText<120>(reason);
    if (!log_.append({{wanted.mode, from_ns, wanted.origin}, words})) return false;
    raise(newest_ns_, from_ns);
    // Looked for in the log it would take the longer the more changes there were, at every job of a device.
    if (wanted.origin != ModeOrigin::rule) raise(without_rule_, (others_.fetch_add(1) + 1) << 32 | wanted.mode);
    return true;
  }
  /// For a change that is not a safe stop.
  bool has_room() const { return log_.size() + 8 <= kMost; }
  /// Instant of the newest change; 0: none.
  int64_t newest_ns() const { return newest_ns_.load(std::memory_order_acquire); }
  size_t size() const { return log_.size(); }
  /// In the order of their instants; null while it is being written.
  const Change* change(size_t i) const { return log_.at(i); }
  /// Why; empty while it is being written.
  std::string reason(size_t i) const {
    const Change* asked = change(i);
    if (asked == nullptr) return {};
    const std::string words(reasons_[asked->words % kReasons].text());
    // Those that are being written may be written over it meanwhile.
    if (words_.load(std::memory_order_acquire) - asked->words + kAtOnce > kReasons)
      return "(reasons of the newest " + std::to_string(kReasons - kAtOnce) + " changes are kept)";
    return words;
  }
  /// A rule asked for the mode that was in force already: so does each process whose devices come back at that instant.
  bool repeats(size_t i) const {
    const Change* asked = change(i);
    if (asked == nullptr || asked->origin != ModeOrigin::rule) return false;
    while (i-- > 0)
      if (const Change* before = change(i); before != nullptr) return before->mode == asked->mode;
    return asked->mode == 0;
  }

 private:
  template <class T>
  static void raise(std::atomic<T>& most, T value) {
    for (T had = most.load(); had < value && !most.compare_exchange_weak(had, value);) {
    }
  }

  static constexpr size_t kAtOnce = 64;  ///< more threads than change the mode at one instant

  AppendLog<Change, kMost> log_;
  std::array<BoundedText<120>, kReasons> reasons_{};
  std::atomic<uint32_t> words_{0};
  std::atomic<int64_t> newest_ns_{0};
  std::atomic<uint64_t> others_{0};        ///< changes that no rule asked for
  std::atomic<uint64_t> without_rule_{0};  ///< the mode of the newest of them, its number above it
};

}  // namespace takt
