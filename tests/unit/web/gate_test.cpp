// SPDX-License-Identifier: Apache-2.0
#include "graph/web/gate.hpp"

#include <doctest/doctest.h>

#include <set>

using namespace takt;

TEST_CASE("a server is asked for under its own names, on its own port") {
  const web::Gate gate({"robot.local", "192.168.1.7"}, 8765);
  for (const char* host : {"localhost", "localhost:8765", "127.0.0.1:8765", "[::1]:8765", "robot.local:8765",
                           "robot.local", "192.168.1.7:8765"})
    CHECK_MESSAGE(gate.host(host), host);
  for (const char* host : {"", ":8765", "evil.com", "evil.com:8765", "localhost:80", "localhost.evil.com:8765",
                           "robot.local:8765.evil.com", "[::1]:80", "::1", "[", "]", "[]", "localhost:8765:8765"})
    CHECK_MESSAGE(!gate.host(host), host);
}

TEST_CASE("a page of somebody else is not let in, a program that is no browser is") {
  web::Gate gate({}, 8765);
  gate.origins = {"https://app.foxglove.dev"};
  for (const char* origin : {"", "http://localhost:8765", "https://127.0.0.1:8765", "https://app.foxglove.dev"})
    CHECK_MESSAGE(gate.origin(origin), origin);
  for (const char* origin : {"null", "http://evil.com", "http://evil.com:8765", "file://", "ftp://localhost:8765",
                             "https://app.foxglove.dev.evil.com", "http://localhost:3000"})
    CHECK_MESSAGE(!gate.origin(origin), origin);
}

TEST_CASE("tokens differ, and only the same one is the same") {
  std::set<std::string> tokens;
  for (int i = 0; i < 100; ++i) tokens.insert(web::new_token());
  CHECK(tokens.size() == 100);
  const std::string token = *tokens.begin();
  CHECK(token.size() == 32);
  CHECK(web::same_token(token, token));
  CHECK_FALSE(web::same_token("", token));
  CHECK_FALSE(web::same_token(token + "a", token));
  CHECK_FALSE(web::same_token(token.substr(1), token));
  std::string other = token;
  other.back() = other.back() == 'a' ? 'b' : 'a';
  CHECK_FALSE(web::same_token(other, token));
}
