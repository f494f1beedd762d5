// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>

namespace takt::machines {

/// What came of the messages of one output, by their numbers 1, 2, 3 ...: each is taken once, in order, and what is
/// missing is counted exactly, whatever the network lost, doubled or reordered. One thread at a time.
///
///   if (arrivals.take(sequence) == Arrivals::fresh) use(message);
class Arrivals {
 public:
  enum Verdict : uint8_t {
    fresh,    ///< newer than all before
    passed,   ///< came after a newer one
    doubled,  ///< was here before, or is older than can be told
  };
  /// The first one begins the count: what was sent before it was not for us.
  Verdict take(uint64_t sequence);
  /// The sender began anew.
  void begin_again() { newest_ = 0; }

  uint64_t received() const { return received_; }  ///< different ones
  /// Between the first and the newest one, and not here: those that the network lost, and those still under way.
  uint64_t missing() const { return expected_ - received_; }
  uint64_t doubles() const { return doubles_; }
  uint64_t passes() const { return passes_; }

 private:
  static constexpr uint64_t kWindow = 64;
  uint64_t newest_ = 0, seen_ = 0;  ///< bit i: newest_ - i came
  uint64_t first_ = 0;
  uint64_t expected_ = 0, received_ = 0, doubles_ = 0, passes_ = 0;
};

}  // namespace takt::machines
