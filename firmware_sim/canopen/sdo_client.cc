#include "firmware_sim/canopen/sdo_client.h"

#include "firmware_sim/bus/wire.h"

namespace mantle::firmware_sim {

namespace {

constexpr std::uint8_t kSpecifierMask = 0xE0;
constexpr std::uint8_t kUploadReply = 0x40;
constexpr std::uint8_t kExpeditedWithSize = 0x03;

}  // namespace

void SdoClient::Begin(bool upload) {
  upload_ = upload;
  result_ = SdoResult::kBusy;
  tries_ = 0;
  value_ = 0;
  abort_code_ = 0;
}

void SdoClient::Upload(SdoObject object) {
  write_ = {.object = object};
  Begin(true);
}

void SdoClient::Download(const SdoWrite& write) {
  write_ = write;
  Begin(false);
}

void SdoClient::OnReply(const CanFrame& frame) {
  const bool ours = result_ == SdoResult::kBusy && tries_ > 0 && frame.size == 8 &&
                    LoadLe(&frame.data[1], 2) == write_.object.index &&
                    frame.data[3] == write_.object.sub;
  if (!ours) {
    ++unexpected_replies_;
    return;
  }
  const std::uint8_t command = frame.data[0];
  if (command == kSdoAbortCommand) {
    abort_code_ = LoadLe(&frame.data[4], 4);
    result_ = SdoResult::kAborted;
  } else if (upload_ && (command & kSpecifierMask) == kUploadReply) {
    if ((command & kExpeditedWithSize) == kExpeditedWithSize) {
      value_ = LoadLe(&frame.data[4], 4U - ((command >> 2U) & 3U));
      result_ = SdoResult::kDone;
    } else {
      // A segmented transfer: no object that we read needs one.
      abort_code_ = static_cast<std::uint32_t>(SdoAbort::kCommandUnknown);
      result_ = SdoResult::kAborted;
    }
  } else if (!upload_ && command == kSdoDownloadReply) {
    result_ = SdoResult::kDone;
  } else {
    ++unexpected_replies_;
  }
}

SdoResult SdoClient::Advance(std::int64_t now_us, FrameBatch& out) {
  if (result_ != SdoResult::kBusy || (tries_ > 0 && now_us - sent_us_ < timeout_us_)) {
    return result_;
  }
  if (tries_ == attempts_) return result_ = SdoResult::kTimedOut;
  ++tries_;
  sent_us_ = now_us;
  CanFrame frame;
  frame.id = CobSdoRequest(node_);
  frame.size = 8;
  frame.data[0] = upload_ ? kSdoUploadRequest : SdoDownloadRequest(write_.size);
  StoreLe(&frame.data[1], 2, write_.object.index);
  frame.data[3] = write_.object.sub;
  if (!upload_) StoreLe(&frame.data[4], write_.size, write_.value);
  out.Push(frame);
  return result_;
}

}  // namespace mantle::firmware_sim
