#include "tools/mantle/lcm_bridge.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <lcm/lcm.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cassert>
#include <cstdio>
#include <exception>
#include <initializer_list>
#include <mantle/command_t.hpp>
#include <mantle/control_t.hpp>
#include <mantle/cycle_t.hpp>
#include <mantle/drives_t.hpp>
#include <mantle/energy_t.hpp>
#include <mantle/plan_t.hpp>
#include <mantle/reduced_state_t.hpp>
#include <mantle/sensors_t.hpp>
#include <mantle/session_t.hpp>
#include <mantle/shape_t.hpp>
#include <mantle/state_t.hpp>
#include <mantle/status_t.hpp>
#include <mantle/step_t.hpp>
#include <mantle/stepped_t.hpp>
#include <mantle/water_t.hpp>
#include <optional>
#include <stdexcept>
#include <type_traits>
#include <utility>
#include <vector>

#include "tools/mantle/bad_input.h"
#include "tools/mantle/output_file.h"
#include "tools/mantle/telemetry_fields.h"
#include "tools/mantle/telemetry_lengths.h"

namespace mantle::tools {
namespace {

constexpr std::string_view kProviders[] = {"udpm://", "memq://"};

template <typename T>
constexpr bool kIsValue = std::is_arithmetic_v<T> || std::is_same_v<T, std::string>;

// From plain arrays and lists to the generated ones, or back; the lists differ in type alone.
template <typename From, typename To>
void Copy(const From& from, To& to) {
  if constexpr (kIsValue<To>) {
    static_assert(std::is_same_v<From, To>, "a field has one type");
    to = from;
  } else {
    if constexpr (requires { to.resize(0); }) to.resize(std::size(from));
    assert(std::size(from) == std::size(to));
    for (std::size_t i = 0; i < std::size(from); ++i) Copy(from[i], to[i]);
  }
}

// The one length of lists that belong together.
std::int32_t Length(const char* lists, std::initializer_list<std::size_t> sizes) {
  for (const std::size_t size : sizes) {
    if (size == *sizes.begin()) continue;
    throw std::invalid_argument(
        fmt::format("{}: lists of {} and {} entries, must be equally long: one entry for each",
                    lists, *sizes.begin(), size));
  }
  return static_cast<std::int32_t>(*sizes.begin());
}

void SetLengths(const StateTelemetry& m, state_t* wire) {
  wire->num_arms = Length("MANTLE_STATE arms", {m.arm_name.size(), m.tip_position.size(),
                                                m.tip_quaternion.size(), m.tip_twist.size()});
  wire->num_cables = Length("MANTLE_STATE cables", {m.cable_name.size(), m.cable_length.size(),
                                                    m.cable_rate.size(), m.cable_tension.size()});
}

void SetLengths(const ReducedStateTelemetry& m, reduced_state_t* wire) {
  wire->num_q = Length("MANTLE_REDUCED_STATE q", {m.q.size()});
  wire->num_v = Length("MANTLE_REDUCED_STATE v", {m.v.size()});
}

void SetLengths(const PlanTelemetry& m, plan_t* wire) {
  wire->num_knots = Length("MANTLE_PLAN knots", {m.time.size(), m.tension.size(),
                                                 m.root_position.size(), m.tip_position.size()});
  wire->num_motors = wire->num_arms = 0;
  for (std::size_t k = 0; k < m.time.size(); ++k) {
    wire->num_motors = Length("MANTLE_PLAN motors", {m.tension[0].size(), m.tension[k].size()});
    wire->num_arms =
        Length("MANTLE_PLAN arms", {m.tip_position[0].size(), m.tip_position[k].size()});
  }
}

void SetLengths(const DrivesTelemetry& m, drives_t* wire) {
  wire->num_drives =
      Length("MANTLE_DRIVES drives",
             {m.motor_name.size(), m.node.size(), m.statusword.size(), m.torque_permille.size(),
              m.position_counts.size(), m.velocity_counts_s.size(), m.current_permille.size(),
              m.temperature_celsius.size(), m.target_torque_permille.size(),
              m.tension_estimate.size(), m.reeled_length.size()});
}

void SetLengths(const EnergyTelemetry& m, energy_t* wire) {
  wire->num_works = Length("MANTLE_ENERGY works", {m.work_name.size(), m.work.size()});
}

void SetLengths(const StatusTelemetry& m, status_t* wire) {
  wire->num_bins = Length("MANTLE_STATUS bins",
                          {m.bin_begin.size(), m.sync_lateness.size(), m.command_time.size()});
}

// A node more than spans for each arm, and for the mantle.
std::int32_t Spans(const char* lists, std::size_t nodes, std::size_t bodies,
                   std::initializer_list<std::size_t> sizes) {
  const std::int32_t spans = Length(lists, sizes);
  if (nodes != *sizes.begin() + bodies) {
    throw std::invalid_argument(fmt::format("{}: {} of {} bodies with {} nodes, must be {}", lists,
                                            spans, bodies, nodes, nodes - bodies));
  }
  return spans;
}

void SetLengths(const ShapeTelemetry& m, shape_t* wire) {
  wire->num_arms = Length("MANTLE_SHAPE arms", {m.arm_name.size(), m.arm_nodes.size()});
  wire->num_nodes = Length("MANTLE_SHAPE nodes", {m.arc_length.size(), m.position.size(),
                                                  m.quaternion.size(), m.radius.size()});
  wire->num_spans = Spans("MANTLE_SHAPE spans", m.position.size(), m.arm_name.size(),
                          {m.strain.size(), m.stress.size()});
  wire->num_mantle_nodes =
      Length("MANTLE_SHAPE mantle_nodes", {m.mantle_arc_length.size(), m.mantle_profile.size()});
  wire->num_mantle_spans =
      Spans("MANTLE_SHAPE mantle_spans", m.mantle_profile.size(), m.mantle_profile.empty() ? 0 : 1,
            {m.mantle_strain.size(), m.mantle_stress.size()});
  wire->num_rigid_points = Length("MANTLE_SHAPE rigid_points", {m.rigid_profile.size()});
  wire->num_cables = Length("MANTLE_SHAPE cables",
                            {m.cable_name.size(), m.cable_points.size(), m.cable_tension.size()});
  wire->num_cable_points = Length("MANTLE_SHAPE cable_points", {m.cable_position.size()});
}

void SetLengths(const ControlTelemetry& m, control_t* wire) {
  wire->num_motors =
      Length("MANTLE_CONTROL motors",
             {m.motor_name.size(), m.commanded_tension.size(), m.actual_tension.size()});
  wire->num_errors = Length("MANTLE_CONTROL errors", {m.estimate_error.size()});
  wire->num_deviations = 0;
  if (m.deviation.empty()) return;
  wire->num_deviations =
      Length("MANTLE_CONTROL deviations", {m.estimate_error.size(), m.deviation.size()});
}

void SetLengths(const WaterTelemetry& m, water_t* wire) {
  wire->num_nodes = Length("MANTLE_WATER nodes", {m.drag.size()});
}

void SetLengths(const SessionTelemetry& m, session_t* wire) {
  wire->num_waypoints = Length("MANTLE_SESSION waypoints", {m.waypoint.size()});
}

void SetLengths(const SensorsTelemetry& m, sensors_t* wire) {
  wire->num_q = Length("MANTLE_SENSORS q", {m.q.size()});
  wire->num_v = Length("MANTLE_SENSORS v", {m.v.size()});
  wire->num_cables = Length("MANTLE_SENSORS cables", {m.cable_length.size(), m.cable_rate.size()});
  wire->num_measurements = Length(
      "MANTLE_SENSORS measurements",
      {m.instrument.size(), m.measured_time.size(), m.measured_size.size(), m.measured.size()});
}

void SetLengths(const CommandTelemetry& m, command_t* wire) {
  wire->num_motors = Length("MANTLE_COMMAND motors", {m.tension.size()});
}

void SetLengths(const CycleTelemetry&, cycle_t*) {}
void SetLengths(const StepTelemetry&, step_t*) {}
void SetLengths(const SteppedTelemetry&, stepped_t*) {}

template <typename Plain, typename Wire>
bool Decode(std::span<const std::uint8_t> bytes, TelemetrySink& to, const char** why) {
  const auto refuse = [&](const char* reason) {
    if (why != nullptr) *why = reason;
    return false;
  };
  if (bytes.size() > kMaxMessage_bytes) return refuse("longer than any message of ours");
  const int size = static_cast<int>(bytes.size());
  std::int64_t hash = 0;
  if (__int64_t_decode_array(bytes.data(), 0, size, &hash, 1) < 0 || hash != Wire::getHash()) {
    return refuse("not of its channel's type");
  }
  // The generated code believes every count and length.
  if (!LengthsFit<Plain>(bytes.subspan(sizeof hash))) return refuse("a length beyond the message");
  Wire wire;
  if (wire.decode(bytes.data(), 0, size) != size) return refuse("not of its channel's type");
  Plain plain;
  VisitFields([](const char*, auto& field, const auto& other) { Copy(other, field); }, plain, wire);
  to.Write(plain);
  return true;
}

struct ChannelDecoder {
  const char* channel;
  bool (*decode)(std::span<const std::uint8_t>, TelemetrySink&, const char**);
};

constexpr ChannelDecoder kDecoders[] = {
    {StateTelemetry::kChannel, Decode<StateTelemetry, state_t>},
    {ReducedStateTelemetry::kChannel, Decode<ReducedStateTelemetry, reduced_state_t>},
    {PlanTelemetry::kChannel, Decode<PlanTelemetry, plan_t>},
    {DrivesTelemetry::kChannel, Decode<DrivesTelemetry, drives_t>},
    {EnergyTelemetry::kChannel, Decode<EnergyTelemetry, energy_t>},
    {StatusTelemetry::kChannel, Decode<StatusTelemetry, status_t>},
    {ShapeTelemetry::kChannel, Decode<ShapeTelemetry, shape_t>},
    {ControlTelemetry::kChannel, Decode<ControlTelemetry, control_t>},
    {WaterTelemetry::kChannel, Decode<WaterTelemetry, water_t>},
    {SessionTelemetry::kChannel, Decode<SessionTelemetry, session_t>},
    {SensorsTelemetry::kChannel, Decode<SensorsTelemetry, sensors_t>},
    {CommandTelemetry::kChannel, Decode<CommandTelemetry, command_t>},
    {CycleTelemetry::kChannel, Decode<CycleTelemetry, cycle_t>},
    {StepTelemetry::kChannel, Decode<StepTelemetry, step_t>},
    {SteppedTelemetry::kChannel, Decode<SteppedTelemetry, stepped_t>},
};

struct Closer {
  void operator()(lcm_t* lcm) const { lcm_destroy(lcm); }
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using LcmPointer = std::unique_ptr<lcm_t, Closer>;

// liblcm has its own words on standard error for what it refuses.
class QuietStandardError {
 public:
  QuietStandardError() : before_(dup(STDERR_FILENO)) {
    std::fflush(stderr);
    const int nothing = open("/dev/null", O_WRONLY | O_CLOEXEC);
    if (before_ >= 0 && nothing >= 0) dup2(nothing, STDERR_FILENO);
    if (nothing >= 0) close(nothing);
  }
  ~QuietStandardError() {
    std::fflush(stderr);
    if (before_ < 0) return;
    dup2(before_, STDERR_FILENO);
    close(before_);
  }
  QuietStandardError(const QuietStandardError&) = delete;
  QuietStandardError& operator=(const QuietStandardError&) = delete;

