// SPDX-License-Identifier: Apache-2.0
// Any file to the reader of MCAP: ids fit, data lie in their chunk, and a part of the messages is never more than all.
#include "rt/record/mcap/reader.hpp"
#include "tests/fuzz/memory_file.hpp"

using namespace takt;
using takt::fuzz::require;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const fuzz::MemoryFile file(data, size);
  const auto reader = mcap::Reader::open(file.path());
  if (!reader) return 0;
  for (const mcap::Channel& channel : reader->channels()) require(channel.schema <= reader->schemas().size());
  size_t all = 0, walked = 0;
  for (const mcap::Chunk& chunk : reader->chunks()) {
    const auto records = reader->unpack(chunk);
    if (!records) continue;
    require(records->size() == chunk.uncompressed_size);
    static_cast<void>(reader->for_each_in(*records, [&](const mcap::Message& message) {
      require(message.channel <= reader->channels().size());
      require(message.data.empty() || (message.data.data() >= records->data() &&
                                       message.data.data() + message.data.size() <= records->data() + records->size()));
      ++all;
      return true;
    }));
  }
  static_cast<void>(reader->for_each([&](const mcap::Message&) { return ++walked > 0; }));
  require(walked <= all);
  return 0;
}
