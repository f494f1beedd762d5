// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>

namespace takt::record {

/// What is recorded of the messages of a port.
struct PortRule {
  enum Keep : uint8_t {
    nothing,
    hash,  ///< header and hash
    all,   ///< and, of some, all fields
  };
  Keep keep = all;
  uint32_t every = 1;    ///< all fields of each so many-th message, by its sequence
  int64_t pause_ns = 0;  ///< ... and of none sooner than this after the last one that has them
  uint8_t jpeg = 0;      ///< their pictures as JPEG of that quality, 1 to 100; 0: as they are
};

}  // namespace takt::record
