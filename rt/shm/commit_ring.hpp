// SPDX-License-Identifier: Apache-2.0
// One commit word per job: all outputs of a job become visible at one instant, and every reader agrees on it.
//
//   const uint32_t job = commits.open({earliest_ns, latest_ns});
//   ...                                        // announce each output: its slot names commit `job`
//   commits.announced(job);
//   const auto out = commits.fill(job, clock.now_ns(), clock);
//   ...                                        // settle each output: its slot says out.visible_at_ns
//
// The word of a commit is `announcing`, then `open`, then the instant from which readers may see the messages. A reader
// that comes to a message whose slot still names its commit looks at the word:
//  - announcing: the producer has yet to read its clock, so the messages come later than this reader's release.
//  - open: the producer may have read its clock before that release and not have written it. The reader fills the word
//    with an instant after its release: the messages are not for its job, on none of its inputs. All of them are
//    announced, so whoever comes later sees all or none.
//  - filled: that instant holds for everybody, the producer included.
//
// What this rests on: the clock moves between a reader's look and a commit that follows it. In real time one cache line
// has travelled between two cores meanwhile.
//
// Slots are settled before the next commit is opened. So a reader that finds its commit still named in the slot after
// it read the word has read the word of that commit, and a successor has to look at the newest commit only. The number
// in an open word makes a slow reader's attempt to fill it fail, if the word has been used again.
//
// Plain data: it lies on the run board, which all processes of a run share. One producer at a time; any readers.
#pragma once
#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <limits>

#include "rt/time/clock.hpp"

namespace takt {

class alignas(64) CommitRing {
 public:
  static constexpr uint32_t kWords = 8;
  static_assert((kWords & (kWords - 1)) == 0);
  /// "Visible" of outputs that are withheld. Later than every release.
  static constexpr int64_t kNever = std::numeric_limits<int64_t>::max();
  /// Of a word that holds no instant that anybody can have written by the rules: a stray store.
  static constexpr int64_t kSpoiled = -1;

  /// When the outputs of a job may become visible.
  struct Terms {
    int64_t earliest_ns = 0;     ///< and not sooner: the planned deadline, with `publish: let`
    int64_t latest_ns = kNever;  ///< what is published later is withheld
    int64_t visible_at_ns(int64_t published_ns) const {
      return published_ns > latest_ns ? kNever : std::max(published_ns, earliest_ns);
    }
  };
  struct Filled {
    int64_t published_ns = 0, visible_at_ns = kNever;
  };

  /// Goes on after commit `newest`.
  explicit CommitRing(uint32_t newest = 0) : newest_(newest) {}

  /// The producer begins to announce the outputs of its next job. Never 0.
  uint32_t open(const Terms& terms) {
    uint32_t commit = newest_.load(std::memory_order_relaxed) + 1;
    if (commit == 0) ++commit;
    Word& word = word_of(commit);
    word.earliest_ns.store(terms.earliest_ns, std::memory_order_relaxed);
    word.latest_ns.store(terms.latest_ns, std::memory_order_relaxed);
    word.state.store(kAnnouncing | commit, std::memory_order_release);
    newest_.store(commit, std::memory_order_release);  // last: a successor looks there
    return commit;
  }
  /// All of them are announced. To be followed by a reading of the clock, which this exchange keeps behind it.
  void announced(uint32_t commit) { word_of(commit).state.exchange(kOpen | commit); }
  /// They become visible, as of `published_ns`, or of the instant that a reader was faster with.
  Filled fill(uint32_t commit, int64_t published_ns, const Clock& clock) {
    Word& word = word_of(commit);
    const Terms terms = word.terms();
    const int64_t mine = terms.visible_at_ns(published_ns);
    uint64_t found = kOpen | commit;
    while (!word.state.compare_exchange_strong(found, static_cast<uint64_t>(mine))) {
      if (sane(found, terms, clock)) return filled(static_cast<int64_t>(found), published_ns, terms);
      note_spoiled();
    }
    return filled(mine, published_ns, terms);
  }
  /// The last commit of a producer that died: what it had not announced to the end is withheld, what was open becomes
  /// visible now. Its slots are to be settled with the answer.
  Filled recover(const Clock& clock) {
    const uint32_t commit = newest_.load(std::memory_order_acquire);
    if (commit == 0) return {};
    Word& word = word_of(commit);
    const uint64_t found = word.state.load();
    if (found == (kOpen | commit)) return fill(commit, clock.now_ns(), clock);
    const Terms terms = word.terms();
    if (sane(found, terms, clock)) return filled(static_cast<int64_t>(found), static_cast<int64_t>(found), terms);
    if (found != (kAnnouncing | commit)) note_spoiled();
    word.latest_ns.store(0, std::memory_order_relaxed);  // withheld, whatever its terms were
    word.state.store(static_cast<uint64_t>(kNever));
    return {};
  }

