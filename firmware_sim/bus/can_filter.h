#pragma once

#include <cstdint>
#include <span>

#include "firmware_sim/bus/can_frame.h"

namespace mantle::firmware_sim {

/// Which frames a station wants: as CAN_RAW_FILTER, a frame passes where
/// (frame.id & mask) == (id & mask) for any filter of the list. An empty list passes everything.
/// SocketCAN applies the list in the kernel, the other transports before they copy a frame.
struct CanFilter {
  std::uint32_t id{0};
  std::uint32_t mask{0x7FF};
};

/// Error frames always pass: they concern every station.
inline bool Passes(std::span<const CanFilter> filters, const CanFrame& frame) {
  if (filters.empty() || frame.error) return true;
  for (const CanFilter& filter : filters) {
    if ((frame.id & filter.mask) == (filter.id & filter.mask)) return true;
  }
  return false;
}

}  // namespace mantle::firmware_sim
