// SPDX-License-Identifier: Apache-2.0
// Who is let in.
#pragma once
#include <string>
#include <string_view>
#include <vector>

namespace takt::web {

/// The secret that lets who has it change a run: 32 letters and digits, of the kernel's random numbers. Throws
/// std::runtime_error if there are none.
std::string new_token();

/// Compares in the same time whatever differs.
bool same_token(std::string_view given, std::string_view token);

/// Names under which this server may be asked for. A page of somebody else, opened in the same browser, asks under its
/// own name (DNS rebinding) or comes from its own (cross-site WebSocket): both are refused.
class Gate {
 public:
  /// `hosts`: names and addresses without a port; loopback's are always among them.
  explicit Gate(std::vector<std::string> hosts, int port = 0) : port(port), hosts_(std::move(hosts)) {}
  /// The header Host: "localhost:8765", "[::1]:8765". Empty: refused.
  bool host(std::string_view header) const;
  /// The header Origin: "http://localhost:8765". Programs that are no browser send none: let in. Those of `origins`
  /// are, too: Foxglove's.
  bool origin(std::string_view header) const;
  std::vector<std::string> origins = {};
  int port;

 private:
  bool known(std::string_view host) const;
  std::vector<std::string> hosts_;
};

}  // namespace takt::web
