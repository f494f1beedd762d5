// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace takt::command {

/// The commit that this program was built from, "-dirty" behind it if files differed: `git describe --always`. "unknown"
/// outside a checkout. Its definition is generated, in a file of its own: only that is compiled after each commit.
extern const char* const kCommit;

}  // namespace takt::command