 private:
  int before_;
};

// An event's header in a log.
constexpr std::uint32_t kSyncWord = 0xEDA1DA01;
constexpr std::size_t kHeader_bytes = 28;

void PutBigEndian(std::uint64_t value, int bytes, std::uint8_t* to) {
  for (int i = 0; i < bytes; ++i) to[i] = static_cast<std::uint8_t>(value >> 8 * (bytes - 1 - i));
}

std::uint64_t GetBigEndian(const std::uint8_t* from, int bytes) {
  std::uint64_t value = 0;
  for (int i = 0; i < bytes; ++i) value = value << 8 | from[i];
  return value;
}

std::uint64_t CountEvents(std::string_view log) {
  std::uint64_t events = 0;
  for (; log.size() >= kHeader_bytes; ++events) {
    const auto* header = reinterpret_cast<const std::uint8_t*>(log.data());
    const std::uint64_t bytes = GetBigEndian(header + 20, 4) + GetBigEndian(header + 24, 4);
    log.remove_prefix(std::min<std::uint64_t>(log.size(), kHeader_bytes + bytes));
  }
  return events;
}

class Link final : public LcmLink {
 public:
  explicit Link(const LcmOptions& options) : log_name_(options.log_name) {
    if (!options.url.empty()) OpenUrl(options);
    if (options.log_folder) StartLog(*options.log_folder, {});
  }

