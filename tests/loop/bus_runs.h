#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <string>
#include <vector>

#include "firmware_sim/bus/candump_log.h"
#include "tests/loop/vehicle.h"
#include "tests/loop/vehicles.h"

/// One second of a two-motor vehicle on a named bus, and what it must have in common with the same
/// second in process.

namespace mantle::loop {

struct BusRun {
  std::vector<firmware_sim::CanFrame> commands;  ///< RPDOs and SYNCs with their simulated times
  std::vector<firmware_sim::CanFrame> all;       ///< with SDOs, TPDOs, heartbeats, NMT
  model::PlantState state;
};

inline bool IsCommand(const firmware_sim::CanFrame& frame) {
  const std::uint32_t function = frame.id & 0x780U;
  return frame.id == firmware_sim::kCobSync || function == 0x200U || function == 0x300U;
}

/// Brings up, pulls for a second by what the drives report, stops.
inline BusRun RunOn(const std::string& bus) {
  const std::string log = ::testing::TempDir() + "mantle_bus_run_" + std::to_string(getpid());
  const model::Plant plant(tests::ClampedArm());
  BusRun run;
  {
    firmware_sim::CandumpWriter writer(log, "bus0");
    Vehicle vehicle(plant, tests::LoopRun(), {tests::CableMotor("a", 0), tests::CableMotor("b", 2)},
                    {.bus = bus}, {.record = &writer});
    Status status = vehicle.BringUp();
    for (int k = 0; k < 100 && status.ok; ++k) {
      MotorCommand commands[2];
      for (int i = 0; i < 2; ++i) {
        const double wanted = 0.2 + 0.2 * std::sin(0.06 * k + 3.0 * i);
        // What the drive reported comes back into the command: a frame that is late by a cycle
        // changes it.
        const double sigma = std::clamp(vehicle.ReportedRate_m_s(i) / 0.01, -1.0, 1.0);
        commands[i].torque_permille = static_cast<std::int16_t>(
            std::lround(TensionToTorque(vehicle.winch_map(), wanted, sigma)));
      }
      status = vehicle.Cycle(commands);
    }
    EXPECT_TRUE(status.ok) << bus << ": " << status.reason;
    run.state = vehicle.state();
    if (status.ok) status = vehicle.Stop();
    EXPECT_TRUE(status.ok) << bus << ": " << status.reason;
    EXPECT_TRUE(writer.Flush());
  }
  std::ifstream in(log);
  run.all = firmware_sim::ReadCandumpLog(in).frames;
  std::remove(log.c_str());
  for (const firmware_sim::CanFrame& frame : run.all) {
    if (IsCommand(frame)) run.commands.push_back(frame);
  }
  return run;
}

inline void ExpectSameFrames(const std::vector<firmware_sim::CanFrame>& a,
                             const std::vector<firmware_sim::CanFrame>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    ASSERT_EQ(a[i].id, b[i].id) << i;
    ASSERT_EQ(a[i].size, b[i].size) << i;
    ASSERT_EQ(a[i].data, b[i].data) << i;
    ASSERT_EQ(a[i].time_us, b[i].time_us) << i;
  }
}

/// To the last bit: every command frame and its instant, everything else on the bus, the plant.
inline void ExpectSameAsInProcess(const BusRun& run) {
  const BusRun reference = RunOn("loop");
  // 100 cycles of two RPDOs for two motors and a SYNC, and the bring-up's.
  EXPECT_GT(reference.commands.size(), 500U);
  ExpectSameFrames(run.commands, reference.commands);
  ExpectSameFrames(run.all, reference.all);
  EXPECT_TRUE(run.state.velocity == reference.state.velocity);
}

}  // namespace mantle::loop
