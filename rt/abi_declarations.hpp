// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/abi_declarations.hpp>: core, stable.
// Written by `tests/tools/api.py --write`: the hash of tests/api/stable.txt.
#pragma once
#define TAKT_ABI_DECLARATIONS "000000000000"
