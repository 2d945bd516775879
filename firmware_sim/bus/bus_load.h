#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "firmware_sim/bus/can_frame.h"

namespace mantle::firmware_sim {

inline constexpr std::int64_t kBitRate = 1'000'000;     ///< bit/s, the profile's
inline constexpr double kBusLoadWarningPercent = 70.0;  ///< the profile's

/// Bits of `frame` with the stuff bits its content needs and the interframe space. An error frame
/// counts as an active error flag with delimiter and interframe space (6 + 8 + 3).
int ActualFrameBits(const CanFrame& frame);

/// Bits of any frame with `size` data bytes (0..8) with the most stuff bits possible.
int WorstFrameBits(int size, bool extended);

/// Bits of such a frame without any stuff bit.
int LeastFrameBits(int size, bool extended);

/// The bits that decide arbitration, most significant first: a lower value wins. A data frame wins
/// over the remote frame of its id, an 11-bit id over the 29-bit ids that begin with it.
std::uint32_t ArbitrationField(const CanFrame& frame);

/// What a scene puts on the bus in every cycle.
struct CyclicTraffic {
  int drives{8};
  int rpdos{2};  ///< per drive, 0..2
  int tpdos{2};  ///< per drive, 0..2
  std::int64_t period_us{10'000};
  std::int64_t heartbeat_us{0};  ///< of every node, the master too; 0: none counted
};

/// One kind of frame in a cycle.
struct LoadRow {
  std::string frame;   ///< "SYNC", "RPDO1", ...
  std::string cob_id;  ///< "0x201..0x208"
  int size{0};         ///< data bytes
  double count{0};     ///< frames a cycle; heartbeats come to a fraction
  int worst_bits{0};   ///< of one frame
};

/// How many bits frames take on a classic CAN wire, and what share of it a scene needs.
///
/// Bits of a frame of n data bytes (ISO 11898-1):
///
/// | part                                             | 11-bit id | 29-bit id | stuffed |
/// |--------------------------------------------------|-----------|-----------|---------|
/// | start of frame                                   | 1         | 1         | yes     |
/// | arbitration and control up to the length code    | 18        | 38        | yes     |
/// | data                                             | 8n        | 8n        | yes     |
/// | cyclic redundancy check (CRC-15, 0x4599)         | 15        | 15        | yes     |
/// | CRC delimiter, acknowledge, its delimiter        | 3         | 3         | no      |
/// | end of frame                                     | 7         | 7         | no      |
/// | interframe space                                 | 3         | 3         | no      |
///
/// that is 47 + 8n and 67 + 8n. A sender inserts the complement after five equal bits of the
/// stuffed part; the inserted bit counts for the next five, so that s stuffed bits grow by at most
/// floor((s - 1) / 4): [Davis] R. Davis, A. Burns, R. Bril, J. Lukkien, "Controller Area Network
/// (CAN) schedulability analysis: refuted, revisited and revised", 2007, eq. 1 and 2.
struct BusLoad {
  std::vector<LoadRow> rows;
  double frames{0};         ///< a cycle
  double least_bits{0};     ///< a cycle, without stuff bits
  double worst_bits{0};     ///< a cycle, with the most stuff bits
  double least_percent{0};  ///< of kBitRate
  double worst_percent{0};
  bool warn{false};  ///< the worst case is above kBusLoadWarningPercent
};

/// The load of a scene. Throws std::invalid_argument where drives are not 1..126, PDOs not 0..2,
/// the period not 100 us..10 s, or the heartbeat negative.
BusLoad LoadOfScene(const CyclicTraffic& traffic);

/// Share of `bit_rate` that `bits` take in `duration_us`, in per cent; 0 for a duration of 0.
double LoadPercent(double bits, std::int64_t duration_us, std::int64_t bit_rate = kBitRate);

}  // namespace mantle::firmware_sim
