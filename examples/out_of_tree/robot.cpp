// SPDX-License-Identifier: Apache-2.0
// A program with all commands of Takt: it knows this node, and nothing else.
#include <takt/main.hpp>

#include "smoother.hpp"

int main(int argc, char** argv) {
  return takt::main(argc, argv, [](takt::Registry& registry) {
    registry.nodes.add<Smoother>("smoother", takt::Layer::processing, "lets a speed change no faster than a limit");
  });
}
