// SPDX-License-Identifier: Apache-2.0
#include "rt/record/picture_codec.hpp"

#include <turbojpeg.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <memory>

#include "rt/record/mcap/bytes.hpp"

namespace takt::record {
namespace {

using Bytes = std::span<const std::byte>;

/// Pixels of one byte of a JPEG: 256 columns of 8 rows need 12 bits at least, so what claims more is damaged.
constexpr uint64_t kMostPixels = 1024;

bool is_picture(const Field& field) {
  return field.is_array() && field.scalar == Scalar::u8 && field.element_bytes == 1 && !field.text;
}

bool is_side(const Field& field) { return field.count == 1 && field.scalar == Scalar::i32; }

int32_t number_at(Bytes packed, uint64_t at) {
  int32_t value = 0;
  std::memcpy(&value, packed.data() + at, sizeof value);
  return value;
}

const unsigned char* plain(Bytes bytes) { return reinterpret_cast<const unsigned char*>(bytes.data()); }

void append_counted(Bytes bytes, std::vector<std::byte>& to) {
  mcap::ByteWriter(to).number(static_cast<uint32_t>(bytes.size()));
  to.insert(to.end(), bytes.begin(), bytes.end());
}

/// Appends the pixels of a JPEG; false: it is damaged.
bool append_pixels(void* decompressor, Bytes jpeg, std::vector<std::byte>& to) {
  int width = 0, height = 0, sampling = 0, colours = 0;
  if (tjDecompressHeader3(decompressor, plain(jpeg), jpeg.size(), &width, &height, &sampling, &colours) != 0)
    return false;
  const int format = colours == TJCS_GRAY ? TJPF_GRAY : TJPF_BGR;
  const uint64_t bytes = uint64_t(width) * uint64_t(height) * uint64_t(tjPixelSize[format]);
  if (bytes > kMostPixels * jpeg.size()) return false;
  const size_t from = to.size();
  to.resize(from + bytes);
  return tjDecompress2(decompressor, plain(jpeg), jpeg.size(), reinterpret_cast<unsigned char*>(to.data() + from),
                       width, 0, height, format, 0) == 0;
}

}  // namespace

bool may_have_pictures(std::span<const Field> fields) {
  for (const std::string_view side : {"width", "height", "channels"})
    if (std::none_of(fields.begin(), fields.end(), [&](const Field& f) { return f.name == side && is_side(f); }))
      return false;
  return std::any_of(fields.begin(), fields.end(), is_picture);
}

bool PictureCoder::append_jpeg(Bytes pixels, int width, int height, int channels, std::vector<std::byte>& to) {
  const auto jpeg = compressor_.compress({plain(pixels), width, height, channels});
  if (jpeg.empty()) return false;
  append_counted(std::as_bytes(jpeg), to);
  return true;
}

void PictureCoder::code(std::span<const Field> fields, Bytes packed, std::vector<std::byte>& to) {
  int32_t width = 0, height = 0, channels = 0;
  uint64_t at = 0, plain_from = 0;
  for (const Field& field : fields) {
    if (!field.is_array()) {
      if (is_side(field) && field.name == "width") width = number_at(packed, at);
      if (is_side(field) && field.name == "height") height = number_at(packed, at);
      if (is_side(field) && field.name == "channels") channels = number_at(packed, at);
      at += uint64_t{field.count} * field.element_bytes;
      continue;
    }
    const auto count = static_cast<uint32_t>(number_at(packed, at));
    at += sizeof count;
    const uint64_t bytes = uint64_t{count} * field.element_bytes;
    const bool fits = is_picture(field) && std::min(width, height) > 0 && std::max(width, height) <= kLargestJpeg &&
                      (channels == 1 || channels == 3) && int64_t{width} * height * channels == count;
    if (fits) {
      const size_t before = to.size();
      append_counted(packed.subspan(plain_from, at - plain_from), to);
      if (append_jpeg(packed.subspan(at, bytes), width, height, channels, to)) plain_from = at + bytes;
      else to.resize(before);
    }
    at += bytes;
  }
  append_counted(packed.subspan(plain_from), to);
  append_counted({}, to);
}

tl::expected<std::vector<std::byte>, std::string> plain_of(Bytes kept) {
  const std::unique_ptr<void, int (*)(void*)> decompressor(tjInitDecompress(), tjDestroy);
  std::vector<std::byte> packed;
  mcap::ByteReader in(kept);
  try {
    while (in.left() > 0) {
      const Bytes as_it_was = in.bytes(in.number<uint32_t>());
      packed.insert(packed.end(), as_it_was.begin(), as_it_was.end());
      const Bytes jpeg = in.bytes(in.number<uint32_t>());
      if (!jpeg.empty() && (decompressor == nullptr || !append_pixels(decompressor.get(), jpeg, packed)))
        return tl::make_unexpected(std::string("a JPEG in it is damaged"));
    }
  } catch (const mcap::TooShort& problem) {
    return tl::make_unexpected(std::string(problem.what()));
  }
  return packed;
}

}  // namespace takt::record
