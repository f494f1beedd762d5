// SPDX-License-Identifier: Apache-2.0
#include "graph/cli/outcome.hpp"

#include <fmt/format.h>

#include <cstdio>

#include "graph/language/share.hpp"

namespace takt::command {

int refuse(const std::string& text, Exit code) {
  std::fprintf(stderr, "takt: error: %s\n", text.c_str());
  return code;
}

int refuse(const OutputFailure& failure, const std::string& option) {
  const char* advice = failure.system ? "make room" : "choose another place";
  return refuse(fmt::format("{}{}{}; {}", option, option.empty() ? "" : " ", failure.what, advice),
                failure.system ? kDeviceOrSystem : kBadInput);
}

int write_output(const std::filesystem::path& file, std::string_view content, const std::string& option) {
  const auto done = write_file(file, content);
  return done ? static_cast<int>(kOk) : refuse(done.error(), option);
}

std::filesystem::path shipped(const std::filesystem::path& relative) {
  const std::filesystem::path share = graph::share_folder();
  return share.empty() ? relative : share / relative;
}

}  // namespace takt::command
