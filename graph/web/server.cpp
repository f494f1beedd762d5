// SPDX-License-Identifier: Apache-2.0
#include "graph/web/server.hpp"

#include <fmt/format.h>
#include <libwebsockets.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <stdexcept>

#include "graph/web/asking.hpp"
#include "graph/web/page_files.hpp"
#include "graph/web/session.hpp"

namespace takt::web {
namespace {

constexpr size_t kMostSessions = 32;
constexpr size_t kLongestMessage = 64 << 10;  ///< from the other side
constexpr const char* kPageProtocol = "takt.v1";
constexpr const char* kPolicy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; connect-src 'self' ws: wss:; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

std::string header_of(lws* connection, lws_token_indexes which) {
  std::array<char, 512> text{};
  const int length = lws_hdr_copy(connection, text.data(), static_cast<int>(text.size()), which);
  return length > 0 ? std::string(text.data(), static_cast<size_t>(length)) : std::string();
}

/// Of the address; empty: it is not there.
std::string argument_of(lws* connection, const char* name) {
  std::array<char, 128> text{};
  const char* found = lws_get_urlarg_by_name(connection, name, text.data(), static_cast<int>(text.size()));
  return found != nullptr ? found : "";
}

bool add_header(lws* connection, const char* name, std::string_view value, unsigned char** at, unsigned char* end) {
  return lws_add_http_header_by_name(connection, reinterpret_cast<const unsigned char*>(name),
                                     reinterpret_cast<const unsigned char*>(value.data()),
                                     static_cast<int>(value.size()), at, end) == 0;
}

}  // namespace

class Server::Inside {
 public:
  Inside(Hub& hub, Ask ask, File file, const ServerOptions& options, Gate gate)
      : gate_(std::move(gate)),
        file_(std::move(file)),
        asking_(std::move(ask), [this] { wake(); }),
        room_{hub, options.token, options.token_to_look, [this](uint64_t session, Json question, Asking::Then then) {
                asking_.ask(session, std::move(question), std::move(then));
              }} {
    lws_set_log_level(0, nullptr);  // what concerns a person is told by main
    lws_context_creation_info info{};
    info.port = options.port;
    info.iface = options.address.c_str();
    info.protocols = protocols().data();
    info.user = this;
    info.vhost_name = "takt";
    info.server_string = "takt";
    info.ka_time = 10, info.ka_probes = 3, info.ka_interval = 5;
    info.options = LWS_SERVER_OPTION_VALIDATE_UTF8;
    info.alpn = "http/1.1";
    const std::string certificate = options.certificate.string(), key = options.key.string();
    if (!certificate.empty()) {
      info.options |= LWS_SERVER_OPTION_DO_SSL_GLOBAL_INIT;
      info.ssl_cert_filepath = certificate.c_str();
      info.ssl_private_key_filepath = key.c_str();
    }
    context_ = lws_create_context(&info);
    if (context_ == nullptr)
      throw std::runtime_error(fmt::format("port {} of {} cannot be served: it is taken, or not this machine's",
                                           options.port, options.address));
    gate_.port = lws_get_vhost_listen_port(lws_get_vhost_by_name(context_, info.vhost_name));
  }
  ~Inside() {
    asking_.end();
    lws_context_destroy(context_);  // ends the sessions
  }
  Inside(const Inside&) = delete;
  Inside& operator=(const Inside&) = delete;

  void run() {
    while (!ending_.load() && lws_service(context_, 0) >= 0) {
    }
  }
  int port() const { return gate_.port; }
  void end() {
    ending_.store(true);
    wake();
  }
  void wake() {
    if (context_ != nullptr) lws_cancel_service(context_);
  }

 private:
  struct Peer {
    std::unique_ptr<Session> session;
    std::string incoming;
    bool open = false;  ///< its handshake is over
  };

  static std::array<lws_protocols, 5>& protocols() {
    const auto one = [](const char* name) { return lws_protocols{name, &Inside::called, 0, 8192, 0, nullptr, 0}; };
    static std::array<lws_protocols, 5> all{one("http"), one(kPageProtocol), one("foxglove.sdk.v1"),
                                            one("foxglove.websocket.v1"), lws_protocols{}};
    return all;
  }

