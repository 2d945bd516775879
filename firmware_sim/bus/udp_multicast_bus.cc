#include "firmware_sim/bus/udp_multicast_bus.h"

#include <arpa/inet.h>
#include <net/if.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <system_error>
#include <vector>

#include "firmware_sim/bus/multicast_frame.h"
#include "firmware_sim/bus/socket_time.h"

namespace mantle::firmware_sim {

namespace {

constexpr std::size_t kBatch = 32;
// Room for keys that later versions of python-can may add.
constexpr std::size_t kDatagramBytes = 1024;
constexpr int kReceiveBufferBytes = 8 << 20;

class UdpMulticastBus final : public Bus {
 public:
  UdpMulticastBus(const UdpMulticastAddress& address, std::span<const CanFilter> filters)
      : filters_(filters.begin(), filters.end()) {
    group_.sin_family = AF_INET;
    group_.sin_port = htons(address.port);
    Demand(inet_pton(AF_INET, address.group.c_str(), &group_.sin_addr) == 1, EINVAL, address);
    ip_mreqn membership{};
    membership.imr_multiaddr = group_.sin_addr;
    if (!address.interface.empty()) {
      membership.imr_ifindex = static_cast<int>(if_nametoindex(address.interface.c_str()));
      Demand(membership.imr_ifindex != 0, errno, address);
    }
    receiver_ = Socket(address);
    sender_ = Socket(address);
    const int on = 1;
    const int hops = 1;
    const auto set = [&](int fd, int level, int name, const auto& value) {
      Demand(setsockopt(fd, level, name, &value, sizeof(value)) == 0, errno, address);
    };
    set(receiver_, SOL_SOCKET, SO_REUSEADDR, on);
    set(receiver_, SOL_SOCKET, SO_TIMESTAMPNS, on);
    set(receiver_, SOL_SOCKET, SO_RXQ_OVFL, on);
    if (setsockopt(receiver_, SOL_SOCKET, SO_RCVBUFFORCE, &kReceiveBufferBytes, sizeof(int)) != 0) {
      setsockopt(receiver_, SOL_SOCKET, SO_RCVBUF, &kReceiveBufferBytes, sizeof(int));
    }
    Demand(bind(receiver_, reinterpret_cast<const sockaddr*>(&group_), sizeof(group_)) == 0, errno,
           address);
    // Without this a socket hears what any program of this machine joined, on any interface.
    const int off = 0;
    set(receiver_, IPPROTO_IP, IP_MULTICAST_ALL, off);
    set(receiver_, IPPROTO_IP, IP_ADD_MEMBERSHIP, membership);
    set(sender_, IPPROTO_IP, IP_MULTICAST_TTL, hops);
    set(sender_, IPPROTO_IP, IP_MULTICAST_LOOP, on);
    if (membership.imr_ifindex != 0) set(sender_, IPPROTO_IP, IP_MULTICAST_IF, membership);
    Demand(connect(sender_, reinterpret_cast<const sockaddr*>(&group_), sizeof(group_)) == 0, errno,
           address);
    socklen_t size = sizeof(own_);
    Demand(getsockname(sender_, reinterpret_cast<sockaddr*>(&own_), &size) == 0, errno, address);
  }
  UdpMulticastBus(const UdpMulticastBus&) = delete;
  UdpMulticastBus& operator=(const UdpMulticastBus&) = delete;
  ~UdpMulticastBus() override { Close(); }

  BusStatus Send(std::span<const CanFrame> frames) override {
    std::size_t done = 0;
    BusStatus status = BusStatus::kOk;
    const std::int64_t now_us = RealTime_us();
    while (status == BusStatus::kOk && done < frames.size()) {
      const std::size_t count = std::min(kBatch, frames.size() - done);
      for (std::size_t i = 0; i < count; ++i) {
        CanFrame frame = frames[done + i];
        frame.time_us = now_us;
        vectors_[i] = {transmit_[i].data(), EncodeMulticastFrame(frame, transmit_[i])};
        headers_[i] = {};
        headers_[i].msg_hdr.msg_iov = &vectors_[i];
        headers_[i].msg_hdr.msg_iovlen = 1;
      }
      const int sent =
          sendmmsg(sender_, headers_.data(), static_cast<unsigned>(count), MSG_DONTWAIT);
      if (sent > 0) {
        done += static_cast<std::size_t>(sent);
      } else if (errno != EINTR) {
        status = errno == EAGAIN || errno == ENOBUFS ? BusStatus::kFull : BusStatus::kDown;
      }
    }
    counters_.sent += done;
    counters_.send_dropped += frames.size() - done;
    return Note(status);
  }

