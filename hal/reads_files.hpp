// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/hal/reads_files.hpp>: hal, experimental.
#pragma once
#include <string>
#include <vector>

namespace takt {

/// A device that reads files, next to Device: it says what it did not take from them as it is.
///
///     class Recorded final : public StereoCamera, public ReadsFiles { ... };
///
/// `takt run` prints the sentences on stderr and puts them into the report (`left_out`).
class ReadsFiles {
 public:
  virtual ~ReadsFiles() = default;
  /// Once it is open: what was left out, cut off, converted or guessed, one sentence for each file and kind, which
  /// begins with the file and says how many. Empty: everything was read. On the thread that opened the device.
  virtual std::vector<std::string> left_out() const = 0;
};

}  // namespace takt
