#include "firmware_sim/bus/socket_can_bus.h"

#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <system_error>
#include <utility>
#include <vector>

#include "firmware_sim/bus/socket_time.h"

namespace mantle::firmware_sim {

namespace {

constexpr std::size_t kBatch = 64;
constexpr int kReceiveBufferBytes = 8 << 20;
// How often a dead interface is looked for while waiting.
constexpr std::int64_t kRecoveryPoll_us = 20'000;

can_frame ToKernel(const CanFrame& frame) {
  can_frame out{};
  out.can_id = frame.id;
  if (frame.extended) out.can_id |= CAN_EFF_FLAG;
  if (frame.remote) out.can_id |= CAN_RTR_FLAG;
  if (frame.error) out.can_id |= CAN_ERR_FLAG;
  out.len = std::min<std::uint8_t>(frame.size, 8);
  std::copy(frame.data.begin(), frame.data.end(), out.data);
  return out;
}

CanFrame FromKernel(const can_frame& in) {
  CanFrame frame;
  frame.error = (in.can_id & CAN_ERR_FLAG) != 0;
  frame.extended = !frame.error && (in.can_id & CAN_EFF_FLAG) != 0;
  frame.remote = !frame.error && (in.can_id & CAN_RTR_FLAG) != 0;
  frame.id = in.can_id & (frame.error      ? CAN_ERR_MASK
                          : frame.extended ? CAN_EFF_MASK
                                           : CAN_SFF_MASK);
  frame.size = std::min<std::uint8_t>(in.len, 8);
  if (!frame.remote) std::copy_n(in.data, frame.size, frame.data.begin());
  return frame;
}

class SocketCanBus final : public Bus {
 public:
  SocketCanBus(const std::string& interface, std::span<const CanFilter> filters) {
    std::memcpy(name_.data(), interface.c_str(), std::min(interface.size(), kMaxInterfaceName));
    for (const CanFilter& filter : filters) {
      filters_.push_back({.can_id = filter.id, .can_mask = filter.mask});
    }
    const int error = Open();
    if (error != 0) {
      throw std::system_error(error, std::generic_category(), "CAN interface '" + interface + "'");
    }
    status_ = InterfaceStatus();
  }
  SocketCanBus(const SocketCanBus&) = delete;
  SocketCanBus& operator=(const SocketCanBus&) = delete;
  ~SocketCanBus() override {
    if (socket_ >= 0) close(socket_);
  }

  BusStatus Send(std::span<const CanFrame> frames) override {
    std::size_t done = 0;
    bool retried = false;
    BusStatus status = Recover();
    while (status == BusStatus::kOk && done < frames.size()) {
      const std::size_t count = std::min(kBatch, frames.size() - done);
      for (std::size_t i = 0; i < count; ++i) {
        transmit_frames_[i] = ToKernel(frames[done + i]);
        transmit_vectors_[i] = {&transmit_frames_[i], sizeof(can_frame)};
        transmit_headers_[i] = {};
        transmit_headers_[i].msg_hdr.msg_iov = &transmit_vectors_[i];
        transmit_headers_[i].msg_hdr.msg_iovlen = 1;
      }
      const int sent =
          sendmmsg(socket_, transmit_headers_.data(), static_cast<unsigned>(count), MSG_DONTWAIT);
      if (sent > 0) {
        done += static_cast<std::size_t>(sent);
      } else if (errno != EINTR) {
        status = Note(errno);
        // A pending error of an outage that is over costs one more call, not the frames.
        if (status == BusStatus::kOk && std::exchange(retried, true)) status = BusStatus::kDown;
      }
    }
    counters_.sent += done;
    counters_.send_dropped += frames.size() - done;
    return status;
  }

  std::size_t Receive(std::span<CanFrame> frames) override {
    std::size_t done = 0;
    bool retried = false;
    // What was queued before the link went down is still there to be read.
    if (Recover() == BusStatus::kGone) return 0;
    while (done < frames.size()) {
      const std::size_t count = std::min(kBatch, frames.size() - done);
      for (std::size_t i = 0; i < count; ++i) {
        receive_vectors_[i] = {&receive_frames_[i], sizeof(can_frame)};
        msghdr& header = receive_headers_[i].msg_hdr;
        header = {};
        header.msg_iov = &receive_vectors_[i];
        header.msg_iovlen = 1;
        header.msg_control = control_[i].bytes.data();
        header.msg_controllen = control_[i].bytes.size();
      }
      const int got = recvmmsg(socket_, receive_headers_.data(), static_cast<unsigned>(count),
                               MSG_DONTWAIT, nullptr);
      if (got <= 0) {
        if (errno == EINTR) continue;
        // A pending error hides the queue behind it for one call.
        if (errno == EAGAIN || Note(errno) == BusStatus::kGone || std::exchange(retried, true)) {
          break;
        }
        continue;
      }
      for (int i = 0; i < got; ++i) frames[done++] = Accept(static_cast<std::size_t>(i));
      if (static_cast<std::size_t>(got) < count) break;
    }
    return done;
  }

  BusStatus Wait(std::int64_t timeout_us) override {
    timeout_us = std::max<std::int64_t>(timeout_us, 0);
    while (Recover() != BusStatus::kOk) {
      const std::int64_t nap_us = std::min(timeout_us, kRecoveryPoll_us);
      if (nap_us == 0) return status_;
      SleepFor(nap_us);
      timeout_us -= nap_us;
    }
    pollfd waiting{.fd = socket_, .events = POLLIN, .revents = 0};
    const timespec limit = ToTimespec(timeout_us);
    if (ppoll(&waiting, 1, &limit, nullptr) > 0 && (waiting.revents & POLLERR) != 0) {
      const int error = TakeError();
      return Note(error != 0 ? error : ENETDOWN);
    }
    return status_;
  }

