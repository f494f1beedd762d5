// SPDX-License-Identifier: Apache-2.0
// The graphics cards of this machine, for algorithms that have a twin on one.
//
//   const auto card = cuda::find_card(0);
//   if (!card) throw SetupError(card.error());                  // plug-in, driver or card: what is missing, and its
//   fix StereoOnCard* stereo = card->cuda->make_stereo(&shape, card->index, why);
#pragma once
#include <string>
#include <tl/expected.hpp>

#include "nodes/cuda/table.hpp"

namespace takt::cuda {

struct Card {
  const Table* cuda = nullptr;  ///< lives as long as the process
  int index = 0;
  std::string name;  ///< "NVIDIA H200"
};

/// A card, and how long a job may wait for it.
struct CardUse {
  Card card;
  int64_t bound_ns = 0;
};

/// Loads the plug-in and CUDA's driver with the first call: some 0.2 s, memory and threads of their own. Error: what of
/// plug-in, driver and card is missing, and how to get it. Any thread.
tl::expected<Card, std::string> find_card(int index);

}  // namespace takt::cuda