  void Write(const StateTelemetry& m) override { Send(m, &state_); }
  void Write(const ReducedStateTelemetry& m) override { Send(m, &reduced_state_); }
  void Write(const PlanTelemetry& m) override { Send(m, &plan_); }
  void Write(const DrivesTelemetry& m) override { Send(m, &drives_); }
  void Write(const EnergyTelemetry& m) override { Send(m, &energy_); }
  void Write(const StatusTelemetry& m) override { Send(m, &status_); }
  void Write(const ShapeTelemetry& m) override { Send(m, &shape_); }
  void Write(const ControlTelemetry& m) override { Send(m, &control_); }
  void Write(const WaterTelemetry& m) override { Send(m, &water_); }
  void Write(const SessionTelemetry& m) override { Send(m, &session_); }
  void Write(const SensorsTelemetry& m) override { Send(m, &sensors_); }
  void Write(const CommandTelemetry& m) override { Send(m, &command_); }
  void Write(const CycleTelemetry& m) override { Send(m, &cycle_); }
  void Write(const StepTelemetry& m) override { Send(m, &step_); }
  void Write(const SteppedTelemetry& m) override { Send(m, &stepped_); }

  int Receive(int timeout_ms, TelemetrySink& to) override {
    assert(receiving_);
    const std::uint64_t before = counters_.received;
    receiver_ = &to;
    int wait_ms = timeout_ms;
    while (!thrown_ && lcm_handle_timeout(lcm_.get(), wait_ms) > 0) wait_ms = 0;
    receiver_ = nullptr;
    if (thrown_) std::rethrow_exception(std::exchange(thrown_, nullptr));
    return static_cast<int>(counters_.received - before);
  }

