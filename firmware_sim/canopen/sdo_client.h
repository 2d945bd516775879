#pragma once

#include <cstdint>

#include "firmware_sim/bus/can_frame.h"
#include "firmware_sim/canopen/canopen.h"
#include "firmware_sim/canopen/frame_batch.h"

namespace mantle::firmware_sim {

/// An entry of the object dictionary.
struct SdoObject {
  std::uint16_t index{0};
  std::uint8_t sub{0};
};

/// A value for an entry.
struct SdoWrite {
  SdoObject object;
  std::uint8_t size{4};  ///< bytes, 1..4
  std::uint32_t value{0};
};

enum class SdoResult : std::uint8_t { kIdle, kBusy, kDone, kAborted, kTimedOut };

/// The client's side of expedited SDO transfers (CiA 301 7.2.4) with one node, one transfer at a
/// time. Time is an input; nothing throws or allocates.
///
///   upload    request  40 index16 sub 00000000       reply 4x index16 sub data, x = 3 | (4-n) << 2
///   download  request  2x index16 sub data           reply 60 index16 sub
///   abort     either   80 index16 sub code32
class SdoClient {
 public:
  /// A request without a reply is repeated every `timeout_us`, `attempts` times in all. An
  /// expedited download may be repeated: it writes the same value.
  SdoClient(NodeId node, std::int64_t timeout_us, int attempts)
      : node_(node), timeout_us_(timeout_us), attempts_(attempts) {}

  /// Begin a transfer; one under way is forgotten. The request leaves in the next Advance.
  void Upload(SdoObject object);
  void Download(const SdoWrite& write);
  void Cancel() { result_ = SdoResult::kIdle; }

  /// Takes a frame with our node's reply COB-ID. Replies to another object are counted, not used.
  void OnReply(const CanFrame& frame);

  /// Sends, repeats or gives up; returns the state of the transfer.
  SdoResult Advance(std::int64_t now_us, FrameBatch& out);

  SdoResult result() const { return result_; }
  SdoObject object() const { return write_.object; }
  std::uint32_t value() const { return value_; }  ///< uploaded
  std::uint32_t abort_code() const { return abort_code_; }
  std::uint64_t unexpected_replies() const { return unexpected_replies_; }

 private:
  void Begin(bool upload);

  NodeId node_;
  std::int64_t timeout_us_;
  int attempts_;
  SdoResult result_{SdoResult::kIdle};
  bool upload_{false};
  SdoWrite write_{};
  std::uint32_t value_{0};
  std::uint32_t abort_code_{0};
  int tries_{0};
  std::int64_t sent_us_{0};
  std::uint64_t unexpected_replies_{0};
};

}  // namespace mantle::firmware_sim
