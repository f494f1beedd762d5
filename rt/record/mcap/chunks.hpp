// SPDX-License-Identifier: Apache-2.0
// What lies in an MCAP file, record by record, and in a chunk of it.
#pragma once
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "rt/record/mcap/format.hpp"
#include "rt/record/mcap/reader.hpp"

namespace takt::mcap {

constexpr uint64_t kHead = 1 + 8;  ///< of a record: opcode and length

/// Calls each(op, fields, at) for every record; stops if it answers false. Throws TooShort.
template <class Each>
void for_each_record(Bytes records, const Each& each) {
  for (size_t at = 0; at < records.size();) {
    ByteReader rest(records.subspan(at));
    const auto op = static_cast<Op>(rest.number<uint8_t>());
    const Bytes fields = rest.bytes(rest.number<uint64_t>());
    if (!each(op, fields, at)) return;
    at += kHead + fields.size();
  }
}

/// Of its fields; `at` is that of the record in the file. Throws TooShort.
Chunk get_chunk(Bytes fields, uint64_t at);

/// Its records. Error: damaged, or compressed in a way this build does not know.
tl::expected<std::vector<std::byte>, std::string> unpack(const Chunk& chunk);

}  // namespace takt::mcap