  std::size_t Receive(std::span<CanFrame> frames) override {
    std::size_t done = 0;
    // No more datagrams than there is room for frames: one taken off the socket cannot go back, and
    // whoever floods the group with rubbish does not hold up the caller.
    for (std::size_t seen = 0; seen < frames.size();) {
      const std::size_t count = std::min(kBatch, frames.size() - seen);
      for (std::size_t i = 0; i < count; ++i) {
        vectors_[i] = {receive_[i].data(), receive_[i].size()};
        msghdr& header = headers_[i].msg_hdr;
        header = {};
        header.msg_name = &sources_[i];
        header.msg_namelen = sizeof(sockaddr_in);
        header.msg_iov = &vectors_[i];
        header.msg_iovlen = 1;
        header.msg_control = control_[i].bytes.data();
        header.msg_controllen = control_[i].bytes.size();
      }
      const int got =
          recvmmsg(receiver_, headers_.data(), static_cast<unsigned>(count), MSG_DONTWAIT, nullptr);
      if (got < 0 && errno == EINTR) continue;
      if (got <= 0) break;
      for (int i = 0; i < got; ++i) {
        if (Accept(static_cast<std::size_t>(i), frames[done])) ++done;
      }
      seen += static_cast<std::size_t>(got);
      if (static_cast<std::size_t>(got) < count) break;
    }
    return done;
  }

  BusStatus Wait(std::int64_t timeout_us) override {
    pollfd waiting{.fd = receiver_, .events = POLLIN, .revents = 0};
    const timespec limit = ToTimespec(std::max<std::int64_t>(timeout_us, 0));
    ppoll(&waiting, 1, &limit, nullptr);
    return status_;
  }

  BusCounters counters() const override { return counters_; }

 private:
  struct Control {
    alignas(cmsghdr)
        std::array<char, CMSG_SPACE(sizeof(timespec)) + CMSG_SPACE(sizeof(std::uint32_t))> bytes;
  };

  void Close() {
    if (receiver_ >= 0) close(receiver_);
    if (sender_ >= 0) close(sender_);
  }

  void Demand(bool good, int error, const UdpMulticastAddress& address) {
    if (good) return;
    Close();
    throw std::system_error(error, std::generic_category(),
                            "multicast bus " + address.group + ":" + std::to_string(address.port) +
                                (address.interface.empty() ? "" : "@" + address.interface));
  }

  int Socket(const UdpMulticastAddress& address) {
    const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    Demand(fd >= 0, errno, address);
    return fd;
  }

  BusStatus Note(BusStatus status) {
    if (status == BusStatus::kOk && status_ == BusStatus::kDown) ++counters_.recoveries;
    if (status != BusStatus::kFull) status_ = status;
    return status;
  }

  // True where the datagram is somebody else's frame that passes the filters.
  bool Accept(std::size_t i, CanFrame& out) {
    CanFrame frame;
    std::int64_t stamp_us = 0;
    msghdr& header = headers_[i].msg_hdr;
    for (cmsghdr* part = CMSG_FIRSTHDR(&header); part; part = CMSG_NXTHDR(&header, part)) {
      if (part->cmsg_level != SOL_SOCKET) continue;
      if (part->cmsg_type == SO_TIMESTAMPNS) {
        timespec stamp{};
        std::memcpy(&stamp, CMSG_DATA(part), sizeof(stamp));
        stamp_us = ToMicroseconds(stamp);
      } else if (part->cmsg_type == SO_RXQ_OVFL) {
        std::uint32_t total = 0;
        std::memcpy(&total, CMSG_DATA(part), sizeof(total));
        counters_.receive_dropped += total - overflow_;  // modulo 2^32, as the kernel counts
        overflow_ = total;
      }
    }
    if (sources_[i].sin_port == own_.sin_port &&
        sources_[i].sin_addr.s_addr == own_.sin_addr.s_addr) {
      return false;
    }
    const bool whole = (header.msg_flags & MSG_TRUNC) == 0;
    const MulticastDecode decode =
        whole ? DecodeMulticastFrame({receive_[i].data(), headers_[i].msg_len}, frame)
              : MulticastDecode::kMalformed;
    if (decode == MulticastDecode::kMalformed) ++counters_.malformed;
    if (decode != MulticastDecode::kFrame || !Passes(filters_, frame)) return false;
    if (stamp_us != 0) frame.time_us = stamp_us;
    ++counters_.received;
    if (frame.error) ++counters_.error_frames;
    out = frame;
    return true;
  }

  std::vector<CanFilter> filters_;
  sockaddr_in group_{};
  sockaddr_in own_{};
  int receiver_{-1};
  int sender_{-1};
  std::uint32_t overflow_{0};
  BusStatus status_{BusStatus::kOk};
  BusCounters counters_{};
  std::array<std::array<std::uint8_t, kMulticastFrameBytes>, kBatch> transmit_{};
  std::array<std::array<std::uint8_t, kDatagramBytes>, kBatch> receive_{};
  std::array<iovec, kBatch> vectors_{};
  std::array<mmsghdr, kBatch> headers_{};
  std::array<sockaddr_in, kBatch> sources_{};
  std::array<Control, kBatch> control_{};
};

}  // namespace

std::unique_ptr<Bus> OpenUdpMulticastBus(const UdpMulticastAddress& address,
                                         std::span<const CanFilter> filters) {
  return std::make_unique<UdpMulticastBus>(address, filters);
}

}  // namespace mantle::firmware_sim
