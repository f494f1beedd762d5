// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "nodes/stereo/aligned_rows.hpp"

namespace takt::object_detection {

/// The references of a stage, compared with one window after another. Counts are packed into bytes, as many of which a
/// vector holds: slot i has min(255, count), and where a reference has more, further bytes have what goes beyond 255,
/// 510 ... Byte by byte the missing masses add up to that of the counts, exactly. An object's references are compared
/// over those blocks of bytes only in which one of them has something. Memory is taken by the constructor.
class ByteReferences {
 public:
  /// Of a reference, by slot; below 65,536 in all.
  using Counts = std::vector<uint16_t>;
  /// `objects`: per object its references, with at most `slots` counts each.
  ByteReferences(size_t slots, const std::vector<std::vector<Counts>>& objects);

  size_t references() const { return references_; }  ///< of all objects
  size_t objects() const { return objects_.size(); }
  size_t references(size_t object) const { return objects_[object].references; }
  /// The window that missing() is about; `counts`: of `slots` slots, padded to a multiple of kLaneBlock.
  void take(std::span<const uint16_t> counts) { pack(counts, window_.data()); }
  /// The missing mass of every reference of the object.
  void missing(size_t object, uint16_t* out) const;

 private:
  struct Object {
    std::vector<size_t> blocks;    ///< where in a window each begins
    stereo::Buffer<uint8_t> rows;  ///< references x blocks x kByteBlock
    size_t references = 0;
  };
  struct Beyond {
    size_t slot;
    uint16_t from;
  };
  Object gather(size_t slots, const std::vector<Counts>& references) const;
  void pack(std::span<const uint16_t> counts, uint8_t* bytes) const;

  size_t first_beyond_;         ///< byte; those before it are slots
  std::vector<Beyond> beyond_;  ///< what the further bytes hold
  stereo::Buffer<uint8_t> window_;
  std::vector<Object> objects_;
  size_t references_ = 0;
};

}  // namespace takt::object_detection
