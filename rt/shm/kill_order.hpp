// SPDX-License-Identifier: Apache-2.0
// The end of a process at an exact step in the life of a message: what a kill at a random instant meets only once in a
// long while. For tests and fault scenarios; without an order it costs a comparison.
#pragma once
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

namespace takt {

enum class MessageStep : uint32_t {
  none,
  inside_loan,     ///< the writer has looked who holds which chunk, and has taken none yet
  after_loan,      ///< the writer has a chunk and has written nothing
  half_written,    ///< ... and has written half of it
  inside_publish,  ///< the message is on its way: readers may or may not find it
  after_publish,   ///< it is out, or announced and waits for the commit of its job
  inside_commit,   ///< all outputs of the job are announced, and become visible together or never
  after_commit,    ///< they have become so; this one is about to be settled
  inside_take,     ///< a reader has flagged the chunk, and not looked again whether the message is still there
  while_held,      ///< a reader has it
  inside_release,  ///< a reader is giving it back
};
inline constexpr size_t kMessageSteps = 11;
/// The most instants that one step has: those of `inside_publish` in the runtime's own pools.
inline constexpr uint32_t kInstantsOfStep = 3;
std::string_view to_string(MessageStep step);
/// None if there is no step of that name.
std::optional<MessageStep> message_step(std::string_view name);

/// Whether a step is one of a reader; else it is one of the writer.
constexpr bool is_of_reader(MessageStep step) {
  return step == MessageStep::inside_take || step == MessageStep::while_held || step == MessageStep::inside_release;
}

/// "Kill yourself (SIGKILL) when you come to that step of that port." In memory that processes may share; `step` is
/// stored last.
struct KillOrder {
  using Deed = void (*)(KillOrder& order, std::byte* message, size_t bytes);
  std::atomic<uint32_t> port{0};
  std::atomic<uint32_t> passes{0};     ///< times that the step is passed before
  std::atomic<Deed> instead{nullptr};  ///< what is done instead of the kill: a function of this very program
  std::atomic<MessageStep> step{MessageStep::none};
};

namespace detail {
inline constinit std::atomic<KillOrder*> kill_order{nullptr};
inline constinit std::atomic<void (*)(MessageStep, size_t)> step_hook{nullptr};
void obey(KillOrder& order, MessageStep step, size_t port, std::byte* message, size_t bytes);
}  // namespace detail

/// The order that this process obeys from now on; null: none. It must live until the process ends.
inline void obey_orders(KillOrder* order) { detail::kill_order.store(order, std::memory_order_release); }

/// For tests: called at every step, with its port, in a process that obeys an order (of `none`, say). Null: not any
/// more.
inline void at_every_step(void (*hook)(MessageStep step, size_t port)) { detail::step_hook.store(hook); }

/// Whether this process dies the next time it comes to that step of that port.
inline bool about_to_die(MessageStep step, size_t port) {
  const KillOrder* order = detail::kill_order.load(std::memory_order_relaxed);
  return order != nullptr && order->step.load(std::memory_order_acquire) == step &&
         order->port.load(std::memory_order_relaxed) == port && order->passes.load(std::memory_order_relaxed) == 0;
}

/// A writer or reader of `port` is at `step`. `message` and `bytes`: what half_written scribbles over. Any thread.
inline void reached(MessageStep step, size_t port, void* message = nullptr, size_t bytes = 0) {
  if (KillOrder* order = detail::kill_order.load(std::memory_order_relaxed))
    detail::obey(*order, step, port, static_cast<std::byte*>(message), bytes);
}

}  // namespace takt
