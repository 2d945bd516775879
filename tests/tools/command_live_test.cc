#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <nlohmann/json.hpp>
#include <random>
#include <thread>

#include "tests/firmware_sim/vcan.h"
#include "tests/tools/multicast.h"
#include "tests/tools/program.h"

namespace mantle::testing_tools {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;
namespace fs = std::filesystem;

// On a machine that does other things as well.
constexpr auto kPatience = 30s;

/// A connection to the server on this port.
class Client {
 public:
  explicit Client(int port) : fd_(socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    inet_pton(AF_INET, "127.0.0.1", &address.sin_addr);
    open_ = connect(fd_, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0;
  }
  ~Client() { close(fd_); }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  bool open() const { return open_; }
  void Send(const std::string& text) const {
    (void)send(fd_, text.data(), text.size(), MSG_NOSIGNAL);
  }
  /// All that comes until `enough` holds, the other end closes, or patience ends.
  template <typename Enough>
  std::string Read(Enough enough, Clock::duration patience = kPatience) const {
    std::string got;
    char buffer[65536];
    const auto end = Clock::now() + patience;
    while (!enough(got) && Clock::now() < end) {
      pollfd waits{fd_, POLLIN, 0};
      if (poll(&waits, 1, 100) <= 0) continue;
      const auto n = recv(fd_, buffer, sizeof buffer, 0);
      if (n <= 0) break;
      got.append(buffer, static_cast<std::size_t>(n));
    }
    return got;
  }

 private:
  int fd_;
  bool open_{false};
};

/// `mantle live` on a port that is free, and what it answers.
class LiveServer {
 public:
  LiveServer(const fs::path& folder, std::vector<std::string> arguments)
      : out_(folder / "live.txt") {
    std::vector<std::string> words{
        tests::BinaryPath("mantle"),     "live", "--port", "0", "--lcm", Url(), "--record-to",
        (folder / "recordings").string()};
    words.insert(words.end(), arguments.begin(), arguments.end());
    process_ = std::make_unique<firmware_sim::Process>(words, out_.string());
    const auto end = Clock::now() + kPatience;
    while (port_ == 0 && Clock::now() < end) {
      std::this_thread::sleep_for(20ms);
      const std::string text = ReadFile(out_);
      const auto at = text.find("127.0.0.1:");
      if (at != text.npos && text.find('/', at) != text.npos)
        port_ = std::stoi(text.substr(at + 10));
    }
  }

  int port() const { return port_; }
  firmware_sim::Process& process() { return *process_; }
  std::string Host() const { return fmt::format("127.0.0.1:{}", port_); }

  std::string Get(const std::string& path, const std::string& headers = "") const {
    return Ask(fmt::format("GET {} HTTP/1.1\r\nHost: {}\r\n{}Connection: close\r\n\r\n", path,
                           Host(), headers));
  }
  std::string Press(const std::string& button,
                    const std::string& headers = "X-Mantle: live\r\n") const {
    return Ask(fmt::format(
        "POST /press/{} HTTP/1.1\r\nHost: {}\r\n{}Content-Length: 0\r\nConnection: close\r\n\r\n",
        button, Host(), headers));
  }
  std::string Ask(const std::string& request) const {
    const Client client(port_);
    client.Send(request);
    return client.Read([](const std::string&) { return false; });
  }
  /// Times of the frames that a viewer gets, once there are so many.
  std::vector<double> Frames(std::size_t count) const {
    const Client viewer(port_);
    viewer.Send(fmt::format("GET /events HTTP/1.1\r\nHost: {}\r\n\r\n", Host()));
    std::vector<double> times;
    viewer.Read([&](const std::string& got) {
      times.clear();
      const std::string mark = "event: frame\ndata: {\"time\":";
      for (auto at = got.find(mark); at != got.npos; at = got.find(mark, at + 1)) {
        if (got.find(',', at) != got.npos) times.push_back(std::stod(got.substr(at + mark.size())));
      }
      return times.size() >= count;
    });
    return times;
  }

