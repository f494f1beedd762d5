// SPDX-License-Identifier: Apache-2.0
// The rows of ace_head.dbc.
#include "hal/head/head_messages.hpp"

namespace takt::head {
namespace {

using namespace can;

constexpr Signal kSyncSignals[] = {
    {"SYNC_Counter", 0, 8, false, 1, 0, 1, 240},
};
constexpr Signal kEmergencySignals[] = {
    {"EM_Code", 0, 16, false, 1, 0, 0, 65535},
    {"EM_Register", 16, 8, false, 1, 0, 0, 255},
    {"EM_Axis", 24, 8, false, 1, 0, 0, 4},
    {"EM_Data", 32, 32, false, 1, 0, 0, 4294967295},
};
constexpr Signal kPosStatusSignals[] = {
    {"PS_State", 12, 4, false, 1, 0, 0, 7},         {"PS_PanPos", 16, 16, true, 0.01, 0, -180, 180},
    {"PS_TiltPos", 32, 16, true, 0.01, 0, -90, 90}, {"PS_PanReached", 48, 1, false, 1, 0, 0, 1},
    {"PS_TiltReached", 49, 1, false, 1, 0, 0, 1},   {"PS_PanHomed", 50, 1, false, 1, 0, 0, 1},
    {"PS_TiltHomed", 51, 1, false, 1, 0, 0, 1},     {"PS_PanLimNeg", 52, 1, false, 1, 0, 0, 1},
    {"PS_PanLimPos", 53, 1, false, 1, 0, 0, 1},     {"PS_TiltLimNeg", 54, 1, false, 1, 0, 0, 1},
    {"PS_TiltLimPos", 55, 1, false, 1, 0, 0, 1},    {"PS_EStop", 56, 1, false, 1, 0, 0, 1},
    {"PS_ServoPower", 57, 1, false, 1, 0, 0, 1},    {"PS_Brake", 58, 1, false, 1, 0, 0, 1},
    {"PS_SetpointStale", 59, 1, false, 1, 0, 0, 1}, {"PS_OverTemp", 60, 1, false, 1, 0, 0, 1},
    {"PS_UnderVoltage", 61, 1, false, 1, 0, 0, 1},  {"PS_FollowError", 62, 1, false, 1, 0, 0, 1},
    {"PS_Fault", 63, 1, false, 1, 0, 0, 1},
};
constexpr Signal kVelStatusSignals[] = {
    {"VS_PanVel", 16, 16, true, 0.01, 0, -300, 300},
    {"VS_TiltVel", 32, 16, true, 0.01, 0, -300, 300},
    {"VS_SampleTime", 48, 16, false, 0.1, 0, 0, 6553.5},
};
constexpr Signal kEyelidStatusSignals[] = {
    {"ES_State", 12, 4, false, 1, 0, 0, 5},
    {"ES_LeftPos", 16, 8, false, 0.5, 0, 0, 100},
    {"ES_RightPos", 24, 8, false, 0.5, 0, 0, 100},
    {"ES_LeftCurrent", 32, 8, false, 10, 0, 0, 2550},
    {"ES_RightCurrent", 40, 8, false, 10, 0, 0, 2550},
    {"ES_ServoVolt", 48, 8, false, 0.05, 0, 0, 12.75},
    {"ES_BlinkCount", 56, 8, false, 1, 0, 0, 255},
};
constexpr Signal kHealthSignals[] = {
    {"HH_PanTemp", 16, 8, false, 1, -40, -40, 215}, {"HH_TiltTemp", 24, 8, false, 1, -40, -40, 215},
    {"HH_SupplyVolt", 32, 8, false, 0.2, 0, 0, 51}, {"HH_SupplyCurr", 40, 8, false, 0.1, 0, 0, 25.5},
    {"HH_Uptime", 48, 16, false, 1, 0, 0, 65535},
};
constexpr Signal kLimitsSignals[] = {
    {"HL_Page", 12, 4, false, 1, 0, 0, 2, kPageNumber},   {"HL_PanMin", 16, 16, true, 0.01, 0, -180, 0, 0},
    {"HL_PanMax", 32, 16, true, 0.01, 0, 0, 180, 0},      {"HL_PanMargin", 48, 16, false, 0.01, 0, 0, 20, 0},
    {"HL_TiltMin", 16, 16, true, 0.01, 0, -90, 0, 1},     {"HL_TiltMax", 32, 16, true, 0.01, 0, 0, 90, 1},
    {"HL_TiltMargin", 48, 16, false, 0.01, 0, 0, 20, 1},  {"HL_PanMaxVel", 16, 16, false, 0.01, 0, 0, 300, 2},
    {"HL_TiltMaxVel", 32, 16, false, 0.01, 0, 0, 300, 2}, {"HL_MaxAcc", 48, 16, false, 0.1, 0, 0, 2000, 2},
};
constexpr Signal kSetpointSignals[] = {
    {"SP_Mode", 12, 4, false, 1, 0, 0, 15},         {"SP_PanPos", 16, 16, true, 0.01, 0, -120, 120},
    {"SP_TiltPos", 32, 16, true, 0.01, 0, -45, 45}, {"SP_MaxVel", 48, 8, false, 1, 0, 0, 200},
    {"SP_MaxAcc", 56, 8, false, 10, 0, 0, 2000},
};
constexpr Signal kVelSetpointSignals[] = {
    {"SV_PanVel", 16, 16, true, 0.01, 0, -200, 200},
    {"SV_TiltVel", 32, 16, true, 0.01, 0, -200, 200},
    {"SV_Timeout", 48, 8, false, 10, 0, 0, 1000},
};
constexpr Signal kEyelidSetpointSignals[] = {
    {"EL_Action", 12, 4, false, 1, 0, 0, 5},       {"EL_LeftPos", 16, 8, false, 0.5, 0, 0, 100},
    {"EL_RightPos", 24, 8, false, 0.5, 0, 0, 100}, {"EL_MoveTime", 32, 16, false, 1, 0, 0, 5000},
    {"EL_HoldTime", 48, 8, false, 10, 0, 0, 2550}, {"EL_Repeat", 56, 4, false, 1, 0, 0, 15},
    {"EL_Token", 60, 4, false, 1, 0, 0, 15},
};
constexpr Signal kHeartbeatSignals[] = {
    {"HB_HeadState", 0, 8, false, 1, 0, 0, 127},
};

constexpr Message kTable[] = {
    {"NMT_Command", 0x000, 2, Sender::host, false, kNodeCommandSignals},
    {"SYNC", 0x080, 1, Sender::host, false, kSyncSignals},
    {"HEAD_EMCY", 0x090, 8, Sender::device, false, kEmergencySignals},
    {"HEAD_PosStatus", 0x190, 8, Sender::device, true, kPosStatusSignals},
    {"HEAD_VelStatus", 0x290, 8, Sender::device, true, kVelStatusSignals},
    {"EYELID_Status", 0x390, 8, Sender::device, true, kEyelidStatusSignals},
    {"HEAD_Health", 0x490, 8, Sender::device, true, kHealthSignals},
    {"HEAD_Limits", 0x4D0, 8, Sender::device, true, kLimitsSignals},
    {"HEAD_Setpoint", 0x210, 8, Sender::host, true, kSetpointSignals},
    {"HEAD_VelSetpoint", 0x310, 8, Sender::host, true, kVelSetpointSignals},
    {"EYELID_Setpoint", 0x410, 8, Sender::host, true, kEyelidSetpointSignals},
    {"HOST_Heartbeat", 0x701, 1, Sender::host, false, kHostHeartbeatSignals},
    {"HEAD_Heartbeat", 0x710, 1, Sender::device, false, kHeartbeatSignals},
};

}  // namespace

std::span<const Message> messages() { return kTable; }

}  // namespace takt::head
