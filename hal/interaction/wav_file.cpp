// SPDX-License-Identifier: Apache-2.0
#include "hal/interaction/wav_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <string_view>

namespace takt {
namespace {

constexpr size_t kFormatBytes = 16;  ///< of linear samples
constexpr size_t kHeader = 12 + 8 + kFormatBytes + 8;
constexpr uint64_t kMostBytes = UINT32_MAX - kHeader - 1;
constexpr uint64_t kPause_ms = 300;

uint32_t number_at(std::span<const uint8_t> bytes, size_t at, size_t size) {
  uint32_t number = 0;
  for (size_t i = 0; i < size; ++i) number |= static_cast<uint32_t>(bytes[at + i]) << (8 * i);
  return number;
}

bool is_word(std::span<const uint8_t> bytes, size_t at, std::string_view word) {
  return std::equal(word.begin(), word.end(), bytes.begin() + static_cast<ptrdiff_t>(at));
}

uint64_t sample_bytes(std::span<const uint8_t> format) { return std::max<uint32_t>(1, number_at(format, 12, 2)); }

void append(std::vector<uint8_t>& to, std::string_view word, uint64_t number) {
  to.insert(to.end(), word.begin(), word.end());
  for (size_t i = 0; i < 4; ++i) to.push_back(static_cast<uint8_t>(number >> (8 * i)));
}

std::vector<uint8_t> header(std::span<const uint8_t> format, uint64_t bytes) {
  std::vector<uint8_t> all;
  append(all, "RIFF", kHeader - 8 + bytes);
  append(all, "WAVEfmt ", kFormatBytes);
  all.insert(all.end(), format.begin(), format.end());
  append(all, "data", bytes);
  return all;
}

bool write_at(int file, std::span<const uint8_t> bytes, uint64_t at) {
  while (!bytes.empty()) {
    const ssize_t done = pwrite(file, bytes.data(), bytes.size(), static_cast<off_t>(at));
    if (done < 0 && errno == EINTR) continue;
    if (done <= 0) return false;
    bytes = bytes.subspan(static_cast<size_t>(done));
    at += static_cast<uint64_t>(done);
  }
  return true;
}

}  // namespace

std::optional<Sound> sound_in(std::span<const uint8_t> file) {
  if (file.size() < 12 || !is_word(file, 0, "RIFF") || !is_word(file, 8, "WAVE")) return std::nullopt;
  Sound sound;
  for (size_t at = 12; file.size() - at >= 8;) {
    const size_t begin = at + 8, size = std::min<size_t>(number_at(file, at + 4, 4), file.size() - begin);
    if (is_word(file, at, "fmt ")) {
      if (size < kFormatBytes || number_at(file, begin, 2) != 1) return std::nullopt;  // 1: linear
      sound.format.assign(file.begin() + static_cast<ptrdiff_t>(begin),
                          file.begin() + static_cast<ptrdiff_t>(begin + kFormatBytes));
    }
    if (is_word(file, at, "data")) {
      if (sound.format.empty()) return std::nullopt;
      sound.samples = file.subspan(begin, size - size % sample_bytes(sound.format));
      return sound;
    }
    at = std::min(begin + size + size % 2, file.size());
  }
  return std::nullopt;
}

bool WavFile::fail(std::string why) {
  problem_ = name_ + ": " + std::move(why);
  return false;
}

bool WavFile::open(const std::filesystem::path& file, bool goes_on) {
  name_ = file.string();
  format_.clear();
  bytes_ = 0;
  file_ = Descriptor(::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | (goes_on ? 0 : O_TRUNC), 0644));
  if (!file_) return fail(std::strerror(errno));
  std::vector<uint8_t> before(kHeader);
  const ssize_t got = pread(file_.get(), before.data(), before.size(), 0);
  if (got == 0) return true;
  struct stat facts {};
  before.resize(static_cast<size_t>(std::max<ssize_t>(0, got)));
  const auto there = sound_in(before);
  if (!there || before.size() < kHeader || !is_word(before, 36, "data") || fstat(file_.get(), &facts) != 0) {
    file_.close();
    return fail("is no WAV file that can go on");
  }
  format_ = there->format;
  bytes_ = std::min<uint64_t>(number_at(before, kHeader - 4, 4), static_cast<uint64_t>(facts.st_size) - kHeader);
  return true;
}

bool WavFile::add(const Sound& sound) {
  if (!file_) return problem_.empty() ? fail("is not open") : false;
  if (!format_.empty() && sound.format != format_) return fail("holds another kind of samples than come now");
  const uint64_t pause =
      format_.empty() ? 0 : kPause_ms * number_at(sound.format, 4, 4) / 1000 * sample_bytes(sound.format);
  const uint64_t grown = bytes_ + pause + sound.samples.size();
  if (grown > kMostBytes) return fail("is full: a WAV file has 4 GiB at most");
  const std::vector<uint8_t> silence(pause);
  // The header last: until then it speaks of what was there before.
  if (!write_at(file_.get(), silence, kHeader + bytes_) ||
      !write_at(file_.get(), sound.samples, kHeader + bytes_ + pause) ||
      !write_at(file_.get(), header(sound.format, grown), 0))
    return fail(std::strerror(errno));
  format_ = sound.format;
  bytes_ = grown;
  return true;
}

}  // namespace takt
