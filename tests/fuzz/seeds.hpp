// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace takt::fuzz {

using Bytes = std::vector<uint8_t>;

/// As tests/fuzz/session.hpp reads it: bytes that come at once, after a pause.
inline Bytes piece(const Bytes& bytes, uint8_t pause) {
  Bytes all{static_cast<uint8_t>(uint32_t{pause} << 5 | bytes.size() >> 8), static_cast<uint8_t>(bytes.size())};
  all.insert(all.end(), bytes.begin(), bytes.end());
  return all;
}

/// A folder of inputs to begin with.
class Seeds {
 public:
  explicit Seeds(std::filesystem::path folder) : folder_(std::move(folder)) {
    std::filesystem::create_directories(folder_);
  }
  void add(const Bytes& bytes) {
    std::ofstream file(folder_ / ("seed" + std::to_string(count_++)), std::ios::binary);
    file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  }
  /// Each part alone, then all of them as they come one after the other.
  void add_conversation(const std::vector<Bytes>& parts) {
    Bytes all;
    for (const Bytes& part : parts) {
      add(part);
      const Bytes next = piece(part, 2);
      all.insert(all.end(), next.begin(), next.end());
    }
    add(all);
  }
  /// As it is; cut after a third, two thirds and before its end; twice; with one bit flipped near the begin, in the
  /// middle, at the end; joined to its own begin.
  void add_and_spoil(const Bytes& bytes) {
    add(bytes);
    const auto end = [&](size_t size) { return bytes.begin() + static_cast<ptrdiff_t>(size); };
    for (const size_t size : {bytes.size() / 3, 2 * bytes.size() / 3, bytes.size() - 1}) {
      add({bytes.begin(), end(size)});
      Bytes joined(bytes.begin(), end(size));
      joined.insert(joined.end(), bytes.begin(), bytes.end());
      add(joined);
    }
    Bytes twice = bytes;
    twice.insert(twice.end(), bytes.begin(), bytes.end());
    add(twice);
    for (const size_t at : {std::min<size_t>(2, bytes.size() - 1), bytes.size() / 2, bytes.size() - 1}) {
      Bytes flipped = bytes;
      flipped[at] ^= 0x10;
      add(flipped);
    }
  }
  size_t count() const { return count_; }

 private:
  std::filesystem::path folder_;
  size_t count_ = 0;
};

/// Of the readers of files: the folders mcap, cloud, web, carmen, calibration and image in `folder`.
size_t file_seeds(const std::filesystem::path& folder);

}  // namespace takt::fuzz
