#include "firmware_sim/canopen/state_machine.h"

#include <gtest/gtest.h>

#include "tests/firmware_sim/drive_bench.h"

namespace mantle::firmware_sim {
namespace {

using test::DriveBench;
using test::Targets;

using enum DriveState;

struct Row {
  DriveState from;
  // Where each command leads, in the order of kCommands; `from` where it is no transition.
  DriveState to[6];
  int number[6];
};

constexpr DriveCommand kCommands[6] = {
    DriveCommand::kShutdown,       DriveCommand::kSwitchOn,  DriveCommand::kEnableOperation,
    DriveCommand::kDisableVoltage, DriveCommand::kQuickStop, DriveCommand::kFaultReset};
constexpr std::uint16_t kWords[6] = {0x0006, 0x0007, 0x000F, 0x0000, 0x0002, 0x0080};

// CiA 402, figure of the state machine; 605A is 6.
constexpr Row kTable[kDriveStateCount] = {
    {kNotReady,
     {kNotReady, kNotReady, kNotReady, kNotReady, kNotReady, kNotReady},
     {0, 0, 0, 0, 0, 0}},
    {kSwitchOnDisabled,
     {kReadyToSwitchOn, kSwitchOnDisabled, kSwitchOnDisabled, kSwitchOnDisabled, kSwitchOnDisabled,
      kSwitchOnDisabled},
     {2, 0, 0, 0, 0, 0}},
    {kReadyToSwitchOn,
     {kReadyToSwitchOn, kSwitchedOn, kOperationEnabled, kSwitchOnDisabled, kSwitchOnDisabled,
      kReadyToSwitchOn},
     {0, 3, 4, 7, 7, 0}},
    {kSwitchedOn,
     {kReadyToSwitchOn, kSwitchedOn, kOperationEnabled, kSwitchOnDisabled, kSwitchOnDisabled,
      kSwitchedOn},
     {6, 0, 4, 10, 10, 0}},
    {kOperationEnabled,
     {kReadyToSwitchOn, kSwitchedOn, kOperationEnabled, kSwitchOnDisabled, kQuickStopActive,
      kOperationEnabled},
     {8, 5, 0, 9, 11, 0}},
    {kQuickStopActive,
     {kQuickStopActive, kQuickStopActive, kOperationEnabled, kSwitchOnDisabled, kQuickStopActive,
      kQuickStopActive},
     {0, 0, 16, 12, 0, 0}},
    {kFaultReactionActive,
     {kFaultReactionActive, kFaultReactionActive, kFaultReactionActive, kFaultReactionActive,
      kFaultReactionActive, kFaultReactionActive},
     {0, 0, 0, 0, 0, 0}},
    {kFault, {kFault, kFault, kFault, kFault, kFault, kSwitchOnDisabled}, {0, 0, 0, 0, 0, 15}},
};

TEST(StateMachine, EveryStateAgainstEveryCommand) {
  for (const Row& row : kTable) {
    for (int i = 0; i < 6; ++i) {
      const Transition transition = CommandTransition(row.from, kCommands[i], 6);
      EXPECT_EQ(transition.next, row.to[i]) << Name(row.from) << " command " << i;
      EXPECT_EQ(transition.number, row.number[i]) << Name(row.from) << " command " << i;
    }
    EXPECT_EQ(CommandTransition(row.from, DriveCommand::kNone, 6).number, 0);
  }
}

TEST(StateMachine, QuickStopIsLeftForEnabledOnlyWithOptionsFiveToEight) {
  for (int option = 0; option <= 8; ++option) {
    const Transition transition =
        CommandTransition(kQuickStopActive, DriveCommand::kEnableOperation, option);
    EXPECT_EQ(transition.number, option >= 5 ? 16 : 0);
  }
}

/// Brings a drive to a state as a client can: over the bus.
void BringTo(DriveBench& bench, DriveState state, Targets& t) {
  bench.Download(0x605A, 0, 2, 6);
  bench.Nmt(NmtCommand::kStart);
  const auto run = [&](std::uint16_t word) {
    t.controlword = word;
    bench.Run(t, 1);
  };
  if (state == kFault) {
    bench.drive.Disturb(Disturbance::kEncoderBroken);
    bench.Advance(20'000);
    bench.drive.Disturb(Disturbance::kNone);
    bench.Advance(20'000);
    return;
  }
  if (state == kSwitchOnDisabled) return;
  run(0x06);
  if (state == kReadyToSwitchOn) return;
  run(0x07);
  if (state == kSwitchedOn) return;
  run(0x0F);
  if (state == kQuickStopActive) run(0x02);
  if (state == kFaultReactionActive) {
    // 800 thousandths of torque take 80 ms to ramp down: the reaction lasts.
    t.torque = 800;
    bench.Run(t, 30);
    bench.drive.Disturb(Disturbance::kEncoderBroken);
    bench.Advance(2'000);
    bench.drive.Disturb(Disturbance::kNone);
  }
}

TEST(StateMachine, TheDriveOnItsBusFollowsTheTable) {
  for (const Row& row : kTable) {
    if (row.from == kNotReady) continue;  // left by itself before the boot-up
    for (int i = 0; i < 6; ++i) {
      DriveBench bench;
      Targets t;
      BringTo(bench, row.from, t);
      ASSERT_EQ(bench.drive.state(), row.from);
      t.controlword = kWords[i];
      bench.SendTargets(t);
      // 0x0080 holds "disable voltage" for a drive that has no fault.
      const int column = kWords[i] == 0x0080 && row.from != kFault ? 3 : i;
      EXPECT_EQ(bench.drive.state(), row.to[column]) << Name(row.from) << " word " << kWords[i];
      EXPECT_EQ(DecodeState(bench.statusword()), bench.drive.state());
    }
  }
}

TEST(StateMachine, StatuswordsAreTheProfiles) {
  const std::pair<DriveState, std::uint16_t> words[] = {
      {kSwitchOnDisabled, 0x0250},
      {kReadyToSwitchOn, 0x0231},
      {kSwitchedOn, 0x0233},
      {kOperationEnabled, 0x1237},
      {kQuickStopActive, 0x0217},
      {kFaultReactionActive, 0x021F},
      {kFault, 0x0218},
  };
  for (const auto& [state, word] : words) {
    DriveBench bench;
    Targets t;
    BringTo(bench, state, t);
    EXPECT_EQ(bench.statusword(), word) << Name(state);
  }
}

TEST(StateMachine, ABitSevenThatStaysHighEnablesNothing) {
  DriveBench bench;
  Targets t;
  BringTo(bench, kSwitchedOn, t);
  t.controlword = 0x8F;
  bench.Run(t, 5);
  EXPECT_EQ(bench.drive.state(), kSwitchedOn);
}

TEST(StateMachine, NoTransitionOverrunsASupplyThatIsMissing) {
  DriveBench bench;
  Targets t;
  BringTo(bench, kReadyToSwitchOn, t);
  bench.drive.Disturb(Disturbance::kUnderVoltage);
  t.controlword = 0x0F;
  bench.Run(t, 3);
  EXPECT_EQ(bench.drive.state(), kReadyToSwitchOn);
  EXPECT_EQ(bench.statusword() & statusword::kVoltageEnabled, 0);
}

TEST(StateMachine, WithoutAnRpdoTimeoutTheDriveIsNotEnabled) {
  DriveBench bench;
  bench.Download(0x1400, 5, 2, 0);
  Targets t;
  BringTo(bench, kSwitchedOn, t);
  t.controlword = 0x0F;
  bench.Run(t, 3);
  EXPECT_EQ(bench.drive.state(), kSwitchedOn);
}

}  // namespace
}  // namespace mantle::firmware_sim