  void StartLog(const std::filesystem::path& folder, std::string_view begin) override {
    log_.emplace(folder, log_name_, begin);
    events_ = CountEvents(begin);
  }

  long FlushLog() override {
    assert(log_);
    log_->Flush();
    return log_->size_bytes();
  }

  void FinishLog() override {
    assert(log_);
    log_->Close();
    log_.reset();
  }

  const LcmCounters& counters() const override { return counters_; }

 private:
  void OpenUrl(const LcmOptions& options) {
    bool known = false;
    for (const std::string_view provider : kProviders) known |= options.url.starts_with(provider);
    if (!known) throw BadInput(fmt::format("--lcm: {}: must be {}", options.url, kLcmUrlHelp));
    {
      const QuietStandardError quiet;  // we say what is wrong
      lcm_.reset(lcm_create(options.url.c_str()));
    }
    bool open = lcm_ != nullptr;
    for (const ChannelDecoder& d : kDecoders) {
      if (!open || !options.receive) break;
      const auto& wanted = options.channels;
      if (!wanted.empty() && std::find(wanted.begin(), wanted.end(), d.channel) == wanted.end()) {
        continue;
      }
      lcm_subscription_t* heard = lcm_subscribe(lcm_.get(), d.channel, OnMessage, this);
      open = heard != nullptr &&
             lcm_subscription_set_queue_capacity(heard, options.queued_messages) == 0;
    }
    if (!open) {
      throw BadInput(fmt::format(
          "--lcm: {}: cannot be opened: must be {}, and this machine needs a route for multicast "
          "(`ip route` shows it; without a network: ip route add 224.0.0.0/4 dev lo)",
          options.url, kLcmUrlHelp));
    }
    receiving_ = options.receive;
  }

  // Runs inside liblcm, which no exception may cross.
  static void OnMessage(const lcm_recv_buf_t* message, const char* channel, void* self) {
    Link& link = *static_cast<Link*>(self);
    if (link.thrown_) return;
    try {
      const std::span bytes(static_cast<const std::uint8_t*>(message->data), message->data_size);
      const bool ours = DecodeTelemetry(channel, bytes, *link.receiver_);
      ++(ours ? link.counters_.received : link.counters_.malformed);
    } catch (...) {
      link.thrown_ = std::current_exception();
    }
  }

  template <typename Plain, typename Wire>
  void Send(const Plain& plain, Wire* wire) {
    SetLengths(plain, wire);
    VisitFields([](const char*, const auto& field, auto& other) { Copy(field, other); }, plain,
                *wire);
    const int size = wire->getEncodedSize();
    if (static_cast<std::size_t>(size) > kMaxMessage_bytes) {
      throw BadInput(fmt::format(
          "{}: a message of {} bytes, must be at most {}: fewer knots, arms, nodes or cables",
          Plain::kChannel, size, kMaxMessage_bytes));
    }
    bytes_.resize(static_cast<std::size_t>(size));
    if (wire->encode(bytes_.data(), 0, size) != size) {
      throw std::invalid_argument(std::string(Plain::kChannel) + ": a text holds a zero byte");
    }
    if (log_) Append(Plain::kChannel, plain.utime);
    if (lcm_ &&
        lcm_publish(lcm_.get(), Plain::kChannel, bytes_.data(), static_cast<unsigned>(size)) != 0) {
      ++counters_.publish_failures;
    }
    ++counters_.written;
  }