 private:
  fs::path out_;
  std::unique_ptr<firmware_sim::Process> process_;
  int port_{0};
};

std::vector<std::string> RunArguments(const fs::path& folder, const char* duration) {
  return {tests::SourcePath("scenes/reach.toml"),
          "--set",
          std::string("time.duration=") + duration,
          "--controller",
          "pid",
          "--out",
          (folder / "out").string()};
}

// Until the file is there; the run that leaves it is another process.
bool Appears(const fs::path& file) {
  const auto end = Clock::now() + kPatience;
  while (!fs::exists(file) && Clock::now() < end) std::this_thread::sleep_for(50ms);
  return fs::exists(file);
}

void ExpectStoppedRun(const fs::path& folder) {
  ASSERT_TRUE(Appears(folder / "out.partial" / "summary.json"));
  const auto summary = ReadJson(folder / "out.partial" / "summary.json");
  EXPECT_EQ(summary["reason"], "interrupted");
  EXPECT_FALSE(summary["complete"].get<bool>());
  EXPECT_GT(summary["sim_time_s"].get<double>(), 0);
  EXPECT_FALSE(fs::exists(folder / "out"));
}

TEST(MantleLive, AnswersItsOwnPageAndNobodyElses) {
  if (!MulticastWorks()) GTEST_SKIP() << kNoMulticast;
  const auto folder = FreshFolder("live_requests");
  LiveServer live(folder, {});
  ASSERT_GT(live.port(), 0);
  const std::string page = live.Get("/");
  EXPECT_TRUE(page.starts_with("HTTP/1.1 200")) << page.substr(0, 300);
  EXPECT_NE(page.find("connect-src 'self'"), page.npos);
  EXPECT_EQ(page.find("connect-src 'none'"), page.npos);
  EXPECT_NE(page.find("X-Frame-Options: DENY"), page.npos);
  EXPECT_TRUE(live.Get("/nothing").starts_with("HTTP/1.1 404"));
  EXPECT_TRUE(live.Press("nothing").starts_with("HTTP/1.1 404"));
  for (const std::string path : {"/", "/events"}) {
    EXPECT_TRUE(
        live.Ask("GET " + path + " HTTP/1.1\r\nHost: evil.example\r\nConnection: close\r\n\r\n")
            .starts_with("HTTP/1.1 403"))
        << path;
  }
  EXPECT_TRUE(live.Get("/events", "Origin: http://evil.example\r\n").starts_with("HTTP/1.1 403"));
  EXPECT_TRUE(live.Get("/events", "Sec-Fetch-Site: cross-site\r\n").starts_with("HTTP/1.1 403"));
  EXPECT_TRUE(live.Press("record", "").starts_with("HTTP/1.1 403"));
  EXPECT_TRUE(live.Press("record", "X-Mantle: live\r\nOrigin: http://evil.example\r\n")
                  .starts_with("HTTP/1.1 403"));
  EXPECT_FALSE(fs::exists(folder / "recordings"));
  EXPECT_NE(live.Press("stop").find("no run says that it is there"), std::string::npos);
  live.process().Signal(SIGINT);
  EXPECT_EQ(live.process().Wait(), 0);
}

TEST(MantleLive, AViewerSeesTheRunMoveAndOneThatReadsNothingHoldsNobodyUp) {
  if (!MulticastWorks()) GTEST_SKIP() << kNoMulticast;
  const auto folder = FreshFolder("live_viewers");
  LiveServer live(folder, RunArguments(folder, "60"));
  ASSERT_GT(live.port(), 0);
  const Client stalled(live.port());
  stalled.Send(fmt::format("GET /events HTTP/1.1\r\nHost: {}\r\n\r\n", live.Host()));
  const std::vector<double> times = live.Frames(20);
  ASSERT_GE(times.size(), 20U);
  for (std::size_t i = 1; i < times.size(); ++i) EXPECT_GT(times[i], times[i - 1]);
  const std::vector<double> later = live.Frames(3);
  ASSERT_GE(later.size(), 3U);
  EXPECT_GE(later[0], times.back());
  EXPECT_GT(later.back(), times.back());
  // Recording, and Ctrl-C that ends run and server.
  EXPECT_NE(live.Press("record").find("\"done\":true"), std::string::npos);
  ASSERT_GE(live.Frames(10).size(), 10U);
  EXPECT_NE(live.Press("record").find("\"done\":true"), std::string::npos);
  live.process().Signal(SIGINT);
  EXPECT_EQ(live.process().Wait(), 3);
  ExpectStoppedRun(folder);
  const auto recording = fs::directory_iterator(folder / "recordings")->path();
  const Outcome report = Mantle(folder, "report '" + recording.string() + "' --json");
  ASSERT_EQ(report.status, 0) << report.err;
  EXPECT_NE(report.out.find("A recording"), std::string::npos) << report.out;
}

TEST(MantleLive, StopEndsTheRunAsCtrlCDoesAndTheServerGoesOn) {
  if (!MulticastWorks()) GTEST_SKIP() << kNoMulticast;
  const auto folder = FreshFolder("live_stop");
  LiveServer live(folder, RunArguments(folder, "60"));
  ASSERT_GE(live.Frames(3).size(), 3U);
  EXPECT_NE(live.Press("stop").find("\"done\":true"), std::string::npos);
  live.Press("stop");  // once more is not a second Ctrl-C
  ExpectStoppedRun(folder);
  EXPECT_TRUE(live.Get("/").starts_with("HTTP/1.1 200"));
  live.process().Signal(SIGINT);
  EXPECT_EQ(live.process().Wait(), 3);
}

TEST(MantleLive, StopEndsARunThatItHasNotBegunAndARestartedServerGoesOnWithIt) {
  if (!MulticastWorks()) GTEST_SKIP() << kNoMulticast;
  const auto folder = FreshFolder("live_foreign");
  std::vector<std::string> words{tests::BinaryPath("mantle"), "run", "--realtime", "--lcm", Url()};
  for (const std::string& word : RunArguments(folder, "60")) words.push_back(word);
  firmware_sim::Process run(words, (folder / "run.txt").string());
  double seen = 0;
  {
    LiveServer first(folder, {});
    const auto times = first.Frames(3);
    ASSERT_GE(times.size(), 3U);
    seen = times.back();
    first.process().Signal(SIGINT);
    EXPECT_EQ(first.process().Wait(), 0);
  }
  LiveServer second(folder, {});
  const auto times = second.Frames(3);
  ASSERT_GE(times.size(), 3U);
  EXPECT_GT(times[0], seen) << "the run went on meanwhile";
  const auto end = Clock::now() + kPatience;  // it says who it is once a second
  while (second.Press("stop").find("\"done\":true") == std::string::npos && Clock::now() < end) {
    std::this_thread::sleep_for(100ms);
  }
  EXPECT_EQ(run.Wait(), 3);
  ExpectStoppedRun(folder);
}

/// A datagram of LCM ("LC02", number, channel, zero, message), sent to the test's group.
void SendDatagram(const std::string& channel, const std::string& message) {
  const int fd = socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(kPort));
  inet_pton(AF_INET, kGroup, &address.sin_addr);
  const unsigned char ttl = 0;
  setsockopt(fd, IPPROTO_IP, IP_MULTICAST_TTL, &ttl, sizeof ttl);
  std::string text = "LC02" + std::string(4, '\0') + channel + '\0' + message;
  (void)sendto(fd, text.data(), text.size(), 0, reinterpret_cast<const sockaddr*>(&address),
               sizeof address);
  close(fd);
}

TEST(MantleLive, WhatIsNoMessageOfOursIsCountedAndHoldsNobodyUp) {
  if (!MulticastWorks()) GTEST_SKIP() << kNoMulticast;
  const auto folder = FreshFolder("live_garbage");
  LiveServer live(folder, {});
  ASSERT_GT(live.port(), 0);
  std::mt19937 random(1618);
  for (int i = 0; i < 3'000; ++i) {
    std::string message(random() % 2'000, '\0');
    for (char& c : message) c = static_cast<char>(random());
    const char* channels[] = {"MANTLE_STATE", "MANTLE_SHAPE", "MANTLE_SESSION", "MANTLE_PLAN",
                              "SOMETHING_ELSE"};
    SendDatagram(channels[random() % 5], message);
  }
  const Client viewer(live.port());
  viewer.Send(fmt::format("GET /events HTTP/1.1\r\nHost: {}\r\n\r\n", live.Host()));
  const auto counted = [](const std::string& got) {
    const std::size_t at = got.rfind("\"refused\":");
    return at != got.npos && got.find_first_of("123456789", at) == at + 10;
  };
  EXPECT_TRUE(counted(viewer.Read(counted)));
  EXPECT_TRUE(live.Get("/").starts_with("HTTP/1.1 200"));
  live.process().Signal(SIGINT);
  EXPECT_EQ(live.process().Wait(), 0);
}

TEST(MantleLive, WhenTheServerIsKilledTheRunIsStoppedToo) {
  if (!MulticastWorks()) GTEST_SKIP() << kNoMulticast;
  const auto folder = FreshFolder("live_killed");
  LiveServer live(folder, RunArguments(folder, "60"));
  ASSERT_GE(live.Frames(3).size(), 3U);
  live.process().Signal(SIGKILL);
  ExpectStoppedRun(folder);
}

TEST(MantleLive, ARunThatComesToItsEndIsSaidToHave) {
  if (!MulticastWorks()) GTEST_SKIP() << kNoMulticast;
  const auto folder = FreshFolder("live_end");
  std::vector<std::string> arguments = RunArguments(folder, "0.5");
  arguments.push_back("--until-end");
  LiveServer live(folder, arguments);
  EXPECT_EQ(live.process().Wait(), 0);
  EXPECT_TRUE(ReadJson(folder / "out" / "summary.json")["complete"].get<bool>());
}

TEST(MantleLive, BadInputIsRefused) {
  const auto folder = FreshFolder("live_bad");
  for (const auto& [arguments, why] : std::vector<std::pair<std::string, std::string>>{
           {"live --lcm nonsense", "--lcm: nonsense: must be"},
           {"live --port 70000", "--port"},
           {"live --until-end", "must be with SCENE"},
           {"live --listen 203.0.113.9 --port 0", "cannot be listened on"},
           {"live --port 0 nowhere.toml", "nowhere.toml"},
           {"live --port 0 " + Scene("paper"), "--realtime: is for a closed loop"},
           {"live --port 0 --out x", "SCENE"}}) {
    const Outcome outcome = Mantle(folder, arguments);
    EXPECT_EQ(outcome.status, 2) << arguments << outcome.err;
    EXPECT_NE(outcome.err.find(why), std::string::npos) << arguments << ": " << outcome.err;
  }
}

}  // namespace
}  // namespace mantle::testing_tools
