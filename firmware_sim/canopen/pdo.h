#pragma once

#include <array>
#include <cstdint>

#include "firmware_sim/bus/can_frame.h"
#include "firmware_sim/canopen/object_dictionary.h"

namespace mantle::firmware_sim {

enum class RpdoResult : std::uint8_t {
  kNotMine,   ///< no existing RPDO has this COB-ID
  kTooShort,  ///< fewer bytes than mapped: not processed
  kBuffered,  ///< waits for SYNC
  kApplied,   ///< its objects hold the new values
};

/// The two RPDOs and two TPDOs of a drive (CiA 301 7.2.2), as objects 14xx, 16xx, 18xx and 1Axx
/// configure them.
///
/// Transmission types: 0 sent at a SYNC where the content changed; 1 to 240 at every n-th SYNC;
/// 254 and 255 sent on a change of the statusword and on the event timer, never more often than the
/// inhibit time. An RPDO of type 0 to 240 is buffered until the next SYNC, one of 254 or 255
/// applied at once. An RPDO longer than its mapping counts with its first bytes; a shorter one is
/// refused.
class PdoSet {
 public:
  /// Reads the configuration; to be called after a reset and after a write to any PDO object.
  void Configure(const ObjectDictionary& objects);

  /// `wrote_controlword` is set where an applied RPDO carried object 6040.
  RpdoResult Receive(const CanFrame& frame, std::int64_t time_us, ObjectDictionary& objects,
                     bool& wrote_controlword);

  /// At SYNC: applies what is buffered; true where object 6040 was among it.
  bool ApplyBuffered(ObjectDictionary& objects);
  void DropBuffered();

  /// Whether the last frame of some RPDO was too short.
  bool has_length_error() const { return pdos_[0].too_short || pdos_[1].too_short; }
  /// When RPDO 0 or 1 last came with enough bytes.
  std::int64_t last_received_us(std::size_t rpdo) const { return pdos_[rpdo].last_us; }
  /// Starts the time-outs of the RPDOs, as if they had come now.
  void Touch(std::int64_t time_us);
  /// Whether some existing RPDO waits for SYNC.
  bool NeedsSync() const;

  /// Whether TPDO 0 or 1 is due at this SYNC, or now by its event timer; fills `frame`.
  bool SampleOnSync(std::size_t tpdo, std::int64_t time_us, const ObjectDictionary& objects,
                    CanFrame& frame);
  bool SampleOnEvent(std::size_t tpdo, std::int64_t time_us, const ObjectDictionary& objects,
                     CanFrame& frame);

 private:
  struct Pdo {
    std::uint32_t cob_id{kPdoInvalid};
    std::uint8_t type{1};
    std::uint8_t count{0};  ///< mapped objects
    std::uint8_t bytes{0};
    std::array<std::uint8_t, kMaxMapped> slots{};
    std::array<std::uint8_t, 8> data{};  ///< RPDO: buffered; TPDO: last sent
    bool too_short{false};               ///< RPDO: the last one was
    bool pending{false};                 ///< RPDO: `data` waits for SYNC
    bool ever_sent{false};
    std::uint8_t sync_count{0};
    std::uint16_t last_statusword{0};
    std::int64_t last_us{0};  ///< last received or sent
  };
  static_assert(kObjectTable.size() <= 256, "slots of mapped objects are bytes");

  static bool Apply(Pdo& pdo, ObjectDictionary& objects);
  static void Fill(const Pdo& pdo, const ObjectDictionary& objects, CanFrame& frame);

  std::array<Pdo, kPdoCount> pdos_{};
};

}  // namespace mantle::firmware_sim
