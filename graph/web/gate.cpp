// SPDX-License-Identifier: Apache-2.0
#include "graph/web/gate.hpp"

#include <sys/random.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <stdexcept>

namespace takt::web {
namespace {

constexpr size_t kTokenLength = 32;
constexpr std::string_view kLetters = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_";  // 64

/// Host without its port. Empty: it is none.
std::string_view without_port(std::string_view host, int port) {
  const std::string end = ":" + std::to_string(port);
  if (host.ends_with(end)) host.remove_suffix(end.size());
  else if (!host.starts_with('[') && host.find(':') != std::string_view::npos) return {};  // another port
  if (host.starts_with('[') && host.ends_with(']')) host = host.substr(1, host.size() - 2);
  return host;
}

}  // namespace

std::string new_token() {
  std::array<uint8_t, kTokenLength> random{};
  if (getrandom(random.data(), random.size(), 0) != static_cast<ssize_t>(random.size()))
    throw std::runtime_error("no random numbers for a token");
  std::string token;
  for (const uint8_t byte : random) token += kLetters[byte % kLetters.size()];
  return token;
}

bool same_token(std::string_view given, std::string_view token) {
  unsigned differ = given.size() == token.size() ? 0 : 1;
  for (size_t i = 0; i < token.size(); ++i)
    differ |= static_cast<unsigned>(token[i] ^ (i < given.size() ? given[i] : '\0'));
  return differ == 0;
}

bool Gate::known(std::string_view host) const {
  constexpr std::array<std::string_view, 3> kLoopback{"localhost", "127.0.0.1", "::1"};
  return std::find(kLoopback.begin(), kLoopback.end(), host) != kLoopback.end() ||
         std::find(hosts_.begin(), hosts_.end(), host) != hosts_.end();
}

bool Gate::host(std::string_view header) const {
  const std::string_view host = without_port(header, port);
  return !host.empty() && known(host);
}

bool Gate::origin(std::string_view header) const {
  if (header.empty() || std::find(origins.begin(), origins.end(), header) != origins.end()) return true;
  for (const std::string_view scheme : {"http://", "https://"})
    if (header.starts_with(scheme)) return host(header.substr(scheme.size()));
  return false;
}

}  // namespace takt::web
