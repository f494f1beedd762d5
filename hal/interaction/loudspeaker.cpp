// SPDX-License-Identifier: Apache-2.0
#include "hal/interaction/loudspeaker.hpp"

#include <pthread.h>

#include <chrono>
#include <cstdio>
#include <thread>

#include "rt/capability.hpp"

namespace takt {
namespace {

/// So late a sentence begins at most, if no other one is being said.
constexpr std::chrono::milliseconds kRound{20};

}  // namespace

void Loudspeaker::start(int64_t epoch_ns) {
  if (thread_.joinable()) return;
  epoch_ns_ = epoch_ns;
  fails_.store(!voice_->start(goes_on_));
  thread_ = OwnThread([this](const std::stop_token& end) { work(end); });
}

void Loudspeaker::stop() {
  if (!thread_.joinable()) return;
  thread_.request_stop();
  thread_.join();
  if (const uint64_t lost = dropped(); lost > 0)
    std::fprintf(stderr, "%s: of what the robot said, %llu sentences were not spoken: %s\n", id_.c_str(),
                 static_cast<unsigned long long>(lost),
                 fails_.load() ? voice_->problem().c_str() : "it said more than there was time for");
}

const char* Loudspeaker::trouble() const {
  return fails_.load(std::memory_order_relaxed) ? "the loudspeaker does not speak; stderr of the run says why" : "";
}

void Loudspeaker::say(std::string_view text) {
  const int64_t at_ns = clock_.now_ns() - epoch_ns_;
  while (!text.empty()) {
    const std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(line.size() + 1, text.size()));
    for (size_t at = 0; at < line.size();) {
      size_t size = std::min(line.size() - at, kLongestSentence);
      if (const size_t space = line.rfind(' ', at + size - 1);
          at + size < line.size() && space != std::string_view::npos && space > at)
        size = space + 1 - at;  // between two words
      put(line.substr(at, size), at_ns);
      at += size;
    }
  }
}

void Loudspeaker::put(std::string_view sentence, int64_t at_ns) {
  const uint64_t next = written_.load(std::memory_order_relaxed);
  if (next - read_.load(std::memory_order_acquire) == kRing) {  // the thread has had no CPU for all that time
    dropped_.fetch_add(1, std::memory_order_relaxed);
    return;
  }
  Slot& slot = ring_[next % kRing];
  slot.at_ns = at_ns;
  slot.size = sentence.copy(slot.text.data(), slot.text.size());
  written_.store(next + 1, std::memory_order_release);
}

void Loudspeaker::fetch() {
  uint64_t next = read_.load(std::memory_order_relaxed);
  for (const uint64_t end = written_.load(std::memory_order_acquire); next != end; ++next) {
    const Slot& slot = ring_[next % kRing];
    waiting_.push_back({slot.at_ns, std::string(slot.text.data(), slot.size)});
  }
  read_.store(next, std::memory_order_release);
  for (; waiting_.size() > kMostWaiting; waiting_.pop_front()) dropped_.fetch_add(1, std::memory_order_relaxed);
}

void Loudspeaker::speak_next(const std::function<bool()>& go_on) {
  const Sentence sentence = std::move(waiting_.front());
  waiting_.pop_front();
  const bool said = voice_->speak(sentence, go_on);
  if (said || go_on()) fails_.store(!said);
  if (said) return;
  dropped_.fetch_add(1);
  if (!go_on() || std::exchange(told_, true)) return;
  std::fprintf(stderr, "%s: the robot cannot be heard: %s\n", id_.c_str(), voice_->problem().c_str());
}

void Loudspeaker::work(const std::stop_token& end) {
  pthread_setname_np(pthread_self(), "takt-speech");
  keep_rights(Rights::none);
  const auto go_on = [&] {
    fetch();
    return !end.stop_requested();
  };
  while (go_on()) {
    if (waiting_.empty()) std::this_thread::sleep_for(kRound);
    else speak_next(go_on);
  }
  fetch();
  while (voice_->catches_up() && !waiting_.empty()) speak_next([] { return true; });
  dropped_.fetch_add(waiting_.size());
  waiting_.clear();
}

}  // namespace takt
