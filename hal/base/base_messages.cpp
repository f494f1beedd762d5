// SPDX-License-Identifier: Apache-2.0
// The rows of ace_base.dbc.
#include "hal/base/base_messages.hpp"

namespace takt::base {
namespace {

using namespace can;

constexpr Signal kWheelsSignals[] = {
    {"WH_State", 12, 4, false, 1, 0, 0, 3},
    {"WH_Left", 16, 24, false, 1, 0, 0, 16777215},
    {"WH_Right", 40, 24, false, 1, 0, 0, 16777215},
};
constexpr Signal kMotionSignals[] = {
    {"MO_EStop", 12, 1, false, 1, 0, 0, 1},
    {"MO_Bumper", 13, 1, false, 1, 0, 0, 1},
    {"MO_CommandStale", 14, 1, false, 1, 0, 0, 1},
    {"MO_Fault", 15, 1, false, 1, 0, 0, 1},
    {"MO_Speed", 16, 16, true, 0.0001, 0, -2, 2},
    {"MO_TurnRate", 32, 16, true, 0.0001, 0, -3, 3},
    {"MO_SampleTime", 48, 16, false, 0.1, 0, 0, 6553.5},
};
constexpr Signal kCommandSignals[] = {
    {"CO_Mode", 12, 4, false, 1, 0, 0, 2},
    {"CO_Speed", 16, 16, true, 0.0001, 0, -2, 2},
    {"CO_TurnRate", 32, 16, true, 0.0001, 0, -3, 3},
    {"CO_MaxAcc", 48, 8, false, 0.01, 0, 0, 2.55},
};
constexpr Signal kHeartbeatSignals[] = {
    {"HB_BaseState", 0, 8, false, 1, 0, 0, 127},
};

constexpr Message kTable[] = {
    {"NMT_Command", 0x000, 2, Sender::host, false, kNodeCommandSignals},
    {"BASE_Wheels", 0x1A0, 8, Sender::device, true, kWheelsSignals},
    {"BASE_Motion", 0x2A0, 8, Sender::device, true, kMotionSignals},
    {"BASE_Command", 0x220, 8, Sender::host, true, kCommandSignals},
    {"HOST_Heartbeat", 0x701, 1, Sender::host, false, kHostHeartbeatSignals},
    {"BASE_Heartbeat", 0x720, 1, Sender::device, false, kHeartbeatSignals},
};

}  // namespace

std::span<const Message> messages() { return kTable; }

}  // namespace takt::base
