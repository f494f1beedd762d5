// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/msg/layout.hpp>: core, experimental.
// How messages lie in memory, for a process that knows their type by its description only: name and fields, none of its
// functions. The process that owns the output has these, and says how long the arrays can become.
//
//   const ArrayCounts counts = counts_of(type, capacity);  // there
//   if (intact(described, message, counts)) ...            // here
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

#include "rt/msg/field.hpp"

namespace takt {

/// Of each array of a message, in the order of its fields, how many elements fit.
using ArrayCounts = std::array<uint32_t, 16>;

ArrayCounts counts_of(const MessageType& type, const Capacity& capacity);

/// As MessageType::bytes().
uint64_t bytes_of(const MessageType& type, const ArrayCounts& counts);

/// As MessageType::intact(), but that nobody asks whether the message is sound.
bool intact(const MessageType& type, const void* message, const ArrayCounts& counts);

/// None of its functions may be called.
inline bool is_described(const MessageType& type) { return type.capacities == nullptr; }

}  // namespace takt
