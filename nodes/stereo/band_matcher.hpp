// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <atomic>
#include <memory>
#include <thread>
#include <vector>

#include "nodes/stereo/matcher.hpp"

namespace takt::stereo {

/// Square-window matching of an image in bands of rows: the first on the calling thread, each other on a thread of its
/// own if a CPU is free for it. No call depends on those threads: a band that was not begun is done by the caller, one
/// that is not done soon after the caller's own (`patience`) is done a second time. So a call takes the CPU time of
/// one matcher plus a few percent at most, and less if others helped; the result is that of one matcher, bit for bit.
/// Every band reads the rows beside it that its windows reach into, from a copy that outlives the call. The threads
/// live as long as the object, sleep between two matches and run under the policy of the thread that made it.
class BandMatcher final : public Matcher {
 public:
  /// About two milliseconds of looking whether a band is done: threads of a virtual machine wake up late.
  static constexpr int kPatience = 80'000;

  /// `bands` 1..8, at most one for every 16 rows; `patience` counts looks. Throws std::invalid_argument for those, for
  /// parameters that problem() objects to and for a selection that looks along the whole image (semi_global).
  BandMatcher(int width, int height, int channels, const MatcherParameters& parameters, int bands,
              int patience = kPatience);
  ~BandMatcher() override;

  [[nodiscard]] bool match(ImageView<const uint8_t> left, ImageView<const uint8_t> right,
                           const DisparityViews& out) override;
  void limit_search(int disparities) override;
  void tune(const MatcherParameters& parameters) override;
  const char* target() const override { return bands_.front().own.matcher->target(); }

  int64_t helper_cpu_ns() const override { return helper_cpu_ns_.load(std::memory_order_relaxed); }

 private:
  /// What a thread needs to match a band.
  struct Desk {
    std::unique_ptr<Matcher> matcher;
    std::vector<int16_t> disparity;
    std::vector<uint8_t> confidence, fraction;
  };
  /// The caller makes idle and done -> soon -> asked and asked -> idle, the thread asked -> busy -> done.
  enum class State : uint8_t { idle, soon, asked, busy, done };
  /// The thread that may do a band, and its copy of the rows.
  struct Helper {
    Desk desk;
    std::vector<uint8_t> left, right;
    int search = 0;  ///< disparities, of what was asked
    MatcherParameters parameters;
    bool asked_now = false;  ///< in this call; of the caller
    std::atomic<State> state{State::idle};
    std::atomic<uint32_t> calls{0};  ///< whether to look at `state` again
    std::jthread thread;             ///< last: ends before what it uses
  };
  struct Band {
    int first = 0, last = 0;         ///< rows of the result
    int top = 0, height = 0;         ///< rows that are read
    Desk own;                        ///< of the caller; of the first band its matcher only
    std::unique_ptr<Helper> helper;  ///< not of the first band
  };

  /// Of the rows that the band reads; it gives those of its result.
  std::unique_ptr<Matcher> make_matcher_of(const Band& band, const MatcherParameters& parameters) const;
  Desk make_desk(const Band& band, const MatcherParameters& parameters) const;
  /// Matches on a desk; `left` and `right` are the rows that the band reads.
  void run(const Band& band, Desk& desk, ImageView<const uint8_t> left, ImageView<const uint8_t> right) const;
  void deliver(const Band& band, const Desk& desk, const DisparityViews& out) const;
  /// Asks for a band, unless the thread is still at one of an earlier call.
  void ask(const Band& band, ImageView<const uint8_t> left, ImageView<const uint8_t> right) const;
  /// Whether the band is done, or will be within the caller's patience. Nobody begins it any more if not.
  bool helped(Helper& helper) const;
  void serve(const Band& band, const std::stop_token& stop);
  size_t bytes_of(int rows) const;

  int width_, channels_, height_, patience_, search_;
  MatcherParameters parameters_;
  std::atomic<int64_t> helper_cpu_ns_{0};
  std::vector<Band> bands_;  ///< does not grow once threads run
};

}  // namespace takt::stereo
