#pragma once

#include "firmware_sim/bus/can_frame.h"
#include "firmware_sim/canopen/object_dictionary.h"

/// @file
/// The expedited SDO server (CiA 301 7.2.4).
///
///   upload    request 40 ii ii ss 00 00 00 00           reply 43|(4-n)<<2 ii ii ss d0 d1 d2 d3
///   download  request 23|(4-n)<<2 ii ii ss d0 d1 d2 d3  reply 60 ii ii ss 00 00 00 00
///             (22 where the size is not told)
///   abort     80 ii ii ss a0 a1 a2 a3                   (a client's abort gets no reply)

namespace mantle::firmware_sim {

/// What came of one request.
struct SdoOutcome {
  bool has_reply{false};
  bool has_written{false};  ///< `slot` passed every check and holds the new value
  std::size_t slot{0};
  CanFrame reply{};
};

/// Serves one request. A request that is not of eight bytes is no SDO and gets no reply. `enabled`
/// as in CheckWrite.
SdoOutcome ServeSdo(const CanFrame& request, ObjectDictionary& objects, bool enabled);

}  // namespace mantle::firmware_sim
