// SPDX-License-Identifier: Apache-2.0
#include "nodes/object_detection/byte_references.hpp"

#include <algorithm>

#include "nodes/object_detection/histogram_kernels.hpp"

namespace takt::object_detection {
namespace {

constexpr uint16_t kMost = UINT8_MAX;

size_t padded(size_t size, size_t block) { return (size + block - 1) / block * block; }

}  // namespace

ByteReferences::ByteReferences(size_t slots, const std::vector<std::vector<Counts>>& objects)
    : first_beyond_(padded(slots, kByteBlock)) {
  Counts most(slots);  // of any reference
  for (const auto& references : objects)
    for (const Counts& counts : references)
      for (size_t slot = 0; slot < counts.size(); ++slot) most[slot] = std::max(most[slot], counts[slot]);
  for (uint32_t from = kMost; from < UINT16_MAX; from += kMost)
    for (size_t slot = 0; slot < slots; ++slot)
      if (most[slot] > from) beyond_.push_back({slot, static_cast<uint16_t>(from)});
  window_ = stereo::Buffer<uint8_t>(padded(first_beyond_ + beyond_.size(), kByteBlock));
  for (const auto& references : objects) {
    objects_.push_back(gather(slots, references));
    references_ += references.size();
  }
}

ByteReferences::Object ByteReferences::gather(size_t slots, const std::vector<Counts>& references) const {
  std::vector<std::vector<uint8_t>> packed;
  for (const Counts& counts : references) {
    Counts whole = counts;
    whole.resize(padded(slots, kLaneBlock));
    pack(whole, packed.emplace_back(window_.size()).data());
  }
  Object object;
  object.references = references.size();
  const auto block_of = [](const std::vector<uint8_t>& bytes, size_t block) {
    return std::span(bytes).subspan(block, kByteBlock);
  };
  const auto has_something = [&](const std::vector<uint8_t>& bytes, size_t block) {
    return std::ranges::any_of(block_of(bytes, block), [](uint8_t count) { return count > 0; });
  };
  for (size_t block = 0; block < window_.size(); block += kByteBlock)
    if (std::ranges::any_of(packed, [&](const auto& bytes) { return has_something(bytes, block); }))
      object.blocks.push_back(block);
  if (object.blocks.empty()) return object;  // without mass
  object.rows = stereo::Buffer<uint8_t>(packed.size() * object.blocks.size() * kByteBlock);
  uint8_t* row = object.rows.data();
  for (const auto& bytes : packed)
    for (const size_t block : object.blocks) row = std::ranges::copy(block_of(bytes, block), row).out;
  return object;
}

void ByteReferences::pack(std::span<const uint16_t> counts, uint8_t* bytes) const {
  saturate_counts(counts, bytes);
  for (const Beyond& beyond : beyond_) {
    const int more = counts[beyond.slot] - beyond.from;
    bytes[first_beyond_ + static_cast<size_t>(&beyond - beyond_.data())] =
        static_cast<uint8_t>(std::clamp<int>(more, 0, kMost));
  }
}

void ByteReferences::missing(size_t object, uint16_t* out) const {
  const Object& of = objects_[object];
  missing_masses(window_.data(), of.blocks, of.rows.data(), of.references, out);
}

}  // namespace takt::object_detection
