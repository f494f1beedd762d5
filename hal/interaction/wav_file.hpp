// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hal/stream/descriptor.hpp"

namespace takt {

/// Whole samples of a WAV file, as they stand there.
struct Sound {
  std::vector<uint8_t> format;  ///< the chunk `fmt `
  std::span<const uint8_t> samples;
};

/// What a WAV file holds. Its sizes may be larger than the file, as in what a program writes to a pipe: what is there
/// counts. Nothing if it is no WAV file of linear samples.
std::optional<Sound> sound_in(std::span<const uint8_t> file);

/// A WAV file that grows by one sound after the other, with a short silence between two. After each it is whole, so
/// that what a killed run leaves can be heard.
class WavFile {
 public:
  /// `goes_on`: what is there stays. False: it cannot be opened, or what is there is no WAV file; see problem().
  bool open(const std::filesystem::path& file, bool goes_on);
  /// False: not written; see problem().
  bool add(const Sound& sound);
  const std::string& problem() const { return problem_; }

 private:
  bool fail(std::string why);

  Descriptor file_;
  std::string name_, problem_;
  std::vector<uint8_t> format_;  ///< of what is there; empty: nothing
  uint64_t bytes_ = 0;           ///< of samples
};

}  // namespace takt
