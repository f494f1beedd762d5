// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "rt/record/mcap/format.hpp"

namespace takt::mcap {

/// The records of an MCAP file that still grows, in their order, each once all of it is there. In memory is one at a
/// time. The file may be removed meanwhile. One thread at a time.
class Tail {
 public:
  struct Record {
    Op op;
    Bytes fields;  ///< valid until the next call
    uint64_t at;   ///< in the file
  };
  /// Error: why it cannot be opened.
  static tl::expected<Tail, std::string> open(const std::filesystem::path& file);
  Tail(Tail&& other) noexcept;
  Tail& operator=(Tail&& other) noexcept;
  ~Tail();

  /// The next one; none if it is not there yet. Error: what is there is no record, and nothing can be read behind it.
  tl::expected<std::optional<Record>, std::string> next();

 private:
  explicit Tail(int descriptor) : descriptor_(descriptor) {}
  bool read(uint64_t at, uint64_t size);

  int descriptor_;
  uint64_t at_ = 0;
  std::vector<std::byte> buffer_;
};

}  // namespace takt::mcap