  static int called(lws* connection, lws_callback_reasons reason, void*, void* in, size_t length) {
    auto* inside = static_cast<Inside*>(lws_context_user(lws_get_context(connection)));
    const std::string_view bytes(static_cast<const char*>(in), in != nullptr ? length : 0);
    switch (reason) {
      case LWS_CALLBACK_HTTP: return inside->answer_http(connection, bytes);
      case LWS_CALLBACK_HTTP_WRITEABLE: return inside->send_file(connection);
      case LWS_CALLBACK_HTTP_FILE_COMPLETION: return lws_http_transaction_completed(connection) != 0 ? -1 : 0;
      case LWS_CALLBACK_CLOSED_HTTP: inside->files_.erase(connection); return 0;
      case LWS_CALLBACK_FILTER_PROTOCOL_CONNECTION: return inside->let_in(connection) ? 0 : -1;
      case LWS_CALLBACK_ESTABLISHED: inside->begin(connection); return 0;
      case LWS_CALLBACK_RECEIVE: return inside->receive(connection, bytes) ? 0 : -1;
      case LWS_CALLBACK_SERVER_WRITEABLE: return inside->send(connection) ? 0 : -1;
      case LWS_CALLBACK_CLOSED:
      case LWS_CALLBACK_WSI_DESTROY: inside->peers_.erase(connection); return 0;
      case LWS_CALLBACK_EVENT_WAIT_CANCELLED: inside->look(); return 0;
      default: return 0;
    }
  }

  static int refuse(lws* connection, unsigned status, const char* why) {
    return lws_return_http_status(connection, status, why) != 0 || lws_http_transaction_completed(connection) != 0 ? -1
                                                                                                                   : 0;
  }

  int answer_http(lws* connection, std::string_view path) {
    if (!gate_.host(header_of(connection, WSI_TOKEN_HOST)))
      return refuse(connection, HTTP_STATUS_FORBIDDEN, "not under this name");
    if (path.starts_with(kFrozenPath)) return hand_out(connection, std::string(path.substr(kFrozenPath.size())));
    const PageFile* file = page_file(path);
    if (file == nullptr) return refuse(connection, HTTP_STATUS_NOT_FOUND, "there is no such page");
    std::array<unsigned char, LWS_PRE + 2048> buffer{};
    unsigned char *begin = buffer.data() + LWS_PRE, *at = begin, *end = buffer.data() + buffer.size();
    if (lws_add_http_common_headers(connection, HTTP_STATUS_OK, file->type, file->bytes.size(), &at, end) != 0 ||
        !add_header(connection, "content-security-policy:", kPolicy, &at, end) ||
        !add_header(connection, "x-content-type-options:", "nosniff", &at, end) ||
        !add_header(connection, "referrer-policy:", "no-referrer", &at, end) ||
        !add_header(connection, "cache-control:", "no-cache", &at, end) ||
        lws_finalize_write_http_header(connection, begin, &at, end) != 0)
      return 1;
    files_[connection] = file;
    lws_callback_on_writable(connection);
    return 0;
  }

  /// A frozen record, to who has a ticket for it.
  int hand_out(lws* connection, const std::string& name) {
    const auto file = file_(name, argument_of(connection, "ticket="));
    if (!file) return refuse(connection, HTTP_STATUS_FORBIDDEN, "this needs a new ticket: the page asks for one");
    const std::string header = fmt::format("content-disposition: attachment; filename=\"{}\"\x0d\x0a", name);
    const int sent = lws_serve_http_file(connection, file->c_str(), "application/octet-stream", header.c_str(),
                                         static_cast<int>(header.size()));
    return sent < 0 || (sent > 0 && lws_http_transaction_completed(connection) != 0) ? -1 : 0;
  }

