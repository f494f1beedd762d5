// SPDX-License-Identifier: Apache-2.0
// The parameters of a node that has a twin on a card.
//
//   cuda::Accelerator accelerator_{this};                                  // a member of the node
//   const auto card = accelerator_.take([&](const cuda::CardUse& use) { detector_->use(use); },  // in setup()
//                                       [&] { return detector_->card_is_quicker(setup.clock); });
//   accelerator_.tell(job, "counts", detector_->trouble());                // at the end of a job
#pragma once
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

#include "nodes/cuda/card.hpp"
#include "rt/node.hpp"

namespace takt::cuda {

class Accelerator {
 public:
  explicit Accelerator(Node* node)
      : which_(
            node, "accelerator", "none", {"none", "auto", "cuda"},
            "what does the most costly work: none, the CPU; auto, a graphics card if there is one and it is quicker; "
            "cuda, a card, which must be there",
            Fixed{"takes memory of a card"}),
        wait_(node, "accelerator_wait", 5.0, {0.1, 1000.0}, "ms",
              "so long a job waits for the card, then the CPU does it", Fixed{"part of what is set up on the card"}) {
    told_.reserve(kWhyBytes);
  }

  /// In setup(). The card that is in use from now on: where the parameters want it, there is one, `take(use)` has set
  /// it up, and under `auto` is_quicker() says so. Else nothing; what take() has set up is to be dropped. Throws
  /// SetupError if under `cuda` there is no card, or take() throws.
  template <class Take, class IsQuicker>
  std::optional<CardUse> take(Take take, IsQuicker is_quicker) const {
    if (which_.word() == "none") return std::nullopt;
    const bool must = which_.word() == "cuda";
    try {
      const auto card = find_card(0);
      if (!card) throw std::runtime_error(card.error());
      const CardUse use{*card, static_cast<int64_t>(wait_ * 1e6)};
      take(use);
      if (must || is_quicker()) return use;
    } catch (const std::exception& error) {
      if (must) throw SetupError(std::string("accelerator is cuda, but ") + error.what());
    }
    return std::nullopt;
  }

  /// Says in the log, once, that the CPU does it and why, and that the card does it again. `verb`: "matches";
  /// `trouble`: empty, or why.
  void tell(Job& job, const char* verb, std::string_view trouble) {
    if (trouble.substr(0, told_.capacity()) == told_) return;
    told_.assign(trouble.substr(0, told_.capacity()));
    if (trouble.empty()) job.log(LogLevel::info, "the card %s again", verb);
    else job.log(LogLevel::warning, "the CPU %s: %.*s", verb, static_cast<int>(trouble.size()), trouble.data());
  }

 private:
  Choice which_;
  Param<double> wait_;
  std::string told_;  ///< with room for what Trust says
};

}  // namespace takt::cuda
