// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <atomic>
#include <deque>
#include <memory>
#include <string>

#include "hal/interaction/voice.hpp"
#include "rt/own_thread.hpp"
#include "rt/time/clock.hpp"

namespace takt {

/// Speaks what jobs say, without a job ever waiting for it:
///
///     Loudspeaker speaker("person", std::make_unique<EspeakVoice>(settings), clock);
///     speaker.open(), speaker.start(epoch_ns);
///     speaker.say("I stop");  // in a job: copies the words, no more
///
/// A thread of its own takes the sentences, one a line, and lets the voice say them one after the other. At most
/// kMostWaiting of them wait; where more come the oldest are dropped and counted. open, start and stop: composition
/// thread; say, dropped and trouble: job thread.
class Loudspeaker {
 public:
  static constexpr size_t kMostWaiting = 8;
  /// A longer line is said in pieces.
  static constexpr size_t kLongestSentence = 400;

  Loudspeaker(std::string id, std::unique_ptr<Voice> voice, const Clock& clock)
      : id_(std::move(id)), voice_(std::move(voice)), clock_(clock) {}
  ~Loudspeaker() { stop(); }
  DeviceResult open() { return voice_->open(); }
  /// An earlier process of this run has spoken before. Before start().
  void go_on() { goes_on_ = true; }
  void start(int64_t epoch_ns);
  /// Leaves off; what was said to a file's voice is written first. Says on stderr what nobody has heard.
  void stop();
  void say(std::string_view text);
  /// Sentences that nobody has heard and nobody will.
  uint64_t dropped() const { return dropped_.load(std::memory_order_relaxed); }
  /// A literal; empty: the last sentence was said.
  const char* trouble() const;

 private:
  /// Sentences on their way from the job to the thread; far more than come within one round of it.
  static constexpr size_t kRing = 32;
  struct Slot {
    int64_t at_ns = 0;
    size_t size = 0;
    std::array<char, kLongestSentence> text;
  };

  void put(std::string_view sentence, int64_t at_ns);
  void work(const std::stop_token& end);
  void fetch();
  void speak_next(const std::function<bool()>& go_on);

  std::string id_;
  std::unique_ptr<Voice> voice_;
  const Clock& clock_;
  int64_t epoch_ns_ = 0;
  bool goes_on_ = false, told_ = false;
  std::array<Slot, kRing> ring_;
  std::atomic<uint64_t> written_{0}, read_{0};
  std::atomic<uint64_t> dropped_{0};
  std::atomic<bool> fails_{false};
  std::deque<Sentence> waiting_;  ///< of the thread
  OwnThread thread_;
};

}  // namespace takt