  int send_file(lws* connection) {
    const auto file = files_.find(connection);
    if (file == files_.end()) return 0;
    std::string padded(LWS_PRE, '\0');
    padded += file->second->bytes;
    files_.erase(file);
    auto* bytes = reinterpret_cast<unsigned char*>(padded.data()) + LWS_PRE;
    if (lws_write(connection, bytes, padded.size() - LWS_PRE, LWS_WRITE_HTTP_FINAL) < 0) return -1;
    return lws_http_transaction_completed(connection) != 0 ? -1 : 0;
  }

  bool let_in(lws* connection) {
    const lws_protocols* protocol = lws_get_protocol(connection);
    if (protocol == nullptr || protocol->name == std::string_view("http") || peers_.size() >= kMostSessions ||
        !gate_.host(header_of(connection, WSI_TOKEN_HOST)) || !gate_.origin(header_of(connection, WSI_TOKEN_ORIGIN)))
      return false;
    const bool may_change = same_token(argument_of(connection, "token="), room_.token);
    const bool page = protocol->name == std::string_view(kPageProtocol);  // says its token later
    if (!page && room_.token_to_look && !may_change) return false;
    Peer& peer = peers_[connection];
    peer.session = page ? page_session(room_, ++sessions_) : foxglove_session(room_, ++sessions_, may_change);
    return true;
  }

  void begin(lws* connection) {
    const auto peer = peers_.find(connection);
    if (peer == peers_.end()) return;
    peer->second.open = true;
    peer->second.session->look();
    lws_callback_on_writable(connection);
  }

  bool receive(lws* connection, std::string_view bytes) {
    const auto peer = peers_.find(connection);
    if (peer == peers_.end() || peer->second.incoming.size() + bytes.size() > kLongestMessage) return false;
    std::string& incoming = peer->second.incoming;
    incoming += bytes;
    if (lws_is_final_fragment(connection) == 0 || lws_remaining_packet_payload(connection) > 0) return true;
    const std::string message = std::exchange(incoming, "");
    try {
      if (!peer->second.session->receive(message, lws_frame_is_binary(connection) != 0)) return false;
    } catch (const Json::exception&) {  // a member of another kind than the protocol has
      return false;
    }
    lws_callback_on_writable(connection);
    return true;
  }

  bool send(lws* connection) {
    const auto peer = peers_.find(connection);
    if (peer == peers_.end()) return false;
    const auto message = peer->second.session->next();
    if (!message) return true;
    std::string padded(LWS_PRE, '\0');
    padded += *message->frame;
    auto* bytes = reinterpret_cast<unsigned char*>(padded.data()) + LWS_PRE;
    if (lws_write(connection, bytes, message->frame->size(), message->binary ? LWS_WRITE_BINARY : LWS_WRITE_TEXT) < 0)
      return false;
    lws_callback_on_writable(connection);  // there may be more
    return true;
  }

  /// Something is new.
  void look() {
    for (const Json& news : room_.hub.take_news())
      for (auto& [connection, peer] : peers_) peer.session->take_news(news);
    asking_.deliver([this](uint64_t session) {
      return std::any_of(peers_.begin(), peers_.end(),
                         [&](const auto& peer) { return peer.second.session->number() == session; });
    });
    for (auto& [connection, peer] : peers_) {
      if (!peer.open) continue;
      peer.session->look();
      lws_callback_on_writable(connection);
    }
  }

  Gate gate_;
  const File file_;
  Asking asking_;
  const Room room_;
  lws_context* context_ = nullptr;
  std::atomic<bool> ending_{false};
  uint64_t sessions_ = 0;
  std::map<lws*, Peer> peers_;
  std::map<lws*, const PageFile*> files_;
};

Server::Server(Hub& hub, Ask ask, File file, const ServerOptions& options, Gate gate)
    : inside_(std::make_unique<Inside>(hub, std::move(ask), std::move(file), options, std::move(gate))) {}
Server::~Server() = default;
int Server::port() const { return inside_->port(); }
void Server::run() { inside_->run(); }
void Server::end() { inside_->end(); }
void Server::wake() { inside_->wake(); }

}  // namespace takt::web
