// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <cstdint>
#include <span>

namespace takt::semantic_link {

using Key = std::array<uint8_t, 16>;

/// SipHash-2-4 (Aumasson, Bernstein: "SipHash: a fast short-input PRF", 2012). Who does not have the key finds the
/// value of other bytes by trying 2^63 of them; with a key that everybody has it is a checksum of 64 bits.
uint64_t siphash(const Key& key, std::span<const uint8_t> bytes);

}  // namespace takt::semantic_link
