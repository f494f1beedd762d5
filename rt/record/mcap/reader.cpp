// SPDX-License-Identifier: Apache-2.0
#include "rt/record/mcap/reader.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zstd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "rt/record/mcap/records.hpp"

namespace takt::mcap {
namespace {

constexpr uint64_t kHead = 1 + 8;  // opcode and length
constexpr uint64_t kMostUnpacked = uint64_t{1} << 31;
constexpr uint64_t kFooterFields = 8 + 8 + 4;

Chunk get_chunk(Bytes from, uint64_t at) {
  ByteReader fields(from);
  Chunk chunk;
  chunk.at = at;
  chunk.start_ns = fields.number<uint64_t>();
  chunk.end_ns = fields.number<uint64_t>();
  chunk.uncompressed_size = fields.number<uint64_t>();
  chunk.crc = fields.number<uint32_t>();
  chunk.compression = fields.text();
  chunk.stored = fields.bytes(fields.number<uint64_t>());
  return chunk;
}

/// A record of the same id again must say the same: then it is the copy of the summary.
template <class Definition>
void keep_once(std::vector<Definition>& list, Definition definition) {
  const auto known =
      std::find_if(list.begin(), list.end(), [&](const Definition& other) { return other.id == definition.id; });
  if (known == list.end()) list.push_back(std::move(definition));
  else if (!(*known == definition))
    throw std::runtime_error("two definitions have the id " + std::to_string(known->id));
}

bool has_magic(Bytes file, size_t at) {
  return at + kMagic.size() <= file.size() && std::memcmp(file.data() + at, kMagic.data(), kMagic.size()) == 0;
}

}  // namespace

tl::expected<Reader, std::string> Reader::open(const std::filesystem::path& file) {
  const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return tl::unexpected(file.string() + ": " + std::strerror(errno));
  struct stat status {};
  void* memory = MAP_FAILED;
  if (fstat(descriptor, &status) == 0 && status.st_size > 0)
    memory = mmap(nullptr, static_cast<size_t>(status.st_size), PROT_READ, MAP_PRIVATE, descriptor, 0);
  close(descriptor);
  if (memory == MAP_FAILED) return tl::unexpected(file.string() + ": is empty or cannot be mapped");
  Reader reader(Bytes(static_cast<const std::byte*>(memory), static_cast<size_t>(status.st_size)));
  if (!has_magic(reader.file_, 0)) return tl::unexpected(file.string() + ": is no MCAP file");
  reader.scan();
  return reader;
}

Reader::Reader(Reader&& other) noexcept
    : file_(std::exchange(other.file_, {})),
      profile_(std::move(other.profile_)),
      written_by_(std::move(other.written_by_)),
      missing_(std::move(other.missing_)),
      schemas_(std::move(other.schemas_)),
      channels_(std::move(other.channels_)),
      chunks_(std::move(other.chunks_)),
      attachments_(std::move(other.attachments_)),
      metadata_(std::move(other.metadata_)) {}

Reader::~Reader() {
  if (!file_.empty()) munmap(const_cast<std::byte*>(file_.data()), file_.size());
}

void Reader::scan() {
  uint64_t at = kMagic.size();
  try {
    for (bool data_section = true; data_section;) {
      ByteReader rest(file_.subspan(static_cast<size_t>(at)));
      const auto op = static_cast<Op>(rest.number<uint8_t>());
      const Bytes fields = rest.bytes(rest.number<uint64_t>());
      if (op == Op::data_end) {
        missing_ = check_end(at, at + kHead + fields.size());
        data_section = false;
      } else {
        take(op, fields, at);
      }
      at += kHead + fields.size();
    }
  } catch (const TooShort&) {
    missing_ = "the file ends within a record: " + std::to_string(file_.size() - at) + " bytes after byte " +
               std::to_string(at) + " cannot be read, and there is no summary";
  } catch (const std::exception& problem) {
    missing_ = "byte " + std::to_string(at) + ": " + problem.what();
  }
}

void Reader::take(Op op, Bytes fields, uint64_t at) {
  if (op == Op::header) {
    ByteReader head(fields);
    profile_ = head.text();
    written_by_ = head.text();
  }
  if (op == Op::schema) keep_once(schemas_, get_schema(fields));
  if (op == Op::channel) keep_once(channels_, get_channel(fields));
  if (op == Op::chunk) chunks_.push_back(get_chunk(fields, at));
  if (op == Op::attachment) attachments_.push_back(get_attachment(fields));
  if (op == Op::metadata) {
    ByteReader entry(fields);
    std::string name = entry.text();
    metadata_.push_back({std::move(name), entry.metadata()});
  }
  // Others, of later versions too, are passed over.
}

std::string Reader::check_end(uint64_t data_end_at, uint64_t summary_at) const {
  const uint64_t tail = kHead + kFooterFields + kMagic.size();
  if (file_.size() < summary_at + tail || !has_magic(file_, file_.size() - kMagic.size()))
    return "the file lacks its summary or footer";
  const auto section = [&](uint64_t from, uint64_t to) {
    return file_.subspan(static_cast<size_t>(from), static_cast<size_t>(to - from));
  };
  const uint64_t footer_at = file_.size() - tail;
  ByteReader footer(file_.subspan(static_cast<size_t>(footer_at)));
  if (footer.number<uint8_t>() != static_cast<uint8_t>(Op::footer) || footer.number<uint64_t>() != kFooterFields)
    return "the file has no footer";
  const auto summary_start = footer.number<uint64_t>();
  footer.number<uint64_t>();
  const auto summary_crc = footer.number<uint32_t>(),
             data_crc = ByteReader(section(data_end_at + kHead, summary_at)).number<uint32_t>();
  if (summary_start != 0 && summary_start != summary_at) return "the summary is not where the footer says";
  if (data_crc != 0 && data_crc != crc_of(0, section(0, data_end_at)))
    return "the CRC of the data section does not fit";
  if (summary_crc != 0 && summary_crc != crc_of(0, section(summary_at, footer_at + kHead + 16)))
    return "the CRC of the summary does not fit";
  return "";
}

tl::expected<std::vector<std::byte>, std::string> Reader::unpack(const Chunk& chunk) const {
  const auto wrong = [&](const std::string& what) {
    return tl::unexpected("the chunk at byte " + std::to_string(chunk.at) + " " + what);
  };
  std::vector<std::byte> records;
  if (chunk.uncompressed_size > kMostUnpacked) return wrong("is larger than 2 GB");
  if (chunk.compression.empty()) {
    records.assign(chunk.stored.begin(), chunk.stored.end());
  } else if (chunk.compression == "zstd") {
    // The size is a claim of the file: memory is taken only where the packed data agrees.
    const auto claimed = ZSTD_getFrameContentSize(chunk.stored.data(), chunk.stored.size());
    if (claimed != ZSTD_CONTENTSIZE_UNKNOWN && claimed != chunk.uncompressed_size) return wrong("is damaged");
    records.resize(static_cast<size_t>(chunk.uncompressed_size));
    const size_t size = ZSTD_decompress(records.data(), records.size(), chunk.stored.data(), chunk.stored.size());
    if (ZSTD_isError(size) != 0) return wrong("is damaged: " + std::string(ZSTD_getErrorName(size)));
    records.resize(size);
  } else {
    return wrong("is compressed with " + chunk.compression + "; this build reads zstd and plain ones");
  }
  if (records.size() != chunk.uncompressed_size || (chunk.crc != 0 && chunk.crc != crc_of(0, records)))
    return wrong("is damaged: its CRC does not fit");
  return records;
}

tl::expected<bool, std::string> Reader::for_each_in(Bytes records, const std::function<bool(const Message&)>& each) {
  try {
    for (ByteReader rest(records); rest.left() > 0;) {
      const auto op = static_cast<Op>(rest.number<uint8_t>());
      const Bytes fields = rest.bytes(rest.number<uint64_t>());
      if (op == Op::message && !each(get_message(fields))) return false;
    }
  } catch (const TooShort& problem) {
    return tl::unexpected(std::string(problem.what()));
  }
  return true;
}

tl::expected<void, std::string> Reader::for_each(const std::function<bool(const Message&)>& each) const {
  for (const Chunk& chunk : chunks_) {
    const auto records = unpack(chunk);
    if (!records) return tl::unexpected(records.error());
    const auto go_on = for_each_in(*records, each);
    if (!go_on) return tl::unexpected("the chunk at byte " + std::to_string(chunk.at) + ": " + go_on.error());
    if (!*go_on) break;
  }
  return {};
}

}  // namespace takt::mcap
