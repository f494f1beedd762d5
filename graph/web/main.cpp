// SPDX-License-Identifier: Apache-2.0
// takt-web, which `takt web` becomes: shows a running graph to browsers and to Foxglove.
#include <fmt/format.h>
#include <pthread.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <csignal>
#include <filesystem>
#include <memory>
#include <stop_token>

#include "graph/ace/ace_registry.hpp"
#include "graph/attach/socket_folder.hpp"
#include "graph/cli/boundary.hpp"
#include "graph/cli/other_program.hpp"
#include "graph/cli/outcome.hpp"
#include "graph/language/graph.hpp"
#include "graph/robot/robot_questions.hpp"
#include "graph/web/frozen_files.hpp"
#include "graph/web/link.hpp"
#include "graph/web/server.hpp"
#include "rt/capability.hpp"
#include "rt/file/output_file.hpp"

namespace takt::web {
namespace {

using command::kBadInput;
using command::kDeviceOrSystem;
using command::refuse;

struct Options {
  int run = 0, with_run = 0;
  ServerOptions server;
  std::vector<std::string> hosts, origins;
  std::filesystem::path token_file;
};

/// The address to open, with the token in its fragment, which no browser sends anywhere.
std::string page_address(const ServerOptions& server) {
  const std::string host = server.address.find(':') != std::string::npos ? "[" + server.address + "]" : server.address;
  return fmt::format("{}://{}:{}/#token={}", server.certificate.empty() ? "http" : "https", host, server.port,
                     server.token);
}

std::filesystem::path frozen_folder(const Json& graph) {
  return graph.is_object() ? graph.value("frozen_folder", "") : "";
}

/// Ends the server at SIGINT, SIGTERM or SIGHUP (not under nohup), which every thread made after this blocks: a flag
/// that a handler sets would not wake it. Ends it with a run, too.
class EndOfServer {
 public:
  EndOfServer() {
    sigemptyset(&signals_);
    for (const int signal : {SIGINT, SIGTERM}) sigaddset(&signals_, signal);
    struct sigaction hangup {};
    if (sigaction(SIGHUP, nullptr, &hangup) == 0 && hangup.sa_handler != SIG_IGN) sigaddset(&signals_, SIGHUP);
    pthread_sigmask(SIG_BLOCK, &signals_, nullptr);
    std::signal(SIGPIPE, SIG_IGN);
  }
  /// `run`: the process that it goes with; 0: none.
  void watch(Server& server, pid_t run) {
    thread_ = OwnThread([this, &server, run](const std::stop_token& end) {
      const timespec patience{0, 100'000'000};
      const auto over = [&] { return run > 0 && kill(run, 0) != 0 && errno == ESRCH; };
      while (!end.stop_requested())
        if (sigtimedwait(&signals_, nullptr, &patience) > 0 || over()) return server.end();
    });
  }

 private:
  sigset_t signals_{};
  OwnThread thread_;
};

int serve(Options options) {
  EndOfServer end;
  keep_rights(Rights::none);
  options.server.token = new_token();
  if (!options.token_file.empty()) {
    umask(0077);
    const int code = command::write_output(options.token_file, options.server.token + "\n", "--token-file");
    if (code != command::kOk) return code;
  }
  Gate gate(options.hosts);
  gate.origins = options.origins;
  const Registry registry = ace_registry();
  const graph::MessageTypes types = graph::message_types(registry);
  std::unique_ptr<Server> server;
  Hub hub([&server] {
    if (server) server->wake();
  });
  std::unique_ptr<Link> link;
  FrozenFiles files([&hub] { return frozen_folder(hub.graph()); }, command::takt_program());
  const robot::RobotQuestions people([&hub] { return hub.graph(); },
                                     [&link](const Json& question) { return link->ask(question); });
  const auto answer = [&](const Json& question) {
    if (FrozenFiles::is_asked(question)) return files.answer(question);
    return robot::RobotQuestions::is_asked(question) ? people.answer(question) : link->ask(question);
  };
  try {
    server = std::make_unique<Server>(
        hub, answer, [&files](const auto& name, const auto& ticket) { return files.redeem(name, ticket); },
        options.server, std::move(gate));
  } catch (const std::runtime_error& problem) {
    return refuse(fmt::format("{}\n  fix: another --port, or --address of this machine", problem.what()),
                  kDeviceOrSystem);
  }
  link =
      std::make_unique<Link>(hub, types, Link::Options{.run = options.with_run > 0 ? options.with_run : options.run});
  options.server.port = server->port();
  fmt::print("{}\nFoxglove: ws{}://{}:{}\n", page_address(options.server),
             options.server.certificate.empty() ? "" : "s", options.server.address, options.server.port);
  if (std::fflush(stdout) != 0)
    return refuse("stdout does not take the address that is to be opened\n  fix: room for it, or --token-file",
                  kDeviceOrSystem);
  end.watch(*server, options.with_run);
  server->run();
  link.reset();
  return command::kOk;
}

int run(int argc, char** argv) {
  CLI::App app{"Shows a running graph in a browser and to Foxglove; prints the address to open", "takt web"};
  Options options;
  app.add_option("--run", options.run, "process id of the run; without it the one that there is");
  app.add_option("--with-run", options.with_run, "process id of a run that may still have to begin; ends with it")
      ->excludes("--run");
  app.add_option("--port", options.server.port, "TCP port of page and Foxglove, 8765 by default; 0: one that is free")
      ->check(CLI::Range(0, 65535));
  app.add_option(
      "--address", options.server.address,
      "address of this machine, 127.0.0.1 by default; any but loopback needs --certificate and --key, and the "
      "token for looking");
  app.add_option("--certificate", options.server.certificate, "PEM file with this server's certificate")
      ->check(CLI::ExistingFile);
  app.add_option("--key", options.server.key, "PEM file with its key")->check(CLI::ExistingFile);
  app.add_option("--host", options.hosts, "name under which browsers may ask for this server, besides localhost");
  app.add_option("--origin", options.origins, "page of somebody else that may connect: https://app.foxglove.dev");
  app.add_option("--token-file", options.token_file, "where the token is written, for this user alone (mode 0600)");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? command::kOk : kBadInput;
  }
  if (options.server.certificate.empty() != options.server.key.empty())
    return refuse("--certificate and --key belong together", kBadInput);
  if (!graph::is_loopback(options.server.address)) {
    if (options.server.certificate.empty())
      return refuse(fmt::format("--address {} is seen by others: it needs --certificate and --key\n"
                                "  fix: openssl req -x509 -newkey rsa:2048 -nodes -days 365 -subj /CN=NAME -keyout "
                                "key.pem -out certificate.pem\n  or: ssh -L {}:localhost:{} HOST, without --address",
                                options.server.address, options.server.port, options.server.port),
                    kBadInput);
    options.server.token_to_look = true;
    options.hosts.push_back(options.server.address);
  }
  return serve(std::move(options));
}

}  // namespace
}  // namespace takt::web

int main(int argc, char** argv) {
  return takt::command::at_boundary(argc, argv, [&] { return takt::web::run(argc, argv); });
}