  /// When the messages of a commit become visible, for a job released at `limit_ns`; kNever if they are not for that
  /// job, or if the clock has not come to `limit_ns` (who asks ahead of time waits for settled slots, and fills
  /// nothing); kSpoiled. Means nothing if the slot does not name the commit any more afterwards.
  int64_t look(uint32_t commit, int64_t limit_ns, const Clock& clock) {
    Word& word = word_of(commit);
    uint64_t found = word.state.load();
    const Terms terms = word.terms();
    const int64_t now_ns = clock.now_ns();
    if (now_ns < limit_ns || terms.earliest_ns > limit_ns || found == (kAnnouncing | commit)) return kNever;
    if (found == (kOpen | commit)) {
      const int64_t after_release = terms.visible_at_ns(std::max(now_ns, limit_ns + 1));
      if (word.state.compare_exchange_strong(found, static_cast<uint64_t>(after_release))) return after_release;
    }
    return sane(found, terms, clock) ? static_cast<int64_t>(found) : kSpoiled;
  }

  void note_spoiled() { spoiled_.fetch_add(1, std::memory_order_relaxed); }
  /// Looks at words that a stray store had hit.
  uint64_t spoiled() const { return spoiled_.load(std::memory_order_relaxed); }

 private:
  static constexpr uint64_t kAnnouncing = uint64_t{1} << 63, kOpen = kAnnouncing | uint64_t{1} << 62;
  /// Clocks of two cores may differ by far less.
  static constexpr int64_t kClocksDiffer_ns = 1'000'000;

  struct Word {
    std::atomic<uint64_t> state{0};
    std::atomic<int64_t> earliest_ns{0}, latest_ns{kNever};
    Terms terms() const {
      return {earliest_ns.load(std::memory_order_relaxed), latest_ns.load(std::memory_order_relaxed)};
    }
  };
  static_assert(std::atomic<uint64_t>::is_always_lock_free && std::atomic<uint32_t>::is_always_lock_free);

  Word& word_of(uint32_t commit) { return words_[commit % kWords]; }

  static bool sane(uint64_t found, const Terms& terms, const Clock& clock) {
    if (found == static_cast<uint64_t>(kNever)) return terms.latest_ns != kNever;
    if (found == 0 || found > static_cast<uint64_t>(kNever)) return false;
    const auto at_ns = static_cast<int64_t>(found);
    return at_ns >= terms.earliest_ns && at_ns <= std::max(terms.earliest_ns, clock.now_ns() + kClocksDiffer_ns);
  }
  /// With the instant of publication that response and lateness count from.
  static Filled filled(int64_t visible_at_ns, int64_t published_ns, const Terms& terms) {
    if (visible_at_ns == kNever) return {std::max(published_ns, terms.latest_ns + 1), kNever};
    return {visible_at_ns > terms.earliest_ns ? visible_at_ns : std::min(published_ns, visible_at_ns), visible_at_ns};
  }

  std::atomic<uint32_t> newest_;  ///< the number that was opened last
  std::atomic<uint64_t> spoiled_{0};
  alignas(64) std::array<Word, kWords> words_{};
};

}  // namespace takt
