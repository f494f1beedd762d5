// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "graph/run/run.hpp"

namespace takt::command {

/// `takt web` beside a run (`takt run --web`): a program of its own, no child of this process, that ends with it.
///
///     options.shown = std::make_shared<WebBeside>(web_arguments(program, graph.web));  // this process has one thread
///     ...                                                                              // the run is admitted
///     if (const auto shown = begin_web(options); !shown) return refuse(shown.error(), kDeviceOrSystem);
class WebBeside {
 public:
  /// Makes the process that will become the program, `arguments[0]`. It waits for begin(), and is gone if none comes.
  explicit WebBeside(std::vector<std::string> arguments);
  ~WebBeside();
  WebBeside(const WebBeside&) = delete;
  WebBeside& operator=(const WebBeside&) = delete;

  /// Starts it and tells on stderr which address to open. Waits for that, 10 s at most. Error: it did not come up; why
  /// stands on stderr already where the program itself said it.
  tl::expected<void, std::string> begin();

 private:
  int go_ = -1, told_ = -1;  ///< pipes: to it, from its stdout
};

/// The file of `takt web`. Error: it is not there, with the way to get it.
tl::expected<std::string, std::string> web_program();

/// Of a run that is admitted; nothing to do where it is not to be shown.
tl::expected<void, std::string> begin_web(const RunOptions& options);

/// What it is called with: the options of `takt web` for this run.
std::vector<std::string> web_arguments(const std::string& program, const graph::WebSpec& web);

}  // namespace takt::command
