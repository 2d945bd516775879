#pragma once

#include <cstdint>

#include "firmware_sim/bus/can_frame.h"
#include "firmware_sim/canopen/canopen.h"
#include "firmware_sim/canopen/object_dictionary.h"

namespace mantle::firmware_sim {

/// Emergencies (CiA 301 7.2.7): which errors are present, the error register 1001, the history 1003
/// (newest first), the last code in 603F.
///
///   EMCY frame, COB-ID 0x080 + node:  [u16 code, u8 error register, 5 bytes zero]
class Emergency {
 public:
  /// Notes an error. True where it was not present yet, so that an EMCY is due.
  bool Raise(EmcyCode code, ObjectDictionary& objects);

  /// Notes that an error is over. True where it was the last one, so that EMCY 0000 is due.
  bool Clear(EmcyCode code, ObjectDictionary& objects);

  bool IsPresent(EmcyCode code) const { return (present_ & Bit(code)) != 0; }

  /// Writes 1001 from what is present.
  void UpdateRegister(ObjectDictionary& objects) const;

  /// Forgets what is present (a reset of the node); the history goes with the objects.
  void Reset() { present_ = 0; }

 private:
  static std::uint16_t Bit(EmcyCode code);

  std::uint16_t present_{0};
};

CanFrame MakeEmcy(NodeId node, EmcyCode code, std::uint8_t error_register);

}  // namespace mantle::firmware_sim
