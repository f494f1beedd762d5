// SPDX-License-Identifier: Apache-2.0
// Options and positionals that name files. Each says which kind it is: the help shows it, and a path that cannot be of
// that kind is refused before the command begins, with its name and the reason.
//
//   reads_file(app.add_option("--scene", o.scene, "..."));       // --scene FILE
//   writes_file(app.add_option("--out", o.out, "..."));          // --out NEW-FILE
#pragma once
#include <CLI/CLI.hpp>
#include <cstdint>

#include "rt/file/input_file.hpp"

namespace takt::command {

CLI::Option* reads_file(CLI::Option* option, uint64_t most_bytes = kLargestInput);
CLI::Option* reads_folder(CLI::Option* option);
/// Its folder must be there.
CLI::Option* writes_file(CLI::Option* option);
/// It is made if it is not there.
CLI::Option* writes_folder(CLI::Option* option);

}  // namespace takt::command
