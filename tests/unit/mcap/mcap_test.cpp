// SPDX-License-Identifier: Apache-2.0
// The container: what is written is read back, whole, cut off anywhere, or damaged.
#include <doctest/doctest.h>
#include <sys/resource.h>

#include <array>
#include <csignal>
#include <fstream>
#include <functional>
#include <iterator>
#include <random>

#include "rt/record/mcap/file_sink.hpp"
#include "rt/record/mcap/reader.hpp"
#include "rt/record/mcap/records.hpp"
#include "rt/record/mcap/tail.hpp"
#include "rt/record/mcap/writer.hpp"
#include "tests/temporary_folder.hpp"

using namespace takt;
using namespace takt::mcap;

namespace {

/// Keeps all in memory; refuses once it would hold more than `room` bytes.
struct MemorySink final : Sink {
  std::vector<std::byte> bytes;
  size_t room = SIZE_MAX;
  tl::expected<void, std::string> append(std::span<const Bytes> parts) override {
    size_t size = bytes.size();
    for (const Bytes part : parts) size += part.size();
    if (size > room) return tl::unexpected(std::string("No space left on device"));
    for (const Bytes part : parts) bytes.insert(bytes.end(), part.begin(), part.end());
    return {};
  }
};

struct Kept {
  uint16_t channel;
  uint32_t sequence;
  uint64_t log_ns, publish_ns;
  std::vector<std::byte> data;
  bool operator==(const Kept&) const = default;
};

Kept message_of(uint32_t i) {
  std::mt19937 random(i);
  Kept message{static_cast<uint16_t>(1 + i % 3), i, 1'000'000ull * i, 1'000'000ull * i + 5, {}};
  message.data.resize(random() % 400);
  for (std::byte& byte : message.data) byte = static_cast<std::byte>(i % 2 == 0 ? random() : 7);
  return message;
}

Message as_message(const Kept& kept) { return {kept.channel, kept.sequence, kept.log_ns, kept.publish_ns, kept.data}; }

void begin(Writer& writer) {
  REQUIRE(writer.begin("takt", "test"));
  const uint16_t schema = writer.add_schema("pose", "jsonschema", R"({"type":"object"})");
  for (const char* topic : {"stereo.cloud", "ego_motion.motion", "mapping_3d.obstacles"})
    writer.add_channel(schema, topic, "takt", {{"node", topic}});
}

std::vector<std::byte> sample(uint32_t messages, Compression compression) {
  MemorySink sink;
  Writer writer(sink, {4096, compression, 1});
  begin(writer);
  REQUIRE(writer.metadata("machine", {{"cpu", "Six"}, {"kernel", "6.1"}}));
  REQUIRE(writer.attach({3, 4, "graph.yaml", "application/yaml", bytes_of("takt: 1\n")}));
  for (uint32_t i = 0; i < messages; ++i) REQUIRE(writer.write(as_message(message_of(i))));
  REQUIRE(writer.finish());
  CHECK(writer.written_bytes() == sink.bytes.size());
  CHECK(writer.lost() == 0);
  return sink.bytes;
}

std::filesystem::path written(const test::TemporaryFolder& folder, Bytes bytes) {
  return folder.write("log.mcap", {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

std::vector<Kept> messages_of(const Reader& reader, std::string* error = nullptr) {
  std::vector<Kept> all;
  const auto done = reader.for_each([&](const Message& m) {
    all.push_back({m.channel, m.sequence, m.log_ns, m.publish_ns, {m.data.begin(), m.data.end()}});
    return true;
  });
  if (error != nullptr) *error = done ? "" : done.error();
  else CHECK(done.has_value());
  return all;
}

}  // namespace

TEST_CASE("mcap: what is written is read back") {
  const test::TemporaryFolder folder;
  for (const Compression compression : {Compression::none, Compression::zstd}) {
    const auto bytes = sample(200, compression);
    const auto reader = Reader::open(written(folder, bytes));
    REQUIRE(reader);
    CHECK(reader->missing() == "");
    CHECK(reader->profile() == "takt");
    REQUIRE(reader->schemas().size() == 1);
    CHECK(reader->schemas()[0] == Schema{1, "pose", "jsonschema", R"({"type":"object"})"});
    REQUIRE(reader->channels().size() == 3);
    CHECK(reader->channels()[1] == Channel{2, 1, "ego_motion.motion", "takt", {{"node", "ego_motion.motion"}}});
    REQUIRE(reader->metadata().size() == 1);
    CHECK(reader->metadata()[0].map.at("cpu") == "Six");
    REQUIRE(reader->attachments().size() == 1);
    CHECK(reader->attachments()[0].data.size() == 8);
    CHECK(reader->chunks().size() > 5);
    const auto all = messages_of(*reader);
    REQUIRE(all.size() == 200);
    for (uint32_t i = 0; i < 200; ++i) CHECK(all[i] == message_of(i));
  }
}

TEST_CASE("mcap: a chunk of noise is stored as it is, one that shrinks is compressed") {
  MemorySink sink;
  Writer writer(sink, {});
  begin(writer);
  std::mt19937 random(1);
  std::vector<std::byte> noise(1 << 20), pattern(1 << 20);
  for (size_t i = 0; i < noise.size(); ++i) {
    noise[i] = static_cast<std::byte>(random());
    pattern[i] = static_cast<std::byte>(i / 1000);
  }
  REQUIRE(writer.write({1, 1, 1, 1, noise}));
  REQUIRE(writer.write({1, 2, 2, 2, pattern}));
  REQUIRE(writer.finish());
  const test::TemporaryFolder folder;
  const auto reader = Reader::open(written(folder, sink.bytes));
  REQUIRE(reader);
  REQUIRE(reader->chunks().size() == 2);
  CHECK(reader->chunks()[0].compression == "");
  CHECK(reader->chunks()[1].compression == "zstd");
  CHECK(reader->chunks()[1].stored.size() < pattern.size() / 10);
  const auto all = messages_of(*reader);
  REQUIRE(all.size() == 2);
  CHECK(all[0].data == noise);
  CHECK(all[1].data == pattern);
}

TEST_CASE("mcap: a file cut off anywhere gives whole chunks, and says what is missing") {
  const test::TemporaryFolder folder;
  const auto bytes = sample(60, Compression::zstd);
  const auto whole = messages_of(*Reader::open(written(folder, bytes)));
  size_t before = 0;
  for (size_t size = 0; size < bytes.size(); size += size < 300 ? 1 : 37) {
    CAPTURE(size);
    const auto reader = Reader::open(written(folder, Bytes(bytes).first(size)));
    if (size < kMagic.size()) {
      CHECK_FALSE(reader);
      continue;
    }
    REQUIRE(reader);
    CHECK_FALSE(reader->missing().empty());
    const auto some = messages_of(*reader);
    CHECK(some.size() >= before);
    REQUIRE(some.size() <= whole.size());
    CHECK(std::equal(some.begin(), some.end(), whole.begin()));
    before = some.size();
  }
  CHECK(before > 40);
}

TEST_CASE("mcap: a changed byte is noticed, or changes no message") {
  const test::TemporaryFolder folder;
  const auto bytes = sample(30, Compression::zstd);
  const auto whole = messages_of(*Reader::open(written(folder, bytes)));
  std::mt19937 random(3);
  for (int round = 0; round < 2'000; ++round) {
    auto damaged = bytes;
    const size_t at = random() % damaged.size();
    CAPTURE(at);
    damaged[at] ^= static_cast<std::byte>(1 + random() % 255);
    const auto reader = Reader::open(written(folder, damaged));
    if (!reader) continue;
    CHECK_FALSE(reader->missing().empty());
    std::string error;
    const auto some = messages_of(*reader, &error);
    REQUIRE(some.size() <= whole.size());
  }
}

TEST_CASE("mcap: a full disk loses the chunk in hand, says so, and what is there stays readable") {
  const test::TemporaryFolder folder;
  MemorySink sink;
  Writer writer(sink, {2048, Compression::none, 1});
  begin(writer);
  sink.room = 9'000;
  uint32_t i = 0;
  while (writer.write(as_message(message_of(i)))) ++i;
  const uint64_t lost = writer.lost();
  CHECK(lost > 0);
  const size_t kept = messages_of(*Reader::open(written(folder, sink.bytes))).size();
  CHECK(kept + lost == i + 1);
  sink.room = SIZE_MAX;  // room again: it goes on
  for (uint32_t k = 0; k < 20; ++k) CHECK(writer.write(as_message(message_of(500 + k))));
  REQUIRE(writer.finish());
  const auto reader = Reader::open(written(folder, sink.bytes));
  REQUIRE(reader);
  CHECK(reader->missing() == "");
  const auto all = messages_of(*reader);
  CHECK(all.size() == kept + 20);
  CHECK(all.back() == message_of(519));
  CHECK(writer.statistics().messages == all.size());
}

TEST_CASE("mcap: files that are none are refused with words") {
  const test::TemporaryFolder folder;
  CHECK(Reader::open(folder.path / "none").error().find("No such file") != std::string::npos);
  CHECK(Reader::open(folder.write("empty", "")).error().find("is empty") != std::string::npos);
  CHECK(Reader::open(folder.write("text", "takt: 1, some text\n")).error().find("no MCAP file") != std::string::npos);
  auto sink = FileSink::open(folder.path / "none" / "file");
  REQUIRE_FALSE(sink);
  CHECK(sink.error().find("No such file") != std::string::npos);
}

TEST_CASE("mcap: a file on disk is what memory would hold") {
  const test::TemporaryFolder folder;
  {
    auto sink = FileSink::open(folder.path / "log.mcap");
    REQUIRE(sink);
    Writer writer(*sink, {4096, Compression::zstd, 1});
    begin(writer);
    REQUIRE(writer.metadata("machine", {{"cpu", "Six"}, {"kernel", "6.1"}}));
    REQUIRE(writer.attach({3, 4, "graph.yaml", "application/yaml", bytes_of("takt: 1\n")}));
    for (uint32_t i = 0; i < 50; ++i) REQUIRE(writer.write(as_message(message_of(i))));
    REQUIRE(writer.finish());
  }
  std::ifstream file(folder.path / "log.mcap", std::ios::binary);
  const std::string text(std::istreambuf_iterator<char>(file), {});
  const auto bytes = sample(50, Compression::zstd);
  CHECK(text == std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
}

namespace {

void put_magic(std::vector<std::byte>& to) { ByteWriter(to).bytes(std::as_bytes(std::span(kMagic))); }

/// A file as another writer may leave it: definitions and messages where `fill` puts them, then the end without a
/// summary.
std::vector<std::byte> foreign(const std::function<void(std::vector<std::byte>&)>& fill) {
  std::vector<std::byte> file;
  put_magic(file);
  put_record(file, Op::header, [](ByteWriter& to) { to.text(""), to.text("another"); });
  fill(file);
  put_record(file, Op::data_end, [](ByteWriter& to) { to.number(uint32_t{0}); });
  put_record(file, Op::footer,
             [](ByteWriter& to) { to.number(uint64_t{0}), to.number(uint64_t{0}), to.number(uint32_t{0}); });
  put_magic(file);
  return file;
}

Message numbered(uint16_t channel, uint32_t sequence) {
  return {channel, sequence, sequence, sequence, bytes_of("data")};
}

}  // namespace

TEST_CASE("mcap: ids are those of the reader, whatever they are in the file; equal channels are one") {
  const test::TemporaryFolder folder;
  const auto reader = Reader::open(written(folder, foreign([](auto& to) {
                                             put(to, Schema{500, "pose", "jsonschema", "{}"});
                                             put(to, Channel{0, 500, "a", "takt", {}});
                                             put(to, numbered(0, 1));
                                             put(to, Channel{77, 0, "b", "json", {}});
                                             put(to, Channel{78, 500, "a", "takt", {}});
                                             put(to, numbered(77, 2)), put(to, numbered(78, 3)),
                                                 put(to, numbered(0, 4));
                                           })));
  REQUIRE(reader);
  CHECK(reader->missing() == "");
  CHECK(reader->left_out().empty());
  REQUIRE(reader->channels().size() == 2);
  CHECK(reader->channels()[0] == Channel{1, 1, "a", "takt", {}});
  CHECK(reader->channels()[1] == Channel{2, 0, "b", "json", {}});
  std::vector<uint16_t> channels;
  for (const Kept& kept : messages_of(*reader)) channels.push_back(kept.channel);
  CHECK(channels == std::vector<uint16_t>{1, 2, 1, 1});
  CHECK(reader->chunks().size() == 2);  // a run of messages each
}

TEST_CASE("mcap: what is not read is counted: unknown records, messages that no channel describes") {
  const test::TemporaryFolder folder;
  const auto reader = Reader::open(written(folder, foreign([](auto& to) {
                                             put(to, Channel{4, 0, "a", "takt", {}});
                                             put(to, numbered(4, 1)), put(to, numbered(5, 2));
                                             for (int i = 0; i < 3; ++i)
                                               put_record(to, static_cast<Op>(0x91),
                                                          [](ByteWriter& fields) { fields.text("private"); });
                                             put(to, numbered(4, 3));
                                           })));
  REQUIRE(reader);
  CHECK(reader->missing() == "");
  REQUIRE(reader->left_out().size() == 1);
  CHECK(reader->left_out()[0].find("3 records of kind 145") != std::string::npos);
  std::vector<uint16_t> channels;
  for (const Kept& kept : messages_of(*reader)) channels.push_back(kept.channel);
  CHECK(channels == std::vector<uint16_t>{1, 0, 1});
}

TEST_CASE("mcap: a damaged record costs itself alone") {
  const test::TemporaryFolder folder;
  const auto reader = Reader::open(
      written(folder, foreign([](auto& to) {
                put(to, Channel{1, 0, "a", "takt", {}});
                put_record(to, Op::channel, [](ByteWriter& fields) { fields.number(uint16_t{2}); });  // ends too early
                put(to, Channel{1, 0, "other", "takt", {}});  // of an id that is taken
                put(to, numbered(1, 1));
              })));
  REQUIRE(reader);
  CHECK(reader->missing().find("ends before its fields do") != std::string::npos);
  CHECK(messages_of(*reader).size() == 1);
  const auto claims = Reader::open(written(folder, foreign([](auto& to) {
                                             ChunkIndex chunk;
                                             chunk.uncompressed_size = uint64_t{1} << 30;
                                             chunk.compression = "zstd";
                                             put_chunk_head(to, chunk, 0);
                                           })));
  REQUIRE(claims);
  std::string error;
  CHECK(messages_of(*claims, &error).empty());
  CHECK(error.find("it claims 1073741824 bytes of 0") != std::string::npos);
}

TEST_CASE("A tail gives each record once, when its last byte is there") {
  const test::TemporaryFolder folder;
  const std::vector<std::byte> bytes = sample(40, Compression::zstd);
  const auto file = folder.path / "grows.mcap";
  std::ofstream out(file, std::ios::binary);
  auto tail = Tail::open(file);
  REQUIRE(tail);
  uint64_t end = kMagic.size(), count = 0;
  for (size_t size = 0; size < bytes.size(); ++size) {
    out.put(static_cast<char>(bytes[size])).flush();
    const auto record = tail->next();
    REQUIRE_MESSAGE(record, record.error());
    if (!*record) continue;
    CHECK((*record)->at == end);
    end += 9 + (*record)->fields.size();
    REQUIRE(end == size + 1);
    ++count;
    if ((*record)->op == Op::footer) break;
  }
  CHECK(count > 40 / 20);
  CHECK(end + kMagic.size() == bytes.size());
}

TEST_CASE("A tail stops at what is no record, and at what is no MCAP file") {
  const test::TemporaryFolder folder;
  CHECK(!Tail::open(folder.path / "none"));
  CHECK(!Tail::open(folder.write("text", "no MCAP file"))->next());
  std::string damaged(reinterpret_cast<const char*>(kMagic.data()), kMagic.size());
  auto tail = Tail::open(folder.write("damaged", damaged + std::string(9, '\x7f')));
  REQUIRE(tail);
  CHECK(tail->next().error() == "at byte 8 there is no record");
}

TEST_CASE("A summary without the index of its chunks takes bounded memory, and the file is whole") {
  const test::TemporaryFolder folder;
  MemorySink all, some;
  for (MemorySink* sink : {&all, &some}) {
    Writer writer(*sink, {.chunk_bytes = 256, .most_index_bytes = sink == &some ? 500 : SIZE_MAX});
    begin(writer);
    for (uint32_t i = 0; i < 50; ++i) REQUIRE(writer.write(as_message(message_of(i))));
    REQUIRE(writer.finish());
  }
  CHECK(some.bytes.size() < all.bytes.size());
  const auto reader = Reader::open(written(folder, some.bytes));
  REQUIRE(reader);
  CHECK(reader->missing() == "");
  CHECK(messages_of(*reader).size() == 50);
}

TEST_CASE("A file that takes a part of what it is given keeps none of it, and takes more later") {
  const test::TemporaryFolder folder;
  const auto bytes = [](size_t size, char fill) { return std::vector<std::byte>(size, std::byte(fill)); };
  const auto one = bytes(1000, 'a'), two = bytes(3000, 'b'), none = bytes(0, 'c');
  std::signal(SIGXFSZ, SIG_IGN);
  rlimit usual{};
  getrlimit(RLIMIT_FSIZE, &usual);
  const rlimit little{3500, usual.rlim_max};
  auto sink = FileSink::open(folder.path / "file");
  REQUIRE(sink);
  const std::array<Bytes, 4> parts{one, none, two, one};
  CHECK(sink->append(std::span(parts).first(2)));
  setrlimit(RLIMIT_FSIZE, &little);
  const auto refused = sink->append(parts);
  setrlimit(RLIMIT_FSIZE, &usual);
  CHECK(!refused);
  CHECK(std::filesystem::file_size(folder.path / "file") == 1000);
  CHECK(sink->append(parts));
  std::ifstream in(folder.path / "file");
  const std::string all{std::istreambuf_iterator<char>(in), {}};
  CHECK(all == std::string(2000, 'a') + std::string(3000, 'b') + std::string(1000, 'a'));
}
