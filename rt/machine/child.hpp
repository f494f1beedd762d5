// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <functional>
#include <optional>
#include <type_traits>

namespace takt::machine {

namespace detail {
bool ask_child(const std::function<void(void*)>& body, void* answer, size_t bytes, int64_t patience_ns);
}

/// Runs `body` in a forked process and returns its result: what it locks, reserves or pins ends with it. Nothing if it
/// did not answer within `patience_ns` (it is then killed) or died. The calling process must have no other threads; the
/// child may start some.
template <class Result>
std::optional<Result> in_child(const std::function<Result()>& body, int64_t patience_ns = 5'000'000'000) {
  static_assert(std::is_trivially_copyable_v<Result>);
  Result result{};
  const bool answered = detail::ask_child([&](void* answer) { *static_cast<Result*>(answer) = body(); }, &result,
                                          sizeof result, patience_ns);
  return answered ? std::optional(result) : std::nullopt;
}

}  // namespace takt::machine
