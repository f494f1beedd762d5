// SPDX-License-Identifier: Apache-2.0
// All commands of Takt, for graphs with thermometers.
#include <takt/main.hpp>

#include "registration.hpp"

int main(int argc, char** argv) { return takt::main(argc, argv, register_room); }
