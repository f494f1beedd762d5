// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <thread>

#include "nodes/object_detection/detector.hpp"

namespace takt::object_detection {

/// Makes new detectors, and frees old ones, on a thread of its own. One other thread, whose jobs may neither wait nor
/// allocate, asks for one, looks now and then whether it is built, and exchanges it for that in use as a whole.
class Reloader {
 public:
  static constexpr size_t kLongestRevision = 255;

  /// `build` makes the detector of a revision on the thread; what it throws becomes error().
  explicit Reloader(std::function<std::unique_ptr<Detector>(const std::string& revision)> build);
  ~Reloader();

  /// Not while another one is asked for and not exchanged yet. Longer names than kLongestRevision are cut off.
  void ask(std::string_view revision);
  bool built() const { return state_.load(std::memory_order_acquire) == kBuilt; }
  /// Until it is built, or could not be: for replays and virtual time, where jobs may wait.
  void wait() const;
  /// Once built(): gives the new detector for the old one. False, and the old one stays, if it could not be built.
  bool exchange(std::unique_ptr<Detector>& in_use);
  /// Why; until the next ask().
  std::string_view error() const { return error_; }

 private:
  /// idle -> asked -> built -> spent (the old detector is to be freed) -> idle; also spent -> asked.
  enum State : uint32_t { kIdle, kAsked, kBuilt, kSpent };
  void serve(const std::stop_token& stop);
  void become(uint32_t state);

  std::function<std::unique_ptr<Detector>(const std::string&)> build_;
  std::atomic<uint32_t> state_{kIdle};
  std::string revision_, error_;
  std::unique_ptr<Detector> detector_;  ///< built, or spent
  std::jthread thread_;                 ///< last: ends before what it uses
};

}  // namespace takt::object_detection
