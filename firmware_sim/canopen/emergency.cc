#include "firmware_sim/canopen/emergency.h"

#include <algorithm>
#include <array>

#include "firmware_sim/bus/wire.h"

namespace mantle::firmware_sim {
namespace {

constexpr std::array<EmcyCode, 10> kCodes = {
    EmcyCode::kOverCurrent,          EmcyCode::kOverVoltage,
    EmcyCode::kUnderVoltage,         EmcyCode::kOverTemperatureDevice,
    EmcyCode::kOverTemperatureMotor, EmcyCode::kEncoder,
    EmcyCode::kHeartbeatLost,        EmcyCode::kPdoLength,
    EmcyCode::kRpdoTimeout,          EmcyCode::kFollowingError};

}  // namespace

std::uint16_t Emergency::Bit(EmcyCode code) {
  for (std::size_t i = 0; i < kCodes.size(); ++i) {
    if (kCodes[i] == code) return static_cast<std::uint16_t>(1U << i);
  }
  return 0;
}

bool Emergency::Raise(EmcyCode code, ObjectDictionary& objects) {
  const std::uint16_t bit = Bit(code);
  if (bit == 0 || (present_ & bit) != 0) return false;
  present_ = static_cast<std::uint16_t>(present_ | bit);
  UpdateRegister(objects);
  constexpr std::size_t kCount = Slot(object::kErrorHistory, 0);
  const std::size_t count = std::min<std::size_t>(objects.Raw(kCount) + 1, kErrorHistoryDepth);
  for (std::size_t i = count; i > 1; --i) objects.Store(kCount + i, objects.Raw(kCount + i - 1));
  objects.Store(kCount + 1, static_cast<std::uint32_t>(code));
  objects.Store(kCount, static_cast<std::uint32_t>(count));
  objects.Store(Slot(object::kErrorCode), static_cast<std::uint32_t>(code));
  return true;
}

bool Emergency::Clear(EmcyCode code, ObjectDictionary& objects) {
  const std::uint16_t bit = Bit(code);
  if ((present_ & bit) == 0) return false;
  present_ = static_cast<std::uint16_t>(present_ & ~bit);
  UpdateRegister(objects);
  if (present_ != 0) return false;
  objects.Store(Slot(object::kErrorCode), 0);
  return true;
}

void Emergency::UpdateRegister(ObjectDictionary& objects) const {
  std::uint32_t value = 0;
  for (const EmcyCode code : kCodes) {
    if (IsPresent(code)) value |= ErrorRegisterBit(code) | kErrorRegisterGeneric;
  }
  objects.Store(Slot(object::kErrorRegister), value);
}

CanFrame MakeEmcy(NodeId node, EmcyCode code, std::uint8_t error_register) {
  CanFrame frame;
  frame.id = CobEmcy(node);
  frame.size = 8;
  StoreLe(frame.data.data(), 2, static_cast<std::uint32_t>(code));
  frame.data[2] = error_register;
  return frame;
}

}  // namespace mantle::firmware_sim
