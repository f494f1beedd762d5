// SPDX-License-Identifier: Apache-2.0
#include "rt/record/mcap/chunks.hpp"

#include <lz4frame.h>
#include <zstd.h>

#include <algorithm>

#include "rt/record/mcap/records.hpp"

namespace takt::mcap {
namespace {

constexpr uint64_t kMostUnpacked = uint64_t{1} << 31;
/// What a chunk may claim of memory: more than that must be this many times its packed size at most.
constexpr uint64_t kTrusted = 64 << 20, kMostRatio = 4096;

bool unpack_lz4(Bytes packed, std::vector<std::byte>& to) {
  LZ4F_dctx* context = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&context, LZ4F_VERSION)) != 0) return false;
  size_t made = 0, used = 0, wanted = 1;
  while (wanted != 0) {
    size_t room = to.size() - made, rest = packed.size() - used;
    wanted = LZ4F_decompress(context, to.data() + made, &room, packed.data() + used, &rest, nullptr);
    if (LZ4F_isError(wanted) != 0 || (room == 0 && rest == 0)) break;
    made += room;
    used += rest;
  }
  LZ4F_freeDecompressionContext(context);
  return wanted == 0 && made == to.size();
}

}  // namespace

Chunk get_chunk(Bytes from, uint64_t at) {
  ByteReader fields(from);
  Chunk chunk;
  chunk.at = at;
  chunk.first_ns = fields.number<uint64_t>();
  chunk.last_ns = fields.number<uint64_t>();
  chunk.uncompressed_size = fields.number<uint64_t>();
  chunk.crc = fields.number<uint32_t>();
  chunk.compression = fields.text();
  chunk.stored = fields.bytes(fields.number<uint64_t>());
  return chunk;
}

tl::expected<std::vector<std::byte>, std::string> unpack(const Chunk& chunk) {
  const auto wrong = [&](const std::string& what) {
    return tl::unexpected("the chunk at byte " + std::to_string(chunk.at) + " " + what);
  };
  std::vector<std::byte> records;
  if (chunk.uncompressed_size > kMostUnpacked) return wrong("is larger than 2 GB");
  if (chunk.uncompressed_size > std::max(kTrusted, kMostRatio * chunk.stored.size()))
    return wrong("is damaged: it claims " + std::to_string(chunk.uncompressed_size) + " bytes of " +
                 std::to_string(chunk.stored.size()));
  if (chunk.compression.empty()) {
    records.assign(chunk.stored.begin(), chunk.stored.end());
  } else if (chunk.compression == "zstd") {
    records.resize(static_cast<size_t>(chunk.uncompressed_size));
    const size_t size = ZSTD_decompress(records.data(), records.size(), chunk.stored.data(), chunk.stored.size());
    if (ZSTD_isError(size) != 0) return wrong("is damaged: " + std::string(ZSTD_getErrorName(size)));
    records.resize(size);
  } else if (chunk.compression == "lz4") {
    records.resize(static_cast<size_t>(chunk.uncompressed_size));
    if (!unpack_lz4(chunk.stored, records)) return wrong("is damaged: its lz4 frame cannot be unpacked");
  } else {
    return wrong("is compressed with " + chunk.compression + "; known: lz4, zstd, none");
  }
  if (records.size() != chunk.uncompressed_size || (chunk.crc != 0 && chunk.crc != crc_of(0, records)))
    return wrong("is damaged: its CRC does not fit");
  return records;
}

}  // namespace takt::mcap
