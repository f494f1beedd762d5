// SPDX-License-Identifier: Apache-2.0
#include "rt/shm/kill_order.hpp"

#include <array>
#include <csignal>
#include <cstring>

namespace takt {
namespace {
constexpr std::array<std::string_view, kMessageSteps> kNames = {
    "none",          "inside_loan",  "after_loan",  "half_written", "inside_publish", "after_publish",
    "inside_commit", "after_commit", "inside_take", "while_held",   "inside_release"};
}  // namespace

std::string_view to_string(MessageStep step) { return kNames[static_cast<size_t>(step)]; }

std::optional<MessageStep> message_step(std::string_view name) {
  for (size_t i = 1; i < kNames.size(); ++i)
    if (kNames[i] == name) return static_cast<MessageStep>(i);
  return std::nullopt;
}

void detail::obey(KillOrder& order, MessageStep step, size_t port, std::byte* message, size_t bytes) {
  if (const auto hook = step_hook.load()) hook(step, port);
  if (order.step.load(std::memory_order_acquire) != step || order.port.load(std::memory_order_relaxed) != port) return;
  for (uint32_t left = order.passes.load(); left > 0;)
    if (order.passes.compare_exchange_weak(left, left - 1)) return;
  order.step.store(MessageStep::none);  // whoever takes this process's place has no such order
  if (const KillOrder::Deed deed = order.instead.load()) return deed(order, message, bytes);
  if (step == MessageStep::half_written && message != nullptr) std::memset(message, 0xA5, bytes / 2);
  raise(SIGKILL);
}

}  // namespace takt
