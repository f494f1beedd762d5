// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/plugin.hpp>: graph, experimental.
// Node types, devices and messages of your own for the stock `takt`, without a program of your own.
//
//   void register_blink(takt::Registry& registry) {
//     registry.nodes.add<Blink>("blink", takt::Layer::processing, "...");
//   }
//   TAKT_PLUGIN(register_blink)
//
// Built as a shared module, and named by `plugins: [blink.so]` of a graph or by `takt run --plugin blink.so`. The same
// register_blink in takt::main (graph/main.hpp) makes a program instead.
//
// The function may throw: the message is the error of the command. It makes no threads and no processes.
#pragma once
#include <array>
#include <string_view>

#include "graph/language/registry.hpp"
#include "rt/abi.hpp"

namespace takt::plugin {

/// What a plug-in's file is recognised by before any of its code runs; the ABI and a zero follow it.
inline constexpr std::string_view kMark = "takt plug-in, ABI: ";

template <size_t n>
constexpr auto marked(const char (&abi)[n]) {
  std::array<char, kMark.size() + n> all{};
  for (size_t i = 0; i < kMark.size(); ++i) all[i] = kMark[i];
  for (size_t i = 0; i < n; ++i) all[kMark.size() + i] = abi[i];
  return all;
}

}  // namespace takt::plugin

/// Once per plug-in, outside all namespaces. `function`: void(takt::Registry&).
#define TAKT_PLUGIN(function)                                                                 \
  extern "C" {                                                                                \
  __attribute__((visibility("default"), used)) extern const decltype(takt::plugin::marked(    \
      takt::kAbi)) takt_plugin_abi = takt::plugin::marked(takt::kAbi);                        \
  __attribute__((visibility("default"))) void takt_plugin_register(takt::Registry& registry); \
  }                                                                                           \
  void takt_plugin_register(takt::Registry& registry) { function(registry); }