  BusCounters counters() const override { return counters_; }

 private:
  struct Control {
    alignas(cmsghdr)
        std::array<char, CMSG_SPACE(sizeof(timespec)) + CMSG_SPACE(sizeof(std::uint32_t))> bytes;
  };

  // Returns 0 or an errno; on failure the bus has no socket.
  int Open() {
    const int fd = socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW);
    if (fd < 0) return errno;
    const int on = 1;
    const can_err_mask_t every_error = CAN_ERR_MASK;
    sockaddr_can address{};
    address.can_family = AF_CAN;
    ifreq request{};
    std::memcpy(request.ifr_name, name_.data(), name_.size());
    bool good = ioctl(fd, SIOCGIFINDEX, &request) == 0;
    address.can_ifindex = request.ifr_ifindex;
    good = good &&
           setsockopt(fd, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, &every_error, sizeof(every_error)) == 0;
    if (good && !filters_.empty()) {
      good = setsockopt(fd, SOL_CAN_RAW, CAN_RAW_FILTER, filters_.data(),
                        static_cast<socklen_t>(filters_.size() * sizeof(can_filter))) == 0;
    }
    good = good && setsockopt(fd, SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof(on)) == 0 &&
           setsockopt(fd, SOL_SOCKET, SO_RXQ_OVFL, &on, sizeof(on)) == 0;
    // As large a receive buffer as we may have; the forced one needs CAP_NET_ADMIN.
    if (setsockopt(fd, SOL_SOCKET, SO_RCVBUFFORCE, &kReceiveBufferBytes, sizeof(int)) != 0) {
      setsockopt(fd, SOL_SOCKET, SO_RCVBUF, &kReceiveBufferBytes, sizeof(int));
    }
    good = good && bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0;
    if (!good) {
      const int error = errno;
      close(fd);
      return error;
    }
    socket_ = fd;
    index_ = address.can_ifindex;
    overflow_ = 0;
    return 0;
  }

  BusStatus InterfaceStatus() const {
    ifreq request{};
    std::memcpy(request.ifr_name, name_.data(), name_.size());
    if (socket_ < 0 || ioctl(socket_, SIOCGIFINDEX, &request) != 0 ||
        request.ifr_ifindex != index_) {
      return BusStatus::kGone;
    }
    if (ioctl(socket_, SIOCGIFFLAGS, &request) != 0) return BusStatus::kGone;
    return (request.ifr_flags & IFF_UP) != 0 ? BusStatus::kOk : BusStatus::kDown;
  }

  BusStatus Recover() {
    if (status_ == BusStatus::kOk) return status_;
    BusStatus now = InterfaceStatus();
    if (now == BusStatus::kGone) {
      const int dead = socket_;
      socket_ = -1;
      if (Open() == 0) {
        now = InterfaceStatus();
        if (dead >= 0) close(dead);
      } else {
        socket_ = dead;
      }
    }
    if (now == BusStatus::kOk) {
      ++counters_.recoveries;
      TakeError();  // the outage's, or that of binding to an interface that was down
    }
    status_ = now;
    return status_;
  }

  int TakeError() const {
    int error = 0;
    socklen_t size = sizeof(error);
    getsockopt(socket_, SOL_SOCKET, SO_ERROR, &error, &size);
    return error;
  }

  BusStatus Note(int error) {
    switch (error) {
      case ENOBUFS:
      case EAGAIN:
        return BusStatus::kFull;
      case ENETDOWN:
      case ENODEV:
      case ENXIO:
        status_ = InterfaceStatus();
        // The flags may already say up again: the outage is over, and counted.
        if (status_ == BusStatus::kOk) ++counters_.recoveries;
        return status_;
      default:
        return BusStatus::kDown;
    }
  }

  CanFrame Accept(std::size_t i) {
    CanFrame frame = FromKernel(receive_frames_[i]);
    msghdr& header = receive_headers_[i].msg_hdr;
    for (cmsghdr* part = CMSG_FIRSTHDR(&header); part; part = CMSG_NXTHDR(&header, part)) {
      if (part->cmsg_level != SOL_SOCKET) continue;
      if (part->cmsg_type == SO_TIMESTAMPNS) {
        timespec stamp{};
        std::memcpy(&stamp, CMSG_DATA(part), sizeof(stamp));
        frame.time_us = ToMicroseconds(stamp);
      } else if (part->cmsg_type == SO_RXQ_OVFL) {
        std::uint32_t total = 0;
        std::memcpy(&total, CMSG_DATA(part), sizeof(total));
        counters_.receive_dropped += total - overflow_;  // modulo 2^32, as the kernel counts
        overflow_ = total;
      }
    }
    ++counters_.received;
    if (frame.error) ++counters_.error_frames;
    return frame;
  }

  std::array<char, IFNAMSIZ> name_{};
  std::vector<can_filter> filters_;
  int socket_{-1};
  int index_{0};
  std::uint32_t overflow_{0};
  BusStatus status_{BusStatus::kOk};
  BusCounters counters_{};
  std::array<can_frame, kBatch> transmit_frames_{};
  std::array<iovec, kBatch> transmit_vectors_{};
  std::array<mmsghdr, kBatch> transmit_headers_{};
  std::array<can_frame, kBatch> receive_frames_{};
  std::array<iovec, kBatch> receive_vectors_{};
  std::array<mmsghdr, kBatch> receive_headers_{};
  std::array<Control, kBatch> control_{};
};

}  // namespace

std::unique_ptr<Bus> OpenSocketCanBus(const std::string& interface,
                                      std::span<const CanFilter> filters) {
  return std::make_unique<SocketCanBus>(interface, filters);
}

}  // namespace mantle::firmware_sim
