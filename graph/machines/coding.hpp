// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "rt/msg/field.hpp"
#include "rt/record/picture_codec.hpp"

namespace takt::machines {

/// How the messages of an output go over the network: as they are, smaller, or smaller and nearly the same (jpeg).
enum class Coding : uint32_t { plain, zstd, lz4, jpeg };

/// "plain", "zstd", "lz4" or "jpeg"; nothing: none of them.
std::optional<Coding> coding_of(std::string_view word);

/// Makes messages small for the way. Keeps its memory from message to message. One thread at a time.
///
///   Coder coder(Coding::zstd);
///   const auto small = coder.code(type, packed);     // of record::pack
class Coder {
 public:
  explicit Coder(Coding coding);
  Coding coding() const { return coding_; }
  /// Valid until the next call, and as long as `packed` is.
  std::span<const std::byte> code(const MessageType& type, std::span<const std::byte> packed);

 private:
  Coding coding_;
  record::PictureCoder pictures_;
  std::vector<std::byte> coded_;
};

/// The packed message; may lie in `into`. Error: what came is none, or would have more than `most` bytes.
tl::expected<std::span<const std::byte>, std::string> decoded(Coding coding, std::span<const std::byte> coded,
                                                              uint64_t most, std::vector<std::byte>& into);

}  // namespace takt::machines
