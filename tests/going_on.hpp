// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <doctest/doctest.h>

#include <cstddef>
#include <memory>
#include <vector>

#include "rt/memory/memory_use.hpp"
#include "rt/state_archive.hpp"

namespace takt::test {

/// `fresh`, which is as `from` was set up, with what that remembers: within what measuring says, nothing allocated, no
/// byte left.
template <class T>
std::unique_ptr<T> going_on(T& from, std::unique_ptr<T> fresh) {
  StateArchive measured = StateArchive::measuring();
  measured(*fresh);
  std::vector<std::byte> bytes(measured.bytes());
  const auto allocations = thread_memory_use().allocations;
  StateArchive saved = StateArchive::saving(bytes);
  saved(from);
  if (counting_allocations()) CHECK(thread_memory_use().allocations == allocations);
  REQUIRE_FALSE(saved.failed());
  StateArchive loaded = StateArchive::loading(std::span<const std::byte>(bytes).first(saved.bytes()));
  loaded(*fresh);
  REQUIRE_FALSE(loaded.failed());
  REQUIRE(loaded.at_end());
  return fresh;
}

}  // namespace takt::test
