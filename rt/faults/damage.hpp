// SPDX-License-Identifier: Apache-2.0
// Damages messages of any type by its field descriptors, so that numbers become wrong, never the memory: placement and
// capacity of an Array stay, and its size never grows. Any thread; no allocation.
#pragma once
#include <cstdint>

#include "rt/msg/field.hpp"

namespace takt::faults {

/// Changes at least one bit of about every 64th byte of what the message uses, chosen by `seed`; at least one bit of
/// all. Elements of arrays and real numbers change; whole numbers only in a message without arrays, because beside an
/// array they may say how it is laid out (the width of an image). False if there is nothing to change.
bool corrupt(const MessageType& type, void* message, uint64_t seed);

/// Shortens every array that is not empty, to a size chosen by `seed`. False if there is none.
bool truncate(const MessageType& type, void* message, uint64_t seed);

/// Copies what `from` uses over `to`. Both are placed messages of that type and of one capacity.
void copy_used(const MessageType& type, const void* from, void* to);

}  // namespace takt::faults
