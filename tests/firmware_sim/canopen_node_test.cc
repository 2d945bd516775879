#include "firmware_sim/canopen/canopen_node.h"

#include <gtest/gtest.h>

#include "tests/firmware_sim/drive_bench.h"

namespace mantle::firmware_sim {
namespace {

using test::DriveBench;
using test::Frame;
using test::Targets;

std::vector<std::uint8_t> HeartbeatStates(const DriveBench& bench) {
  std::vector<std::uint8_t> states;
  for (const CanFrame& frame : bench.WithId(CobHeartbeat(bench.node()))) {
    EXPECT_EQ(frame.size, 1);
    states.push_back(frame.data[0]);
  }
  return states;
}

TEST(CanopenNode, BootsUpIntoPreOperational) {
  DriveBench bench({.node = 9});
  ASSERT_EQ(bench.frames.size(), 1U);
  EXPECT_EQ(bench.frames[0].id, 0x709U);
  EXPECT_EQ(bench.frames[0].size, 1);
  EXPECT_EQ(bench.frames[0].data[0], 0);
  EXPECT_EQ(bench.drive.nmt_state(), NmtState::kPreOperational);
}

TEST(CanopenNode, FirstHeartbeatFollowsOnePeriodAfterBootUp) {
  DriveBench bench;
  bench.frames.clear();
  bench.Advance(99'000);
  EXPECT_TRUE(bench.frames.empty());
  bench.Advance(1'000);
  EXPECT_EQ(HeartbeatStates(bench), (std::vector<std::uint8_t>{127}));
  bench.Advance(900'000);
  EXPECT_EQ(HeartbeatStates(bench).size(), 10U);
}

TEST(CanopenNode, HeartbeatTellsTheNmtState) {
  DriveBench bench;
  bench.frames.clear();
  for (const NmtCommand command :
       {NmtCommand::kStart, NmtCommand::kStop, NmtCommand::kPreOperational}) {
    bench.Nmt(command, 1);
    bench.Advance(100'000);
  }
  EXPECT_EQ(HeartbeatStates(bench), (std::vector<std::uint8_t>{5, 4, 127}));
}

TEST(CanopenNode, HeartbeatPeriodIsObject1017) {
  DriveBench bench;
  bench.Download(0x1017, 0, 2, 20);
  bench.frames.clear();
  bench.Advance(200'000);
  EXPECT_EQ(HeartbeatStates(bench).size(), 10U);
  bench.Download(0x1017, 0, 2, 0);
  bench.frames.clear();
  bench.Advance(1'000'000);
  EXPECT_TRUE(HeartbeatStates(bench).empty());
}

TEST(CanopenNode, NmtHeedsAddressLengthAndCommand) {
  DriveBench bench({.node = 4});
  bench.Nmt(NmtCommand::kStart, 5);
  EXPECT_EQ(bench.drive.nmt_state(), NmtState::kPreOperational);
  bench.Send(Frame(0x000, {1}));
  bench.Send(Frame(0x000, {1, 4, 0}));
  bench.Send(Frame(0x000, {3, 4}));
  EXPECT_EQ(bench.drive.nmt_state(), NmtState::kPreOperational);
  bench.Nmt(NmtCommand::kStart, 4);
  EXPECT_EQ(bench.drive.nmt_state(), NmtState::kOperational);
  bench.Nmt(NmtCommand::kStop, 0);
  EXPECT_EQ(bench.drive.nmt_state(), NmtState::kStopped);
}

TEST(CanopenNode, StoppedNodeServesNoSdo) {
  DriveBench bench;
  bench.Nmt(NmtCommand::kStop);
  EXPECT_FALSE(bench.Upload(0x1000, 0).came);
  bench.Nmt(NmtCommand::kPreOperational);
  EXPECT_TRUE(bench.Upload(0x1000, 0).came);
}

TEST(CanopenNode, StoppedNodeSendsNoEmergency) {
  DriveBench bench;
  bench.Nmt(NmtCommand::kStop);
  bench.drive.Disturb(Disturbance::kEncoderBroken);
  bench.Advance(50'000);
  EXPECT_EQ(bench.drive.state(), DriveState::kFault);
  EXPECT_TRUE(bench.Emergencies().empty());
  bench.Nmt(NmtCommand::kPreOperational);
  EXPECT_EQ(bench.Upload(0x1003, 1).data, 0x7320U);  // the history knows it
}

TEST(CanopenNode, IgnoresExtendedRemoteAndErrorFrames) {
  DriveBench bench;
  CanFrame start = Frame(0x000, {1, 0});
  start.extended = true;
  bench.Send(start);
  start.extended = false;
  start.remote = true;
  bench.Send(start);
  start.remote = false;
  start.error = true;
  bench.Send(start);
  EXPECT_EQ(bench.drive.nmt_state(), NmtState::kPreOperational);
}

TEST(CanopenNode, MasterIsWatchedFromItsFirstHeartbeat) {
  DriveBench bench;
  bench.Advance(2'000'000);
  EXPECT_TRUE(bench.Emergencies().empty());
  bench.Send(Frame(0x77F, {0}));  // its boot-up does not arm
  bench.Advance(2'000'000);
  EXPECT_TRUE(bench.Emergencies().empty());
  bench.Heartbeat();
  bench.Advance(200'000);
  EXPECT_TRUE(bench.Emergencies().empty());
  bench.Advance(2'000);
  EXPECT_EQ(bench.Emergencies(), (std::vector<EmcyCode>{EmcyCode::kHeartbeatLost}));
}

TEST(CanopenNode, ErrorBehaviourIsObject1029) {
  const NmtState expected[] = {NmtState::kPreOperational, NmtState::kOperational,
                               NmtState::kStopped};
  for (unsigned behaviour = 0; behaviour < 3; ++behaviour) {
    DriveBench bench;
    bench.Download(0x1029, 1, 1, behaviour);
    bench.Nmt(NmtCommand::kStart);
    bench.Heartbeat();
    bench.Advance(300'000);
    EXPECT_EQ(bench.drive.nmt_state(), expected[behaviour]);
    EXPECT_EQ(bench.Emergencies(), (std::vector<EmcyCode>{EmcyCode::kHeartbeatLost}));
  }
}

TEST(CanopenNode, ResetNodeRestoresEveryDefaultAndBoots) {
  DriveBench bench;
  bench.Download(0x1017, 0, 2, 77);
  bench.Download(0x6065, 0, 4, 5);
  bench.Nmt(NmtCommand::kStart);
  bench.frames.clear();
  bench.Nmt(NmtCommand::kResetNode, 1);
  bench.Advance(4'000);
  EXPECT_TRUE(bench.frames.empty()) << "deaf and mute while it starts";
  EXPECT_FALSE(bench.Upload(0x1000, 0).came);
  bench.Advance(1'000);
  ASSERT_EQ(bench.frames.size(), 1U);
  EXPECT_EQ(bench.frames[0].data[0], 0);
  EXPECT_EQ(bench.drive.nmt_state(), NmtState::kPreOperational);
  EXPECT_EQ(bench.Number(Slot(0x1017)), 100);
  EXPECT_EQ(bench.Number(Slot(0x6065)), 2000);
}

TEST(CanopenNode, ResetCommunicationLeavesTheDevicesObjects) {
  DriveBench bench;
  bench.Download(0x1017, 0, 2, 77);
  bench.Download(0x6065, 0, 4, 5);
  bench.Nmt(NmtCommand::kResetCommunication, 1);
  bench.Advance(5'000);
  EXPECT_EQ(HeartbeatStates(bench), (std::vector<std::uint8_t>{0, 0}));
  EXPECT_EQ(bench.Number(Slot(0x1017)), 100);
  EXPECT_EQ(bench.Number(Slot(0x6065)), 5);
}

TEST(CanopenNode, ResetCommunicationDoesNotWashAFaultAway) {
  DriveBench bench;
  bench.drive.Disturb(Disturbance::kEncoderBroken);
  bench.Advance(10'000);
  bench.Nmt(NmtCommand::kResetCommunication);
  bench.Advance(5'000);
  EXPECT_EQ(bench.drive.state(), DriveState::kFault);
  EXPECT_EQ(bench.Number(Slot(0x1001)), 0x21);
}

TEST(CanopenNode, EmergenciesLeaveNoCloserThanTheInhibitTime) {
  DriveBench bench;
  constexpr int kInhibit_us = 50'000;
  bench.Download(0x1015, 0, 2, kInhibit_us / 100);
  bench.Nmt(NmtCommand::kStart);
  bench.frames.clear();
  // An RPDO that is too short at every other millisecond: an error comes and goes.
  for (int i = 0; i < 500; ++i) {
    bench.Send(i % 2 == 0 ? Frame(0x201, {0}) : Frame(0x201, {0, 0, 0, 0, 0, 0, 0, 0}));
    bench.Advance(1'000);
  }
  const auto sent = bench.WithId(CobEmcy(bench.node()));
  ASSERT_EQ(sent.size(), 11U) << "at once, then one in each 50 ms of 500 ms";
  for (std::size_t i = 1; i < sent.size(); ++i) {
    EXPECT_GE(sent[i].time_us - sent[i - 1].time_us, kInhibit_us) << i;
  }
  EXPECT_GT(bench.drive.frames_dropped(), 0U) << "of more than eight that wait the oldest is lost";
  // What waits comes when its time has come, and then no more: the last of those above left room.
  bench.Advance(1'000'000);
  EXPECT_EQ(bench.WithId(CobEmcy(bench.node())).size(),
            sent.size() + CanopenNode::kEmcyCapacity - 1);
  EXPECT_EQ(bench.Emergencies().back(), EmcyCode::kNoError);
}

TEST(CanopenNode, AStoppedNodeSendsNoEmergencyThatWaited) {
  DriveBench bench;
  bench.Download(0x1015, 0, 2, 1000);
  bench.Nmt(NmtCommand::kStart);
  bench.frames.clear();
  bench.Send(Frame(0x201, {0}));
  bench.Send(Frame(0x201, {0, 0, 0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(bench.Emergencies(), (std::vector<EmcyCode>{EmcyCode::kPdoLength}));
  bench.Nmt(NmtCommand::kStop);
  bench.Advance(1'000'000);
  bench.Nmt(NmtCommand::kPreOperational);
  bench.Advance(1'000'000);
  EXPECT_EQ(bench.Emergencies().size(), 1U);
}

}  // namespace
}  // namespace mantle::firmware_sim
