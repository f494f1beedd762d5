// SPDX-License-Identifier: Apache-2.0
// Where the runs of a graph are shown (`web`).
#include <fmt/format.h>

#include "graph/language/loader.hpp"

namespace takt::graph {

using nlohmann::json;

bool is_loopback(std::string_view address) {
  return address == "localhost" || address == "::1" || address.starts_with("127.");
}

void Loader::read_web() {
  const json web = graph_.root.value("web", json());
  if (!web.is_object()) return;
  WebSpec& spec = spec_.web;
  const auto text = [&](const char* key) {
    const json value = web.value(key, json());
    return value.is_string() ? value.get<std::string>() : "";
  };
  const auto path = [&](const char* key) {
    const std::string name = text(key);
    return name.empty() ? std::filesystem::path() : spec_.directory / name;
  };
  const auto list = [&](const char* key, std::vector<std::string>& into) {
    const json values = web.value(key, json());
    for (const json& value : values.is_array() ? values : json::array())
      if (value.is_string()) into.push_back(value.get<std::string>());
  };
  if (const json port = web.value("port", json()); port.is_number_integer()) spec.port = port.get<int>();
  spec.address = text("address");
  spec.certificate = path("certificate"), spec.key = path("key"), spec.token_file = path("token_file");
  list("hosts", spec.hosts), list("origins", spec.origins);
  if (spec.certificate.empty() != spec.key.empty())
    problem(graph_.key_at("/web"), "`web` has `certificate` or `key`; they belong together");
  else if (!spec.address.empty() && !is_loopback(spec.address) && spec.certificate.empty())
    problem(graph_.value_at("/web/address"),
            fmt::format("`address` of `web` is {}, which others reach; it needs `certificate` and `key`",
                        ticked(spec.address)));
}

}  // namespace takt::graph
