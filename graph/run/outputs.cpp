// SPDX-License-Identifier: Apache-2.0
#include "graph/run/outputs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <system_error>
#include <tuple>
#include <utility>

#include "graph/cli/outcome.hpp"

namespace takt::command {

int claim_folder(const std::filesystem::path& folder, std::vector<WriterLock>& locks) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error)
    return refuse(fmt::format("--output {}: {}; choose a writable folder", folder.string(), error.message()),
                  kBadInput);
  auto lock = WriterLock::of_folder(folder);
  if (!lock) return refuse(lock.error(), "--output");
  locks.push_back(std::move(*lock));
  return kOk;
}

int claim_outputs(RunOptions& options) {
  options.outputs = std::make_shared<RunOutputs>();
  RunOutputs& outputs = *options.outputs;
  // A program that looks on names no files, and may run graphs next to one another.
  if (options.witness == nullptr)
    if (const int code = claim_folder(options.output, outputs.locks); code != kOk) return code;
  for (const auto& [option, path, place] : {std::tuple("--report", &options.report, &outputs.report),
                                            {"--html", &options.html, &outputs.html},
                                            {"--junit", &options.junit, &outputs.junit},
                                            {"--trace", &options.trace, &outputs.trace}}) {
    if (path->empty()) continue;
    auto file = OutputFile::claim(*path);
    if (!file) return refuse(file.error(), option);
    place->emplace(std::move(*file));
  }
  if (options.record.empty()) return kOk;
  auto lock = WriterLock::of_file(options.record);
  if (!lock) return refuse(lock.error(), "--record");
  outputs.locks.push_back(std::move(*lock));
  return kOk;
}

void RunOutputs::write(std::optional<OutputFile>& file, std::string_view content, const char* option) {
  if (!file) return;
  file->stream() << content;
  if (const auto done = file->finish(); !done) code = std::max(code, refuse(done.error(), option));
  file.reset();
}

}  // namespace takt::command
