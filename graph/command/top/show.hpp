// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "graph/attach/endpoint.hpp"

namespace takt::top {

/// `takt top` in a terminal: shows pages of the run until a key, a signal or the end of the run ends it. The exit code;
/// the terminal is as before then. A signal other than SIGINT is raised again.
int show(attach::Connection connection);

}  // namespace takt::top
