// SPDX-License-Identifier: Apache-2.0
#include "hal/interaction/voice_double.hpp"

#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>

namespace takt {

DeviceResult check_speech_file(const std::string& id, const std::filesystem::path& file) {
  const auto folder = file.has_parent_path() ? file.parent_path() : std::filesystem::path(".");
  const bool there = access(file.c_str(), F_OK) == 0;
  if (access(there ? file.c_str() : folder.c_str(), W_OK) == 0) return {};
  return device_error(id, "`speech_to`: " + file.string() + ": " + std::strerror(errno),
                      "name a file that this user may write");
}

DeviceResult VoiceDouble::open() { return check_speech_file(id_, file_); }

bool VoiceDouble::start(bool goes_on) {
  out_.open(file_, goes_on ? std::ios::app : std::ios::trunc);
  return out_.is_open();
}

bool VoiceDouble::speak(const Sentence& sentence, const std::function<bool()>&) {
  std::array<char, 32> at{};
  std::snprintf(at.data(), at.size(), "%.3f s ", static_cast<double>(sentence.at_ns) * 1e-9);
  out_ << at.data() << sentence.text << std::endl;
  return out_.good();
}

}  // namespace takt
