// SPDX-License-Identifier: Apache-2.0
// The part `web` of a graph.
#include "fixture.hpp"

using namespace takt;
using namespace takt::test;
using namespace takt::graph;

namespace {

WebSpec web_of(const std::string& text) {
  Loaded loaded = Files(kGraph + text).load();
  INFO(all(loaded));
  REQUIRE(loaded.graph);
  return loaded.graph->web;
}

void wrong_web(const std::string& text, const std::string& at, const std::vector<std::string>& words) {
  const std::string graph = kGraph + text;
  expect_at(Files(graph).load(), "graph.yaml", graph, at, words, kGraph.size());
}

}  // namespace

TEST_CASE("what a graph says of its page; paths are relative to it") {
  const WebSpec none = web_of("");
  CHECK(none.port == 0);
  CHECK(none.address == "");
  const WebSpec web = web_of(
      "web: {port: 8080, address: 10.0.0.7, certificate: c.pem, key: k.pem, token_file: token, hosts: [ace], origins: "
      "[https://app.foxglove.dev]}\n");
  CHECK(web.port == 8080);
  CHECK(web.address == "10.0.0.7");
  CHECK(web.certificate.filename() == "c.pem");
  CHECK(web.certificate.is_absolute());
  CHECK(web.token_file.filename() == "token");
  CHECK(web.hosts == std::vector<std::string>{"ace"});
  CHECK(web.origins == std::vector<std::string>{"https://app.foxglove.dev"});
}

TEST_CASE("what others reach needs a certificate with its key; a port is one; keys are known ones") {
  wrong_web("web: {address: 10.0.0.7}\n", "10.0.0.7", {"which others reach", "`certificate` and `key`"});
  wrong_web("web: {certificate: c.pem}\n", "web", {"they belong together"});
  wrong_web("web: {port: 70000}\n", "70000", {"65535"});
  wrong_web("web: {prot: 8080}\n", "prot", {"port"});
  for (const char* address : {"localhost", "127.0.0.1", "127.1.2.3", "::1"}) CHECK(is_loopback(address));
  for (const char* address : {"0.0.0.0", "::", "192.168.1.7", "localhost.evil"}) CHECK(!is_loopback(address));
}
