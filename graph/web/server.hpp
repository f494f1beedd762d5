// SPDX-License-Identifier: Apache-2.0
// The side of `takt web` that faces browsers and Foxglove.
#pragma once
#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "graph/web/gate.hpp"
#include "graph/web/hub.hpp"

namespace takt::web {

struct ServerOptions {
  std::string address = "127.0.0.1";
  int port = 8765;
  std::string token;
  bool token_to_look = false;
  std::filesystem::path certificate, key;  ///< PEM; both or none
};

/// HTTP for the page and WebSockets on one port, in one thread: that which calls run().
///
///   Server server(hub, ask, options, gate);      // Error: the port is taken
///   server.run(ending);
class Server {
 public:
  using Ask = std::function<Json(const Json& question)>;
  /// `ask` blocks; it is called on threads of the server's own. All given outlives this. Throws std::runtime_error.
  Server(Hub& hub, Ask ask, const ServerOptions& options, Gate gate);
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;
  /// Until end() is called.
  void run();
  /// Any thread, also a signal handler.
  void end();
  /// Something is new in the hub. Any thread.
  void wake();

 private:
  class Inside;
  std::unique_ptr<Inside> inside_;
};

}  // namespace takt::web