  void Append(std::string_view channel, std::int64_t utime) {
    record_.resize(kHeader_bytes + channel.size() + bytes_.size());
    PutBigEndian(kSyncWord, 4, record_.data());
    PutBigEndian(events_++, 8, record_.data() + 4);
    PutBigEndian(static_cast<std::uint64_t>(utime), 8, record_.data() + 12);
    PutBigEndian(channel.size(), 4, record_.data() + 20);
    PutBigEndian(bytes_.size(), 4, record_.data() + 24);
    const auto behind = std::copy(channel.begin(), channel.end(), record_.begin() + kHeader_bytes);
    std::copy(bytes_.begin(), bytes_.end(), behind);
    log_->Write({reinterpret_cast<const char*>(record_.data()), record_.size()});
  }

  std::string log_name_;
  LcmCounters counters_;
  std::uint64_t events_{0};  ///< of the log
  bool receiving_{false};
  TelemetrySink* receiver_{nullptr};
  std::exception_ptr thrown_;
  std::vector<std::uint8_t> bytes_, record_;
  state_t state_;
  reduced_state_t reduced_state_;
  plan_t plan_;
  drives_t drives_;
  energy_t energy_;
  status_t status_;
  shape_t shape_;
  control_t control_;
  water_t water_;
  session_t session_;
  sensors_t sensors_;
  command_t command_;
  cycle_t cycle_;
  step_t step_;
  stepped_t stepped_;
  std::optional<OutputFile> log_;
  LcmPointer lcm_;
};

}  // namespace

std::unique_ptr<LcmLink> OpenLcm(const LcmOptions& options) {
  return std::make_unique<Link>(options);
}

LogEnd ReadEventLog(const std::filesystem::path& file,
                    const std::function<void(const LogEvent&)>& on_event) {
  // Never waits for the other end of a pipe.
  const int fd = open(file.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  struct stat status {};
  const bool regular = fd >= 0 && fstat(fd, &status) == 0 && S_ISREG(status.st_mode);
  const std::unique_ptr<std::FILE, Closer> in(regular ? fdopen(fd, "rb") : nullptr);
  if (!in) {
    if (fd >= 0) close(fd);
    throw BadInput(file.string() + ": cannot be read: must be an LCM event log");
  }
  const std::int64_t size = status.st_size;
  LogEnd end;
  std::int64_t at = 0;
  std::vector<std::uint8_t> event;
  std::uint8_t header[kHeader_bytes];
  while (size - at >= std::ssize(header) &&
         std::fread(header, 1, sizeof header, in.get()) == sizeof header) {
    const auto name_bytes = static_cast<std::int64_t>(GetBigEndian(header + 20, 4));
    const auto data_bytes = static_cast<std::int64_t>(GetBigEndian(header + 24, 4));
    const std::int64_t bytes = name_bytes + data_bytes;
    if (GetBigEndian(header, 4) != kSyncWord || bytes > size - at - std::ssize(header) ||
        bytes > kMaxEvent_bytes) {
      break;
    }
    event.resize(static_cast<std::size_t>(bytes));
    if (std::fread(event.data(), 1, event.size(), in.get()) != event.size()) break;
    const auto name_size = static_cast<std::size_t>(name_bytes);
    on_event({static_cast<std::int64_t>(GetBigEndian(header + 12, 8)),
              {reinterpret_cast<const char*>(event.data()), name_size},
              std::span(event).subspan(name_size)});
    at += std::ssize(header) + bytes;
    ++end.events;
  }
  if (at != size) end.damaged_at_byte = at;
  return end;
}

bool DecodeTelemetry(std::string_view channel, std::span<const std::uint8_t> bytes,
                     TelemetrySink& to, const char** why) {
  for (const ChannelDecoder& d : kDecoders) {
    if (channel == d.channel) return d.decode(bytes, to, why);
  }
  if (why != nullptr) *why = "not a channel of ours";
  return false;
}

}  // namespace mantle::tools
