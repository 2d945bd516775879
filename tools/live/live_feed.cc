#include "tools/live/live_feed.h"

#include <fmt/format.h>

#include <utility>

#include "tools/report/shape_fault.h"

namespace mantle::tools {
namespace {

using namespace std::chrono_literals;

// An instant with nothing behind it for so long is whole: the run has ended or stands.
constexpr auto kWhole = 150ms;
constexpr auto kServer = 1s;
constexpr auto kSession = 3s;

double SecondsSince(LiveFeed::Clock::time_point then, LiveFeed::Clock::time_point now) {
  return std::chrono::duration<double>(now - then).count();
}

std::string Line(const Json& j) { return j.dump(-1, ' ', false, Json::error_handler_t::replace); }

// One server-sent event; JSON in a line holds no line's end.
LiveFeed::Text EventText(const char* name, const std::string& line) {
  return std::make_shared<const std::string>(fmt::format("event: {}\ndata: {}\n\n", name, line));
}

}  // namespace

// The lock is held. A run says all of an instant before anything of the next one.
void LiveFeed::Begin(std::int64_t utime) {
  last_message_ = Clock::now();
  ++messages_;
  if (any_ && utime == told_.utime) return;
  if (any_ && utime < told_.utime) {
    ++restarts_;
    plan_.reset();
    whole_.reset();
  } else if (any_ && !published_told_) {
    whole_ = std::move(told_);
  }
  told_ = {};
  told_.utime = utime;
  any_ = true;
  published_told_ = false;
}

template <typename Message>
void LiveFeed::Keep(const Message& m, std::optional<Message> LiveFrame::*slot) {
  const std::lock_guard lock(mutex_);
  Begin(m.utime);
  told_.*slot = m;
}

template void LiveFeed::Keep(const StateTelemetry&, std::optional<StateTelemetry> LiveFrame::*);
template void LiveFeed::Keep(const DrivesTelemetry&, std::optional<DrivesTelemetry> LiveFrame::*);
template void LiveFeed::Keep(const EnergyTelemetry&, std::optional<EnergyTelemetry> LiveFrame::*);
template void LiveFeed::Keep(const StatusTelemetry&, std::optional<StatusTelemetry> LiveFrame::*);
template void LiveFeed::Keep(const ControlTelemetry&, std::optional<ControlTelemetry> LiveFrame::*);
template void LiveFeed::Keep(const WaterTelemetry&, std::optional<WaterTelemetry> LiveFrame::*);

void LiveFeed::Write(const ShapeTelemetry& m) {
  if (ShapeFault(m) == nullptr) {
    Keep(m, &LiveFrame::shape);
    return;
  }
  const std::lock_guard lock(mutex_);
  ++refused_;
}

// A plan is made between two samples: it begins no instant.
void LiveFeed::Write(const PlanTelemetry& m) {
  const std::lock_guard lock(mutex_);
  last_message_ = Clock::now();
  ++messages_;
  plan_ = m;
}

void LiveFeed::Write(const SessionTelemetry& m) {
  const std::lock_guard lock(mutex_);
  const auto now = Clock::now();
  ++messages_;
  const bool other = session_ && (session_->host != m.host || session_->process != m.process);
  if (other && now - last_session_ < kSession) last_other_ = now;
  last_message_ = last_session_ = now;
  session_ = m;
}

// The lock is held.
void LiveFeed::Remember(const LiveFrame& frame) {
  if (restarts_ != frame_restarts_ || frame.utime < remembered_us_) {
    history_.clear();
    history_bytes_ = 0;
    frame_restarts_ = restarts_;
  } else if (!history_.empty() && frame.utime < remembered_us_ + kHistory_us) {
    return;
  }
  remembered_us_ = frame.utime;
  history_.push_back(Line(FrameRows(frame)));
  history_bytes_ += history_.back().size();
  while (!history_.empty() &&
         (history_.size() > kMostHistory || history_bytes_ > kMostHistory_bytes)) {
    history_bytes_ -= history_.front().size();
    history_.pop_front();
  }
}

void LiveFeed::Publish(const Json& server, Clock::time_point now) {
  std::optional<LiveFrame> frame;
  std::optional<PlanTelemetry> plan;
  std::optional<SessionTelemetry> session;
  std::string said;
  {
    const std::lock_guard lock(mutex_);
    if (whole_) {
      frame = std::exchange(whole_, std::nullopt);
    } else if (any_ && !published_told_ && now - last_message_ > kWhole) {
      frame = told_;
      published_told_ = true;
    }
    if (frame) {
      plan = plan_;
      session = session_;
    }
    std::string line = Line(server);
    if (line != server_ || now - last_server_ > kServer) {
      server_ = std::move(line);
      last_server_ = now;
      said = server_;
    }
  }
  if (!frame && said.empty()) return;
  Text frame_text, server_text;
  if (!said.empty()) server_text = EventText("server", said);
  if (frame) {
    frame_text = EventText(
        "frame", Line(FrameJson(*frame, plan ? &*plan : nullptr, session ? &*session : nullptr)));
  }
  const std::lock_guard lock(mutex_);
  if (frame) Remember(*frame);
  ++sequence_;
  if (frame_text) frame_text_ = {sequence_, std::move(frame_text)};
  if (server_text) server_text_ = {sequence_, std::move(server_text)};
  newer_.notify_all();
}

LiveFeed::Text LiveFeed::Next(std::uint64_t* seen, int wait_ms) {
  std::unique_lock lock(mutex_);
  std::string text;
  if (*seen == 0) {  // all that is remembered first
    std::string rows;
    rows.reserve(history_bytes_ + history_.size());
    for (const std::string& row : history_) rows += (rows.empty() ? "" : ",") + row;
    text = fmt::format("retry: 1000\n\nevent: history\ndata: [{}]\n\n", rows);
  } else {
    newer_.wait_for(lock, std::chrono::milliseconds(wait_ms),
                    [&] { return closed_ || sequence_ > *seen; });
    if (closed_ || sequence_ <= *seen) return nullptr;
  }
  const bool server = server_text_.sequence > *seen, frame = frame_text_.sequence > *seen;
  *seen = sequence_;
  if (text.empty() && server != frame) return server ? server_text_.text : frame_text_.text;
  if (server) text += *server_text_.text;
  if (frame) text += *frame_text_.text;
  return std::make_shared<const std::string>(std::move(text));
}

void LiveFeed::Close() {
  const std::lock_guard lock(mutex_);
  closed_ = true;
  newer_.notify_all();
}

LiveFeed::Figures LiveFeed::figures(Clock::time_point now) const {
  const std::lock_guard lock(mutex_);
  Figures f;
  f.messages = messages_;
  f.refused = refused_;
  f.restarts = restarts_;
  if (messages_ > 0) f.age_s = SecondsSince(last_message_, now);
  if (session_ && now - last_session_ < kSession) f.session = session_;
  f.two_runs = last_other_ != Clock::time_point{} && now - last_other_ < kSession;
  return f;
}

}  // namespace mantle::tools
