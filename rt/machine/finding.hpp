// SPDX-License-Identifier: Apache-2.0
// What one check of the machine has found, as data: the text of `takt doctor` and the refusal of --require-rt are made
// from the same findings.
#pragma once
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace takt::machine {

enum class Status : uint8_t {
  ok,
  warn,    ///< it works, but figures will be worse or another user of the machine may spoil them
  lacks,   ///< something Takt asks for is refused here
  unknown  ///< this machine or these rights do not show it
};
std::string_view to_string(Status status);

/// Which runs a check matters to. `advice`: none depends on it.
enum class Need : uint8_t { every_run, deadline, fixed, iceoryx, advice };

/// One way to change what was found: text to be taken over as it stands, and where it belongs.
struct Fix {
  std::string where;  ///< "shell", "kernel command line", a file, "systemd unit"
  std::string text;
};

struct Finding {
  std::string group;  ///< policies | memory | timing | cores | transport
  std::string name;
  Need need = Need::advice;
  Status status = Status::unknown;
  std::string found;            ///< the value that was read back
  std::string meaning;          ///< for Takt, one line
  std::vector<Fix> fixes = {};  ///< empty where there is nothing to change
};

}  // namespace takt::machine
