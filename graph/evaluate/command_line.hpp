// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace CLI {
class App;
}

namespace takt::command {

struct Evaluations;

/// Adds `eval` with all its tasks, whose options must live until the command line has been parsed.
void add_evaluations(CLI::App& app, Evaluations& options, int& exit_code);

}  // namespace takt::command
