// SPDX-License-Identifier: Apache-2.0
#include "nodes/cuda/trust.hpp"

namespace takt::cuda {

Trust::Trust(const std::string& card, int64_t bound_ns)
    : late_(card + " was later than " + std::to_string(bound_ns / 1000) + " us"),
      failed_(card + " has failed, and is not asked again") {}

bool Trust::asks() {
  if (given_up_) return false;
  if (pause_ == 0) return true;
  --pause_;
  return false;
}

bool Trust::done(Outcome outcome) {
  switch (outcome) {
    case Outcome::done:
      late_in_row_ = 0;
      trouble_ = &none_;
      return true;
    case Outcome::late:
      trouble_ = &late_;
      if (++late_in_row_ < kMostLate) return false;
      late_in_row_ = 0;
      pause_ = kPause;
      return false;
    case Outcome::failed: break;
  }
  trouble_ = &failed_;
  given_up_ = true;
  return false;
}

}  // namespace takt::cuda
