// SPDX-License-Identifier: Apache-2.0
// Whether a card is asked, by what became of the last times.
//
//   if (trust.asks() && trust.done(cuda.match(...))) return true;   // else the twin on the CPU does it
#pragma once
#include <string>
#include <string_view>

#include "nodes/cuda/table.hpp"

namespace takt::cuda {

/// After kMostLate times in a row that came late the card is left alone for kPause, after an error of CUDA for good.
/// One thread at a time.
class Trust {
 public:
  static constexpr int kMostLate = 3, kPause = 150;
  Trust(const std::string& card, int64_t bound_ns);
  /// To be called once for all that is to be done.
  bool asks();
  /// What became of it.
  bool done(Outcome outcome);
  /// Why the CPU does it; empty: it does not. As long as this lives.
  std::string_view trouble() const { return *trouble_; }

 private:
  const std::string none_, late_, failed_;
  const std::string* trouble_ = &none_;
  int late_in_row_ = 0, pause_ = 0;
  bool given_up_ = false;
};

}  // namespace takt::cuda
