// SPDX-License-Identifier: Apache-2.0
// Installed as <takt/abi_declarations.hpp>: core, stable.
// Written by `tests/tools/api.py . --write`: a hash of all public headers.
#pragma once
#define TAKT_ABI_DECLARATIONS "e8b588333d01"
