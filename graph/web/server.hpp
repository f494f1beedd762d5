// SPDX-License-Identifier: Apache-2.0
// The side of `takt web` that faces browsers and Foxglove.
#pragma once
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "graph/web/gate.hpp"
#include "graph/web/hub.hpp"

namespace takt::web {

struct ServerOptions {
  std::string address = "127.0.0.1";
  int port = 8765;  ///< 0: one that is free
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
  /// The file that may be fetched once under that name, with that ticket.
  using File = std::function<std::optional<std::filesystem::path>(const std::string& name, const std::string& ticket)>;
  /// `ask` blocks; it is called on threads of the server's own, `file` on that of run(). All given outlives this.
  /// Throws std::runtime_error.
  Server(Hub& hub, Ask ask, File file, const ServerOptions& options, Gate gate);
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;
  /// That it listens at.
  int port() const;
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
