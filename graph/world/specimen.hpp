// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "rt/memory/aligned_bytes.hpp"
#include "rt/msg/field.hpp"

namespace takt::world {

/// A message of zeros, as large as its output can carry, so that it shows what messages of that output can show: an
/// empty picture shows nothing. It is sound(); a type that calls such a message unsound gives an empty one.
///
///   const AlignedBytes message = specimen(type, capacity);
///   type.show(message.get(), viewer);
AlignedBytes specimen(const MessageType& type, const Capacity& capacity);

}  // namespace takt::world
