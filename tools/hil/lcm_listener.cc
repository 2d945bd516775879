#include "tools/hil/lcm_listener.h"

#include <future>
#include <utility>

#include "loop/timing.h"
#include "tools/mantle/loop_telemetry.h"

namespace mantle::tools {
namespace {

constexpr int kReceive_ms = 50;
constexpr int kQueued = 64;  // messages of a channel that wait

}  // namespace

LcmListener::LcmListener(const std::string& url, const std::vector<std::string>& channels,
                         TelemetrySink& to) {
  std::promise<std::unique_ptr<LcmLink>> opened;
  std::future<std::unique_ptr<LcmLink>> link = opened.get_future();
  thread_ = std::thread([this, &to, &url, &channels, opened = std::move(opened)]() mutable {
    loop::RunAtOnce(loop::kSensorPriority);  // a thread that liblcm makes inherits it
    LcmLink* heard = nullptr;
    try {
      auto made =
          OpenLcm({.url = url, .receive = true, .channels = channels, .queued_messages = kQueued});
      heard = made.get();
      opened.set_value(std::move(made));
    } catch (...) {
      opened.set_exception(std::current_exception());
      return;
    }
    while (!stopping_.load(std::memory_order_relaxed)) {
      heard->Receive(kReceive_ms, to);
      malformed_.store(heard->counters().malformed, std::memory_order_relaxed);
    }
  });
  try {
    link_ = link.get();
  } catch (...) {
    thread_.join();
    throw;
  }
}

LcmListener::~LcmListener() {
  stopping_.store(true, std::memory_order_relaxed);
  thread_.join();
}

bool LcmSensorSink::Send(const loop::Sensors& message) {
  const std::uint64_t before = link_->counters().publish_failures;
  link_->Write(SensorsMessage(message));
  return link_->counters().publish_failures == before;
}

}  // namespace mantle::tools
