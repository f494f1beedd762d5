// SPDX-License-Identifier: Apache-2.0
#include "graph/command/check_command.hpp"
