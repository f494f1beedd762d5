// SPDX-License-Identifier: Apache-2.0
#include "graph/machines/coding.hpp"

#include <lz4.h>
#include <zstd.h>

#include <algorithm>
#include <array>

#include "rt/record/mcap/bytes.hpp"

namespace takt::machines {
namespace {

constexpr std::array<std::string_view, 4> kWords{"plain", "zstd", "lz4", "jpeg"};  // in the order of Coding
constexpr int kJpegQuality = 85;
constexpr int kZstdLevel = 1;  // time counts: 300 kB take about a millisecond

using Bytes = std::span<const std::byte>;

const char* chars(const std::byte* bytes) { return reinterpret_cast<const char*>(bytes); }
char* chars(std::byte* bytes) { return reinterpret_cast<char*>(bytes); }

tl::unexpected<std::string> damaged(std::string_view what) {
  return tl::make_unexpected("cannot be unpacked: " + std::string(what));
}

tl::expected<Bytes, std::string> of_zstd(Bytes coded, uint64_t most, std::vector<std::byte>& into) {
  const unsigned long long size = ZSTD_getFrameContentSize(coded.data(), coded.size());
  if (size == ZSTD_CONTENTSIZE_UNKNOWN || size == ZSTD_CONTENTSIZE_ERROR || size > most) return damaged("its size");
  into.resize(size);
  const size_t made = ZSTD_decompress(into.data(), into.size(), coded.data(), coded.size());
  if (ZSTD_isError(made) != 0 || made != size) return damaged("zstd");
  return Bytes(into);
}

/// A block behind the size of what is in it (u32).
tl::expected<Bytes, std::string> of_lz4(Bytes coded, uint64_t most, std::vector<std::byte>& into) {
  if (coded.size() < sizeof(uint32_t)) return damaged("too short");
  mcap::ByteReader in(coded);
  const auto size = in.number<uint32_t>();
  if (size > std::min<uint64_t>(most, LZ4_MAX_INPUT_SIZE)) return damaged("its size");
  into.resize(size);
  const Bytes block = in.bytes(in.left());
  const int made = LZ4_decompress_safe(chars(block.data()), chars(into.data()), static_cast<int>(block.size()),
                                       static_cast<int>(size));
  if (made != static_cast<int>(size)) return damaged("lz4");
  return Bytes(into);
}

void append_zstd(Bytes packed, std::vector<std::byte>& to) {
  to.resize(ZSTD_compressBound(packed.size()));
  to.resize(ZSTD_compress(to.data(), to.size(), packed.data(), packed.size(), kZstdLevel));
}

void append_lz4(Bytes packed, std::vector<std::byte>& to) {
  mcap::ByteWriter(to).number(static_cast<uint32_t>(packed.size()));
  const size_t head = to.size();
  to.resize(head + static_cast<size_t>(LZ4_compressBound(static_cast<int>(packed.size()))));
  to.resize(head + static_cast<size_t>(LZ4_compress_default(chars(packed.data()), chars(to.data() + head),
                                                            static_cast<int>(packed.size()),
                                                            static_cast<int>(to.size() - head))));
}

}  // namespace

std::optional<Coding> coding_of(std::string_view word) {
  const auto at = std::find(kWords.begin(), kWords.end(), word);
  if (at == kWords.end()) return std::nullopt;
  return static_cast<Coding>(at - kWords.begin());
}

Coder::Coder(Coding coding) : coding_(coding), pictures_(kJpegQuality) {}

Bytes Coder::code(const MessageType& type, Bytes packed) {
  coded_.clear();
  switch (coding_) {
    case Coding::plain: return packed;
    case Coding::zstd: append_zstd(packed, coded_); break;
    case Coding::lz4: append_lz4(packed, coded_); break;
    case Coding::jpeg: pictures_.code(type.fields, packed, coded_); break;
  }
  return coded_;
}

tl::expected<Bytes, std::string> decoded(Coding coding, Bytes coded, uint64_t most, std::vector<std::byte>& into) {
  switch (coding) {
    case Coding::plain: return coded;
    case Coding::zstd: return of_zstd(coded, most, into);
    case Coding::lz4: return of_lz4(coded, most, into);
    case Coding::jpeg: break;
  }
  auto plain = record::plain_of(coded);
  if (!plain) return tl::make_unexpected(std::move(plain.error()));
  into = std::move(*plain);
  return Bytes(into);
}

}  // namespace takt::machines
